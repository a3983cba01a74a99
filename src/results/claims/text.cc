#include "results/claims/text.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/quantity.h"
#include "base/text.h"
#include "results/values.h"

namespace assay {
namespace {

using nlohmann::json;

json number(std::optional<double> value) { return value && std::isfinite(*value) ? json(*value) : json(nullptr); }

// In a cell of a table.
std::string escaped(std::string text) {
  for (size_t at = text.find('|'); at != std::string::npos; at = text.find('|', at + 2)) text.insert(at, "\\");
  return text;
}

// What differs from the paper is what a reader looks for.
std::string marked(Verdict verdict) {
  return verdict == Verdict::kChanged ? fmt::format("**{}**", verdict_words(verdict)) : verdict_words(verdict);
}

std::string sentence(const std::string& text) { return text.empty() || text.back() == '.' ? text : text + "."; }

}  // namespace

std::string figure_text(double value) {
  const double size = std::abs(value);
  if (size >= 100 && size < 1e5) return fmt::format("{:.0f}", value);
  return fmt::format("{:.3g}", value);
}

std::string interval_text(const Interval& interval) {
  if (!(interval.low < interval.high)) return figure_text(interval.value);
  return fmt::format("{} [{}, {}]", figure_text(interval.value), figure_text(interval.low), figure_text(interval.high));
}

std::string value_text(const std::string& value, bool capital) {
  std::string text = value_info(value).label;
  if (value == "grasp_held") text += " (1: yes)";
  if (!capital && !text.empty()) text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  return text;
}

std::string bound_text(const ClaimBound& bound) {
  switch (bound.kind) {
    case ClaimBound::Kind::kAbove:
      return fmt::format("above {}", figure_text(bound.x));
    case ClaimBound::Kind::kBelow:
      return fmt::format("below {}", figure_text(bound.x));
    case ClaimBound::Kind::kBetween:
      return fmt::format("between {} and {}", figure_text(bound.x), figure_text(bound.y));
    case ClaimBound::Kind::kNotAbove:
      return fmt::format("not above {}", figure_text(bound.x));
  }
  return "";
}

std::string verdict_text(Verdict verdict) {
  constexpr std::array kTexts = {"holds", "changed", "not-settled", "not-measurable"};
  return kTexts.at(static_cast<size_t>(verdict));
}

std::string verdict_words(Verdict verdict) {
  std::string text = verdict_text(verdict);
  std::ranges::replace(text, '-', ' ');
  return text;
}

std::string times_text(const Interval& ratio) {
  std::string text = number_text(ratio.value) + " times";
  if (ratio.low < ratio.high) text += fmt::format(" ({} to {})", number_text(ratio.low), number_text(ratio.high));
  return text;
}

json claims_json(const std::vector<Judgement>& judgements) {
  json list = json::array();
  for (const Judgement& each : judgements) {
    json figures = json::array();
    for (const ClaimFigure& figure : each.figures) {
      figures.push_back({{"label", figure.label},
                         {"contender", figure.contender},
                         {"system", figure.system},
                         {"timestep_ms", number(figure.timestep_ms)},
                         {"measure", figure.measure},
                         {"value", number(figure.value)},
                         {"unit", figure.unit},
                         {"low", number(figure.low)},
                         {"high", number(figure.high)}});
    }
    list.push_back({{"number", each.claim.number},
                    {"title", each.claim.title},
                    {"statement", each.claim.statement},
                    {"paper", each.claim.paper},
                    {"verdict", verdict_text(each.verdict)},
                    {"now", each.now},
                    {"threshold", each.threshold},
                    {"summary", each.summary},
                    {"reason", each.reason},
                    {"today", each.today},
                    {"key", each.key},
                    {"figures", std::move(figures)}});
  }
  return list;
}

std::string claims_markdown(const std::vector<Judgement>& judgements) {
  std::string text = "| | claim | verdict | figures |\n| --- | --- | --- | --- |\n";
  for (const Judgement& each : judgements) {
    text += fmt::format("| {} | {} | {} | {} |\n", each.claim.number, escaped(each.claim.title), marked(each.verdict),
                        escaped(each.key));
  }
  for (const Judgement& each : judgements) {
    text += fmt::format("\n### {}. {}\n\n{}\n\n", each.claim.number, each.claim.title, sentence(each.claim.statement));
    text += fmt::format("- The paper: {}\n", sentence(each.claim.paper));
    text += fmt::format("- Verdict: **{}**", verdict_words(each.verdict));
    text += each.reason.empty() ? ".\n" : fmt::format(": {}\n", sentence(each.reason));
    if (!each.now.empty()) text += fmt::format("- {} Needed: {}.\n", each.now, each.threshold);
    if (!each.summary.empty()) text += fmt::format("- Measured: {}\n", each.summary);
    if (!each.today.empty()) text += fmt::format("- {}\n", each.today);
  }
  return text;
}

}  // namespace assay
