#include "results/answer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/quantity.h"
#include "base/text.h"
#include "measures/measure.h"

namespace assay {

using Json = nlohmann::ordered_json;

// ---- parts ------------------------------------------------------------------------------------------------------------

void Answer::table(std::vector<std::string> headings, std::vector<std::vector<std::string>> rows,
                   std::vector<size_t> right) {
  AnswerPart& own = parts_.back();
  own.columns = std::move(headings);
  own.rows = std::move(rows);
  own.right = std::move(right);
}

Json parts_json(const std::vector<AnswerPart>& parts) {
  Json all = Json::array();
  for (const AnswerPart& part : parts) {
    Json lines = Json::array();
    for (const AnswerLine& line : part.lines) lines.push_back({{"label", line.label}, {"text", line.text}});
    all.push_back({{"heading", part.heading},
                   {"evidence", part.evidence},
                   {"lines", std::move(lines)},
                   {"columns", part.columns},
                   {"rows", part.rows},
                   {"right", part.right}});
  }
  return all;
}

nlohmann::json stored_answer(const std::string& entry) {
  constexpr size_t kLongestLabel = 40;
  nlohmann::json parts = nlohmann::json::parse(entry, nullptr, /*allow_exceptions=*/false);
  if (!parts.is_array()) return nlohmann::json::array();
  bool evidence = false;
  for (nlohmann::json& part : parts) {
    if (!part.is_object() || !part.contains("heading") || !part["heading"].is_string() || !part.contains("lines") ||
        !part["lines"].is_array()) {
      return nlohmann::json::array();
    }
    const std::string heading = part["heading"];
    evidence = evidence || heading.starts_with("What ") || heading.starts_with("Engines ");
    if (!part.contains("evidence")) part["evidence"] = evidence;
    for (nlohmann::json& line : part["lines"]) {
      if (!line.is_string()) continue;
      const std::string text = line;
      const size_t end = text.find_first_of(":.");
      const bool labelled = end != std::string::npos && end > 0 && end <= kLongestLabel && text[end] == ':' &&
                            end + 1 < text.size() && text[end + 1] == ' ';
      const size_t begin = labelled ? text.find_first_not_of(' ', end + 1) : 0;
      line = {{"label", labelled ? text.substr(0, end) : ""}, {"text", begin < text.size() ? text.substr(begin) : ""}};
    }
  }
  return parts;
}

// ---- sentences --------------------------------------------------------------------------------------------------------

namespace {

struct Phrase {
  std::string_view name, text;
};
constexpr std::array kPhrases = {
    Phrase{"best", "{system}: {answer}"},
    Phrase{"answer", "{place}, {realtime} real time"},
    Phrase{"answer_at_edge", "{place}, {realtime} real time, {edge}"},
    Phrase{"place_at_edge", "{place}, {edge},"},
    Phrase{"largest_tried", "the largest timestep tried"},
    Phrase{"largest_timed", "the largest timestep timed"},
    Phrase{"largest_measured", "the largest timestep measured in full"},
    Phrase{"between", "not measured in full at {steps} ms"},
    Phrase{"smallest_tried", "the smallest timestep tried"},
    Phrase{"smallest_timed", "the smallest timestep timed"},
    Phrase{"smallest_measured", "the smallest timestep measured in full"},
    Phrase{"only_tried", "the only timestep tried"},
    Phrase{"edges", "{larger} and {smaller}"},
    Phrase{"larger_mark", "+ larger timesteps were not tried, timed or measured in full: one may do, and be faster"},
    Phrase{"smaller_mark", "- smaller timesteps were not tried, timed or measured in full"},
    Phrase{"asked", "asked"},
    Phrase{"within", "{value} within {limit}"},
    Phrase{"within_usual", "{value} within {limit} (default)"},
    Phrase{"at_least", "at least {realtime} real time"},
    Phrase{"settings", "settings"},
    Phrase{"setting", "setting"},
    Phrase{"defaults", "the adapter's defaults"},
    Phrase{"speed", "speed"},
    Phrase{"grasp", "grasp"},
    Phrase{"margin", "margin"},
    Phrase{"exceeds", "{value} {figure} at {factor} times this step ({step} ms), above the limit; {margin}"},
    Phrase{"alike", "not told apart by speed"},
    Phrase{"reaches", "its 95 % interval reaches beyond the limit; {whole}"},
    Phrase{"whole", "the fastest that stays within as a whole: {answer}"},
    Phrase{"no_whole", "no contender stays within as a whole"},
    Phrase{"not_accuracy", "self-consistency is not accuracy"},
    Phrase{"accuracy", "its error against the reference solution is {error}; --measure truth limits that one"},
    Phrase{"each", "Each contender at its fastest within the limits"},
    Phrase{"contender", "contender"},
    Phrase{"timestep", "timestep"},
    Phrase{"realtime", "real time"},
    Phrase{"estimated", "~ {realtime}"},
    Phrase{"estimates", "~ interpolated between timed timesteps"},
    Phrase{"left_out", "Not considered, or beyond the limits"},
    Phrase{"at", "at {steps} ms"},
    Phrase{"from", "from {steps} ms"},
    Phrase{"unmeasured", "the {value} was not measured"},
    Phrase{"near", "beyond the limits, and nearest to them here: {values}"},
    Phrase{"figure", "{value} {figure}"},
    Phrase{"times_realtime", "{realtime} real time"},
    Phrase{"none", "no contender on {system} has {limits}: {nearest}"},
    Phrase{"relax", "relax the {value} to {limit}"},
    Phrase{"relax_speed", "relax the speed to {realtime} real time"},
    Phrase{"relaxed", "{relax}: {answer}"},
    Phrase{"or", "; or "},
    Phrase{"not_alone", "; to relax the {values} alone is not enough"},
    Phrase{"or_value", " or the "},
    Phrase{"none_alone", "to relax one of these alone is not enough, and {nearest}"},
    Phrase{"the_speed", "speed"},
    Phrase{"grounds", "What the limits rest on"},
    Phrase{"nearest", "the nearest is {place} with {values}"},
    Phrase{"begun", "; not measured there: {values}"},
    Phrase{"unmeasured_speed", "speed"},
    Phrase{"nothing", "no point is sound and has any of these values"},
    Phrase{"over", ", {factor} times the limit"},
    Phrase{"under", ", {factor} of the least"},
};

}  // namespace

std::string phrase(std::string_view name, const std::vector<std::pair<std::string_view, std::string>>& words) {
  const auto* found = std::ranges::find(kPhrases, name, &Phrase::name);
  std::string_view rest = found == kPhrases.end() ? name : found->text;
  std::string text;
  for (size_t open = rest.find('{'); open != std::string_view::npos; open = rest.find('{')) {
    const size_t close = rest.find('}', open);
    const std::string_view key = rest.substr(open + 1, close - open - 1);
    text += rest.substr(0, open);
    for (const auto& [own, word] : words) {
      if (own == key) text += word;
    }
    rest.remove_prefix(close + 1);
  }
  return text += rest;
}

nlohmann::json phrases_json() {
  nlohmann::json all = nlohmann::json::object();
  for (const Phrase& each : kPhrases) all[std::string(each.name)] = each.text;
  return all;
}

namespace {

std::string labels_of(const std::vector<double>& timesteps_ms) {
  std::vector<std::string> labels;
  labels.reserve(timesteps_ms.size());
  for (const double step : timesteps_ms) labels.push_back(timestep_label(step));
  return join(labels, ", ");
}

std::string with_interval(const Interval& interval, const std::string& unit) {
  std::string text = quantity_text(interval.value, unit);
  // Of lengths that are all below the least one there is no more to say.
  if (interval.low == interval.high || std::abs(interval.high) < least_quantity(unit)) return text;
  return fmt::format("{} ({} to {})", text, quantity_text(interval.low, unit), quantity_text(interval.high, unit));
}

}  // namespace

std::string edge_text(const Edge& edge) {
  if (edge.larger == End::kTried && edge.smaller == End::kTried) return phrase("only_tried");
  std::string larger, smaller;
  switch (edge.larger) {
    case End::kNone:
      break;
    case End::kTried:
      larger = phrase("largest_tried");
      break;
    case End::kTimed:
      larger = phrase("largest_timed");
      break;
    case End::kMeasured:
      larger = phrase("largest_measured");
      break;
    case End::kBetween:
      larger = phrase("between", {{"steps", labels_of(edge.between_ms)}});
      break;
  }
  switch (edge.smaller) {
    case End::kNone:
    case End::kBetween:
      break;
    case End::kTried:
      smaller = phrase("smallest_tried");
      break;
    case End::kTimed:
      smaller = phrase("smallest_timed");
      break;
    case End::kMeasured:
      smaller = phrase("smallest_measured");
      break;
  }
  if (larger.empty() || smaller.empty()) return larger + smaller;
  return phrase("edges", {{"larger", larger}, {"smaller", smaller}});
}

std::string edge_mark(const Edge& edge) {
  if (edge.larger != End::kNone && edge.smaller != End::kNone) return " ±";
  if (edge.larger != End::kNone) return " +";
  return edge.smaller != End::kNone ? " -" : "";
}

std::vector<std::string> mark_lines(const std::vector<Edge>& edges) {
  std::vector<std::string> lines;
  if (std::ranges::any_of(edges, [](const Edge& edge) { return edge.larger != End::kNone; })) {
    lines.push_back(phrase("larger_mark"));
  }
  if (std::ranges::any_of(edges, [](const Edge& edge) { return edge.smaller != End::kNone; })) {
    lines.push_back(phrase("smaller_mark"));
  }
  return lines;
}

std::string answering_text(const SystemAnswers& answers, size_t index, const Limits& limits) {
  const Candidate& candidate = answers.candidates[index];
  const std::string edge = edge_text(edge_of(answers, candidate, limits));
  return phrase(edge.empty() ? "answer" : "answer_at_edge", {{"place", place_text(answers.at(candidate))},
                                                             {"realtime", realtime_text(candidate.speed.factor.value)},
                                                             {"edge", edge}});
}

std::string place_text(const Point& point) {
  return fmt::format("{} at {} ms", point.contender, timestep_label(point.timestep_ms));
}

std::string places_text(const SystemAnswers& answers, const std::vector<size_t>& candidates) {
  std::vector<std::string> places;
  places.reserve(candidates.size());
  for (const size_t i : candidates) places.push_back(place_text(answers.at(answers.candidates[i])));
  return join(places, ", ");
}

std::string speed_text(const Candidate& candidate) {
  const Speed& speed = candidate.speed;
  return fmt::format("{}, {}", with_interval(speed.factor, "1"),
                     speed.timed ? "timed at this timestep"
                                 : fmt::format("interpolated between {} and {} ms", timestep_label(speed.below_ms),
                                               timestep_label(speed.above_ms)));
}

std::string held_text(const Interval& held) {
  return fmt::format("held from every initial state; at 95 % from at least {:.0f} % of such states", 100 * held.low);
}

std::string worst_text(const Worst& worst, const std::string& unit) {
  const bool below = std::abs(worst.value.value) < least_quantity(unit);  // which the text says
  return (worst.is_bound && !below ? "<= " : "") + quantity_text(worst.value.value, unit);
}

std::string worst_line(const Worst& worst, const std::string& unit, double timestep_ms) {
  return fmt::format("{}{}",
                     worst.is_bound ? worst_text(worst, unit) + " (near the floor of its fine-step run)"
                                    : with_interval(worst.value, unit),
                     same_timestep(worst.at_ms, timestep_ms)
                         ? ""
                         : fmt::format(", at {} ms, the largest up to this timestep", timestep_label(worst.at_ms)));
}

std::vector<ValueInfo> errors_besides(const SystemAnswers& answers) {
  std::vector<ValueInfo> values;
  for (const char* name : {"penetration_added_max", "penetration_max", "grasp_slip", "rebound"}) {
    const bool is_there = !values.empty() && values.front().name == "penetration_added_max";
    if (is_there && std::string_view(name) == "penetration_max") continue;
    const auto measured = std::ranges::find(answers.values, name, &ValueInfo::name);
    if (measured != answers.values.end()) values.push_back(*measured);
  }
  return values;
}

NotAccuracy not_accuracy(const SystemAnswers& answers) {
  const std::string open = value_named("truth", answers.values);
  const bool measured = std::ranges::find(answers.values, open, &ValueInfo::name) != answers.values.end();
  return {{"consistency_cold", "consistency"}, measured ? open : ""};
}

// ---- answers ----------------------------------------------------------------------------------------------------------

namespace {

void add_candidates(const SystemAnswers& answers, const Question& question, const std::vector<size_t>& candidates,
                    Answer& answer) {
  std::vector<ValueInfo> errors;
  for (const Asked& asked : question.asked) {
    if (errors.size() < kMostErrors) errors.push_back(asked.value);
  }
  if (!errors.empty()) {
    for (const ValueInfo& value : errors_besides(answers)) {
      if (std::ranges::find(errors, value.name, &ValueInfo::name) == errors.end()) errors.push_back(value);
    }
  }
  std::vector<std::string> headings = {phrase("contender"), phrase("timestep"), phrase("realtime")};
  for (const ValueInfo& value : errors) headings.push_back(value.brief);
  std::vector<std::vector<std::string>> rows;
  std::vector<Edge> edges;
  bool estimated = false;
  for (const size_t i : candidates) {
    const Candidate& candidate = answers.candidates[i];
    const Point& point = answers.at(candidate);
    const std::string realtime = realtime_text(candidate.speed.factor.value);
    estimated = estimated || !candidate.speed.timed;
    std::vector<std::string>& row = rows.emplace_back();
    edges.push_back(edge_of(answers, candidate, question.limits));
    row = {point.contender, timestep_label(point.timestep_ms) + " ms" + edge_mark(edges.back()),
           candidate.speed.timed ? realtime : phrase("estimated", {{"realtime", realtime}})};
    for (const ValueInfo& value : errors) {
      const auto own = candidate.worst.find(value.name);
      row.push_back(own == candidate.worst.end() ? "" : worst_text(own->second, value.unit));
    }
  }
  if (estimated) answer.line(phrase("estimates"));
  for (const std::string& line : mark_lines(edges)) answer.line(line);
  std::vector<size_t> right(headings.size() - 1);
  std::iota(right.begin(), right.end(), 1);
  answer.table(headings, rows, right);
}

// What a candidate has of the values that are limited.
std::string asked_text(const Candidate& candidate, const Question& question) {
  std::vector<std::string> parts;
  parts.reserve(question.asked.size() + 1);
  for (const Asked& asked : question.asked) {
    parts.push_back(phrase("figure", {{"value", asked.value.brief},
                                      {"figure", worst_text(candidate.worst.at(asked.value.name), asked.value.unit)}}));
  }
  if (question.limits.realtime) {
    parts.push_back(phrase("times_realtime", {{"realtime", realtime_text(candidate.speed.factor.value)}}));
  }
  return join(parts, ", ");
}

// The values that are asked for, as far as they are known, and by how much they miss their limits.
std::string missed_text(const std::map<std::string, Worst>& worst, std::optional<double> speed,
                        const Question& question) {
  std::vector<std::string> parts;
  const auto missing = [](const char* how, double factor) {
    return phrase(how, {{"factor", fmt::format("{:.3g}", factor)}});
  };
  for (const Asked& asked : question.asked) {
    const auto own = worst.find(asked.value.name);
    if (own == worst.end()) continue;
    const double factor = own->second.value.value / asked.largest;
    parts.push_back(
        phrase("figure", {{"value", asked.value.brief}, {"figure", worst_text(own->second, asked.value.unit)}}) +
        (exceeds(own->second.value.value, asked.largest) && std::isfinite(factor) ? missing("over", factor) : ""));
  }
  if (question.limits.realtime && speed) {
    const double least = *question.limits.realtime;
    parts.push_back(phrase("times_realtime", {{"realtime", realtime_text(*speed)}}) +
                    (*speed < least ? missing("under", *speed / least) : ""));
  }
  return join(parts, "; ");
}

std::string margin_line(const SystemAnswers& answers, const Question& question, const Candidate& best) {
  const auto beyond = first_exceeded(answers, best, question.limits);
  if (!beyond) return best.margin;
  const ValueInfo& value =
      std::ranges::find(question.asked, beyond->value, [](const Asked& asked) { return asked.value.name; })->value;
  const double factor = std::round(100 * beyond->timestep_ms / answers.at(best).timestep_ms) / 100;
  return phrase("exceeds", {{"value", value.brief},
                            {"figure", worst_text(beyond->worst, value.unit)},
                            {"factor", shortest(factor)},
                            {"step", timestep_label(beyond->timestep_ms)},
                            {"margin", best.margin}});
}

}  // namespace

void add_best(const SystemAnswers& answers, const Question& question, const Recommendation& found, Answer& answer) {
  const Candidate& best = answers.candidates[found.contenders.front()];
  const Point& point = answers.at(best);
  answer.part(phrase("best", {{"system", answers.system},
                              {"answer", answering_text(answers, found.contenders.front(), question.limits)}}));
  answer.fact(phrase("asked"), limits_text(question));
  const std::vector<SettingChange>& changes = answers.changes.at(point.contender);
  if (changes.empty()) answer.fact(phrase("settings"), phrase("defaults"));
  for (const SettingChange& change : changes) answer.fact(phrase("setting"), change_text(change));
  answer.fact(phrase("speed"), speed_text(best));
  constexpr size_t kBelowSpeed = 8;
  if (const std::string note = caveat(best.speed); !note.empty()) answer.line({"", note, kBelowSpeed});
  for (const Asked& asked : question.asked) {
    answer.fact(asked.value.brief, worst_line(best.worst.at(asked.value.name), asked.value.unit, point.timestep_ms));
  }
  if (point.held) answer.fact(phrase("grasp"), held_text(*point.held));
  answer.remark(phrase("margin"), margin_line(answers, question, best));
  if (!found.alike.empty()) answer.remark(phrase("alike"), places_text(answers, found.alike));
  if (found.certain != found.best) {
    const std::string whole =
        found.certain ? phrase("whole", {{"answer", answering_text(answers, *found.certain, question.limits)}})
                      : phrase("no_whole");
    answer.line(phrase("reaches", {{"whole", whole}}));
  }
  const NotAccuracy other = not_accuracy(answers);
  const auto open = best.worst.find(other.open);
  const bool limited = std::ranges::any_of(
      question.asked, [](const Asked& asked) { return reads(asked.value.measure, Reads::kSolution); });
  const bool is_limited = !question.asked.empty() &&
                          std::ranges::find(other.limited, question.asked.front().value.name) != other.limited.end();
  if (is_limited && !limited && open != best.worst.end()) {
    answer.remark(phrase("not_accuracy"), phrase("accuracy", {{"error", worst_text(open->second, "m")}}));
  }
  answer.part(phrase("each"));
  add_candidates(answers, question, found.contenders, answer);
}

namespace {

// With the limit that has given way.
Limits relaxed_limits(const Limits& limits, const Relaxation& by) {
  Limits relaxed = limits;
  for (auto& [value, largest] : relaxed.largest) {
    if (value == by.value) largest = by.to;
  }
  if (by.value.empty()) relaxed.realtime = by.to;
  return relaxed;
}

// "relax the error to 2.41 mm: fast at 4 ms, 400× real time; or relax the slip to ...".
std::string relaxed_text(const SystemAnswers& answers, const Question& question, const Recommendation& found) {
  std::vector<std::string> ways, unmoved;
  const auto add = [&](const std::string& value, const std::string& named) {
    const auto own = std::ranges::find(found.relaxed, value, &Relaxation::value);
    if (own == found.relaxed.end()) return unmoved.push_back(named);
    const std::string relax = value.empty() ? phrase("relax_speed", {{"realtime", realtime_text(own->to)}})
                                            : phrase("relax", {{"value", named}, {"limit", own->text}});
    ways.push_back(phrase(
        "relaxed", {{"relax", relax},
                    {"answer", answering_text(answers, own->candidate, relaxed_limits(question.limits, *own))}}));
  };
  for (const Asked& asked : question.asked) add(asked.value.name, asked.value.brief);
  if (question.limits.realtime) add("", phrase("the_speed"));
  return join(ways, phrase("or")) +
         (unmoved.empty() ? "" : phrase("not_alone", {{"values", join(unmoved, phrase("or_value"))}}));
}

}  // namespace

std::string nearest_text(const SystemAnswers& answers, const Question& question, const Recommendation& found) {
  if (!found.relaxed.empty()) return relaxed_text(answers, question, found);
  if (found.nearest) {
    const Candidate& candidate = answers.candidates[*found.nearest];
    const Point& point = answers.at(candidate);
    const std::string edge = edge_text(edge_of(answers, candidate, question.limits));
    const std::string place =
        edge.empty() ? place_text(point) : phrase("place_at_edge", {{"place", place_text(point)}, {"edge", edge}});
    return phrase(
        "none_alone",
        {{"nearest",
          phrase("nearest",
                 {{"place", place}, {"values", missed_text(point.worst, candidate.speed.factor.value, question)}})}});
  }
  // what was begun
  const Point* nearest = nullptr;
  std::pair<size_t, double> least;  // values that are missing, largest factor
  for (const Point& point : answers.points) {
    std::pair<size_t, double> own;
    for (const Asked& asked : question.asked) {
      const auto worst = point.worst.find(asked.value.name);
      if (worst == point.worst.end()) {
        ++own.first;
      } else {
        own.second = std::max(own.second, worst->second.value.value / asked.largest);
      }
    }
    if (!point.sound || own.first == question.asked.size() || (nearest != nullptr && own >= least)) continue;
    nearest = &point;
    least = own;
  }
  if (nearest == nullptr) return phrase("nothing");
  std::vector<std::string> missing;
  for (const Asked& asked : question.asked) {
    if (!nearest->worst.contains(asked.value.name)) missing.push_back(asked.value.brief);
  }
  if (!nearest->speed) missing.push_back(phrase("unmeasured_speed"));
  std::optional<double> factor;
  if (nearest->speed) factor = nearest->speed->factor.value;
  return phrase("nearest",
                {{"place", place_text(*nearest)}, {"values", missed_text(nearest->worst, factor, question)}}) +
         (missing.empty() ? "" : phrase("begun", {{"values", join(missing, ", ")}}));
}

// ---- what is left out -------------------------------------------------------------------------------------------------

std::string LeftOutPoints::when() const {
  if (fails) return phrase("from", {{"steps", timestep_label(timesteps_ms.front())}});
  return phrase("at", {{"steps", labels_of(timesteps_ms)}});
}

namespace {

void add_to(std::vector<LeftOutPoints>& groups, const Point& point, const std::string& why, bool fails) {
  auto same = std::ranges::find_if(groups, [&](const LeftOutPoints& group) {
    return group.contender == point.contender && (fails ? group.fails : group.why == why);
  });
  if (same == groups.end()) same = groups.insert(groups.end(), {point.contender, why, {}, fails});
  same->timesteps_ms.push_back(point.timestep_ms);
}

}  // namespace

std::vector<LeftOutPoints> excluded_groups(const SystemAnswers& answers) {
  std::vector<LeftOutPoints> groups;
  for (const Excluded& each : answers.excluded) {
    const Point& point = answers.points[each.point];
    add_to(groups, point, each.why, !point.sound);
  }
  for (LeftOutPoints& group : groups) std::ranges::sort(group.timesteps_ms);
  return groups;
}

std::vector<LeftOutPoints> left_out(const SystemAnswers& answers, const Question& question,
                                    const Recommendation& found) {
  std::vector<LeftOutPoints> groups = excluded_groups(answers);
  for (const Candidate& candidate : answers.candidates) {
    for (const Asked& asked : question.asked) {
      if (candidate.worst.contains(asked.value.name)) continue;
      add_to(groups, answers.at(candidate), phrase("unmeasured", {{"value", asked.value.brief}}), false);
    }
  }
  for (const size_t i : found.beyond) {
    const Candidate& candidate = answers.candidates[i];
    add_to(groups, answers.at(candidate), phrase("near", {{"values", asked_text(candidate, question)}}), false);
  }
  for (LeftOutPoints& group : groups) std::ranges::sort(group.timesteps_ms);
  std::ranges::stable_sort(groups, {}, &LeftOutPoints::contender);
  return groups;
}

void add_left_out(const SystemAnswers& answers, const Question& question, const Recommendation& found, Answer& answer) {
  std::vector<LeftOutPoints> groups = left_out(answers, question, found), single, shared;
  if (groups.empty()) return;
  answer.part(phrase("left_out"), /*evidence=*/true);
  // What is the same for several contenders stands once, and last.
  while (!groups.empty()) {
    LeftOutPoints group = groups.front();
    const auto alike = [&](const LeftOutPoints& other) {
      return !group.fails && !other.fails && other.why == group.why && other.timesteps_ms == group.timesteps_ms;
    };
    const auto count = std::ranges::count_if(groups, alike);
    if (count > 1) {
      std::erase_if(groups, alike);
      group.contender = counted(static_cast<size_t>(count), "contender");
    } else {
      groups.erase(groups.begin());
    }
    (count > 1 ? shared : single).push_back(std::move(group));
  }
  single.insert(single.end(), shared.begin(), shared.end());
  for (const LeftOutPoints& group : single) answer.remark(group.contender + " " + group.when(), group.why);
}

std::vector<std::string> grounds(const SystemAnswers& answers, const Question& question) {
  std::vector<std::string> sentences;
  for (const Asked& asked : question.asked) {
    const auto own = answers.stand_ins.find(asked.value.name);
    if (own != answers.stand_ins.end()) sentences.push_back(own->second);
  }
  return sentences;
}

void add_grounds(const SystemAnswers& answers, const Question& question, Answer& answer) {
  const std::vector<std::string> sentences = grounds(answers, question);
  if (sentences.empty()) return;
  answer.part(phrase("grounds"), /*evidence=*/true);
  for (const std::string& sentence : sentences) answer.line(sentence);
}

Answer best_answer(const SystemAnswers& answers, const Question& question, const Recommendation& found) {
  Answer answer;
  add_best(answers, question, found, answer);
  add_grounds(answers, question, answer);
  add_left_out(answers, question, found, answer);
  return answer;
}

std::string none_text(const SystemAnswers& answers, const Question& question, const Recommendation& found) {
  return phrase("none", {{"system", answers.system},
                         {"limits", limits_text(question)},
                         {"nearest", nearest_text(answers, question, found)}});
}

// ---- the same as JSON -------------------------------------------------------------------------------------------------

namespace {

Json interval_json(const Interval& of) { return {{"value", of.value}, {"low", of.low}, {"high", of.high}}; }

Json candidate_json(const SystemAnswers& answers, const Question& question, size_t index) {
  const Candidate& candidate = answers.candidates[index];
  const std::string edge = edge_text(edge_of(answers, candidate, question.limits));
  const Point& point = answers.at(candidate);
  Json worst = Json::object();
  for (const auto& [name, of] : candidate.worst) {
    worst[name] = interval_json(of.value);
    worst[name]["at_ms"] = of.at_ms;
    if (of.is_bound) worst[name]["bound"] = true;
  }
  Json settings = Json::array();
  for (const SettingChange& change : answers.changes.at(point.contender)) {
    settings.push_back({{"setting", change.setting},
                        {"value", change.value},
                        {"default", change.otherwise.empty() ? Json(nullptr) : Json(change.otherwise)},
                        {"unit", change.unit},
                        {"meaning", change.meaning}});
  }
  const std::string first = question.asked.empty() ? answers.main : question.asked.front().value.name;
  Json exceeds = nullptr;
  if (const auto beyond = first_exceeded(answers, candidate, question.limits)) {
    exceeds = {{"timestep_ms", beyond->timestep_ms}, {"value", beyond->value}, {"worst", beyond->worst.value.value}};
  }
  return {{"contender", point.contender},
          {"timestep_ms", point.timestep_ms},
          {"realtime_factor", interval_json(candidate.speed.factor)},
          {"error", worst.contains(first) ? interval_json(candidate.worst.at(first).value) : Json(nullptr)},
          {"varies", point.varies},
          {"settings", std::move(settings)},
          {"timed", candidate.speed.timed},
          {"between_ms", {candidate.speed.below_ms, candidate.speed.above_ms}},
          {"coverage", candidate.speed.coverage ? Json(*candidate.speed.coverage) : Json(nullptr)},
          {"worst", std::move(worst)},
          {"exceeds", std::move(exceeds)},
          {"margin", candidate.margin},
          {"end_of_grid", candidate.end_of_grid.empty() ? Json(nullptr) : Json(candidate.end_of_grid)},
          {"edge", edge.empty() ? Json(nullptr) : Json(edge)}};
}

}  // namespace

Json recommendation_json(const SystemAnswers& answers, const Question& question, const Recommendation& found) {
  const auto list = [&](const std::vector<size_t>& indices) {
    Json all = Json::array();
    for (const size_t i : indices) all.push_back(candidate_json(answers, question, i));
    return all;
  };
  const auto one = [&](const std::optional<size_t>& index) {
    return index ? candidate_json(answers, question, *index) : Json(nullptr);
  };
  Json limits = Json::array(), excluded = Json::array();
  for (const Asked& asked : question.asked) {
    limits.push_back({{"value", asked.value.name},
                      {"unit", asked.value.unit},
                      {"largest", asked.largest},
                      {"default", asked.is_usual}});
  }
  for (const LeftOutPoints& group : left_out(answers, question, found)) {
    excluded.push_back({{"contender", group.contender}, {"timesteps_ms", group.timesteps_ms}, {"why", group.why}});
  }
  Json relaxed = Json::array();
  for (const Relaxation& each : found.relaxed) {
    Question with = question;
    with.limits = relaxed_limits(question.limits, each);
    relaxed.push_back({{"value", each.value.empty() ? Json("realtime_factor") : Json(each.value)},
                       {"to", each.to},
                       {"text", each.text},
                       {"recommended", candidate_json(answers, with, each.candidate)}});
  }
  const Asked* first = question.asked.empty() ? nullptr : &question.asked.front();
  const std::string name = first == nullptr ? answers.main : first->value.name;
  std::vector<size_t> front;
  if (const auto members = answers.fronts.find(name); members != answers.fronts.end()) {
    for (const FrontMember& member : members->second) {
      const auto at = std::ranges::find(answers.candidates, member.point, &Candidate::point);
      front.push_back(static_cast<size_t>(at - answers.candidates.begin()));
    }
  }
  return {{"system", answers.system},
          {"measure", name},
          {"unit", first == nullptr ? Json(nullptr) : Json(first->value.unit)},
          {"error", first == nullptr ? Json(nullptr) : Json(first->largest)},
          {"limits", std::move(limits)},
          {"realtime", question.limits.realtime ? Json(*question.limits.realtime) : Json(nullptr)},
          {"recommended", one(found.best)},
          {"certain", one(found.certain)},
          {"nearest", one(found.nearest)},
          {"relaxations", std::move(relaxed)},
          {"grounds", grounds(answers, question)},
          {"not_told_apart", list(found.alike)},
          {"contenders", list(found.contenders)},
          {"front", list(front)},
          {"excluded", std::move(excluded)}};
}

}  // namespace assay
