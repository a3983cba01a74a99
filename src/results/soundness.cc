#include "results/soundness.h"

#include <algorithm>
#include <map>
#include <numbers>
#include <tuple>

#include <fmt/format.h>

#include "base/text.h"
#include "measures/measure.h"
#include "measures/plausible.h"
#include "results/store/facts.h"

namespace assay {
namespace {

using RunName = std::tuple<std::string, std::string, double>;  // system, contender, timestep

// Whether the measure reads the contender's runs from the initial states, as the one does that says how far they went.
bool reads_runs(const Cell& cell) {
  return reads(cell.measure, Reads::kFineRun) || reads(cell.measure, Reads::kSolution) ||
         reads(cell.measure, Reads::kRun);
}

RunName run_of(const Cell& cell) { return {cell.system, cell.contender, cell.timestep_ms}; }

}  // namespace

JudgedCells judged_cells(const Store& store) {
  constexpr double kTurn = 2 * std::numbers::pi;
  JudgedCells judged;
  judged.cells = store.cells();
  const auto rules = parse_number(store.manifest(kSoundnessEntry).value_or("1"));
  if (rules && *rules >= kSoundnessRules) return judged;
  std::map<RunName, double> beyond;
  for (const Cell& cell : judged.cells) {
    const Value* mean = find_value(cell, "limit_violation_max");
    if (mean == nullptr || !mean->value) continue;
    // from the initial state from which it went furthest
    double largest = *mean->value;
    for (const SampleSeries& series : store.samples(cell.id)) {
      if (series.name != "limit_violation_max of states") continue;
      for (const double of_state : series.values) largest = std::max(largest, of_state);
    }
    if (largest > kTurn) beyond[run_of(cell)] = largest;
  }
  for (Cell& cell : judged.cells) {
    const auto run = beyond.find(run_of(cell));
    if (run == beyond.end() || cell.outcome != Outcome::kOk || !reads_runs(cell)) continue;
    cell.outcome = Outcome::kUnstable;
    cell.reason = fmt::format("judged again: a hinge is {:.3g} rad beyond its limit", run->second);
    ++judged.changed;
  }
  judged.note = fmt::format(
      "measured with older rules of soundness: {} that {} stored as ok {} unstable, because a hinge is more than a "
      "turn "
      "beyond its limit; pieces, timings and systems without the measure 'violation' hold no value to judge again",
      counted(judged.changed, "cell"), judged.changed == 1 ? "was" : "were", judged.changed == 1 ? "is" : "are");
  return judged;
}

}  // namespace assay
