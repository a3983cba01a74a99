#include "measures/batch.h"

#include <algorithm>
#include <cassert>
#include <random>
#include <set>

#include <fmt/format.h>

#include "base/text.h"
#include "measures/measure.h"
#include "model/joint.h"

namespace assay {
namespace {

// In [-1, 1), the same everywhere.
double signed_draw(std::mt19937_64& random) { return 2 * static_cast<double>(random() >> 11U) * 0x1p-53 - 1; }

}  // namespace

std::string batch_name(const BatchOf& batch) {
  return fmt::format("{}-{}{}", kBatchMeasure, batch.worlds, batch.device == "cpu" ? "" : "-" + batch.device);
}

std::optional<BatchOf> batch_of(std::string_view measure) {
  if (!measure.starts_with(kBatchMeasure)) return std::nullopt;
  measure.remove_prefix(kBatchMeasure.size());
  if (!measure.starts_with('-')) return std::nullopt;
  measure.remove_prefix(1);
  const size_t dash = measure.find('-');
  const auto worlds = parse_integer(std::string(measure.substr(0, dash)));
  if (!worlds || *worlds < 1) return std::nullopt;
  return BatchOf{static_cast<int>(*worlds),
                 dash == std::string_view::npos ? "cpu" : std::string(measure.substr(dash + 1))};
}

int batch_moment(int world) {
  int moment = 0;
  for (int bit = 1, place = kBatchMoments / 2; place > 0; bit *= 2, place /= 2) {
    if ((world & bit) != 0) moment += place;
  }
  return moment;
}

std::vector<State> batch_states(const Model& model, const std::vector<State>& run, const InitialStates& states,
                                int worlds) {
  assert(std::ssize(run) == kBatchMoments);
  std::vector<State> found;
  found.reserve(static_cast<size_t>(worlds));
  for (int world = 0; world < worlds; ++world) {
    const State& moment = run[static_cast<size_t>(batch_moment(world))];
    found.push_back(world == 0 ? moment : with_other_rates(model, moment, states, world));
    found.back().time = 0;
  }
  return found;
}

std::vector<int> compared_worlds(int worlds, std::uint64_t seed) {
  std::set<int> chosen = {0, worlds - 1};
  std::mt19937_64 random(seed);
  while (std::ssize(chosen) < std::min(worlds, kMostCompared)) {
    chosen.insert(static_cast<int>(random() % static_cast<std::uint64_t>(worlds)));
  }
  return {chosen.begin(), chosen.end()};
}

double equivalence_bound(bool single_precision) { return single_precision ? 1e-5 : 1e-9; }

std::vector<double> batch_torques(const Model& model, int worlds, double timestep_s, std::uint64_t seed) {
  constexpr double kRate = 0.1;  // rad/s, of a slide m/s
  std::vector<double> largest;   // of each joint
  for (const Joint& joint : model.joints) {
    // the child by itself moves the more easily
    largest.push_back(kRate * child_inertia(model, joint) / timestep_s);
  }
  std::vector<double> torques;
  torques.reserve(largest.size() * static_cast<size_t>(worlds));
  std::mt19937_64 random(seed);
  for (int world = 0; world < worlds; ++world) {
    for (const double torque : largest) torques.push_back(torque * signed_draw(random));
  }
  return torques;
}

double centre_distance(const State& a, const State& b) {
  double largest = 0;
  for (size_t i = 0; i < a.bodies.size(); ++i) {
    largest = std::max(largest, (a.bodies[i].p_WBcm - b.bodies[i].p_WBcm).norm());
  }
  return largest;
}

namespace {

std::string batch_obstacle(const MeasuredSystem& system) {
  return system.passive ? ""
                        : "has a control, and the worlds of 'batch' move by themselves: give control = \"passive\", or "
                          "leave 'batch' out of its measures";
}

}  // namespace

Measure batch_measure() {
  using namespace rows;
  return {.name = kBatchMeasure,
          .reads = Reads::kWorlds,
          .version = 1,
          .values = {{"batch_rate", "1/s", "World-steps per second", "world-steps per second", kHigh, kNo, kNo,
                      "steps per second times the number of worlds that are stepped together", 17},
                     {"batch_step_time", "us", "Step time of all worlds", "step of all worlds", kLow, kNo, kNo,
                      "time of one step of all worlds, in the mean over steps that are asked for at once", 17},
                     {"batch_latency", "us", "Latency", "latency", kLow, kNo, kNo,
                      "time of a single step of all worlds, from the call until all are done", 17},
                     {"batch_memory", "B", "Memory of the worlds", "memory", kLow, kNo, kNo,
                      "memory that all worlds take: the engine's arrays, or what the processes of one world each have "
                      "for themselves",
                      17},
                     {"batch_compile_time", "s", "Compile time", "compile time", kLow, kNo, kNo,
                      "time until the first step of so many worlds can be asked for; kernels that were compiled before "
                      "are loaded",
                      17},
                     {"batch_equivalence", "m", "Distance from one world", "distance from one world", kLow, kNo, kNo,
                      "largest distance of a body in the batch from the same contender's run of one world, after the "
                      "same steps from the same state",
                      17},
                     {"batch_bound", "m", "Bound of the distance", "bound", kNone, kNo, kNo,
                      "distance from one world that rounding explains; what is further off has no rate", 17},
                     {"batch_compared", "1", "Compared worlds", "compared worlds", kNone, kNo, kNo,
                      "worlds of the batch that were compared with a run of one world", 17},
                     {"batch_worlds", "1", "Worlds", "worlds", kNone, kNo, kNo, "worlds that are stepped together", 17},
                     {"batch_processes", "1", "Processes", "processes", kNone, kNo, kNo,
                      "processes, each on a core of its own, that share the worlds of an engine that steps one", 17}},
          .obstacle = batch_obstacle,
          .time = "batch_step_time"};
}

}  // namespace assay
