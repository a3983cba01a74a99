#include "results/looks.h"

#include <algorithm>
#include <array>
#include <optional>
#include <set>

#include <nlohmann/json.hpp>

#include "engines/about.h"
#include "results/line_up.h"
#include "results/store/facts.h"

namespace assay {
namespace {

struct Hue {
  const char *light, *dark;
};
// Families name theirs by its place here (`look` of src/engines/*/about.toml). Chosen so that any two differ by 0.06 in
// Oklab as people without green cones see them; the test computes it.
constexpr std::array kHues = {Hue{"#1463c4", "#5aa2f5"}, Hue{"#d4590c", "#f58a45"}, Hue{"#a98b59", "#e3b835"},
                              Hue{"#039963", "#52d58d"}, Hue{"#7233a0", "#9b72da"}, Hue{"#c03481", "#d963a4"},
                              Hue{"#608300", "#79ac26"}, Hue{"#126e56", "#4addd6"}, Hue{"#b13347", "#db5859"},
                              Hue{"#774d28", "#c3997d"}, Hue{"#566981", "#94adb8"}, Hue{"#0f90b1", "#49c1e7"}};

// What is under a line, and text on it, by theme.
struct Theme {
  const char *ink, *paper;
};
constexpr Theme kLight = {"#1d2126", "#fbfaf7"}, kDark = {"#e8e6e1", "#14171a"};

constexpr std::array<std::string_view, 8> kMarks = {"circle",        "square", "triangle", "diamond",
                                                    "triangle-down", "cross",  "star",     "wye"};

struct Variant {
  std::array<double, 6> dash;  // up to the first 0
  bool with_ink;               // what the hue is mixed with, and how much
  double share;
};
constexpr std::array kVariants = {Variant{{}, true, 0},          Variant{{7, 3}, true, 0.28},
                                  Variant{{2, 3}, false, 0.22},  Variant{{9, 3, 2, 3}, true, 0.45},
                                  Variant{{12, 4}, false, 0.30}, Variant{{4, 2}, true, 0.14},
                                  Variant{{1, 3}, false, 0.12},  Variant{{9, 2, 1, 2, 1, 2}, true, 0.36}};

std::string engine_of(const ContenderRow& contender) {
  const std::string& name = contender.engine;
  return name.ends_with("-f32") || name.ends_with("-f64") ? name.substr(0, name.size() - 4) : name;
}

bool is_joint(const ContenderRow& contender) {
  return text_fact(facts_of(contender.capabilities_json), "coordinates") == "joint";
}

std::string shade(const char* hue, const Variant& variant, const Theme& theme) {
  return color_text(mix(parse_color(hue), parse_color(variant.with_ink ? theme.ink : theme.paper), variant.share));
}

}  // namespace

std::string_view mark_text(Mark mark) { return kMarks.at(static_cast<size_t>(mark)); }

std::vector<std::string> family_colors(bool dark) {
  std::vector<std::string> colors;
  colors.reserve(kHues.size());
  for (const Hue& hue : kHues) colors.emplace_back(dark ? hue.dark : hue.light);
  return colors;
}

std::string variant_of(const ContenderRow& row) { return text_fact(facts_of(row.capabilities_json), "varies"); }

std::map<std::string, Look> looks_of(const std::vector<ContenderRow>& all) {
  std::vector<ContenderRow> contenders;
  std::vector<std::string> names;
  std::map<std::string, std::set<bool>> kinds;  // of coordinates, by engine
  for (const ContenderRow& row : all) {
    if (row.engine == kHarness || !variant_of(row).empty()) continue;
    contenders.push_back(row);
    names.push_back(row.name);
    kinds[engine_of(row)].insert(is_joint(row));
  }
  const auto is_joint_family = [&](const ContenderRow& row) {
    return kinds[engine_of(row)].size() > 1 && is_joint(row);
  };
  const auto family_of = [&](const ContenderRow& row) {
    return engine_of(row) + (is_joint_family(row) ? "/joint" : "");
  };
  std::map<std::string, size_t> hues, marks, members;
  std::set<size_t> taken;
  for (const ContenderRow& row : contenders) {
    const EngineAbout* about = about_engine(engine_of(row));
    if (about == nullptr) continue;
    const std::optional<FamilyLook>& look = is_joint_family(row) ? about->joint_look : about->look;
    if (!look) continue;
    hues[family_of(row)] = look->hue;
    marks[family_of(row)] = static_cast<size_t>(std::ranges::find(kMarks, look->mark) - kMarks.begin());
    taken.insert(look->hue);
  }
  const std::vector<std::string> shown = shown_first(names);
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
    // With more contenders than dashes the marks move on by one, so that no two have both.
    const size_t index = members[family]++;
    const Variant& variant = kVariants.at(index % kVariants.size());
    const Hue& hue = kHues.at(hues[family]);
    Look& look = looks[row.name];
    look.family = family;
    look.light = shade(hue.light, variant, kLight);
    look.dark = shade(hue.dark, variant, kDark);
    look.mark = static_cast<Mark>((marks[family] + index + index / kVariants.size()) % kMarks.size());
    for (const double part : variant.dash) {
      if (part > 0) look.dash.push_back(part);
    }
    look.first = std::ranges::find(shown, row.name) != shown.end();
  }
  for (const ContenderRow& row : all) {
    if (const auto own = looks.find(variant_of(row)); own != looks.end()) looks[row.name] = own->second;
  }
  return looks;
}

}  // namespace assay
