#include "cli/check_findings.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/quantity.h"
#include "base/text.h"

namespace assay::cli {
namespace {

constexpr size_t kMostPlaces = 5;
constexpr size_t kMostSprings = 5;

// ---- JSON -----------------------------------------------------------------------------------------------------------

Json line_json(int line) { return line > 0 ? Json(line) : Json(nullptr); }
Json number_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
Json milliseconds_json(double seconds) { return number_json(1000 * seconds); }

Json bound_json(const StepBound& bound, const FileFacts& facts) {
  Json springs = Json::array();
  for (const ExplicitSpring& spring : bound.springs) {
    springs.push_back({{"element", spring.element},
                       {"line", line_json(facts.line_of(spring.element))},
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
          {"springs", springs}};
}

// ---- for people -----------------------------------------------------------------------------------------------------

std::string place_text(const Place& place) {
  std::string text = place.element;
  if (place.line > 0) text += fmt::format(" (line {})", place.line);
  if (!place.text.empty()) text += " " + place.text;
  return text;
}

// "5 joints", "all 22 joints": the noun of elements that are all of one sort.
std::string count_text(const Finding& finding) {
  const std::string& first = finding.places.front().element;
  std::string noun = first.substr(0, first.find(" '"));
  const bool same =
      std::ranges::all_of(finding.places, [&](const Place& place) { return place.element.starts_with(noun + " '"); });
  if (!same) noun = "element";
  if (noun == "geoms") noun = "pair";
  return fmt::format("{}{} {}", finding.all ? "all " : "", finding.places.size(),
                     noun == "body"   ? "bodies"
                     : noun == "mesh" ? "meshes"
                                      : noun + "s");
}

void print_finding(const Finding& finding) {
  std::string text = fmt::format("  {}: ", finding.title);
  const size_t count = finding.places.size();
  const bool plain = std::ranges::all_of(finding.places, [](const Place& place) { return place.text.empty(); });
  if (finding.all && plain && count > 1) {
    text += count_text(finding);
  } else {
    std::vector<std::string> shown;
    for (size_t i = 0; i < std::min(count, kMostPlaces); ++i) shown.push_back(place_text(finding.places[i]));
    if (count > kMostPlaces) text += count_text(finding) + ": ";
    text += join(shown, ", ");
    if (count > kMostPlaces) text += fmt::format(" and {} more", count - kMostPlaces);
  }
  if (!finding.advice.empty()) text += "; " + finding.advice;
  print(paragraph(text, 4));
}

std::string step_text(double seconds) { return std::isfinite(seconds) ? quantity_text(seconds, "s") : ""; }

void print_bound(const std::string& what, const StepBound& bound, const FileFacts& facts) {
  const ExplicitSpring* critical = bound.critical();
  if (critical == nullptr) return;
  std::string text = fmt::format("  {}: {}", what, step_text(bound.largest));
  if (bound.springs.size() > 1) text += fmt::format(" for all {} together", bound.springs.size());
  text += fmt::format("; {} is the stiffest", critical->element);
  if (bound.frequency > 0)
    text += fmt::format("; fastest oscillation {}", quantity_text(bound.frequency / 1000, "kHz"));
  print(paragraph(text, 4));
  std::vector<std::vector<std::string>> rows;
  for (size_t i = 0; i < std::min(bound.springs.size(), kMostSprings); ++i) {
    const ExplicitSpring& spring = bound.springs[i];
    const int line = facts.line_of(spring.element);
    rows.push_back({"    " + spring.element, line > 0 ? std::to_string(line) : "",
                    fmt::format("{:.3g}", spring.inertia), step_text(spring.damper_step()),
                    step_text(spring.spring_step()), step_text(spring.held_damper_step())});
  }
  print(table({"    alone", "line", "I", "2 I/B", "2/omega", "2 I/B, others held"}, rows, {1, 2, 3, 4, 5}));
  if (bound.springs.size() > kMostSprings) {
    print(fmt::format("    and {} more that stand larger timesteps\n", bound.springs.size() - kMostSprings));
  }
}

bool was_printed(const std::string& note, const std::vector<Problem>& left_out) {
  return std::ranges::any_of(left_out, [&](const Problem& problem) { return problem_text(problem) == note; });
}

}  // namespace

Json findings_json(const std::vector<Finding>& findings) {
  Json json = Json::array();
  for (const Finding& finding : findings) {
    Json places = Json::array();
    for (const Place& place : finding.places) {
      places.push_back({{"element", place.element},
                        {"line", line_json(place.line)},
                        {"value", finding.unit.empty() ? Json(nullptr) : number_json(place.value)},
                        {"text", place.text}});
    }
    json.push_back({{"level", finding.level == Level::kMend ? "mend" : "know"},
                    {"kind", finding.kind},
                    {"title", finding.title},
                    {"unit", finding.unit},
                    {"places", places},
                    {"advice", finding.advice}});
  }
  return json;
}

Json bounds_json(const StepBounds& bounds, const FileFacts& facts) {
  return {{"pose", "start"},
          {"singular", bounds.singular},
          {"springs", bound_json(bounds.joints, facts)},
          {"with_feedback", bounds.has_feedback ? bound_json(bounds.with_feedback, facts) : Json(nullptr)}};
}

void print_findings(const std::vector<Finding>& findings, const std::vector<Problem>& left_out) {
  if (!left_out.empty()) print("\n" + heading("left out") + "\n");
  for (const Problem& problem : left_out) print(paragraph("  " + problem_text(problem), 4));
  for (const Level level : {Level::kMend, Level::kKnow}) {
    bool first = true;
    for (const Finding& finding : findings) {
      if (finding.level != level) continue;
      if (first) print("\n" + heading(level == Level::kMend ? "to mend" : "to know") + "\n");
      first = false;
      print_finding(finding);
    }
  }
}

void print_bounds(const StepBounds& bounds, const FileFacts& facts) {
  if (bounds.singular || !std::isfinite(bounds.with_feedback.largest)) return;
  print("\n" + heading("largest stable timestep of explicit springs and dampers, at the start pose") + "\n");
  print_bound("springs and dampers", bounds.joints, facts);
  if (!bounds.has_feedback) return;
  constexpr double kAlike = 1e-3;
  if (bounds.with_feedback.largest > (1 - kAlike) * bounds.joints.largest) {
    print("  the actuators' feedback does not lower it\n");
  } else {
    print_bound("with the actuators' feedback", bounds.with_feedback, facts);
  }
}

void print_notes(const Model& model, const std::vector<Problem>& left_out) {
  bool first = true;
  for (const std::string& note : model.notes) {
    if (was_printed(note, left_out)) continue;
    if (first) print("\n" + heading("notes") + "\n");
    first = false;
    print(paragraph("  " + note, 4));
  }
}

}  // namespace assay::cli
