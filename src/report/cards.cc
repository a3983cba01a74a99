#include "report/cards.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/quantity.h"
#include "base/text.h"
#include "measures/measure.h"
#include "results/answer.h"

namespace assay {
namespace {

using nlohmann::json;

const ValueInfo& info_of(const SystemAnswers& answers, const std::string& value) {
  return *std::ranges::find(answers.values, value, &ValueInfo::name);
}

// `figures` are of `point`; without one they are the whole text.
struct CardText {
  const Point* point = nullptr;  // that answers; null where none does
  std::string figures;           // its, or the whole text
  const char* before = ": ";     // the figures, where they follow the point's name
};

json answer(const char* id, const std::string& question, const CardText& text, const json& limits,
            const json& realtime) {
  const Point* point = text.point;
  return {{"id", id},
          {"question", question},
          {"text", point == nullptr ? text.figures
                                    : place_text(*point) + (text.figures.empty() ? "" : text.before) + text.figures},
          {"figures", text.figures},
          {"contender", point == nullptr ? json(nullptr) : json(point->contender)},
          {"timestep_ms", point == nullptr ? json(nullptr) : json(point->timestep_ms)},
          {"limits", limits},
          {"realtime", realtime}};
}

// "Fastest within 1 mm, penetration within 5 mm (default)"
std::string with_usual(const std::string& question, const Question& asked) {
  std::string text = question;
  for (const Asked& each : asked.asked) {
    if (each.is_usual) text += ", " + limit_of(each);
  }
  return text;
}

json limits_data(const Question& question) {
  json limits = json::object();
  for (const auto& [value, largest] : question.limits.largest) limits[value] = largest;
  return limits;
}

// "120× real time, error 0.412 mm"
std::string candidate_figures(const SystemAnswers& answers, const Candidate& candidate, const Limits& limits) {
  const ValueInfo& info = info_of(answers, answers.main);
  // "about": the speed was interpolated, not timed.
  std::string text =
      fmt::format("{}{} real time", candidate.speed.timed ? "" : "about ", realtime_text(candidate.speed.factor.value));
  const auto own = candidate.worst.find(answers.main);
  if (own != candidate.worst.end()) {
    text += fmt::format(", {} {}", info.brief, quantity_text(own->second.value.value, info.unit));
  }
  const std::string edge = edge_text(edge_of(answers, candidate, limits));
  return edge.empty() ? text : text + " (" + edge + ")";
}

// The one that is most accurate among those within the limits; of equally accurate ones the fastest.
std::optional<size_t> most_accurate(const SystemAnswers& answers, const Limits& limits) {
  const double resolution = error_resolution(info_of(answers, answers.main).unit);
  std::optional<size_t> best;
  double least = HUGE_VAL;
  for (size_t i = 0; i < answers.candidates.size(); ++i) {
    const Candidate& candidate = answers.candidates[i];
    const auto own = candidate.worst.find(answers.main);
    if (own == candidate.worst.end() || excess(candidate, limits) != 0) continue;
    const double error = std::max(own->second.value.value, resolution);
    if (error < least * (1 - kSameError)) best = i, least = error;
  }
  return best;
}

json fastest_within(const SystemAnswers& answers, double limit) {
  const std::string within = quantity_text(limit, "m", 1);
  LimitOptions options;
  options.error = fmt::format("{}m", limit);
  const Question asked = question_of(options, answers);
  const std::string question = with_usual("Fastest within " + within, asked);
  const Recommendation found = recommend(answers, asked.limits);
  const json limits = limits_data(asked);
  if (found.best) {
    const Candidate& best = answers.candidates[*found.best];
    std::string text = candidate_figures(answers, best, asked.limits);
    if (!found.alike.empty()) {
      text += fmt::format("; not told apart: {}", answers.at(answers.candidates[found.alike.front()]).contender);
      if (found.alike.size() > 1) text += fmt::format(" and {} more", found.alike.size() - 1);
    }
    return answer("fastest-1mm", question, {&answers.at(best), text}, limits, nullptr);
  }
  std::string text = "No sound run was timed";
  if (!answers.candidates.empty()) {
    const bool alone = asked.asked.size() < 2;
    text = fmt::format("No contender is within {}: {}", alone ? within : "all of these",
                       nearest_text(answers, asked, found));
  }
  return answer("fastest-1mm", question, {nullptr, text}, limits, nullptr);
}

json most_accurate_in_real_time(const SystemAnswers& answers) {
  LimitOptions options;
  options.realtime = "1";
  const Question asked = question_of(options, answers);
  const std::optional<size_t> best = most_accurate(answers, asked.limits);
  CardText text{nullptr, "No sound contender was timed in real time"};
  if (!answers.usual.empty()) text.figures += " within these limits";
  if (best) {
    const Candidate& candidate = answers.candidates[*best];
    text = {&answers.at(candidate), candidate_figures(answers, candidate, asked.limits)};
  }
  return answer("most-accurate-realtime", with_usual("Most accurate in real time", asked), text, limits_data(asked), 1);
}

json largest_sound(const SystemAnswers& answers) {
  double largest = 0;
  for (const Point& point : answers.points) {
    if (point.sound) largest = std::max(largest, point.timestep_ms);
  }
  const char* id = "largest-sound-timestep";
  const std::string question = "Largest sound timestep";
  if (largest == 0) return answer(id, question, {nullptr, "No contender is sound at any timestep"}, json::object(), {});
  std::vector<const Point*> there;
  for (const Point& point : answers.points) {
    if (point.sound && same_timestep(point.timestep_ms, largest)) there.push_back(&point);
  }
  // Of several the one with the smallest error, where that is known; its speed need not be.
  const auto error = [&](const Point* point) {
    const auto own = point->worst.find(answers.main);
    return own == point->worst.end() ? HUGE_VAL : own->second.value.value;
  };
  const Point* best = *std::ranges::min_element(there, {}, error);
  std::vector<std::string> figures;
  const bool known = error(best) < HUGE_VAL;
  const auto is_tried = [&](const Point& point) {
    return point.timestep_ms > largest && !same_timestep(point.timestep_ms, largest);
  };
  const bool at_end = std::ranges::none_of(answers.points, is_tried);
  if (known) {
    const ValueInfo& info = info_of(answers, answers.main);
    figures.push_back(fmt::format("{} {}", info.brief, quantity_text(error(best), info.unit)));
  }
  if (there.size() > 1) {
    figures.push_back(
        fmt::format("{} {} sound there", there.size() - 1, there.size() == 2 ? "other is" : "others are"));
  }
  if (at_end) figures.push_back(phrase("largest_tried"));
  return answer(id, question, {best, join(figures, "; "), known ? ": " : "; "}, json::object(), {});
}

// How far the contenders' fine-step runs are apart at the end, as far as they were compared.
std::optional<double> disagreement(const Results& results, const std::string& system) {
  std::vector<double> distances;
  for (const std::string& contender : results.contenders()) {
    const Figure figure = results.figure(system, contender, "agreement", {});
    if (figure.found == Found::kThere) distances.push_back(figure.value.value);
  }
  return distances.empty() ? std::nullopt : std::optional(median(distances));
}

constexpr double kDeep = 1e-3;  // m: more than a contact's softness should show

std::string caveat(const Results& results, const SystemAnswers& answers, const json& fastest) {
  std::vector<std::string> sentences;
  if (!results.timed(answers.system)) {
    sentences.emplace_back("The speed on this system was not timed, so no contender is the fastest.");
  }
  const Candidate* best = nullptr;
  for (const Candidate& candidate : answers.candidates) {
    const Point& point = answers.at(candidate);
    if (fastest["contender"] == point.contender && fastest["timestep_ms"] == point.timestep_ms) best = &candidate;
  }
  const std::string overlap = overlap_text(answers);
  if (!overlap.empty()) sentences.push_back(overlap);
  if (best != nullptr) {
    const Point& point = answers.at(*best);
    // It may have been measured at some of the timesteps only.
    double depth = 0;
    for (const Candidate& candidate : answers.candidates) {
      const Point& other = answers.at(candidate);
      const auto own = candidate.worst.find("penetration_max");
      if (other.contender != point.contender || other.timestep_ms > point.timestep_ms) continue;
      if (own != candidate.worst.end()) depth = std::max(depth, own->second.value.value);
    }
    if (depth > (overlap.empty() ? 0 : answers.start_overlap) + kDeep) {
      sentences.push_back(
          fmt::format("The fastest lets shapes penetrate each other by up to {}.", quantity_text(depth, "m", 2)));
    }
    const double limit = fastest["limits"].value(answers.main, HUGE_VAL);
    if (best->worst.at(answers.main).value.high > limit) {
      sentences.push_back(fmt::format("The error's 95 % interval of the fastest reaches to {}.",
                                      quantity_text(best->worst.at(answers.main).value.high, "m")));
    }
    if (!best->speed.timed) {
      sentences.push_back(fmt::format("The speed of the fastest is interpolated between {} and {} ms.",
                                      timestep_label(best->speed.below_ms), timestep_label(best->speed.above_ms)));
    }
  }
  const std::string measure = value_info(answers.main).measure;
  if (reads(measure, Reads::kPieces)) {
    std::string text = answers.main == "consistency" ? "The error is against each contender's own fine-step run"
                                                     : "The error is against each contender's own motion at its finest "
                                                       "timestep";
    const auto apart = disagreement(results, answers.system);
    if (apart) text += fmt::format("; these runs end {} apart (median)", quantity_text(*apart, "m", 2));
    sentences.push_back(text + ".");
  }
  constexpr size_t kMost = 2;
  sentences.resize(std::min(sentences.size(), kMost));
  return join(sentences, " ");
}

}  // namespace

std::string overlap_text(const SystemAnswers& answers) {
  if (answers.start_overlap <= kDeep) return "";
  return fmt::format("The model overlaps itself by {} at its start, which is no engine's fault.",
                     quantity_text(answers.start_overlap, "m", 2));
}

json card_data(const Results& results, const SystemAnswers& answers) {
  constexpr double kLimit = 1e-3;  // m
  json list = json::array();
  json first = json::object({{"contender", nullptr}, {"timestep_ms", nullptr}});
  if (!answers.main.empty() && info_of(answers, answers.main).unit == "m") {
    list.push_back(fastest_within(answers, kLimit));
    first = list.back();
  }
  if (!answers.main.empty()) list.push_back(most_accurate_in_real_time(answers));
  list.push_back(largest_sound(answers));
  return {{"answers", std::move(list)}, {"caveat", caveat(results, answers, first)}};
}

}  // namespace assay
