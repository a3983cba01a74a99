#include "report/figures/speed_accuracy.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "report/figures/drawing.h"

namespace assay::figures {
namespace {

struct Curve {
  std::string contender;
  std::vector<Canvas::Point> points;  // realtime factor, error
  std::vector<bool> bounds;           // whether the error is an upper bound, of each point
  std::optional<double> fails_at;     // realtime factor of the first timestep above them that gave nothing
};

std::vector<Curve> curves_of(const Results& results, const std::string& system, const std::string& measure,
                             const std::string& name) {
  const bool timed = results.timed(system);
  std::vector<Curve> curves;
  for (const std::string& contender : results.papers()) {
    Curve curve{contender, {}, {}, {}};
    for (const auto& [step, cell] : results.cells(system, contender, measure)) {
      std::optional<double> speed = step;
      if (timed) {
        const auto found = results.speed(system, contender, step);
        speed = found ? std::optional(found->factor.value) : std::nullopt;
      }
      // At the reference's own timestep the error says nothing of integration.
      if (is_reference(*cell) || cell->outcome == Outcome::kUnsupported) continue;
      const auto error = interval_of(*cell, name);
      if (speed && error && std::abs(error->value) > 0 && cell->outcome == Outcome::kOk) {
        curve.points.push_back({*speed, std::abs(error->value)});
        curve.bounds.push_back(bound_of(*cell, name).has_value());
        curve.fails_at.reset();
      } else if (cell->outcome != Outcome::kOk && !curve.fails_at) {
        // Straight above the last point where a run that failed could not be timed.
        if (!speed && !curve.points.empty()) speed = curve.points.back().x;
        curve.fails_at = speed;
      }
    }
    if (!curve.points.empty() || curve.fails_at) curves.push_back(std::move(curve));
  }
  return curves;
}

void draw_curve(Canvas& canvas, const Box& box, const LogAxis& x, const LogAxis& y, const Curve& curve,
                const Ink& look) {
  std::vector<Canvas::Point> path;
  path.reserve(curve.points.size());
  for (const auto& [speed, error] : curve.points) path.push_back({x.at(speed), y.at(error)});
  canvas.polyline(path, look.color, 0.9, look.dash);
  if (curve.fails_at) {
    const Canvas::Point end{x.at(*curve.fails_at), box.top + 4};
    if (!path.empty()) canvas.line(path.back().x, path.back().y, end.x, end.y, look.color, 0.5, {1, 1.5});
    canvas.cross(end, 4.5, look.color);
  }
  for (size_t i = 0; i < path.size(); ++i) {
    const Canvas::Point& point = path[i];
    canvas.mark(look.mark, point, 3.4, look.color);
    if (!curve.bounds[i]) continue;
    canvas.line(point.x, point.y + 2, point.x, point.y + 6, look.color, 0.6);
    canvas.line(point.x - 1.5, point.y + 4.3, point.x, point.y + 6, look.color, 0.6);
    canvas.line(point.x + 1.5, point.y + 4.3, point.x, point.y + 6, look.color, 0.6);
  }
}

// Draws or only measures; returns the height.
double legend_rows(Canvas& canvas, const Results& results, const std::vector<std::string>& contenders, double top,
                   bool draw) {
  constexpr double kLine = 20, kGap = 14, kRow = 11;
  double x = 30, y = top + 8;
  bool failures = false;
  const auto room = [&](double width) {
    if (x + width > canvas.width() - 10 && x > 30) {
      x = 30;
      y += kRow;
    }
  };
  for (const std::string& contender : contenders) {
    const double width = kLine + 4 + canvas.text_width(contender, kText) + kGap;
    room(width);
    if (draw) {
      const Ink look = ink_of(results, contender);
      canvas.line(x, y - 2.4, x + kLine, y - 2.4, look.color, 0.9, look.dash);
      canvas.mark(look.mark, {x + kLine / 2, y - 2.4}, 3.6, look.color);
      canvas.text(contender, {x + kLine + 4, y}, kText, Align::kLeft, kInk);
    }
    x += width;
    failures = true;
  }
  if (failures) {
    const std::string text = "from here on unstable or failed";
    room(14 + canvas.text_width(text, kText));
    if (draw) {
      canvas.cross({x + 4, y - 2.4}, 4.5, kInk);
      canvas.text(text, {x + 12, y}, kText, Align::kLeft, kInk);
    }
  }
  return y + 6 - top;
}

}  // namespace

Ink ink_of(const Results& results, const std::string& contender) {
  const Look& look = results.look(contender);
  Ink ink{parse_color(look.light), look.mark, look.dash};
  for (double& part : ink.dash) part *= 0.5;  // a figure is half as large as a page's plot
  return ink;
}

void speed_accuracy(Canvas& canvas, const Results& results, const Box& box, const std::string& system,
                    const std::string& measure, const std::string& name, const std::string& title) {
  const std::vector<Curve> curves = curves_of(results, system, measure, name);
  std::vector<double> speeds, errors;
  for (const Curve& curve : curves) {
    for (const auto& [speed, error] : curve.points) {
      speeds.push_back(speed);
      errors.push_back(error);
    }
    if (const auto fails_at = curve.fails_at) speeds.push_back(*fails_at);
  }
  if (errors.empty()) {
    empty_plot(canvas, box, "not measured");
    return;
  }
  const LogAxis x(speeds, box.left, box.right), y(errors, box.bottom, box.top);
  for (const int exponent : x.decades()) {
    const double at = x.at(std::pow(10, exponent));
    canvas.line(at, box.top, at, box.bottom, kFaint, 0.5);
  }
  for (const int exponent : y.decades()) {
    const double at = y.at(std::pow(10, exponent));
    canvas.line(box.left, at, box.right, at, kFaint, 0.5);
  }
  for (const int exponent : x.labels(26)) {
    const double at = x.at(std::pow(10, exponent));
    canvas.line(at, box.bottom, at, box.bottom - 3, kSoft, 0.5);
    canvas.text(power_of_ten(exponent), {at, box.bottom + 8}, kSmall, Align::kMiddle, kInk);
  }
  for (const int exponent : y.labels(10)) {
    const double at = y.at(std::pow(10, exponent));
    canvas.line(box.left, at, box.left + 3, at, kSoft, 0.5);
    canvas.text(power_of_ten(exponent), {box.left - 3, at + 2}, kSmall, Align::kRight, kInk);
  }
  canvas.clip(box.left - 2, box.top - 2, box.width() + 4, box.height() + 4);
  for (const Curve& curve : curves) draw_curve(canvas, box, x, y, curve, ink_of(results, curve.contender));
  canvas.unclip();
  canvas.outline_rectangle(box.left, box.top, box.width(), box.height(), kSoft, 0.5);
  canvas.text(results.timed(system) ? "realtime factor" : "timestep (ms); the speed was not timed",
              {box.right, box.bottom + 17}, kSmall, Align::kRight, kSoft);
  canvas.text(title, {box.left - 27, (box.top + box.bottom) / 2}, kSmall, Align::kMiddle, kSoft, false, 90);
}

// Room that text of this size takes does not depend on the format.
double legend_height(const Results& results) {
  Canvas trial(Format::kSvg, kWidth, 100);
  return legend_rows(trial, results, results.papers(), 0, false);
}

void draw_legend(Canvas& canvas, const Results& results) {
  legend_rows(canvas, results, results.papers(), canvas.height() - legend_height(results) - 2, true);
}

}  // namespace assay::figures
