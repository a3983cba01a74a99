#include "cli/pictures.h"

#include <algorithm>
#include <array>
#include <optional>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"

namespace assay::cli {

std::pair<int, int> parse_size(const std::string& text) {
  constexpr int kLeast = 16, kMost = 8192;
  const size_t cross = text.find('x');
  if (cross != std::string::npos) {
    const auto width = parse_integer(text.substr(0, cross)), height = parse_integer(text.substr(cross + 1));
    const auto fine = [](long long side) { return side >= kLeast && side <= kMost && side % 2 == 0; };
    if (width && height && fine(*width) && fine(*height)) {
      return {static_cast<int>(*width), static_cast<int>(*height)};
    }
  }
  throw InputError(fmt::format("--size is '{}': give WIDTHxHEIGHT in pixels, even numbers from {} to {}, as 1280x720",
                               text, kLeast, kMost));
}

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

}  // namespace assay::cli
