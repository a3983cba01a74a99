#include "report/figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/text.h"
#include "measures/pareto.h"
#include "report/canvas.h"
#include "report/look.h"
#include "report/write_file.h"
#include "store/scene.h"
#include "store/store.h"
#include "store/trajectory.h"

namespace assay {
namespace {

constexpr Color kInk{0.11, 0.13, 0.15};
constexpr Color kSoft{0.38, 0.41, 0.45};
constexpr Color kRule{0.82, 0.82, 0.80};
constexpr Color kFaint{0.93, 0.93, 0.91};
constexpr double kText = 7;     // pt
constexpr double kSmall = 6;    // pt
constexpr double kTitle = 8;    // pt
constexpr double kWidth = 516;  // pt: two columns of a journal, 182 mm

// The paper's contenders by today's names; of those in braces the first that was measured.
const std::vector<std::vector<std::string>>& line_up() {
  static const std::vector<std::vector<std::string>> kLineUp = {{"bullet-si-f64", "bullet-si-f32"},
                                                                {"bullet-mb"},
                                                                {"havok"},
                                                                {"mujoco-euler"},
                                                                {"mujoco-rk4"},
                                                                {"ode-quick"},
                                                                {"physx-d6-pgs"}};
  return kLineUp;
}

// ---- what was measured ------------------------------------------------------------------------------------------------

struct Figure {
  double value = 0, low = 0, high = 0;
};

class Results {
 public:
  explicit Results(const Store& store) : store_(&store), looks_(looks_of(store.contenders())) {
    for (const SystemRow& row : store.systems()) {
      const auto parsed = nlohmann::json::parse(row.json, nullptr, false);
      facts_[row.name] = parsed.is_object() ? parsed : nlohmann::json::object();
      systems_.push_back(row.name);
    }
    for (const SceneRow& row : store.scenes()) scenes_.emplace(row.system, parse_scene(row.json));
    for (Cell& cell : store.cells()) {
      measured_.insert(cell.contender);
      cells_[{cell.system, cell.contender, cell.measure}].emplace(cell.timestep_ms, std::move(cell));
    }
    for (const auto& names : line_up()) {
      const auto found = std::ranges::find_if(names, [&](const std::string& name) { return measured_.contains(name); });
      if (found != names.end()) contenders_.push_back(*found);
    }
  }

  const std::vector<std::string>& contenders() const { return contenders_; }
  const std::vector<std::string>& systems() const { return systems_; }
  const Look& look(const std::string& contender) const {
    static const Look kPlain;
    const auto found = looks_.find(contender);
    return found == looks_.end() ? kPlain : found->second;
  }
  double fact(const std::string& system, const char* name) const {
    const auto found = facts_.find(system);
    return found == facts_.end() || !found->second.contains(name) || !found->second[name].is_number()
               ? 0
               : found->second[name].get<double>();
  }
  bool fact_flag(const std::string& system, const char* name) const {
    const auto found = facts_.find(system);
    return found != facts_.end() && found->second.value(name, false);
  }
  std::string family(const std::string& system) const {
    const auto found = facts_.find(system);
    return found == facts_.end() ? "" : found->second.value("family", "");
  }

  // By timestep; empty when nothing was tried.
  const std::map<double, Cell>& cells(const std::string& system, const std::string& contender,
                                      const std::string& measure) const {
    static const std::map<double, Cell> kNone;
    const auto found = cells_.find({system, contender, measure});
    return found == cells_.end() ? kNone : found->second;
  }

  static std::optional<Figure> value(const Cell& cell, const std::string& name) {
    const Value* found = find_value(cell, name);
    if (found == nullptr) return std::nullopt;
    const double middle = found->value.value_or(0);
    return Figure{middle, found->low.value_or(middle), found->high.value_or(middle)};
  }

  std::optional<double> speed(const std::string& system, const std::string& contender, double timestep_ms) const {
    SpeedCurve speeds;
    for (const auto& [step, cell] : cells(system, contender, "raw_speed")) {
      const auto factor = value(cell, "realtime_factor");
      if (factor && factor->value > 0) speeds[step] = {factor->value, factor->low, factor->high};
    }
    const auto speed = speed_at(speeds, timestep_ms);
    return speed ? std::optional(speed->value) : std::nullopt;
  }

  bool timed(const std::string& system) const {
    return std::ranges::any_of(contenders_,
                               [&](const std::string& contender) { return speed(system, contender, 1).has_value(); });
  }

