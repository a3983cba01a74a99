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

// Rules before 2 let a hinge pass its limit any number of times.
void judge_limits(const Store& store, JudgedCells& judged) {
  constexpr double kTurn = 2 * std::numbers::pi;
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
      "turn beyond its limit; pieces, timings and systems without the measure 'violation' hold no value to judge again",
      counted(judged.changed, "cell"), judged.changed == 1 ? "was" : "were", judged.changed == 1 ? "is" : "are");
}

// Rules before 3 called a shape unstable that lies below the ground by a part of its body's size. How much a robot of
// today's rules may is not stored, so these cells stay as they are.
void note_ground(JudgedCells& judged) {
  const auto count = std::ranges::count_if(judged.cells, [](const Cell& cell) {
    return cell.outcome == Outcome::kUnstable && cell.reason.find(kBelowGround) != std::string::npos;
  });
  if (count == 0) return;
  judged.note += fmt::format(
      "{}{} {} unstable by an older rule, because a shape lies wholly below the ground: by today's it may be a "
      "penetration, which measuring again tells",
      judged.note.empty() ? "" : "; ", counted(static_cast<size_t>(count), "cell"), count == 1 ? "is" : "are");
}

}  // namespace

JudgedCells judged_cells(const Store& store) {
  JudgedCells judged;
  judged.cells = store.cells();
  const double rules = parse_number(store.manifest(kSoundnessEntry).value_or("1")).value_or(1);
  if (rules < 2) judge_limits(store, judged);
  if (rules < 3) note_ground(judged);
  return judged;
}

}  // namespace assay
