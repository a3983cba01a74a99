#include "report/look.h"

#include <algorithm>
#include <array>
#include <set>

#include <nlohmann/json.hpp>

namespace assay {
namespace {

// The light theme's of web/src/style.css.
constexpr std::array kHues = {"#1463c4", "#d4590c", "#b08400", "#1f8a4c", "#8240b8", "#c0307e",
                              "#5f8a00", "#008578", "#b4232e", "#79543a", "#56616e", "#0a8fb0"};
constexpr const char* kInk = "#1d2126";
constexpr const char* kPaper = "#fbfaf7";

// A family's hue and the mark of its first contender.
struct Slot {
  const char* family;
  size_t hue, mark;
};
constexpr std::array kSlots = {Slot{"mujoco", 0, 0}, Slot{"bullet", 1, 2},      Slot{"bullet/joint", 2, 4},
                               Slot{"ode", 3, 3},    Slot{"simbody", 4, 1},     Slot{"dart", 5, 2},
                               Slot{"physx", 6, 5},  Slot{"physx/joint", 7, 7}, Slot{"havok", 8, 6},
                               Slot{"jolt", 9, 7},   Slot{"rapier", 10, 3},     Slot{"rapier/joint", 11, 4}};

constexpr std::array kMarks = {Mark::kCircle,       Mark::kSquare, Mark::kTriangle, Mark::kDiamond,
                               Mark::kTriangleDown, Mark::kCross,  Mark::kStar,     Mark::kWye};

struct Variant {
  std::array<double, 6> dash;  // up to the first 0
  const char* with;            // what the hue is mixed with, and how much
  double share;
};
constexpr std::array kVariants = {Variant{{}, kInk, 0},           Variant{{7, 3}, kInk, 0.28},
                                  Variant{{2, 3}, kPaper, 0.22},  Variant{{9, 3, 2, 3}, kInk, 0.45},
                                  Variant{{12, 4}, kPaper, 0.30}, Variant{{4, 2}, kInk, 0.14},
                                  Variant{{1, 3}, kPaper, 0.12},  Variant{{9, 2, 1, 2, 1, 2}, kInk, 0.36}};

std::string engine_of(const ContenderRow& contender) {
  const std::string& name = contender.engine;
  return name.ends_with("-f32") || name.ends_with("-f64") ? name.substr(0, name.size() - 4) : name;
}

bool is_joint(const ContenderRow& contender) {
  const auto facts = nlohmann::json::parse(contender.capabilities_json, nullptr, false);
  return facts.is_object() && facts.value("coordinates", "") == "joint";
}

}  // namespace

std::map<std::string, Look> looks_of(const std::vector<ContenderRow>& all) {
  std::vector<ContenderRow> contenders;
  std::ranges::copy_if(all, std::back_inserter(contenders),
                       [](const ContenderRow& row) { return row.engine != "null"; });
  std::map<std::string, std::set<bool>> kinds;  // of coordinates, by engine
  for (const ContenderRow& row : contenders) kinds[engine_of(row)].insert(is_joint(row));
  const auto family_of = [&](const ContenderRow& row) {
    return engine_of(row) + (kinds[engine_of(row)].size() > 1 && is_joint(row) ? "/joint" : "");
  };
  std::map<std::string, size_t> hues, marks, members;
  std::set<size_t> taken;
  for (const ContenderRow& row : contenders) {
    const auto* slot =
        std::ranges::find(kSlots, family_of(row), [](const Slot& each) { return std::string(each.family); });
    if (slot == kSlots.end()) continue;
    hues[family_of(row)] = slot->hue;
    marks[family_of(row)] = slot->mark;
    taken.insert(slot->hue);
  }
  size_t next = 0;
  std::map<std::string, Look> looks;
  for (const ContenderRow& row : contenders) {
    const std::string family = family_of(row);
    if (!hues.contains(family)) {
      while (taken.contains(next) && next < kHues.size()) ++next;
      hues[family] = next % kHues.size();
      taken.insert(next % kHues.size());
      ++next;
    }
    const size_t index = members[family]++;
    const Variant& variant = kVariants.at(index % kVariants.size());
    Look& look = looks[row.name];
    look.color = mix(parse_color(kHues.at(hues[family])), parse_color(variant.with), variant.share);
    look.mark = kMarks.at((marks[family] + index) % kMarks.size());
    for (const double part : variant.dash) {
      if (part > 0) look.dash.push_back(0.5 * part);
    }
  }
  return looks;
}

}  // namespace assay
