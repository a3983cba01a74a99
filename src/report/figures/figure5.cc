// Processor time of growing heaps of capsules.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/text.h"
#include "report/figures/axes.h"
#include "report/figures/drawing.h"
#include "report/figures/picture.h"
#include "results/line_up.h"

namespace assay::figures {
namespace {

struct Scaling {
  std::map<double, Interval> seconds;  // by number of bodies; of several seeds the median, from the least to the most
  std::optional<Interval> exponent;
};

// Of a contender on a family of sizes, contacts on or off.
Scaling scaling_of(const Results& results, const std::string& contender, bool contacts) {
  Scaling scaling;
  std::map<double, std::vector<Interval>> seeds;
  for (const std::string& system : results.systems()) {
    const std::string family = results.family(system);
    if (family.empty() || (results.fact_flag(system, "contacts") != contacts)) continue;
    for (const auto& [step, cell] : results.cells(system, contender, "scaling")) {
      const auto time = interval_of(*cell, "run_time");
      if (time && cell->outcome == Outcome::kOk) seeds[results.fact(system, "bodies")].push_back(*time);
      if (const auto exponent = interval_of(*cell, "scaling_exponent")) scaling.exponent = exponent;
    }
  }
  for (const auto& [bodies, times] : seeds) {
    std::vector<double> values;
    values.reserve(times.size());
    for (const Interval& time : times) values.push_back(time.value);
    scaling.seconds[bodies] = {median(values), std::ranges::min(times, {}, &Interval::low).low,
                               std::ranges::max(times, {}, &Interval::high).high};
  }
  return scaling;
}

// Empty: none.
std::string measured(const Results& results, const StandIns& solver) {
  for (const std::string& contender : solver.second) {
    for (const bool contacts : {true, false}) {
      if (!scaling_of(results, contender, contacts).seconds.empty()) return contender;
    }
  }
  return "";
}

void scaling_plot(Canvas& canvas, const Results& results, const Box& box, const std::string& contender,
                  const std::string& title) {
  canvas.text(title, {box.left, box.top - 6}, kTitle, Align::kLeft, kInk, true);
  const std::array both = {scaling_of(results, contender, true), scaling_of(results, contender, false)};
  double most_bodies = 0, most_seconds = 0;
  for (const Scaling& scaling : both) {
    for (const auto& [bodies, seconds] : scaling.seconds) {
      most_bodies = std::max(most_bodies, bodies);
      most_seconds = std::max({most_seconds, seconds.value, seconds.high});
    }
  }
  if (!(most_seconds > 0)) {
    empty_plot(canvas, box, "not measured");
    return;
  }
  const double right = 1.04 * most_bodies, top = 1.08 * most_seconds;
  const auto x = [&](double bodies) { return box.left + box.width() * bodies / right; };
  const auto y = [&](double seconds) { return box.bottom - box.height() * seconds / top; };
  for (const double tick : linear_ticks(right, 5)) {
    canvas.line(x(tick), box.bottom, x(tick), box.bottom - 3, kSoft, 0.5);
    canvas.text(fmt::format("{:g}", tick), {x(tick), box.bottom + 8}, kSmall, Align::kMiddle, kInk);
  }
  for (const double tick : linear_ticks(top, 5)) {
    canvas.line(box.left, y(tick), box.right, y(tick), kFaint, 0.5);
    canvas.text(fmt::format("{:g}", tick), {box.left - 3, y(tick) + 2}, kSmall, Align::kRight, kInk);
  }
  const Ink look = ink_of(results, contender);
  double row = box.top + 10;
  for (const bool contacts : {true, false}) {
    const Scaling& scaling = both.at(contacts ? 0 : 1);
    if (scaling.seconds.empty()) continue;
    const std::vector<double> dash = contacts ? std::vector<double>() : std::vector<double>{3, 2};
    std::vector<Canvas::Point> path;
    path.reserve(scaling.seconds.size());
    for (const auto& [bodies, seconds] : scaling.seconds) path.push_back({x(bodies), y(seconds.value)});
    canvas.polyline(path, look.color, 1, dash);
    for (const auto& [bodies, seconds] : scaling.seconds) {
      canvas.line(x(bodies), y(seconds.low), x(bodies), y(seconds.high), look.color, 0.5);
      canvas.mark(look.mark, {x(bodies), y(seconds.value)}, 3.4, look.color, contacts);
    }
    canvas.line(box.left + 6, row - 2.2, box.left + 24, row - 2.2, look.color, 1, dash);
    canvas.mark(look.mark, {box.left + 15, row - 2.2}, 3.4, look.color, contacts);
    std::string text = contacts ? "contacts" : "no contacts";
    if (scaling.exponent) text += ", grows as N";
    canvas.text(text, {box.left + 28, row}, kSmall, Align::kLeft, kInk);
    if (const auto& power = scaling.exponent) {
      const double end = box.left + 28.5 + canvas.text_width(text, kSmall);
      const std::string exponent = fmt::format("{:.2f}", power->value);
      canvas.text(exponent, {end, row - 2.2}, 0.8 * kSmall, Align::kLeft, kInk);
      canvas.text(fmt::format("({:.2f} to {:.2f})", power->low, power->high),
                  {end + canvas.text_width(exponent, 0.8 * kSmall) + 3, row}, kSmall, Align::kLeft, kSoft);
    }
    row += 10;
  }
  canvas.outline_rectangle(box.left, box.top, box.width(), box.height(), kSoft, 0.5);
  canvas.text("number of capsules N", {box.right, box.bottom + 18}, kSmall, Align::kRight, kSoft);
  canvas.text("processor time (s)", {box.left - 26, (box.top + box.bottom) / 2}, kSmall, Align::kMiddle, kSoft, false,
              90);
}

// Where a run of `system` starts, and where it ends if that is kept.
void configurations(Canvas& canvas, const Results& results, const std::string& system, double height) {
  const Scene& scene = *results.scene(system);
  const auto end = results.end_of(system);
  const bool both = end && end->state.bodies.size() == scene.bodies.size();
  const auto title = [&](double left, const std::string& text, const std::string& more) {
    canvas.text(text, {left, 14}, kTitle, Align::kLeft, kInk, true);
    canvas.text(more, {left + 4 + canvas.text_width(text, kTitle, true), 14}, kSmall, Align::kLeft, kSoft);
  };
  title(30, fmt::format("{}: at the start", system), "");
  picture(canvas, {30, 22, both ? 240.0 : canvas.width() - 30, height - 4}, scene, start_of(scene), 70);
  if (!both) return;
  std::vector<Pose> poses;
  poses.reserve(scene.bodies.size());
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    poses.push_back(scene_pose(scene.bodies[i], end->state.bodies[i]));
  }
  // Nothing brakes rolling: some are far away when the rest has come to lie.
  constexpr double kShare = 0.9;
  const size_t outside = picture(canvas, {276, 22, 506, height - 4}, scene, poses, 70, kShare);
  std::string more = fmt::format("after {:g} s of {}", end->state.time, end->contender);
  if (outside > 0) more += fmt::format("; {} lie outside", outside);
  title(276, "at the end", more);
}

}  // namespace

std::optional<Drawing> figure5(const Results& results) {
  const bool any = std::ranges::any_of(paper_figures().solvers,
                                       [&](const StandIns& each) { return !measured(results, each).empty(); });
  if (!any) return std::nullopt;
  // The largest system that can be drawn.
  std::string largest;
  for (const std::string& system : results.systems()) {
    if (results.family(system).empty() || results.scene(system) == nullptr || !results.fact_flag(system, "contacts"))
      continue;
    if (largest.empty() || results.fact(system, "bodies") > results.fact(largest, "bodies")) largest = system;
  }
  const double pictures = largest.empty() ? 0 : 170;
  return Drawing{pictures + 210, [&results, largest, pictures](Canvas& canvas) {
                   if (!largest.empty()) configurations(canvas, results, largest, pictures);
                   double left = 46;
                   for (const StandIns& solver : paper_figures().solvers) {
                     scaling_plot(canvas, results, {left, pictures + 22, left + 200, canvas.height() - 26},
                                  measured(results, solver), solver.first);
                     left += 262;
                   }
                 }};
}

}  // namespace assay::figures
