#include "report/figures/results.h"

#include <algorithm>

#include "measures/pareto.h"
#include "store/trajectory.h"

namespace assay::figures {
namespace {

// The paper's contenders by today's names; of those in braces the first that was measured.
const std::vector<std::vector<std::string>>& line_up() {
  static const std::vector<std::vector<std::string>> kLineUp = {{"bullet-si-f64", "bullet-si-f32"},
                                                                {"bullet-mb"},
                                                                {"havok"},
                                                                {"mujoco-euler"},
                                                                {"mujoco-rk4"},
                                                                {"ode-quick"},
                                                                {"physx-d6-pgs"},
                                                                // with its own drives, as the paper's, in the grasp
                                                                {"physx-d6-pgs-native-pd"}};
  return kLineUp;
}

}  // namespace

Results::Results(const Store& store) : store_(&store), looks_(looks_of(store.contenders())) {
  for (const SystemRow& row : store.systems()) {
    const auto parsed = nlohmann::json::parse(row.json, nullptr, false);
    facts_[row.name] = parsed.is_object() ? parsed : nlohmann::json::object();
    systems_.push_back(row.name);
  }
  for (const SceneRow& row : store.scenes()) scenes_.emplace(row.system, parse_scene(row.json));
  for (Cell& cell : store.cells()) {
    measured_.insert(cell.contender);
    cells_[{cell.system, cell.contender, cell.measure}].emplace(cell.timestep_ms, std::move(cell));
  }
  for (const auto& names : line_up()) {
    const auto found = std::ranges::find_if(names, [&](const std::string& name) { return measured_.contains(name); });
    if (found != names.end()) contenders_.push_back(*found);
  }
}

std::optional<Figure> Results::value(const Cell& cell, const std::string& name) {
  const Value* found = find_value(cell, name);
  if (found == nullptr) return std::nullopt;
  const double middle = found->value.value_or(0);
  return Figure{middle, found->low.value_or(middle), found->high.value_or(middle)};
}

std::optional<double> Results::speed(const std::string& system, const std::string& contender,
                                     double timestep_ms) const {
  SpeedCurve speeds;
  for (const auto& [step, cell] : cells(system, contender, "raw_speed")) {
    const auto factor = value(cell, "realtime_factor");
    if (factor && factor->value > 0) speeds[step] = {factor->value, factor->low, factor->high};
  }
  const auto speed = speed_at(speeds, timestep_ms);
  return speed ? std::optional(speed->value) : std::nullopt;
}

bool Results::timed(const std::string& system) const {
  return std::ranges::any_of(contenders_,
                             [&](const std::string& contender) { return speed(system, contender, 1).has_value(); });
}

std::optional<Results::End> Results::end_of(const std::string& system) const {
  for (const RunRow& run : store_->runs()) {
    if (run.system != system) continue;
    const auto trajectory = read_trajectory(store_->trajectories_dir(), run.address);
    if (trajectory && !trajectory->states.empty()) return End{run.contender, trajectory->states.back()};
  }
  return std::nullopt;
}

}  // namespace assay::figures
