// What changed from results A to results B, cell by cell.
//
// Times: the ratio of the mean step times (B over A), by the clock's own estimate for each process
// (measures/step_time.h), with the 95 % interval and the p-value of Welch's t on the logarithms of the processes'
// times. A process is one sample, because its rounds share its place in memory; where there is one process, its rounds
// are the samples, and what processes differ by is added to their variance. The p-values are corrected for their
// number, a contender's times being a family (measures/rank_test.h). A time has changed when its corrected p-value is
// at most `level`, a rank test on the same samples agrees (at most `level`, or as small as so few samples can make it),
// and its ratio is at least the practical threshold away from 1.
//
// Accuracy is deterministic: a value is equal to the last bit, or it changed, and the ratio of its magnitudes says how
// much. A change that is smaller than the threshold, or of values that are smaller than kRounding in their unit, counts
// as "within". But another build rounds otherwise, and a chaotic motion makes that large: where a value is over several
// initial states or pieces of the run, the pairs of both results are tested (Student's t, corrected like the times),
// and a change that is not alike in them, or whose mean moved the other way, is "unsettled". Pieces from one initial
// state count as one figure, their mean; only where there is one state, they stand for themselves.
//
// Both runs' samples say nothing of what happened between the runs: a machine that is slower on another day slows all
// contenders. A control is a contender that is known not to have changed: times are then divided by its time in the
// same process of the same run.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "measures/statistics.h"
#include "results/store/differences.h"
#include "results/store/store.h"
#include "results/values.h"

namespace assay {

struct CompareOptions {
  double threshold = 0.02;       // of practical significance, relative
  double level = 0.05;           // of corrected p-values
  std::string control = {};      // contender whose times the others' are divided by; "" for none
  bool across_machines = false;  // accuracy alone
  bool across_programs = false;  // another version or build of assay is accepted
};

// Whether two stores that differ so may be compared under these options.
bool accepts(const CompareOptions& options, const Difference& difference);

// Smaller magnitudes of accuracy are of no practical significance, in any unit of the catalogue.
inline constexpr double kRounding = 1e-9;

enum class Change {
  kNone,    // equal to the last bit, or no difference found
  kWithin,  // it differs, by less than the threshold
  kBetter,
  kWorse,
  kOther,      // it differs, and neither is better
  kUnsettled,  // it differs, and not alike in the initial states
};
// What it is that a value has changed: it grew, or fell. kOther where neither is better.
Change change_of(bool grew, Better better);
Change change_of_outcome(bool was_ok, bool is_ok);
std::string_view change_text(Change change);  // "none", "within", "better", "worse", "other", "unsettled"

struct CellChange {
  std::string system, contender, measure, value, unit;
  double timestep_ms = 0;
  std::optional<double> a, b;
  std::string outcome_a, outcome_b;  // "ok", ...
  std::optional<Interval> ratio;     // b over a; an interval of times, none (NaN ends) of accuracy
  bool time = false;
  // of times, and of accuracy over several initial states or pieces
  bool tested = false;
  size_t samples_a = 0, samples_b = 0;
  bool rounds = false;  // samples are rounds of one process
  double p = 1, p_corrected = 1;
  double p_rank = 1;  // of times
  Change change = Change::kNone;
};

struct Comparison {
  std::string a, b;  // directories
  CompareOptions options;
  std::vector<Difference> builds;    // engines' versions and plugins that differ: what the comparison may be about
  std::vector<Difference> coverage;  // systems and contenders that one of them lacks
  std::vector<Difference> ignored;   // other machines or programs that the options accept
  std::vector<CellChange> rows;      // as stored, times and accuracy; cells that only one of them has are left out
  std::vector<CellChange> only_a;    // cells, without figures
  size_t only_b = 0;                 // cells
  std::vector<CellChange> values_only_in_a;  // of cells that both have: times, and values of which less is better
  std::vector<CellChange> other_windows;     // times that are not compared: each run timed another part of the motion
  std::vector<CellChange> without_control;   // times that are not compared: the control has none beside them
  // The median ratio of all times, where there are at least three contenders: far from 1 it is rather the machine's.
  std::optional<double> common_ratio;
};

// Throws InputError that names the first difference when the two cannot be compared: another model, method or settings
// of a contender that both have; another machine or program that the options do not accept; no cell in common; a
// control that one of them lacks or that is the harness; or when both timed other windows of every run.
Comparison compare(const Store& a, const Store& b, const CompareOptions& options);

// Throws InputError for a control that is the harness, whose times are noise alone.
void require_control(const std::string& control);

// The names of the nodes that timed each system, of those whose nodes are known. `cells`: the store's.
using TimingNodes = std::map<std::string, std::set<std::string>>;
TimingNodes timing_nodes(const Store& store, const std::vector<Cell>& cells);

// The first system that other nodes timed in `b` than in `a`: its times do not compare, even if both results are of the
// same nodes.
std::optional<Difference> other_machine(const TimingNodes& a, const TimingNodes& b);

// Rows that are worse: times whose ratio is at least 1 + `limit`, accuracy whose error grew by at least `limit` of
// itself, outcomes that were ok and no longer are.
std::vector<const CellChange*> regressions(const Comparison& comparison, double limit);

// What may be worse by `limit` for all that the samples say: times that are no regression, but whose interval reaches
// that far, or that have none; accuracy that is unsettled and whose value is worse by that much.
std::vector<const CellChange*> undecided(const Comparison& comparison, double limit);

// A sentence on what keeps the comparison from saying that nothing is worse: cells that B lacks, times that are not
// compared. Empty when there is nothing.
std::string gaps(const Comparison& comparison);

// ---- tables.cc -----------------------------------------------------------------------------------------------------

// Changes first, then counts of the rest: "| system | contender | ..."
std::string comparison_markdown(const Comparison& comparison);
std::string comparison_csv(const Comparison& comparison);  // all rows
nlohmann::json comparison_json(const Comparison& comparison);

// One sentence on the whole: "3 of 40 times changed: 1 faster, 2 slower; ..."
std::string comparison_summary(const Comparison& comparison);

}  // namespace assay