  const Scene* scene(const std::string& system) const {
    const auto found = scenes_.find(system);
    return found == scenes_.end() ? nullptr : &found->second;
  }

  struct End {
    std::string contender;
    State state;
  };

  // The last state of the first run of the system that is kept.
  std::optional<End> end_of(const std::string& system) const {
    for (const RunRow& run : store_->runs()) {
      if (run.system != system) continue;
      const auto trajectory = read_trajectory(store_->trajectories_dir(), run.address);
      if (trajectory && !trajectory->states.empty()) return End{run.contender, trajectory->states.back()};
    }
    return std::nullopt;
  }

 private:
  const Store* store_;
  std::map<std::string, Look> looks_;
  std::map<std::string, nlohmann::json> facts_;
  std::map<std::string, Scene> scenes_;
  std::vector<std::string> systems_, contenders_;
  std::set<std::string> measured_;
  std::map<std::tuple<std::string, std::string, std::string>, std::map<double, Cell>> cells_;
};

// ---- axes ---------------------------------------------------------------------------------------------------------------

struct Box {
  double left = 0, top = 0, right = 0, bottom = 0;
  double width() const { return right - left; }
  double height() const { return bottom - top; }
};

std::string superscript(int number) {
  static const std::array<const char*, 10> kDigits = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = number < 0 ? "⁻" : "";
  for (const char digit : std::to_string(std::abs(number))) text += kDigits.at(static_cast<size_t>(digit - '0'));
  return text;
}

std::string power_of_ten(int exponent) {
  if (exponent >= -2 && exponent <= 3) return fmt::format("{:g}", std::pow(10, exponent));
  return "10" + superscript(exponent);
}

class LogAxis {
 public:
  LogAxis(const std::vector<double>& values, double from, double to) : from_(from), to_(to) {
    const auto [least, most] = std::ranges::minmax(values);
    const double low = std::log10(least), high = std::log10(most);
    const double margin = std::max({0.07 * (high - low), (1 - (high - low)) / 2, 0.12});
    low_ = low - margin;
    high_ = high + margin;
  }
  double at(double value) const { return from_ + (std::log10(value) - low_) / (high_ - low_) * (to_ - from_); }

  // Exponents to label, at least `spacing` apart.
  std::vector<int> labels(double spacing) const {
    const double decade = std::abs(to_ - from_) / (high_ - low_);
    int stride = 1;
    while (stride * decade < spacing) ++stride;
    std::vector<int> found;
    for (const int exponent : decades()) {
      if (exponent % stride == 0) found.push_back(exponent);
    }
    return found;
  }
  std::vector<int> decades() const {
    std::vector<int> found;
    for (int e = static_cast<int>(std::ceil(low_)); e <= static_cast<int>(std::floor(high_)); ++e) found.push_back(e);
    return found;
  }

