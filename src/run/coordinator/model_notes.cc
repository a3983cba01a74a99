#include "run/coordinator/model_notes.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"

namespace assay {
namespace {

constexpr size_t kMostNotes = 10;  // of a robot
constexpr size_t kMostSystems = 4;

std::string systems_label(std::vector<std::string> names) {
  if (names.size() > kMostSystems) {
    const size_t more = names.size() - (kMostSystems - 1);
    names.resize(kMostSystems - 1);
    names.push_back(fmt::format("{} more", more));
  }
  return join(names, ", ");
}

}  // namespace

std::vector<std::string> model_notes(const Campaign& campaign) {
  std::vector<std::pair<const Model*, std::vector<std::string>>> robots;  // a model, and the systems with its notes
  for (const CampaignSystem& system : campaign.systems) {
    const std::vector<std::string>& notes = system.model.notes;
    if (notes.empty()) continue;
    const auto robot = std::ranges::find_if(robots, [&](const auto& each) {
      return each.first->source == system.model.source && each.first->notes == notes;
    });
    if (robot == robots.end()) {
      robots.emplace_back(&system.model, std::vector{system.name});
    } else {
      robot->second.push_back(system.name);
    }
  }
  std::vector<std::string> lines;
  for (const auto& [model, systems] : robots) {
    const std::string label = systems_label(systems);
    const size_t count = model->notes.size();
    const size_t shown = count > kMostNotes + 1 ? kMostNotes : count;
    for (size_t i = 0; i < shown; ++i) lines.push_back(fmt::format("{}: {}", label, model->notes[i]));
    if (shown < count) {
      lines.push_back(fmt::format("{}: {} more notes on its model, which the report lists", label, count - shown));
    }
  }
  return lines;
}

}  // namespace assay
