#include "cli/conformance_markdown.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/quantity.h"
#include "base/text.h"
#include "conformance/conformance.h"

namespace assay::cli {

std::string figure_text(const Json& result) {
  // a figure that is not finite is null in JSON
  const auto number = [&](const char* key) {
    const Json& value = result.at(key);
    return quantity_text(value.is_number() ? value.get<double>() : NAN, result.at("unit").get<std::string>());
  };
  return fmt::format("{} of {}", number("figure"), number("tolerance"));
}

std::string conformance_markdown(const Json& contenders) {
  const std::map<std::string, std::string> marks = {
      {"pass", "✓"}, {"fail", "✕"}, {"deviation", "≈"}, {"not-applicable", "–"}};
  std::vector<std::string> columns;
  for (const ConformanceTest& test : conformance_tests()) columns.push_back(test.name);
  std::string text = fmt::format("| contender | {} |\n| --- |", join(columns, " | "));
  for (std::size_t i = 0; i < columns.size(); ++i) text += " :-: |";
  text += "\n";
  // a note that several contenders share stands once
  std::vector<std::pair<std::array<std::string, 3>, std::vector<std::string>>> notes;
  for (const Json& contender : contenders) {
    const std::string name = contender.at("contender");
    std::map<std::string, std::string> cells;
    for (const Json& result : contender.at("results")) {
      const std::string status = result.at("status");
      cells[result.at("test")] = marks.at(status);
      if (status == "pass") continue;
      const std::array<std::string, 3> key = {status, result.at("test"), result.at("note")};
      auto entry = std::ranges::find(notes, key, [](const auto& note) { return note.first; });
      if (entry == notes.end()) entry = notes.insert(notes.end(), {key, {}});
      entry->second.push_back(status == "not-applicable" ? name : fmt::format("{} ({})", name, figure_text(result)));
    }
    text += fmt::format("| {} |", name);
    for (const std::string& test : columns) text += fmt::format(" {} |", cells.contains(test) ? cells[test] : " ");
    text += "\n";
  }
  const std::vector<std::pair<std::string, std::string>> headings = {
      {"fail", "Failures"}, {"deviation", "Declared deviations"}, {"not-applicable", "Not applicable"}};
  for (const auto& [status, heading] : headings) {
    std::string lines;
    for (const auto& [key, who] : notes) {
      if (key[0] == status) lines += fmt::format("- **{}**: {}. {}\n", key[1], join(who, ", "), key[2]);
    }
    if (!lines.empty()) text += fmt::format("\n## {}\n\n{}", heading, lines);
  }
  return text;
}

}  // namespace assay::cli