 private:
  double from_, to_;
  double low_ = 0, high_ = 1;
};

// 0 and steps of 1, 2 or 5 times a power of ten, about `count` of them.
std::vector<double> linear_ticks(double most, int count) {
  const double raw = most / count, power = std::pow(10, std::floor(std::log10(raw)));
  double step = 10 * power;
  for (const double digit : {5, 2, 1}) {
    if (digit * power >= raw) step = digit * power;
  }
  std::vector<double> ticks;
  for (int i = 0; i * step <= most * (1 + 1e-9); ++i) ticks.push_back(i * step);
  return ticks;
}

void empty_plot(Canvas& canvas, const Box& box, const std::string& why) {
  canvas.outline_rectangle(box.left, box.top, box.width(), box.height(), kRule, 0.5);
  canvas.text(why, {(box.left + box.right) / 2, (box.top + box.bottom) / 2}, kText, Align::kMiddle, kSoft);
}

// ---- speed against an error ---------------------------------------------------------------------------------------------

struct Curve {
  std::string contender;
  std::vector<Canvas::Point> points;  // realtime factor, error
  std::optional<double> fails_at;     // realtime factor of the first timestep above them that gave nothing
};

// On a system that was not timed the timesteps stand for the realtime factors.

std::vector<Curve> curves_of(const Results& results, const std::string& system, const std::string& measure,
                             const std::string& name) {
  const bool timed = results.timed(system);
  std::vector<Curve> curves;
  for (const std::string& contender : results.contenders()) {
    Curve curve{contender, {}, {}};
    for (const auto& [step, cell] : results.cells(system, contender, measure)) {
      const auto speed = timed ? results.speed(system, contender, step) : std::optional(step);
      // At the reference's own timestep the error says nothing of integration.
      if (!speed || Results::value(cell, "restart_floor") || cell.outcome == Outcome::kUnsupported) continue;
      const auto error = Results::value(cell, name);
      if (error && std::abs(error->value) > 0 && cell.outcome == Outcome::kOk) {
        curve.points.push_back({*speed, std::abs(error->value)});
        curve.fails_at.reset();
      } else if (cell.outcome != Outcome::kOk && !curve.fails_at) {
        curve.fails_at = speed;
      }
    }
    if (!curve.points.empty() || curve.fails_at) curves.push_back(std::move(curve));
  }
  return curves;
}

void draw_curve(Canvas& canvas, const Box& box, const LogAxis& x, const LogAxis& y, const Curve& curve,
                const Look& look) {
  std::vector<Canvas::Point> path;
  path.reserve(curve.points.size());
  for (const auto& [speed, error] : curve.points) path.push_back({x.at(speed), y.at(error)});
  canvas.polyline(path, look.color, 0.9, look.dash);
  if (curve.fails_at) {
    const Canvas::Point end{x.at(*curve.fails_at), box.top + 4};
    if (!path.empty()) canvas.line(path.back().x, path.back().y, end.x, end.y, look.color, 0.5, {1, 1.5});
    canvas.cross(end, 4.5, look.color);
  }
  for (const Canvas::Point& point : path) canvas.mark(look.mark, point, 3.4, look.color);
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
  for (const Curve& curve : curves) draw_curve(canvas, box, x, y, curve, results.look(curve.contender));
  canvas.unclip();
  canvas.outline_rectangle(box.left, box.top, box.width(), box.height(), kSoft, 0.5);
  canvas.text(results.timed(system) ? "realtime factor" : "timestep (ms), for it was not timed",
              {box.right, box.bottom + 17}, kSmall, Align::kRight, kSoft);
  canvas.text(title, {box.left - 27, (box.top + box.bottom) / 2}, kSmall, Align::kMiddle, kSoft, false, 90);
}

// Every contender with its line and mark, in as many rows as it takes.
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
      const Look& look = results.look(contender);
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

// ---- pictures -----------------------------------------------------------------------------------------------------------

// Parallel projection, the far shapes first; the camera looks down by 15 degrees. Of all shapes the `share` that is
// nearest to their middle fills the box. Returns how many lie outside it.
size_t picture(Canvas& canvas, const Box& box, const Scene& scene, const std::vector<Pose>& poses,
               double azimuth_degrees, double share = 1) {
  constexpr double kDegree = 0.017453292519943295;
  const double azimuth = azimuth_degrees * kDegree, elevation = -15 * kDegree;
  const double ca = std::cos(azimuth), sa = std::sin(azimuth), ce = std::cos(elevation), se = std::sin(elevation);
  const Vec3 right(sa, -ca, 0), up(-ca * se, -sa * se, ce), back(-ca * ce, -sa * ce, -se);
  struct Stroke {
    double depth;
    Canvas::Point a, b;
    double radius;
    Color color;
  };
  std::vector<Stroke> strokes;
  for (const SceneShape& shape : scene.shapes) {
    if (shape.type == ShapeType::kPlane) continue;
    const Pose pose = (shape.body == kWorld ? Pose() : poses[static_cast<size_t>(shape.body)]) * shape.X_BS;
    const double half = shape.type == ShapeType::kCapsule ? shape.half_length : 0;
    const Vec3 a = pose * Vec3(0, 0, -half), b = pose * Vec3(0, 0, half);
    strokes.push_back({back.dot(a + b),
                       {right.dot(a), -up.dot(a)},
                       {right.dot(b), -up.dot(b)},
                       shape.radius,
                       {shape.rgba[0], shape.rgba[1], shape.rgba[2]}});
  }
  if (strokes.empty()) return 0;
  const auto middle_of = [&](double Canvas::Point::* axis) {
    std::vector<double> sums;
    sums.reserve(strokes.size());
    for (const Stroke& stroke : strokes) sums.push_back(stroke.a.*axis + stroke.b.*axis);
    std::ranges::nth_element(sums, sums.begin() + std::ssize(sums) / 2);
    return sums[sums.size() / 2] / 2;
  };
  const Canvas::Point middle{middle_of(&Canvas::Point::x), middle_of(&Canvas::Point::y)};
  std::ranges::stable_sort(strokes, {}, [&](const Stroke& stroke) {
    return std::hypot((stroke.a.x + stroke.b.x) / 2 - middle.x, (stroke.a.y + stroke.b.y) / 2 - middle.y);
  });
  const auto shown = static_cast<size_t>(std::ceil(share * static_cast<double>(strokes.size())));
  double x1 = std::numeric_limits<double>::infinity(), x2 = -x1, y1 = x1, y2 = -x1;
  for (size_t i = 0; i < shown; ++i) {
    const Stroke& stroke = strokes[i];
    for (const Canvas::Point& end : {stroke.a, stroke.b}) {
      x1 = std::min(x1, end.x - stroke.radius);
      x2 = std::max(x2, end.x + stroke.radius);
      y1 = std::min(y1, end.y - stroke.radius);
      y2 = std::max(y2, end.y + stroke.radius);
    }
  }
  std::ranges::stable_sort(strokes, {}, &Stroke::depth);
  const double scale = std::min(box.width() / (x2 - x1), box.height() / (y2 - y1));
  const auto place = [&](const Canvas::Point& p) {
    return Canvas::Point{(box.left + box.right) / 2 + scale * (p.x - (x1 + x2) / 2),
                         (box.top + box.bottom) / 2 + scale * (p.y - (y1 + y2) / 2)};
  };
  size_t outside = 0;
  canvas.clip(box.left - 1, box.top - 1, box.width() + 2, box.height() + 2);
  for (const Stroke& stroke : strokes) {
    const double thickness = 2 * scale * stroke.radius;
    const Canvas::Point a = place(stroke.a), b = place(stroke.b);
    const double x = (a.x + b.x) / 2, y = (a.y + b.y) / 2;
    if (x < box.left || x > box.right || y < box.top || y > box.bottom) ++outside;
    canvas.stroke(a, b, mix(stroke.color, kInk, 0.55), thickness);
    canvas.stroke(a, b, stroke.color, std::max(0.7 * thickness, thickness - 1));
  }
  canvas.unclip();
  return outside;
}

std::vector<Pose> start_of(const Scene& scene) {
  std::vector<Pose> poses;
  poses.reserve(scene.bodies.size());
  for (const SceneBody& body : scene.bodies) poses.push_back(body.X_WB);
  return poses;
}

// From where a system shows best.
double azimuth_of(const std::string& system) {
  if (system.starts_with("grasp")) return 60;
  if (system.starts_with("humanoid") || system.starts_with("astronaut")) return 150;
  return 70;
}

void start_picture(Canvas& canvas, const Results& results, const Box& box, const std::string& system) {
  if (const Scene* scene = results.scene(system)) picture(canvas, box, *scene, start_of(*scene), azimuth_of(system));
}

// ---- figure 3 -----------------------------------------------------------------------------------------------------------

std::string speed_text(double kilohertz) {
  return kilohertz >= 100 ? fmt::format("{:.0f}", kilohertz) : fmt::format("{:.3g}", kilohertz);
}

void speed_bars(Canvas& canvas, const Results& results, const Box& box, const std::string& system) {
  struct Bar {
    std::string contender;
    Figure speed;
  };
  // Of the timesteps the one nearest to 1 ms at which the most contenders were timed.
  std::map<double, std::vector<Bar>> by_step;
  for (const std::string& contender : results.contenders()) {
    for (const auto& [step, cell] : results.cells(system, contender, "raw_speed")) {
      if (const auto speed = Results::value(cell, "raw_speed")) by_step[step].push_back({contender, *speed});
    }
  }
  if (by_step.empty()) {
    empty_plot(canvas, box, "not timed");
    return;
  }
  const auto best = std::ranges::max_element(
      by_step, {}, [](const auto& entry) { return std::pair(entry.second.size(), -std::abs(std::log(entry.first))); });
  std::vector<Bar> bars = best->second;
  std::ranges::stable_sort(bars, std::ranges::greater(), [](const Bar& bar) { return bar.speed.value; });
  double names = 0, most = 0;
  for (const Bar& bar : bars) {
    names = std::max(names, canvas.text_width(bar.contender, kSmall));
    most = std::max({most, bar.speed.value, bar.speed.high});
  }
  const double from = box.left + names + 4, to = box.right - 24,
               row = std::min(14.0, box.height() / static_cast<double>(bars.size()));
  const double top = box.bottom - row * static_cast<double>(bars.size());
  for (const double tick : linear_ticks(most, 4)) {
    const double at = from + (to - from) * tick / most;
    canvas.line(at, top, at, box.bottom, kFaint, 0.5);
    canvas.text(fmt::format("{:g}", tick), {at, box.bottom + 8}, kSmall, Align::kMiddle, kInk);
  }
  for (size_t i = 0; i < bars.size(); ++i) {
    const Bar& bar = bars[i];
    const double y = top + row * static_cast<double>(i), middle = y + row / 2;
    const auto along = [&](double value) { return from + (to - from) * value / most; };
    canvas.fill_rectangle(from, y + 0.18 * row, along(bar.speed.value) - from, 0.64 * row,
                          results.look(bar.contender).color);
    if (bar.speed.low < bar.speed.high) {
      canvas.line(along(bar.speed.low), middle, along(bar.speed.high), middle, kInk, 0.5);
      for (const double end : {bar.speed.low, bar.speed.high}) {
        canvas.line(along(end), middle - 1.5, along(end), middle + 1.5, kInk, 0.5);
      }
    }
    canvas.text(bar.contender, {from - 3, middle + 2}, kSmall, Align::kRight, kInk);
    canvas.text(speed_text(bar.speed.value), {along(std::max(bar.speed.value, bar.speed.high)) + 3, middle + 2}, kSmall,
                Align::kLeft, kSoft);
  }
  canvas.line(from, top, from, box.bottom, kSoft, 0.5);
  canvas.text(fmt::format("raw speed at {} ms (kHz)", timestep_label(best->first)), {to, box.bottom + 17}, kSmall,
              Align::kRight, kSoft);
}

constexpr std::array kFigure3 = {std::pair{"grasp", "Grasp"}, std::pair{"humanoid", "Humanoid"},
                                 std::pair{"planar-chain", "Planar chain"}, std::pair{"capsules-27", "27 capsules"}};

struct Drawing {
  double height = 0;
  std::function<void(Canvas&)> draw;
};

// Room that text of this size takes does not depend on the format.
double legend_height(const Results& results) {
  Canvas trial(Format::kSvg, kWidth, 100);
  return legend_rows(trial, results, results.contenders(), 0, false);
}

std::optional<Drawing> figure3(const Results& results) {
  const bool any = std::ranges::any_of(kFigure3, [&](const auto& row) {
    return std::ranges::any_of(results.contenders(), [&](const std::string& contender) {
      return !results.cells(row.first, contender, "raw_speed").empty() ||
             !results.cells(row.first, contender, "consistency").empty();
    });
  });
  if (!any) return std::nullopt;
  constexpr double kRow = 138;
  const double legend = legend_height(results);
  return Drawing{4 * kRow + legend + 6, [&results, legend](Canvas& canvas) {
                   double top = 6;
                   for (const auto& [system, title] : kFigure3) {
                     canvas.text(title, {6, top + 8}, kTitle, Align::kLeft, kInk, true);
                     const double dof = results.fact(system, "dof");
                     if (dof > 0) canvas.text(fmt::format("{:g} DOF", dof), {6, top + 17}, kSmall, Align::kLeft, kSoft);
                     start_picture(canvas, results, {8, top + 22, 104, top + kRow - 16}, system);
                     speed_bars(canvas, results, {112, top + 6, 290, top + kRow - 26}, system);
                     speed_accuracy(canvas, results, {336, top + 4, 502, top + kRow - 26}, system, "consistency",
                                    "consistency", "consistency error (m)");
                     top += kRow;
                   }
                   legend_rows(canvas, results, results.contenders(), canvas.height() - legend - 2, true);
                 }};
}

// ---- figure 4 -----------------------------------------------------------------------------------------------------------

struct DriftPlot {
  std::vector<const char*> systems;  // the first that has it
  const char *value, *system_title, *title, *axis;
};

const std::vector<DriftPlot>& drift_plots() {
  static const std::vector<DriftPlot> kPlots = {
      {{"astronaut-energy", "astronaut"}, "energy_drift", "Astronaut", "energy", "energy drift (J)"},
      {{"astronaut"}, "angular_momentum_drift", "Astronaut", "angular momentum", "drift (kg m²/s)"},
      {{"astronaut"}, "linear_momentum_drift", "Astronaut", "linear momentum", "drift (kg m/s)"},
      {{"planar-chain"}, "energy_drift", "Planar chain", "energy", "energy drift (J)"},
      {{"planar-chain"}, "angular_momentum_drift", "Planar chain", "angular momentum", "drift (kg m²/s)"}};
  return kPlots;
}

std::string system_of(const Results& results, const DriftPlot& plot) {
  for (const char* system : plot.systems) {
    for (const std::string& contender : results.contenders()) {
      for (const auto& [step, cell] : results.cells(system, contender, "drift")) {
        if (Results::value(cell, plot.value)) return system;
      }
    }
  }
  return "";
}

std::optional<Drawing> figure4(const Results& results) {
  if (std::ranges::none_of(drift_plots(), [&](const DriftPlot& plot) { return !system_of(results, plot).empty(); })) {
    return std::nullopt;
  }
  constexpr double kRow = 162;
  const double legend = legend_height(results);
  return Drawing{2 * kRow + legend + 6, [&results, legend](Canvas& canvas) {
                   for (size_t i = 0; i < drift_plots().size(); ++i) {
                     const DriftPlot& plot = drift_plots()[i];
                     // three of the astronaut, two of the chain below and in the middle
                     const double column = i < 3 ? static_cast<double>(i) : static_cast<double>(i) - 2.5;
                     const double left = 40 + column * 172, top = 20 + (i < 3 ? 0 : kRow);
                     canvas.text(fmt::format("{}: {}", plot.system_title, plot.title), {left, top - 6}, kTitle - 0.5,
                                 Align::kLeft, kInk, true);
                     speed_accuracy(canvas, results, {left, top, left + 128, top + kRow - 46}, system_of(results, plot),
                                    "drift", plot.value, plot.axis);
                   }
                   legend_rows(canvas, results, results.contenders(), canvas.height() - legend - 2, true);
                 }};
}

// ---- figure 5 -----------------------------------------------------------------------------------------------------------

struct Scaling {
  std::map<double, Figure> seconds;  // by number of bodies
  std::optional<Figure> exponent;
};

// Of a contender on a family of sizes, contacts on or off.
Scaling scaling_of(const Results& results, const std::string& contender, bool contacts) {
  Scaling scaling;
  for (const std::string& system : results.systems()) {
    const std::string family = results.family(system);
    if (family.empty() || (results.fact_flag(system, "contacts") != contacts)) continue;
    for (const auto& [step, cell] : results.cells(system, contender, "scaling")) {
      const auto time = Results::value(cell, "run_time");
      if (time && cell.outcome == Outcome::kOk) scaling.seconds[results.fact(system, "bodies")] = *time;
      if (const auto exponent = Results::value(cell, "scaling_exponent")) scaling.exponent = exponent;
    }
  }
  return scaling;
}

constexpr std::array kSolvers = {std::pair{"mujoco-euler", "MuJoCo, sparse"},
                                 std::pair{"mujoco-euler-dense", "MuJoCo, dense"}};

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
  const Look& look = results.look(contender);
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

std::optional<Drawing> figure5(const Results& results) {
  const bool any = std::ranges::any_of(kSolvers, [&](const auto& solver) {
    return !scaling_of(results, solver.first, true).seconds.empty() ||
           !scaling_of(results, solver.first, false).seconds.empty();
  });
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
                   for (const auto& [contender, title] : kSolvers) {
                     scaling_plot(canvas, results, {left, pictures + 22, left + 200, canvas.height() - 26}, contender,
                                  title);
                     left += 262;
                   }
                 }};
}

