#include "report/render/shots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/console.h"
#include "base/errors.h"
#include "base/text.h"
#include "measures/measure.h"
#include "results/store/trajectory.h"

namespace assay {
namespace {

// Why a contender has no kept run: its reference's reason.
std::string reason_of(const std::vector<Cell>& cells, const std::string& system, const std::string& contender) {
  for (const Cell& cell : cells) {
    if (cell.system == system && cell.contender == contender && reads(cell.measure, Reads::kFineRun) &&
        cell.outcome != Outcome::kOk) {
      return fmt::format("{} {}", outcome_text(cell.outcome), cell.reason);
    }
  }
  return "no kept run";
}

}  // namespace

Scene scene_named(const Store& store, const std::string& system) {
  std::vector<std::string> names;
  for (const SceneRow& row : store.scenes()) {
    if (row.system == system) return parse_scene(row.json);
    names.push_back(row.system);
  }
  if (names.empty()) {
    throw InputError(
        fmt::format("'{}' was made by an older assay and holds no pictures' data of its systems: run the "
                    "command that made it again to add them",
                    store.dir()));
  }
  throw InputError(fmt::format("'{}' has no system '{}'{}", store.dir(), system, did_you_mean(system, names)));
}

std::string figures_text(const std::vector<Cell>& cells, const std::string& system, const std::string& contender,
                         double timestep_ms) {
  const auto value = [&](const std::string& name) -> std::optional<double> {
    for (const Cell& cell : cells) {
      if (cell.system != system || cell.contender != contender) continue;
      if (!same_timestep(cell.timestep_ms, timestep_ms)) continue;
      if (const Value* found = find_value(cell, name)) return found->value;
    }
    return std::nullopt;
  };
  std::string text = timestep_label(timestep_ms) + " ms";
  if (const auto factor = value("realtime_factor")) text += fmt::format(", {:.3g} x realtime", *factor);
  constexpr std::array kErrors = {
      std::array{"consistency", "consistency", "m"}, std::array{"truth_error_max", "largest error", "m"},
      std::array{"truth_error", "error at the end", "m"}, std::array{"energy_drift", "energy drift", "J"}};
  for (const auto& [name, label, unit] : kErrors) {
    const auto error = value(name);
    if (!error) continue;
    text += fmt::format("\n{} {:.2g} {}", label, *error, unit);
    break;
  }
  return text;
}

Shot kept_shot(const Store& store, const std::string& system, const std::optional<std::string>& contender,
               const std::optional<std::string>& time) {
  Shot shot{scene_named(store, system), {}, 0};
  std::vector<std::string> kept;
  for (const RunRow& run : store.runs()) {
    if (run.system != system || !has_trajectory(store.trajectories_dir(), run.address)) continue;
    kept.push_back(run.contender);
    if (!shot.states.empty() || (contender && *contender != run.contender)) continue;
    const Scene& scene = shot.scene;
    auto trajectory = read_run(store.trajectories_dir(), run.address, scene.bodies.size(), scene.joints.size());
    if (trajectory) shot.states = std::move(trajectory->states);
  }
  if (shot.states.empty()) {
    if (!contender) throw InputError(fmt::format("'{}' keeps no run of '{}'", store.dir(), system));
    throw InputError(fmt::format("'{}' keeps no run of '{}' on '{}'{}", store.dir(), *contender, system,
                                 did_you_mean(*contender, kept)));
  }
  if (shot.states.size() == 1) {
    message(fmt::format("note: of this run only the state at {} s is kept", shortest(shot.states.back().time)));
  }
  if (time) {
    const double last = shot.states.back().time;
    const auto seconds = parse_number(*time);
    if (!seconds || *seconds < 0 || *seconds > last * (1 + 1e-9)) {
      throw InputError(
          fmt::format("--time is '{}': give seconds from 0 to {}, the length of the run", *time, shortest(last)));
    }
    for (size_t i = 0; i < shot.states.size(); ++i) {
      if (std::abs(shot.states[i].time - *seconds) < std::abs(shot.states[shot.shown].time - *seconds)) shot.shown = i;
    }
  }
  return shot;
}

std::vector<MoviePart> stored_parts(const Store& store, const Scene& scene, const std::string& system,
                                    const std::vector<std::string>& contenders) {
  const std::vector<Cell> cells = store.cells();
  std::vector<MoviePart> parts;
  const std::vector<RunRow> runs = store.runs();
  for (const std::string& contender : contenders) {
    MoviePart& part = parts.emplace_back();
    part.contender = contender;
    for (const RunRow& run : runs) {
      if (run.system != system || run.contender != contender || !part.states.empty()) continue;
      part.timestep_ms = run.timestep_ms;
      auto kept = read_run(store.trajectories_dir(), run.address, scene.bodies.size(), scene.joints.size());
      if (kept) part.states = std::move(kept->states);
    }
    if (part.states.empty()) part.failure = reason_of(cells, system, contender);
  }
  return parts;
}

}  // namespace assay
