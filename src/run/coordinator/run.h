// Runs a campaign: a worker process for each cell, results into the store as soon as they exist.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "campaign/campaign.h"
#include "campaign/plan.h"
#include "results/store/store.h"

namespace assay {

// Receives the progress of a run. All calls come from the thread that runs the campaign.
class Progress {
 public:
  virtual ~Progress() = default;
  // One line for each system: what will be measured and how long that will take.
  virtual void plan(const std::vector<std::string>& lines) { (void)lines; }
  // The work ahead: cells to do, cells that the store already has, estimated seconds.
  virtual void begin(int todo, int done_before, double estimate_s) { (void)todo, (void)done_before, (void)estimate_s; }
  virtual void phase(const std::string& what) { (void)what; }  // "accuracy", "timing, alone on one core"
  // A test of the conformance suite has ended: "mujoco-rk4 free-fall", the 12th of 71 in all contenders' suites.
  virtual void tested(const std::string& test, int done, int all) { (void)test, (void)done, (void)all; }
  // A cell, or a round of the timing, in which a long time passes without a finished cell.
  virtual void started(const std::string& cell, double remaining_s) { (void)cell, (void)remaining_s; }
  virtual void finished(const Cell& cell, double remaining_s) { (void)cell, (void)remaining_s; }
  // A run that cells wait for and that is not a cell: from another initial state, or a reference solution.
  virtual void made(const std::string& run, double remaining_s) { (void)run, (void)remaining_s; }
  virtual void message(const std::string& line) { (void)line; }  // a sentence that stays on the terminal
  virtual void end() {}
};

constexpr double kProgressInterval = 10;  // s

// A bar with rate, time left and current cell when `stream` is a terminal, else a plain line each `interval_s`.
std::unique_ptr<Progress> make_progress(FILE* stream, double interval_s = kProgressInterval);

// For programs: every call as one line of JSON, an object with "event", which is the call's name, and its arguments
// (docs/python.md).
std::unique_ptr<Progress> make_json_progress(FILE* stream);

struct RunOptions {
  std::string out;  // the results directory
  int jobs = 0;     // accuracy workers at a time; 0: one a core
  Shard shard;      // which part of the cells
  Progress* progress = nullptr;
  std::string program;  // started as `program worker`; "": this program
  std::string command;  // the command that resumes the run, for the manifest; "" leaves it out
  // Where runs are kept for other campaigns (results/store/references.h); "": only in `out`.
  std::string references;
  // Where verdicts of the conformance suite are kept for other campaigns, by contender, adapter build and program; "":
  // only in `out`.
  std::string suites;
  // Measures again what is stored as crashed or timed out (also contenders whose conformance suite ended so), and cells
  // that are damaged in the database.
  bool retry = false;
  // Results whose timings are to compare with these: what they have timed of a system at a timestep is timed here, too,
  // however long this run's contenders take. "" for none.
  std::string windows_of;

  // ---- parts of a campaign, one after the other (run/search/search.h) ----
  std::function<bool(const PlannedCell&)> wanted;  // only these cells; all when empty
  // false: contenders need not have passed the conformance suite yet. A later call with true replaces what was measured
  // of one that fails.
  bool gate = true;
  bool probe = true;            // look at each contender's speed first, for the estimate of the time left
  double budget_s = 0;          // ends like an interrupt, by SIGALRM; 0: none
  double truth_limit_s = 3600;  // of a reference solution
  // A reference solution that fails leaves the cells that need it out (RunSummary::without_truth).
  bool truth_optional = false;
};

struct TimePair {
  std::string system, a, b;
  double timestep_ms = 0;
  double ratio = 0, low = 0, high = 0;  // of step times, b over a
};

// How far equal contenders under two names are apart: what the timing can resolve.
struct TwinSummary {
  int cells = 0;
  int within_1_percent = 0;
  int told_apart = 0;  // whose interval does not contain 1
};
TwinSummary summarised(const std::vector<TimePair>& twins);

// A contender or a system that is left out.
struct Missing {
  std::string name, why;
};

struct RunSummary {
  int cells = 0;        // of this shard
  int done_before = 0;  // already there
  int done_now = 0;
  bool makes_runs = false;                       // for other parts (ShardCells::kRuns), and measures nothing
  int runs = 0, runs_made = 0, runs_failed = 0;  // of these
  std::map<std::string, int> outcomes;           // of all the shard's stored cells
  std::vector<Missing> failed_gate;              // contenders that failed the conformance suite
  std::vector<std::string> left_out;             // contenders of absent engines, a sentence each
  std::vector<std::string> warnings;             // a sentence each: floors, noisy timings, ...
  std::vector<TimePair> aa;                      // pairs of equal contenders under two names
  std::vector<TimePair> ratios;                  // those the campaign asks for
  double wall_s = 0, cpu_s = 0;
  double engine_share_accuracy = 0;  // time inside engine steps / wall time of the cells, over this run's cells
  double engine_share_timing = 0;
  double engine_share_cpu = 0;         // time inside engine steps / processor time of all workers, of what was done now
  std::vector<Missing> without_truth;  // systems without a reference solution, because that failed
  int unmeasured =
      0;             // cells whose workers somebody else ended or the machine could not hold: the same call tries them
  std::string lack;  // what the machine lacked for them, where that is known
  bool interrupted = false;  // by SIGINT or SIGTERM: everything finished is stored, the same call resumes
  int signal = 0;            // which
};

// Throws InputError when `out` holds something else (see Store::create), SystemError when it cannot be written or no
// worker can be started. A cell that fails is a stored outcome and no error.
RunSummary run_campaign(const Campaign& campaign, const RunOptions& options);

// Values that follow from several cells: order of convergence, floors that do not depend on the timestep, A/A ratios,
// the largest timestep that holds an object, exponents of scaling.
// run_campaign() calls it at its end. A union of shards has to call it too. Returns warnings, a sentence each.
std::vector<std::string> derive_values(Store& store);
// The names of these values.
const std::vector<std::string>& derived_values();

}  // namespace assay
