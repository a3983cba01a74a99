// A measure: one object, in the file of its name, in the list of measures.cc. Campaigns name it. The plan, workers,
// results and pages know it by what it reads and by what it says of its values, never by its name.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "measures/contact_residuals.h"
#include "measures/grasp.h"
#include "measures/reference/certified.h"
#include "measures/transfer.h"
#include "measures/value.h"
#include "measures/watch.h"
#include "model/model.h"

namespace assay {

// What a cell of a measure is made from, in the order of a plan's cells.
enum class Reads {
  kFineRun,    // makes the contender's fine-step run, without values
  kPieces,     // pieces of the contender's fine-step runs, each started anew from a state of one
  kSolution,   // the run from the model's own initial state, and the reference solution of the same motion
  kRun,        // the runs from all initial states
  kRunPairs,   // the same, each with the fine-step run of the contender in which the policy was trained
  kFineRuns,   // the contender's fine-step run with those of all others
  kWholeRuns,  // the time of whole runs
  kSteps,      // the time of steps; contenders take turns
  kWorlds      // the time of steps of many worlds at once
};

// Its figures are times: its cells are measured alone on the machine, and compare only on one machine.
constexpr bool is_timed(Reads reads) { return reads >= Reads::kWholeRuns; }
// Its cells at one timestep share the runs from the initial states: the first of them makes these.
constexpr bool shares_runs(Reads reads) { return reads >= Reads::kSolution && reads <= Reads::kRunPairs; }
// Its cells have runs from every initial state of the system.
constexpr bool takes_all_states(Reads reads) {
  return reads == Reads::kPieces || reads == Reads::kRun || reads == Reads::kRunPairs;
}

// A system before anything runs, as a measure may ask about it.
struct MeasuredSystem {
  const Model& model;
  bool passive = true;      // no control acts
  bool has_policy = false;  // a policy controls it
  bool has_family = false;  // there are systems that differ from it only in size
  GraspBodies grasp = {};
  double duration_s = 0;
  std::string solution = {};       // the certified solution of its motion (reference/certified.h); "": none is named
  bool has_solution_file = false;  // the motion is compared with one that a file gives
};

// A run that came to its end, or diverged, as a measure sees it.
struct MeasuredRun {
  const Model& model;
  const std::vector<State>& states;  // at equal distances, the initial state first
  double duration_s = 0;             // that was asked for: a run that diverges is shorter
  bool diverged = false;             // only for a measure with `of_failed_runs`
  bool passive = true;               // no control acts
  std::uint64_t seed = 1;            // of bootstraps
  long long steps = 0;               // of the engine, over the whole duration
  bool single_precision = false;     // the engine's
  // The same motion, for kSolution the reference solution, for kRunPairs the other contender's run; null: there is
  // none.
  const std::vector<State>* other = nullptr;
  // For kSolution, where the solution is certified: it, and the run, both at the instants of measures/watch.h.
  const CertifiedMotion* certified = nullptr;
  const std::vector<State>* instants = nullptr;
  GraspBodies grasp = {};
  const Watched* watched = nullptr;            // of a measure with `reads_between`
  const ContactResiduals* contacts = nullptr;  // null where the engine gives none, or nothing touched
  const TransferTask* task = nullptr;          // of the policy that controls it
  double work_J = 0, policy_s = 0;             // of the control; wall time inside the policy
  long long policy_steps = 0;
};

// A fine-step run and those of the other contenders that have one, at the same moments.
struct ComparedRuns {
  struct Other {
    std::string contender;
    std::vector<State> states;
  };
  const std::vector<State>& own;
  const std::vector<Other>& others;
};

struct Measured {
  std::vector<Value> values;
  std::vector<SampleSeries> samples = {};
};

// A motion of its own that a measure makes with the contender's settings.
struct Experiment {
  Model model;
  long long steps = 0;
};

using Parameter = std::variant<int, double>;

struct Measure {
  std::string_view name;  // in campaigns, and as stored, but for kWorlds (measures/batch.h)
  Reads reads = Reads::kRun;
  int version = 0;  // part of its cells' keys unless it is 0: raise it when equal runs give other values
  std::vector<ValueInfo> values = {};

  // Why the system cannot be measured and how to change that, as the end of a sentence about it; "" when it can. Null:
  // every system can.
  std::string (*obstacle)(const MeasuredSystem& system) = nullptr;
  // What its values depend on beside what it reads: part of its cells' keys. Null: nothing.
  std::vector<Parameter> (*parameters)(const MeasuredSystem& system) = nullptr;
  // A system's key in campaigns for the timesteps at which it is measured; "": at all.
  std::string_view timesteps_key = "";

  // ---- of one run: kSolution, kRun, kRunPairs ----
  Measured (*of_run)(const MeasuredRun& run) = nullptr;
  bool of_failed_runs = false;                 // a run that diverges has values, too
  bool reads_between = false;                  // MeasuredRun::watched
  bool reads_contacts = false;                 // MeasuredRun::contacts
  std::vector<SampleSeries> without_run = {};  // samples of an initial state from which nothing could run
  std::string_view held = "";  // the value that is 1 where it held: up to which timesteps it does follows
  std::optional<Experiment> (*experiment)(const Model& system, double timestep_s) = nullptr;
  Value (*of_experiment)(const std::vector<State>& states) = nullptr;

  // ---- of others ----
  Measured (*of_fine_runs)(const ComparedRuns& runs) = nullptr;            // kFineRuns
  double (*of_piece)(const State& end, const State& reference) = nullptr;  // kPieces: the error of one
  std::string_view time = "";                                              // timed: the value that is compared
};

// In the order in which campaigns list them, which is part of a campaign's hash.
const std::vector<Measure>& measures();

// By the name in a campaign; null when there is none of this name.
const Measure* find_measure(std::string_view name);
// By the name of a cell as stored; null for one of another version of assay.
const Measure* measure_of(std::string_view stored);
// Whether a cell of this stored name is made from that.
bool reads(std::string_view stored, Reads what);
bool is_timed(std::string_view stored);

// The stored name of the cell that makes a fine-step run.
inline constexpr const char* kFineRunCell = "reference";

}  // namespace assay
