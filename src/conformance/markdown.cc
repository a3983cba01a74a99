#include "conformance/markdown.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <ranges>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/quantity.h"
#include "base/text.h"
#include "conformance/conformance.h"

namespace assay {

std::string figure_text(const Json& result) {
  // a figure that is not finite is null in JSON
  const auto number = [&](const char* key) {
    const Json& value = result.at(key);
    return quantity_text(value.is_number() ? value.get<double>() : NAN, result.at("unit").get<std::string>());
  };
  return fmt::format("{} of {}", number("figure"), number("tolerance"));
}

std::string conformance_markdown(const Json& contenders) {
  const std::vector<std::pair<std::string, std::string>> marks = {
      {"pass", "✓"}, {"deviation", "≈"}, {"not-applicable", "–"}, {"fail", "✕"}};
  const auto mark = [&](const std::string& status) {
    return std::ranges::find(marks, status, &std::pair<std::string, std::string>::first)->second;
  };
  // a note that several contenders share stands once
  std::vector<std::pair<std::array<std::string, 3>, std::vector<std::string>>> notes;
  std::vector<std::map<std::string, std::string>> rows;
  std::set<std::string> ran, not_always_passed;
  for (const Json& contender : contenders) {
    std::map<std::string, std::string>& row = rows.emplace_back();
    for (const Json& result : contender.at("results")) {
      const std::string status = result.at("status"), test = result.at("test");
      row[test] = mark(status);
      ran.insert(test);
      if (status == "pass") continue;
      not_always_passed.insert(test);
      const std::array<std::string, 3> key = {status, test, result.at("note")};
      auto entry = std::ranges::find(notes, key, [](const auto& note) { return note.first; });
      if (entry == notes.end()) entry = notes.insert(notes.end(), {key, {}});
      const std::string name = contender.at("contender");
      entry->second.push_back(status == "not-applicable" ? name : fmt::format("{} ({})", name, figure_text(result)));
    }
  }
  // A test that all pass has no column of its own: the width goes to what tells contenders apart.
  std::vector<std::string> columns, passed_by_all;
  for (const ConformanceTest& test : conformance_tests()) {
    if (ran.contains(test.name)) (not_always_passed.contains(test.name) ? columns : passed_by_all).push_back(test.name);
  }
  std::string text = "| contender |", rule = "| --- |";
  for (const auto& [status, symbol] : marks) text += fmt::format(" {} |", symbol), rule += " --: |";
  for (const std::string& test : columns) text += fmt::format(" {} |", test), rule += " :-: |";
  text += "\n" + rule + "\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    text += fmt::format("| {} |", contenders.at(i).at("contender").get<std::string>());
    for (const auto& [status, symbol] : marks) {
      text += fmt::format(" {} |", std::ranges::count(rows[i] | std::views::values, symbol));
    }
    for (const std::string& test : columns) text += fmt::format(" {} |", rows[i].contains(test) ? rows[i][test] : " ");
    text += "\n";
  }
  if (!passed_by_all.empty()) text += fmt::format("\nPassed by all: {}.\n", join(passed_by_all, ", "));
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

}  // namespace assay