// ---- the table of grasps --------------------------------------------------------------------------------------------------

enum class Grip { kHeld, kDropped, kFailed, kNone };

Grip grip_of(const Cell& cell) {
  if (cell.outcome == Outcome::kUnsupported) return Grip::kNone;
  if (cell.outcome != Outcome::kOk) return Grip::kFailed;
  const auto held = Results::value(cell, "grasp_held");
  if (!held) return Grip::kNone;
  return held->value == 1 ? Grip::kHeld : Grip::kDropped;
}

void draw_grip(Canvas& canvas, Canvas::Point at, Grip grip) {
  if (grip == Grip::kHeld) canvas.mark(Mark::kCircle, at, 6, parse_color("#1463c4"));
  if (grip == Grip::kDropped) canvas.mark(Mark::kTriangleDown, at, 5.5, parse_color("#d4590c"), false);
  if (grip == Grip::kFailed) canvas.cross(at, 5.5, kInk);
}

std::optional<Drawing> grasp_table(const Results& results) {
  constexpr const char* kSystem = "grasp";
  std::set<double> steps;
  std::vector<std::string> contenders;
  for (const std::string& contender : results.contenders()) {
    const auto& cells = results.cells(kSystem, contender, "grasp");
    if (!cells.empty()) contenders.push_back(contender);
    for (const auto& [step, cell] : cells) steps.insert(step);
  }
  if (contenders.empty()) return std::nullopt;
  constexpr double kRow = 15;
  return Drawing{
      44 + kRow * static_cast<double>(contenders.size()) + 18, [&results, steps, contenders](Canvas& canvas) {
        constexpr double kLeft = 96, kLast = 430;
        const double column = (kLast - kLeft) / static_cast<double>(steps.size());
        canvas.text("timestep (ms)", {kLeft, 12}, kSmall, Align::kLeft, kSoft);
        canvas.text("largest that", {canvas.width() - 8, 12}, kSmall, Align::kRight, kSoft);
        canvas.text("holds (ms)", {canvas.width() - 8, 21}, kSmall, Align::kRight, kSoft);
        double x = kLeft + column / 2;
        for (const double step : steps) {
          canvas.text(timestep_label(step), {x, 22}, kText, Align::kMiddle, kInk);
          x += column;
        }
        canvas.line(8, 27, canvas.width() - 8, 27, kSoft, 0.7);
        double y = 38;
        for (const std::string& contender : contenders) {
          canvas.text(contender, {8, y + 2.5}, kText, Align::kLeft, kInk);
          x = kLeft + column / 2;
          std::string largest = "–";
          for (const double step : steps) {
            const auto& cells = results.cells(kSystem, contender, "grasp");
            if (const auto cell = cells.find(step); cell != cells.end()) {
              draw_grip(canvas, {x, y}, grip_of(cell->second));
              if (Results::value(cell->second, "largest_stable_timestep")) largest = timestep_label(step);
            }
            x += column;
          }
          canvas.text(largest, {canvas.width() - 8, y + 2.5}, kText, Align::kRight, kInk, true);
          y += kRow;
        }
        canvas.line(8, y - 7, canvas.width() - 8, y - 7, kSoft, 0.7);
        x = kLeft;
        for (const auto& [grip, word] : {std::pair{Grip::kHeld, "held"}, std::pair{Grip::kDropped, "dropped"},
                                         std::pair{Grip::kFailed, "unstable or failed"}}) {
          draw_grip(canvas, {x, y + 3}, grip);
          canvas.text(word, {x + 7, y + 5.5}, kText, Align::kLeft, kInk);
          x += 24 + canvas.text_width(word, kText);
        }
      }};
}

}  // namespace

