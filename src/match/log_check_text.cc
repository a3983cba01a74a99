#include <algorithm>
#include <array>
#include <map>

#include <fmt/format.h>

#include "base/text.h"
#include "match/log_check.h"

namespace assay::match {
namespace {

constexpr std::array kSeverities = {"wrong", "warning", "remark"};
constexpr size_t kMostShown = 20, kMostOfAKind = 6;

const char* severity_text(FindingSeverity severity) { return kSeverities[static_cast<size_t>(severity)]; }

// "run.csv:17: 'knee'": where a finding is.
std::string place_text(const LogFinding& finding) {
  if (finding.log.empty()) return "all logs";
  if (finding.line == 0) return finding.log;
  return fmt::format("{}, line {}", finding.log, finding.line);
}

double spoiled_share(const LogCheck& check, size_t log) {
  if (check.logs[log].duration <= 0) return 0;
  std::vector<TimeSpan> spans;
  for (const SpoiledSpan& spoiled : check.spoiled) {
    if (spoiled.log == log) spans.push_back(spoiled.span);
  }
  std::ranges::sort(spans, {}, &TimeSpan::from);
  double sum = 0, reached = 0;
  bool first = true;
  for (const TimeSpan& span : spans) {
    const double from = first ? span.from : std::max(span.from, reached);
    sum += std::max(0.0, span.to - from);
    reached = first ? span.to : std::max(reached, span.to);
    first = false;
  }
  return sum / check.logs[log].duration;
}

}  // namespace

std::string finding_text(const LogFinding& finding) {
  std::string text = place_text(finding) + ": ";
  // a text that names the quantity need not be told it
  if (!finding.column.empty() && finding.text.find("'" + finding.column + "'") == std::string::npos) {
    text += fmt::format("'{}': ", finding.column);
  }
  text += finding.text;
  return finding.fix.empty() ? text : fmt::format("{}; {}", text, finding.fix);
}

Answer check_answer(const LogCheck& check) {
  Answer answer;
  answer.part("Logs");
  std::vector<std::vector<std::string>> rows;
  for (size_t i = 0; i < check.logs.size() && i < kMostShown; ++i) {
    const LogFacts& log = check.logs[i];
    rows.push_back({log.name, std::to_string(log.samples), fmt::format("{:.3g}", log.duration),
                    fmt::format("{:.4g}", log.rate), fmt::format("{:.0f}", 100 * log.jitter),
                    fmt::format("{:.0f}", 100 * spoiled_share(check, i))});
  }
  answer.table({"log", "samples", "length s", "rate Hz", "jitter %", "unusable %"}, std::move(rows), {1, 2, 3, 4, 5});
  if (check.logs.size() > kMostShown) {
    answer.line(fmt::format("and {}, which --json lists", counted(check.logs.size() - kMostShown, "more log")));
  }
  answer.part("Quantities");
  struct Sum {
    double lower = 0, upper = 0, step = 0, glitches = 0;
    std::vector<double> noise;
  };
  std::vector<std::string> order;
  std::map<std::string, Sum> sums;
  for (const LogFacts& log : check.logs) {
    for (const ChannelFacts& channel : log.channels) {
      const auto [at, is_new] = sums.try_emplace(channel.quantity, Sum{channel.lower, channel.upper, 0, 0, {}});
      if (is_new) order.push_back(channel.quantity);
      Sum& sum = at->second;
      sum.lower = std::min(sum.lower, channel.lower);
      sum.upper = std::max(sum.upper, channel.upper);
      if (sum.step == 0 || (channel.step > 0 && channel.step < sum.step)) sum.step = channel.step;
      sum.glitches = std::max(sum.glitches, channel.glitches);
      sum.noise.push_back(channel.noise);
    }
  }
  rows.clear();
  for (const std::string& quantity : order) {
    Sum& sum = sums[quantity];
    std::ranges::sort(sum.noise);
    rows.push_back({quantity, fmt::format("{:.4g}", sum.lower), fmt::format("{:.4g}", sum.upper),
                    fmt::format("{:.2g}", sum.noise[sum.noise.size() / 2]), fmt::format("{:.2g}", sum.step),
                    fmt::format("{:.1f}", 100 * sum.glitches)});
  }
  answer.table({"quantity", "lowest", "highest", "noise", "step", "glitches %"}, std::move(rows), {1, 2, 3, 4, 5});
  constexpr std::array kHeadings = {"To fix before a fit", "Warnings", "Remarks"};
  for (size_t severity = 0; severity < kHeadings.size(); ++severity) {
    std::map<std::string, size_t> count;
    bool first = true;
    for (const LogFinding& finding : check.findings) {
      if (static_cast<size_t>(finding.severity) != severity) continue;
      if (first) answer.part(kHeadings[severity]);
      first = false;
      if (++count[finding.kind] <= kMostOfAKind) answer.line(finding_text(finding));
    }
    for (const auto& [kind, number] : count) {
      if (number <= kMostOfAKind) continue;
      answer.line(fmt::format("{}: {}, which --json lists", kind, counted(number - kMostOfAKind, "more finding")));
    }
  }
  if (check.findings.empty()) {
    answer.part("Findings");
    answer.line("no mistake was found");
  }
  return answer;
}

nlohmann::ordered_json check_json(const LogCheck& check) {
  using Json = nlohmann::ordered_json;
  Json logs = Json::array(), findings = Json::array(), spoiled = Json::array();
  for (size_t i = 0; i < check.logs.size(); ++i) {
    const LogFacts& log = check.logs[i];
    Json channels = Json::array();
    for (const ChannelFacts& channel : log.channels) {
      channels.push_back({{"quantity", channel.quantity},
                          {"lowest", channel.lower},
                          {"highest", channel.upper},
                          {"noise", channel.noise},
                          {"step", channel.step},
                          {"glitches", channel.glitches}});
    }
    logs.push_back({{"log", log.name},
                    {"file", log.source},
                    {"samples", log.samples},
                    {"duration_s", log.duration},
                    {"rate_hz", log.rate},
                    {"jitter", log.jitter},
                    {"unusable", spoiled_share(check, i)},
                    {"quantities", std::move(channels)}});
  }
  const auto or_null = [](const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); };
  for (const LogFinding& finding : check.findings) {
    const bool whole = finding.span.from == 0 && finding.span.to == 0;
    findings.push_back({{"severity", severity_text(finding.severity)},
                        {"kind", finding.kind},
                        {"log", or_null(finding.log)},
                        {"file", or_null(finding.source)},
                        {"line", finding.line > 0 ? Json(finding.line) : Json(nullptr)},
                        {"quantity", or_null(finding.column)},
                        {"span_s", whole ? Json(nullptr) : Json({finding.span.from, finding.span.to})},
                        {"message", finding.text},
                        {"fix", or_null(finding.fix)}});
  }
  for (const SpoiledSpan& span : check.spoiled) {
    spoiled.push_back(
        {{"log", check.logs[span.log].name}, {"span_s", {span.span.from, span.span.to}}, {"reason", span.reason}});
  }
  return {{"logs", std::move(logs)}, {"findings", std::move(findings)}, {"spoiled", std::move(spoiled)}};
}

}  // namespace assay::match
