// A comparison as a document, a table and data.
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/text.h"
#include "results/compare/compare.h"

namespace assay {
namespace {

using nlohmann::json;

json number(std::optional<double> value) { return value && std::isfinite(*value) ? json(*value) : json(nullptr); }

std::string csv_number(std::optional<double> value) { return value && std::isfinite(*value) ? shortest(*value) : ""; }

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

// "+5.1 % (+4.0 to +6.2)"
std::string ratio_text(const CellChange& row) {
  if (row.value == "outcome") return fmt::format("{} → {}", row.outcome_a, row.outcome_b);
  if (!row.ratio) return row.time ? "" : "from zero";
  const auto percent = [](double ratio) { return fmt::format("{:+.1f}", 100 * (ratio - 1)); };
  if (std::abs(row.ratio->value) > 10 || std::abs(row.ratio->value) < 0.1) {
    return fmt::format("× {:.3g}", row.ratio->value);
  }
  if (!std::isfinite(row.ratio->low)) return percent(row.ratio->value) + " %";
  return fmt::format("{} % ({} to {})", percent(row.ratio->value), percent(row.ratio->low), percent(row.ratio->high));
}

std::string value_text(std::optional<double> value) { return value ? fmt::format("{:.4g}", *value) : ""; }

json difference_json(const Difference& difference, const Comparison& comparison) {
  return difference.text(comparison.a, comparison.b);
}

struct Counts {
  size_t all = 0;
  std::map<Change, size_t> of;
};

Counts count(const Comparison& comparison, bool times) {
  Counts counts;
  for (const CellChange& row : comparison.rows) {
    if (row.time != times) continue;
    ++counts.all;
    ++counts.of[row.change];
  }
  return counts;
}

std::string counts_text(const Counts& counts, const char* better, const char* worse) {
  std::vector<std::string> parts;
  const auto add = [&](Change change, const std::string& words) {
    const auto found = counts.of.find(change);
    if (found != counts.of.end()) parts.push_back(fmt::format("{} {}", found->second, words));
  };
  add(Change::kWorse, worse);
  add(Change::kBetter, better);
  add(Change::kOther, "otherwise");
  add(Change::kUnsettled, "not alike in all initial states");
  add(Change::kWithin, "by less than the threshold");
  return parts.empty() ? "none changed" : "changed: " + join(parts, ", ");
}

}  // namespace

std::string comparison_summary(const Comparison& comparison) {
  const Counts times = count(comparison, true), others = count(comparison, false);
  std::string text =
      fmt::format("times: {}, {}; accuracy and outcomes: {}, {}", times.all, counts_text(times, "faster", "slower"),
                  others.all, counts_text(others, "better", "worse"));
  if (!comparison.other_windows.empty()) {
    text += fmt::format("; times that are not compared because of other windows of the run: {}",
                        comparison.other_windows.size());
  }
  if (!comparison.without_control.empty()) {
    text += fmt::format("; times that are not compared because the control has none: {}",
                        comparison.without_control.size());
  }
  if (comparison.only_a.size() + comparison.only_b > 0) {
    text += fmt::format("; {} cells only in '{}', {} only in '{}'", comparison.only_a.size(), comparison.a,
                        comparison.only_b, comparison.b);
  }
  if (!comparison.values_only_in_a.empty()) {
    text += fmt::format("; {} of cells that both have only in '{}'",
                        counted(comparison.values_only_in_a.size(), "figure", "figures"), comparison.a);
  }
  return text;
}

std::string comparison_markdown(const Comparison& comparison) {
  std::string text = fmt::format("# What changed from `{}` to `{}`\n\n{}.\n", comparison.a, comparison.b,
                                 comparison_summary(comparison));
  const auto list = [&](const char* title, const std::vector<Difference>& differences) {
    if (differences.empty()) return;
    text += fmt::format("\n{}\n\n", title);
    for (const Difference& each : differences) text += fmt::format("- {}\n", each.text(comparison.a, comparison.b));
  };
  list("Other builds of engines:", comparison.builds);
  list("Accepted differences:", comparison.ignored);
  list("Not in both:", comparison.coverage);
  const auto cells = [&](const char* title, const std::vector<CellChange>& rows) {
    if (rows.empty()) return;
    text += fmt::format("\n{}\n\n", title);
    for (const CellChange& row : rows) {
      text += fmt::format("- {} of {} on {} at {} ms\n", row.measure, row.contender, row.system,
                          timestep_label(row.timestep_ms));
    }
  };
  cells("Timed in other windows of the run, which do not compare:", comparison.other_windows);
  cells("Without a time of the control:", comparison.without_control);
  if (comparison.common_ratio) {
    text += fmt::format(
        "\nThe median of all times' ratios is {:.3f}. What all contenders have in common is rather the machine's: name "
        "one "
        "that did not change with `--control`.\n",
        *comparison.common_ratio);
  }
  std::string rows;
  for (const CellChange& row : comparison.rows) {
    if (row.change == Change::kNone || row.change == Change::kWithin) continue;
    rows += fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", change_text(row.change), row.system,
                        row.contender, timestep_label(row.timestep_ms), row.value, value_text(row.a), value_text(row.b),
                        ratio_text(row), row.tested ? fmt::format("{:.2g}", row.p_corrected) : "exact");
  }
  if (!rows.empty()) {
    text +=
        "\n| change | system | contender | ms | value | A | B | B against A | p, corrected |\n"
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n" +
        rows;
  }
  const CompareOptions& options = comparison.options;
  text += fmt::format(
      "\nTimes: ratios of means with Welch's 95 % interval over processes, p-values corrected for the number of "
      "contenders (Holm) and of a contender's times (Benjamini and Hochberg) at {:.2g}, and a rank test that agrees; "
      "practical threshold {:.2g} %{}. Accuracy is deterministic for one build; where it is over initial states and "
      "changes not alike in them, it is unsettled.\n",
      options.level, 100 * options.threshold,
      options.control.empty() ? "" : fmt::format("; relative to the control {}", options.control));
  return text;
}