std::vector<std::string> write_figures(const Store& store, const std::string& folder) {
  // after the last canvas
  struct Fonts {
    Fonts() = default;
    Fonts(const Fonts&) = delete;
    Fonts& operator=(const Fonts&) = delete;
    ~Fonts() { forget_fonts(); }
  };
  const Fonts fonts;
  const Results results(store);
  const std::array figures = {std::pair{"figure3", figure3(results)}, std::pair{"figure4", figure4(results)},
                              std::pair{"figure5", figure5(results)}, std::pair{"grasp-table", grasp_table(results)}};
  std::vector<std::string> files;
  for (const auto& [name, drawing] : figures) {
    if (!drawing) continue;
    for (const auto& [format, ending] : {std::pair{Format::kSvg, "svg"}, std::pair{Format::kPdf, "pdf"}}) {
      std::error_code error;
      std::filesystem::create_directories(folder, error);
      if (error) throw SystemError(fmt::format("cannot make the folder '{}': {}", folder, error.message()));
      Canvas canvas(format, kWidth, drawing->height);
      canvas.fill_rectangle(0, 0, kWidth, drawing->height, {1, 1, 1});
      drawing->draw(canvas);
      const std::string file = (std::filesystem::path(folder) / fmt::format("{}.{}", name, ending)).string();
      write_file(file, canvas.finish());
      files.push_back(file);
    }
  }
  return files;
}

}  // namespace assay
