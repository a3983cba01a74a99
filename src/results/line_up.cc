#include "results/line_up.h"

#include <algorithm>

#include "base/toml_file.h"

namespace assay {
namespace {

constexpr const char* kFile =
#include "paper.inc"
    ;

struct LineUp {
  std::vector<StandIns> engines;
  std::vector<std::string> only_in_scaling, only_in_text;  // names among `engines`
  std::vector<std::string> others;                         // contenders
  PaperFigures figures;
};

bool holds(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

std::string text_of(const toml::table& table, const char* key) { return table[key].value<std::string>().value(); }

std::vector<std::string> texts_of(const toml::table& table, const char* key) {
  std::vector<std::string> texts;
  for (const toml::node& text : *table[key].as_array()) texts.push_back(text.value<std::string>().value());
  return texts;
}

const LineUp& whole_line_up() {
  static const LineUp whole = [] {
    LineUp read;
    const toml::table file = toml_table(kFile, "src/results/paper.toml");
    for (const toml::node& node : *file["engine"].as_array()) {
      const toml::table& engine = *node.as_table();
      read.engines.emplace_back(text_of(engine, "name"), texts_of(engine, "contenders"));
      const auto& [name, contenders] = read.engines.back();
      if (engine.contains("solver")) read.figures.solvers.emplace_back(text_of(engine, "solver"), contenders);
      const std::string where = engine["in"].value_or<std::string>("figures");
      if (where == "scaling") read.only_in_scaling.push_back(name);
      if (where == "text") read.only_in_text.push_back(name);
    }
    read.others = texts_of(*file["others"].as_table(), "contenders");
    for (const toml::node& node : *file["figure3"].as_array()) {
      const toml::table& row = *node.as_table();
      read.figures.comparisons.push_back({text_of(row, "system"), text_of(row, "title")});
    }
    for (const toml::node& node : *file["figure4"].as_array()) {
      const toml::table& plot = *node.as_table();
      read.figures.drifts.push_back(
          {texts_of(plot, "systems"), text_of(plot, "value"), text_of(plot, "title"), text_of(plot, "axis")});
    }
    return read;
  }();
  return whole;
}

}  // namespace

const std::vector<StandIns>& paper_line_up() { return whole_line_up().engines; }

const PaperFigures& paper_figures() { return whole_line_up().figures; }

std::vector<std::string> papers_among(const std::vector<std::string>& present, bool solvers) {
  const LineUp& whole = whole_line_up();
  std::vector<std::string> chosen;
  for (const auto& [engine, names] : whole.engines) {
    if ((!solvers && holds(whole.only_in_scaling, engine)) || holds(whole.only_in_text, engine)) continue;
    const auto found = std::ranges::find_if(names, [&](const std::string& name) { return holds(present, name); });
    if (found != names.end() && !holds(chosen, *found)) chosen.push_back(*found);
  }
  return chosen;
}

std::vector<std::string> line_up(const std::vector<std::string>& present, size_t most) {
  std::vector<std::string> chosen;
  const auto add = [&](const std::string& name) {
    if (chosen.size() < most && holds(present, name) && !holds(chosen, name)) chosen.push_back(name);
  };
  for (const std::string& name : papers_among(present)) add(name);
  for (const std::string& name : whole_line_up().others) add(name);
  for (const std::string& name : present) add(name);
  return chosen;
}

std::vector<std::string> shown_first(const std::vector<std::string>& present) {
  constexpr size_t kMany = 16, kFew = 3;
  const std::vector<std::string> papers = papers_among(present, /*solvers=*/true);
  return present.size() <= kMany || papers.size() < kFew ? present : papers;
}

}  // namespace assay
