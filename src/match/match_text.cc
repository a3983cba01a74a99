// The answer as JSON and in words.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/text.h"
#include "match/match.h"

namespace assay::match {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMostOdd = 5;  // of the logs that nobody explains, in words

Json number(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

Json json_of(const ErrorFigures& figures) {
  Json json = Json::object();
  if (figures.joints_deg) json["joints_deg"] = *figures.joints_deg;
  if (figures.position_percent) json["position_percent"] = *figures.position_percent;
  if (figures.rotation_deg) json["rotation_deg"] = *figures.rotation_deg;
  return json;
}

Json json_of(const Interval& interval) {
  return {{"value", interval.value}, {"low", interval.low}, {"high", interval.high}};
}

// The mean over logs.
ErrorFigures mean_of(const std::vector<LogResult>& logs, ErrorFigures LogResult::* which) {
  std::vector<ErrorFigures> all;
  for (const LogResult& log : logs) all.push_back(log.*which);
  return mean_of(all);
}

// The same in a sentence: "21.7 % of its size and 17.5 deg".
std::string in_words(const ErrorFigures& figures) {
  std::vector<std::string> parts;
  if (figures.joints_deg) parts.push_back(fmt::format("{:.3g} deg", *figures.joints_deg));
  if (figures.position_percent) parts.push_back(fmt::format("{:.3g} % of the body's size", *figures.position_percent));
  if (figures.rotation_deg) parts.push_back(fmt::format("{:.3g} deg", *figures.rotation_deg));
  return parts.empty() ? "-" : join(parts, " and ");
}

// What became of each parameter: its value and interval, or why there is none.
struct Verdict {
  std::string status;  // "fitted", "at its bound", "not identified"
  std::string with;    // the combination that was not identified
};
Verdict verdict_of(const ContenderResult& result, size_t index) {
  const std::string& name = result.parameters[index].name;
  for (const Combination& each : result.fit.combinations) {
    if (each.frozen != name) continue;
    return {"not identified", join(each.members, " x ")};
  }
  const auto& bound = result.fit.at_bound;
  return {std::ranges::find(bound, name) != bound.end() ? "at its bound" : "fitted", ""};
}

// How the held-out error goes with the timestep.
void add_timesteps(const MatchAnswer& answer, Answer& text) {
  std::vector<double> columns;
  for (const ContenderResult& result : answer.contenders) {
    for (const TimestepResult& at : result.timesteps) columns.push_back(at.timestep_ms);
  }
  std::ranges::sort(columns);
  columns.erase(std::ranges::unique(columns).begin(), columns.end());
  if (columns.size() < 2) return;
  std::vector<std::string> headings = {"contender"};
  for (const double timestep_ms : columns) headings.push_back(timestep_label(timestep_ms) + " ms");
  std::vector<std::vector<std::string>> rows;
  for (const ContenderResult& result : answer.contenders) {
    if (result.timesteps.empty()) continue;
    std::vector<std::string> row = {result.contender};
    for (const double timestep_ms : columns) {
      const auto at = std::ranges::find(result.timesteps, timestep_ms, &TimestepResult::timestep_ms);
      row.push_back(at == result.timesteps.end() ? "-"
                    : at->failed > 0
                        ? fmt::format("{}, {} of {} fail", figures_text(at->error), at->failed, at->windows)
                        : figures_text(at->error));
    }
    rows.push_back(std::move(row));
  }
  text.part("Held out, by timestep");
  text.table(std::move(headings), std::move(rows));
}

}  // namespace

std::string figures_text(const ErrorFigures& figures) {
  std::vector<std::string> parts;
  if (figures.joints_deg) parts.push_back(fmt::format("{:.2f} deg", *figures.joints_deg));
  if (figures.position_percent) parts.push_back(fmt::format("{:.1f} %", *figures.position_percent));
  if (figures.rotation_deg) parts.push_back(fmt::format("{:.1f} deg", *figures.rotation_deg));
  return parts.empty() ? "-" : join(parts, " / ");
}

std::string answer_text(const MatchQuestion& question, const MatchAnswer& answer) {
  std::string text;
  const size_t asked = answer.contenders.size() + answer.to_do.size();
  if (!answer.to_do.empty())
    text = fmt::format("So far {} of {} contenders were fitted. ", answer.contenders.size(), asked);
  if (answer.contenders.empty()) return text + "Nothing can be said yet.";
  const ContenderResult& best = answer.contenders.front();
  if (!best.failure.empty()) {
    return text + fmt::format("No contender could be fitted; {}: {}.", best.contender, best.failure);
  }
  const std::string over =
      answer.whole ? "over whole motions" : fmt::format("over {:g} s", question.config.report_window_s);
  const std::string whom = question.like.empty() ? "the robot" : question.like;
  const std::string fitted = in_words(mean_of(best.logs, &LogResult::fitted));
  if (best.no_better_than_rest()) {
    text += fmt::format(
        "No contender moves as {} did: the nearest, {}, is off by {} {}, on logs that its fit did not see; what stays "
        "where it starts is off by {}",
        whom, best.contender, fitted, over, in_words(mean_of(best.logs, &LogResult::at_rest)));
  } else {
    text += fmt::format("{} moves as {} did within {} {}, on logs that its fit did not see", best.contender, whom,
                        fitted, over);
  }
  std::vector<std::string> good;
  for (const ContenderResult& result : answer.contenders) {
    if (result.failure.empty() && &result != &best && result.as_good_as_best) good.push_back(result.contender);
  }
  if (!good.empty()) text += "; as good: " + join(good, ", ");
  text += fmt::format(". With the values of the model's file: {}", in_words(mean_of(best.logs, &LogResult::untuned)));
  if (best.worse_than_untuned()) text += ", which is better than the fit";
  return text + fmt::format(". Noise floor, what noise of the first states alone makes: {}.",
                            in_words(mean_of(best.logs, &LogResult::floor)));
}

Json match_json(const MatchQuestion& question, const MatchAnswer& answer) {
  Json json;
  json["model"] = question.model.name;
  json["model_hash"] = question.spec.hash;
  if (!question.like.empty()) json["like"] = question.like;
  json["timestep_ms"] = question.timestep_ms;
  json["seed"] = question.config.seed;
  json["windows"] = answer.whole
                        ? Json("whole motions")
                        : Json{{"fit_s", question.config.fit_window_s}, {"report_s", question.config.report_window_s}};
  json["held_out_by"] = answer.leave_one_out ? "leaving one out" : "logs";
  json["training"] = answer.training;
  json["held_out"] = answer.held_out;
  json["answer"] = answer_text(question, answer);
  json["to_do"] = answer.to_do;
  json["contenders"] = Json::array();
  for (const ContenderResult& result : answer.contenders) {
    Json one;
    one["contender"] = result.contender;
    one["failure"] = result.failure.empty() ? Json() : Json(result.failure);
    one["warnings"] = result.warnings;
    if (result.failure.empty()) {
      one["score"] = json_of(result.score);
      one["untuned_score"] = json_of(result.untuned_score);
      one["worse_than_untuned"] = result.worse_than_untuned();
      one["as_good_as_best"] = result.as_good_as_best;
      one["behind_best"] = result.behind_best ? json_of(*result.behind_best) : Json();
      one["held_out"] = json_of(mean_of(result.logs, &LogResult::fitted));
      one["untuned"] = json_of(mean_of(result.logs, &LogResult::untuned));
      one["floor"] = json_of(mean_of(result.logs, &LogResult::floor));
      one["at_rest"] = json_of(mean_of(result.logs, &LogResult::at_rest));
      one["floor_score"] = mean_of(result.logs, &LogResult::floor).score();
      if (!answer.whole) {
        one["held_out_short"] = json_of(mean_of(result.logs, &LogResult::fitted_short));
        one["untuned_short"] = json_of(mean_of(result.logs, &LogResult::untuned_short));
      }
      one["parameters"] = Json::array();
      for (size_t k = 0; k < result.parameters.size(); ++k) {
        const Parameter& p = result.parameters[k];
        const Verdict verdict = verdict_of(result, k);
        one["parameters"].push_back({{"name", p.name},
                                     {"unit", p.unit},
                                     {"status", verdict.status},
                                     {"value", result.fit.values[k]},
                                     {"low", number(result.fit.low[k])},
                                     {"high", number(result.fit.high[k])},
                                     {"model", p.nominal},
                                     {"lower_bound", p.lower},
                                     {"upper_bound", p.upper},
                                     {"with", verdict.with}});
      }
      const Json fit = fit_json(result.fit);
      one["not_identified"] = fit.at("combinations");
      one["starts"] = fit.at("starts");
      one["changes"] = result.changes;
      one["settings"] = result.settings;
      one["phases"] = Json::array();
      for (const Phase& phase : result.phases) {
        Json each = json_of(phase.fitted);
        each["phase"] = phase.name;
        one["phases"].push_back(each);
      }
      one["timesteps"] = Json::array();
      for (const TimestepResult& at : result.timesteps) {
        one["timesteps"].push_back({{"timestep_ms", at.timestep_ms},
                                    {"held_out", json_of(at.error)},
                                    {"score", json_of(at.score)},
                                    {"windows", at.windows},
                                    {"failed", at.failed}});
      }
      one["logs"] = Json::array();
      for (const LogResult& log : result.logs) {
        one["logs"].push_back({{"log", log.log},
                               {"windows", log.windows},
                               {"unpredictable", log.unpredictable},
                               {"failed", log.failed},
                               {"held_out", json_of(log.fitted)},
                               {"untuned", json_of(log.untuned)},
                               {"floor", json_of(log.floor)},
                               {"at_rest", json_of(log.at_rest)},
                               {"held_out_short", json_of(log.fitted_short)},
                               {"untuned_short", json_of(log.untuned_short)}});
      }
      one["evaluations"] = result.evaluations;
    }
    json["contenders"].push_back(one);
  }
  json["unpredictable"] = answer.unpredictable;
  json["odd_logs"] = answer.odd_logs;
  json["odd_names"] = answer.odd_names;
  json["warnings"] = answer.warnings;
  return json;
}

Answer match_text(const MatchQuestion& question, const MatchAnswer& answer) {
  Answer text;
  text.part(fmt::format("{}: which contender moves as {}", question.model.name,
                        question.like.empty() ? "measured" : question.like + " does"));
  text.line(fmt::format("{} to fit, {} held out{}; timestep {} ms", counted(answer.training.size(), "log", "logs"),
                        counted(answer.held_out.size(), "log", "logs"), answer.leave_one_out ? ", each once" : "",
                        shortest(question.timestep_ms)));
  for (const std::string& warning : answer.warnings) text.remark("warning", warning);
  const auto best = answer.contenders.begin();
  if (best != answer.contenders.end() && best->failure.empty()) {
    text.line(answer_text(question, answer));
  }
  std::vector<std::vector<std::string>> rows;
  for (const ContenderResult& result : answer.contenders) {
    if (!result.failure.empty()) continue;
    std::vector<std::string> row = {result.contender, figures_text(mean_of(result.logs, &LogResult::fitted)),
                                    figures_text(mean_of(result.logs, &LogResult::untuned)),
                                    figures_text(mean_of(result.logs, &LogResult::floor)),
                                    &result == &*best        ? "best"
                                    : result.as_good_as_best ? "as good"
                                                             : fmt::format("+{:.2g}", result.behind_best->value)};
    if (!answer.whole) row.insert(row.begin() + 2, figures_text(mean_of(result.logs, &LogResult::fitted_short)));
    rows.push_back(std::move(row));
  }
  if (!rows.empty()) {
    std::vector<std::string> columns = {"contender", "held out", "untuned", "floor", "to the best"};
    if (!answer.whole) {
      columns[1] = fmt::format("held out, {:g} s", question.config.report_window_s);
      columns.insert(columns.begin() + 2, fmt::format("{:g} s", question.config.fit_window_s));
    }
    text.table(columns, std::move(rows));
  }
  add_timesteps(answer, text);
  for (const ContenderResult& result : answer.contenders) {
    text.part(result.contender);
    if (!result.failure.empty()) {
      text.line("not fitted: " + result.failure);
      continue;
    }
    for (const std::string& warning : result.warnings) text.remark("warning", warning);
    std::vector<std::vector<std::string>> parameters;
    for (size_t k = 0; k < result.parameters.size(); ++k) {
      const Parameter& p = result.parameters[k];
      const Verdict verdict = verdict_of(result, k);
      const bool known = result.fit.low[k] && result.fit.high[k];
      parameters.push_back({p.name, fmt::format("{:.4g}{}{}", result.fit.values[k], p.unit.empty() ? "" : " ", p.unit),
                            known ? fmt::format("{:.4g} to {:.4g}", *result.fit.low[k], *result.fit.high[k]) : "-",
                            fmt::format("{:.4g}", p.nominal),
                            verdict.status + (verdict.with.empty() ? "" : ": " + verdict.with)});
    }
    if (!parameters.empty()) {
      text.table({"parameter", "fitted", "95 %", "model", ""}, std::move(parameters), {3});
    }
    for (const Combination& each : result.fit.combinations) {
      text.line(fmt::format(
          "not identified: {} (95 % spans {:.2g} times itself): {} {}", join(each.members, " x "), each.interval,
          each.frozen,
          each.as_found ? "stays as found, because the model's value fits worse" : "stays as in the model"));
    }
    for (const Phase& phase : result.phases) text.fact(phase.name, figures_text(phase.fitted));
  }
  if (!answer.unpredictable.empty() || !answer.odd_logs.empty()) {
    text.part("Logs");
    for (const std::string& log : answer.unpredictable) text.line("not predictable: " + log);
    for (size_t i = 0; i < answer.odd_logs.size() && i < kMostOdd; ++i) {
      text.line("the others do not predict it: " + answer.odd_logs[i]);
    }
    if (answer.odd_logs.size() > kMostOdd) {
      text.line(fmt::format("and {} more, in match.json", answer.odd_logs.size() - kMostOdd));
    }
  }
  return text;
}

}  // namespace assay::match
