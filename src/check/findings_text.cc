#include "check/findings_text.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "base/quantity.h"
#include "base/text.h"

namespace assay {
namespace {

constexpr size_t kMostPlaces = 3;
constexpr size_t kMostSprings = 5;
constexpr size_t kMostInJson = 200;   // in JSON, the worst first
constexpr double kOfInterest = 0.02;  // s; nobody steps a robot with more

// ---- JSON -----------------------------------------------------------------------------------------------------------

Json file_json(const std::string& file) { return file.empty() ? Json(nullptr) : Json(file); }
Json number_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
Json milliseconds_json(double seconds) { return number_json(1000 * seconds); }

Json bound_json(const StepBound& bound, const FileFacts& facts) {
  Json springs = Json::array();
  for (const ExplicitSpring& spring : bound.springs) {
    if (springs.size() == kMostInJson) break;
    springs.push_back({{"element", spring.element},
                       {"line", line_json(facts.line_of(spring.element))},
                       {"file", file_json(facts.file_of(spring.element))},
                       {"inertia", number_json(spring.inertia)},
                       {"inertia_held", spring.held_inertia > 0 ? Json(spring.held_inertia) : Json(nullptr)},
                       {"stiffness", spring.stiffness},
                       {"damping", spring.damping},
                       {"damper_ms", milliseconds_json(spring.damper_step())},
                       {"spring_ms", milliseconds_json(spring.spring_step())},
                       {"damper_held_ms", milliseconds_json(spring.held_damper_step())},
                       {"largest_ms", milliseconds_json(spring.step())},
                       {"share", spring.share}});
  }
  const ExplicitSpring* critical = bound.critical();
  return {{"largest_ms", milliseconds_json(bound.largest)},
          {"critical", critical == nullptr ? Json(nullptr) : Json(critical->element)},
          {"frequency_hz", bound.frequency},
          {"decay_per_s", bound.decay},
          {"count", bound.springs.size()},
          {"springs", springs}};
}

// ---- for people -----------------------------------------------------------------------------------------------------

// "geom 'foot'" without "geom ", which stands before all of them.
std::string place_text(const Place& place, const std::string& noun) {
  std::string text = noun.empty() ? place.element : place.element.substr(noun.size() + 1);
  if (place.line > 0) text += fmt::format(" ({})", assay::place_text(place.file, place.line));
  if (!place.text.empty()) text += " " + place.text;
  return text;
}

// The noun before the names of all places, "joint"; empty where they differ.
std::string common_noun(const Finding& finding) {
  const std::string& first = finding.places.front().element;
  std::string noun = first.substr(0, first.find(" '"));
  const bool same =
      std::ranges::all_of(finding.places, [&](const Place& place) { return place.element.starts_with(noun + " '"); });
  return same ? noun : "";
}

std::string plural(const std::string& noun) {
  if (noun == "geoms") return "pairs";
  if (noun == "body") return "bodies";
  return noun + (noun.ends_with("h") ? "es" : "s");
}

std::string finding_text(const Finding& finding) {
  std::string out;
  std::string text = fmt::format("  {}: ", finding.title);
  const size_t count = finding.places.size();
  const std::string noun = count > 1 ? common_noun(finding) : "";
  const bool plain = std::ranges::all_of(finding.places, [](const Place& place) { return place.text.empty(); });
  if (!noun.empty()) text += fmt::format("{}{} {}", finding.all && count > 1 ? "all " : "", count, plural(noun));
  if (!finding.all || !plain || noun.empty()) {
    std::vector<std::string> shown;
    shown.reserve(kMostPlaces + 1);
    for (size_t i = 0; i < std::min(count, kMostPlaces); ++i) shown.push_back(place_text(finding.places[i], noun));
    if (count > kMostPlaces) shown.push_back(fmt::format("{} more", count - kMostPlaces));
    if (!noun.empty()) text += ", ";
    text += join(shown, ", ");
  }
  if (!finding.advice.empty()) text += "; " + finding.advice;
  out += paragraph(text, 4);
  return out;
}

std::string step_text(double seconds) { return std::isfinite(seconds) ? quantity_text(seconds, "s") : ""; }

std::string bound_text(const StepBound& bound) {
  const ExplicitSpring* critical = bound.critical();
  std::string text = step_text(bound.largest);
  if (bound.springs.size() > 1) {
    text += fmt::format(" for all {} together, {} the stiffest", bound.springs.size(), critical->element);
  } else {
    text += fmt::format(" ({})", critical->element);
  }
  if (bound.frequency > 0) text += fmt::format("; fastest mode {}", quantity_text(bound.frequency / 1000, "kHz"));
  return text;
}

// The springs and dampers that stand the least, each alone.
std::string springs_text(const StepBound& bound, const FileFacts& facts) {
  std::string out;
  std::vector<std::vector<std::string>> rows;
  for (size_t i = 0; i < std::min(bound.springs.size(), kMostSprings); ++i) {
    const ExplicitSpring& spring = bound.springs[i];
    const int line = facts.line_of(spring.element);
    const std::string file = facts.file_of(spring.element);
    rows.push_back({spring.element, line > 0 ? file + (file.empty() ? "" : ":") + std::to_string(line) : "",
                    fmt::format("{:.3g}", spring.inertia), step_text(spring.damper_step()),
                    step_text(spring.spring_step()), step_text(spring.held_damper_step())});
  }
  std::vector<std::string> headings = {"each alone", "line", "I", "2I/B", "2/omega", "2I/B held"};
  for (size_t column = headings.size(); column-- > 1;) {
    if (std::ranges::any_of(rows, [&](const auto& row) { return !row[column].empty(); })) continue;
    const auto at = static_cast<std::ptrdiff_t>(column);
    headings.erase(headings.begin() + at);
    for (auto& row : rows) row.erase(row.begin() + at);
  }
  std::vector<size_t> right(headings.size() - 1);
  std::iota(right.begin(), right.end(), 1);
  out += "\n" + table(headings, rows, right);
  if (bound.springs.size() > kMostSprings) {
    out += paragraph(fmt::format("and {} that stand larger timesteps", bound.springs.size() - kMostSprings));
  }
  return out;
}

bool was_printed(const std::string& note, const std::vector<Problem>& left_out) {
  return std::ranges::any_of(left_out, [&](const Problem& problem) { return problem_text(problem) == note; });
}

}  // namespace

Json line_json(int line) { return line > 0 ? Json(line) : Json(nullptr); }

Json findings_json(const std::vector<Finding>& findings) {
  Json listed = Json::array();
  for (const Finding& finding : findings) {
    Json places = Json::array();
    for (const Place& place : finding.places) {
      if (places.size() == kMostInJson) break;
      places.push_back({{"element", place.element},
                        {"line", line_json(place.line)},
                        {"file", file_json(place.file)},
                        {"value", finding.unit.empty() ? Json(nullptr) : number_json(place.value)},
                        {"text", place.text}});
    }
    listed.push_back({{"level", finding.level == Level::kMend ? "mend" : "know"},
                      {"kind", finding.kind},
                      {"title", finding.title},
                      {"unit", finding.unit},
                      {"count", finding.places.size()},
                      {"places", places},
                      {"advice", finding.advice}});
  }
  return listed;
}

Json bounds_json(const StepBounds& bounds, const FileFacts& facts) {
  return {{"pose", "start"},
          {"singular", bounds.singular},
          {"springs", bound_json(bounds.joints, facts)},
          {"with_feedback", bounds.has_feedback ? bound_json(bounds.with_feedback, facts) : Json(nullptr)}};
}

std::string findings_text(const std::vector<Finding>& findings, const std::vector<Problem>& left_out) {
  std::string out;
  if (!left_out.empty()) out += "\n" + heading("left out") + "\n";
  for (const Problem& problem : left_out) out += paragraph("  " + problem_text(problem), 4);
  for (const Level level : {Level::kMend, Level::kKnow}) {
    bool first = true;
    for (const Finding& finding : findings) {
      if (finding.level != level) continue;
      if (first) out += "\n" + heading(level == Level::kMend ? "to mend" : "to know") + "\n";
      first = false;
      out += finding_text(finding);
    }
  }
  return out;
}

std::string bounds_text(const StepBounds& bounds, const FileFacts& facts) {
  std::string out;
  const bool springs = std::isfinite(bounds.joints.largest);
  if (bounds.singular || !std::isfinite(bounds.with_feedback.largest)) return out;
  constexpr double kAlike = 1e-3;
  const bool lower = bounds.has_feedback && bounds.with_feedback.largest < (1 - kAlike) * bounds.joints.largest;
  out += "\n" + heading("largest explicit timestep") + "\n";
  if (springs) out += paragraph("  springs and dampers, at the start pose: " + bound_text(bounds.joints), 4);
  if (lower) {
    out += paragraph("  with the actuators' feedback: " + bound_text(bounds.with_feedback), 4);
  } else if (bounds.has_feedback) {
    out += paragraph("  the actuators' feedback does not lower it", 4);
  }
  const StepBound& least = lower ? bounds.with_feedback : bounds.joints;
  if (least.largest < kOfInterest) out += springs_text(least, facts);
  return out;
}

std::string notes_text(const Model& model, const std::vector<Problem>& left_out) {
  std::string out;
  bool first = true;
  for (const std::string& note : model.notes) {
    if (was_printed(note, left_out)) continue;
    if (first) out += "\n" + heading("notes") + "\n";
    first = false;
    out += paragraph("  " + note, 4);
  }
  return out;
}

}  // namespace assay