std::string comparison_csv(const Comparison& comparison) {
  std::string text =
      "system,contender,timestep_ms,measure,value,unit,a,b,ratio,low,high,p,p_rank,p_corrected,change,outcome_a,"
      "outcome_b\n";
  for (const CellChange& row : comparison.rows) {
    const auto bound = [&](double Interval::* which) {
      return csv_number(row.ratio ? std::optional((*row.ratio).*which) : std::nullopt);
    };
    const auto p = [&](double value) { return row.tested ? csv_number(value) : ""; };
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", quoted(row.system),
                        quoted(row.contender), shortest(row.timestep_ms), row.measure, row.value, row.unit,
                        csv_number(row.a), csv_number(row.b), bound(&Interval::value), bound(&Interval::low),
                        bound(&Interval::high), p(row.p), row.time ? csv_number(row.p_rank) : "", p(row.p_corrected),
                        change_text(row.change), row.outcome_a, row.outcome_b);
  }
  return text;
}

json comparison_json(const Comparison& comparison) {
  json rows = json::array();
  for (const CellChange& row : comparison.rows) {
    json& one = rows.emplace_back(json{{"system", row.system},
                                       {"contender", row.contender},
                                       {"timestep_ms", row.timestep_ms},
                                       {"measure", row.measure},
                                       {"value", row.value},
                                       {"unit", row.unit},
                                       {"a", number(row.a)},
                                       {"b", number(row.b)},
                                       {"ratio", nullptr},
                                       {"change", change_text(row.change)},
                                       {"text", ratio_text(row)},
                                       {"outcome_a", row.outcome_a},
                                       {"outcome_b", row.outcome_b}});
    if (row.ratio) {
      one["ratio"] = number(row.ratio->value);
      one["low"] = number(row.ratio->low);
      one["high"] = number(row.ratio->high);
    }
    if (row.tested) {
      const char* sample = row.rounds ? "round" : "process";
      one.update({{"p", row.p},
                  {"p_corrected", row.p_corrected},
                  {"samples", {row.samples_a, row.samples_b}},
                  {"sample", row.time ? sample : "state or piece"}});
    }
    if (row.time) one["p_rank"] = row.p_rank;
  }
  const auto all = [&](const std::vector<Difference>& differences) {
    json texts = json::array();
    for (const Difference& each : differences) texts.push_back(difference_json(each, comparison));
    return texts;
  };
  const auto cells = [](const std::vector<CellChange>& list) {
    json found = json::array();
    for (const CellChange& row : list) {
      found.push_back({{"system", row.system},
                       {"contender", row.contender},
                       {"measure", row.measure},
                       {"timestep_ms", row.timestep_ms}});
    }
    return found;
  };
  return {{"a", comparison.a},
          {"b", comparison.b},
          {"other_windows", cells(comparison.other_windows)},
          {"without_control", cells(comparison.without_control)},
          {"threshold", comparison.options.threshold},
          {"level", comparison.options.level},
          {"control", comparison.options.control.empty() ? json(nullptr) : json(comparison.options.control)},
          {"correction", "Holm over contenders, Benjamini-Hochberg within"},
          {"gaps", gaps(comparison)},
          {"summary", comparison_summary(comparison)},
          {"common_ratio", number(comparison.common_ratio)},
          {"builds", all(comparison.builds)},
          {"accepted", all(comparison.ignored)},
          {"coverage", all(comparison.coverage)},
          {"only_a", comparison.only_a.size()},
          {"only_b", comparison.only_b},
          {"values_only_in_a", comparison.values_only_in_a.size()},
          {"rows", std::move(rows)}};
}

}  // namespace assay
