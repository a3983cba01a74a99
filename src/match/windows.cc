#include "match/windows.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <fmt/format.h>

#include "base/errors.h"
#include "measures/first_state.h"
#include "model/kinematics.h"

namespace assay::match {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kAroundStart = 0.03;     // s, to each side: what a joint's first state is found from
constexpr size_t kLeastAround = 3;        // samples to each side
constexpr size_t kLeastFlight = 6;        // samples
constexpr double kFinestSample = 0.0095;  // s: joints are compared about every 10 ms
constexpr double kMillimetres = 1000;

double extent_of(const Model& model, int body) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const Shape& shape : model.shapes) {
    if (shape.body != body) continue;
    Vec3 half = shape.half_size;
    if (shape.type == ShapeType::kHull) {
      for (const Vec3& vertex : model.hulls[static_cast<size_t>(shape.data)].vertices) {
        low = low.cwiseMin(shape.X_BS * vertex), high = high.cwiseMax(shape.X_BS * vertex);
      }
      continue;
    }
    if (half.isZero()) half = Vec3(shape.radius, shape.radius, shape.radius + shape.half_length);
    // of a shape that is turned in its body, its own extents count, not the box around it
    low = low.cwiseMin(shape.X_BS.p - half), high = high.cwiseMax(shape.X_BS.p + half);
  }
  if (!low.allFinite()) {
    const Body& own = model.bodies[static_cast<size_t>(body)];
    return std::sqrt(6 * own.I_BBcm_B.trace() / (3 * own.mass));  // the side of a cube of this inertia
  }
  return (high - low).maxCoeff();
}

Quat quaternion(const std::vector<double>& numbers, size_t at) {
  return {numbers[at], numbers[at + 1], numbers[at + 2], numbers[at + 3]};
}

Vec3 rotation_between(const Quat& from, const Quat& to) {
  Quat off = from.conjugate() * to;
  if (off.w() < 0) off.coeffs() *= -1;
  return rotation_vector(off);
}

bool touches(const LogCheck& check, size_t log, double from, double to) {
  return std::ranges::any_of(check.spoiled, [&](const SpoiledSpan& spoiled) {
    return spoiled.log == log && spoiled.span.from < to && spoiled.span.to > from;
  });
}

}  // namespace

Windows::Windows(const Model& model, const std::vector<MeasuredLog>& logs, const MatchConfig& config,
                 const LogCheck& check)
    : joints_(model.joints.size()), whole_(config.whole_motions.value_or(!model.contacts.empty())) {
  for (const Joint& joint : model.joints) slides_.push_back(joint.is_slide());
  const DriveLaw law = drive_law(logs, config);
  for (size_t index = 0; index < logs.size(); ++index) {
    const MeasuredLog& log = logs[index];
    MatchDrive drive;
    if (law != DriveLaw::kNone) {
      drive.times = log.time;
      drive.torques.resize(joints_), drive.targets.resize(joints_);
      drive.stiffness.resize(joints_), drive.damping.resize(joints_);
      for (const MeasuredJoint& joint : log.joints) {
        const auto j = static_cast<size_t>(joint.joint);
        if (law == DriveLaw::kTorque) drive.torques[j] = without_glitches(joint.torque, config.torque_median);
        if (law == DriveLaw::kPd) drive.targets[j] = joint.target;
        const std::string& name = model.joints[j].name;
        drive.stiffness[j] = gain_of(config.stiffness, name), drive.damping[j] = gain_of(config.damping, name);
      }
    }
    drives_.push_back(std::move(drive));
    for (const MeasuredBody& body : log.bodies) {
      if (std::ranges::find(bodies_, body.body, &BodyMeasure::body) == bodies_.end()) {
        bodies_.push_back({body.body, extent_of(model, body.body)});
      }
    }
    if (log.samples() < 2 * kLeastAround + 1) continue;
    if (whole_) {
      if (!touches(check, index, log.time.front(), log.time.back())) {
        add(model, log, index, 0, log.samples() - 1, WindowUse::kFit, config);
        add(model, log, index, 0, log.samples() - 1, WindowUse::kReport, config);
      }
      continue;
    }
    for (const auto& [use, length] :
         {std::pair(WindowUse::kFit, config.fit_window_s), std::pair(WindowUse::kReport, config.report_window_s)}) {
      for (const TimeSpan& span : log.rows) {
        // the first and last samples serve the first state
        size_t from = kLeastAround;
        while (from < log.samples() && log.time[from] < span.from) ++from;
        const double end = std::min(span.to, log.time[log.samples() - 1 - kLeastAround]);
        while (from < log.samples() && log.time[from] + length <= end + 1e-9) {
          size_t to = from;
          while (to + 1 < log.samples() && log.time[to] < log.time[from] + length - 1e-9) ++to;
          if (!touches(check, index, log.time[from], log.time[to])) add(model, log, index, from, to, use, config);
          from = to;
        }
      }
    }
  }
  // a log that is too short for what is reported is reported by what is fitted
  const std::vector<Window> made = windows_;
  for (const Window& window : made) {
    const bool reported = std::ranges::any_of(
        made, [&](const Window& other) { return other.use == WindowUse::kReport && other.log == window.log; });
    if (reported) continue;
    windows_.push_back(window);
    windows_.back().use = WindowUse::kReport;
  }
  if (windows_.empty()) {
    throw InputError(
        fmt::format("the logs have no stretch of {:g} s that can be used: give longer logs, or [windows] "
                    "fit_s in the configuration; assay match --check says what spoils them",
                    config.fit_window_s));
  }
}

void Windows::add(const Model& model, const MeasuredLog& log, size_t index, size_t from, size_t to, WindowUse use,
                  const MatchConfig& config) {
  Window window;
  window.log = index;
  window.use = use;
  window.start_s = log.time[from], window.end_s = log.time[to];
  MatchWindow& message = window.message;
  message.drive = static_cast<int>(index);
  if (drives_[index].times.empty()) message.drive = -1;
  message.start_s = window.start_s;
  message.position = model.initial.position;
  message.velocity.assign(joints_, 0);
  if (message.position.size() != joints_) message.position.assign(joints_, 0);
  // joints: a cubic through the samples around the start
  const auto around_from = [&] {
    size_t first = from >= kLeastAround ? from - kLeastAround : 0;
    while (first > 0 && log.time[first - 1] >= log.time[from] - kAroundStart) --first;
    return first;
  }();
  const auto around_to = [&] {
    size_t last = std::min(from + kLeastAround, log.samples() - 1);
    while (last + 1 < log.samples() && log.time[last + 1] <= log.time[from] + kAroundStart) ++last;
    return last;
  }();
  std::vector<double> times, positions;
  for (size_t i = around_from; i <= around_to; ++i) times.push_back(log.time[i] - log.time[from]);
  for (const MeasuredJoint& joint : log.joints) {
    positions.assign(joint.position.begin() + static_cast<std::ptrdiff_t>(around_from),
                     joint.position.begin() + static_cast<std::ptrdiff_t>(around_to) + 1);
    const FirstCoordinate first = first_coordinate(times, positions);
    const auto j = static_cast<size_t>(joint.joint);
    message.position[j] = first.position, message.velocity[j] = first.velocity;
    window.joints.push_back(joint.joint);
    window.joint_noise.push_back({first.position_sd, first.velocity_sd, first.sample_sd});
  }
  // free bodies: flight
  size_t flown = to - from + 1;
  for (const MeasuredBody& body : log.bodies) {
    FlightSamples samples;
    for (size_t i = from; i <= to; ++i) {
      samples.times.push_back(log.time[i] - log.time[from]);
      samples.p_WB.push_back(body.p_WB[i]);
      samples.q_WB.push_back(body.q_WB[i]);
    }
    const Body& own = model.bodies[static_cast<size_t>(body.body)];
    const size_t length = flight_length(samples, own, kLeastFlight);
    flown = std::min(flown, length);
    // the last sample before an impact may already feel it
    const size_t used = length < samples.times.size() ? std::max(kLeastFlight, length - 1) : length;
    samples.times.resize(std::min(used, samples.times.size()));
    samples.p_WB.resize(samples.times.size()), samples.q_WB.resize(samples.times.size(), Quat::Identity());
    const FirstFlight first = first_flight(samples, own, model.gravity);
    MatchFlight flight;
    flight.body = body.body;
    flight.times = samples.times;
    for (size_t i = 0; i < samples.times.size(); ++i) {
      const Vec3& p = samples.p_WB[i];
      const Quat& q = samples.q_WB[i];
      flight.positions.insert(flight.positions.end(), {p.x(), p.y(), p.z()});
      flight.rotations.insert(flight.rotations.end(), {q.w(), q.x(), q.y(), q.z()});
    }
    message.flights.push_back(std::move(flight));
    window.flight_noise.push_back({first.p_sd, first.v_sd, first.q_sd, first.w_sd});
  }
  window.flown = flown;
  // what is compared
  const double span = log.time[to] - log.time[from];
  const double rate = span > 0 ? static_cast<double>(to - from) / span : 1;
  const size_t stride = log.bodies.empty() ? std::max<size_t>(1, static_cast<size_t>(rate * kFinestSample)) : 1;
  for (size_t i = from + stride; i <= to; i += stride) {
    message.times.push_back(log.time[i] - log.time[from]);
    for (const MeasuredJoint& joint : log.joints) window.measured.push_back(joint.position[i]);
    for (const MeasuredBody& body : log.bodies) {
      const Vec3& p = body.p_WB[i];
      const Quat& q = body.q_WB[i];
      window.measured.insert(window.measured.end(), {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()});
    }
  }
  static_cast<void>(config);
  if (!message.times.empty()) windows_.push_back(std::move(window));
}

std::vector<size_t> Windows::of(WindowUse use, const std::vector<bool>& logs) const {
  std::vector<size_t> found;
  for (size_t i = 0; i < windows_.size(); ++i) {
    if (windows_[i].use == use && logs[windows_[i].log]) found.push_back(i);
  }
  return found;
}

double Windows::unit_of(int joint) const { return slides_[static_cast<size_t>(joint)] ? kMillimetres : kDegrees; }

size_t Windows::residual_count(const Window& window) const {
  return window.message.times.size() * (window.joints.size() + 6 * window.message.flights.size());
}

namespace {

// The compared numbers of a run, in the order of Window::measured; shorter where it ended early.
std::vector<double> compared(const Window& window, const MatchRun& run, size_t joints) {
  const size_t flights = 7 * window.message.flights.size(), row = joints + flights;
  const size_t samples = row == 0 ? 0 : run.samples.size() / row;
  std::vector<double> found;
  found.reserve(samples * (window.joints.size() + flights));
  for (size_t s = 0; s < samples; ++s) {
    const double* at = run.samples.data() + s * row;
    for (const int joint : window.joints) found.push_back(at[joint]);
    found.insert(found.end(), at + joints, at + row);
  }
  return found;
}

}  // namespace

std::vector<double> Windows::residuals(const Window& window, const MatchRun& run) const {
  const std::vector<double> simulated = compared(window, run, joints_);
  const size_t row = window.joints.size() + 7 * window.message.flights.size();
  std::vector<double> found;
  found.reserve(residual_count(window));
  const auto add = [&](double value, double most) {
    found.push_back(std::isfinite(value) ? std::clamp(value, -most, most) : most);
  };
  for (size_t s = 0; s < window.message.times.size(); ++s) {
    const size_t at = s * row;
    const bool there = at + row <= simulated.size();
    for (size_t j = 0; j < window.joints.size(); ++j) {
      const double unit = unit_of(window.joints[j]);
      add(there ? unit * (simulated[at + j] - window.measured[at + j]) : kLostDegrees, kLostDegrees);
    }
    for (size_t f = 0; f < window.message.flights.size(); ++f) {
      const size_t p = at + window.joints.size() + 7 * f, q = p + 3;
      const auto body = std::ranges::find(bodies_, window.message.flights[f].body, &BodyMeasure::body);
      for (size_t k = 0; k < 3; ++k) {
        add(there ? 100 / body->size * (simulated[p + k] - window.measured[p + k]) : kLostPercent, kLostPercent);
      }
      const Vec3 turn =
          there ? Vec3(kDegrees * rotation_between(quaternion(window.measured, q), quaternion(simulated, q)))
                : Vec3(Vec3::Constant(kLostDegrees));
      for (int k = 0; k < 3; ++k) add(turn[k], 2 * kLostDegrees);
    }
  }
  return found;
}

std::vector<WindowError> Windows::compare(const Window& window, const std::vector<double>& a,
                                          const std::vector<double>& b) const {
  const size_t row = window.joints.size() + 7 * window.message.flights.size();
  std::vector<WindowError> errors;
  for (size_t s = 0; s < window.message.times.size(); ++s) {
    const size_t at = s * row;
    WindowError error;
    if (at + row > a.size() || at + row > b.size()) {
      error = {kLostDegrees, kLostPercent, kHalfTurn, true};
      errors.push_back(error);
      continue;
    }
    double squares = 0;
    for (size_t j = 0; j < window.joints.size(); ++j) {
      const double unit = unit_of(window.joints[j]);
      squares += std::pow(unit * (a[at + j] - b[at + j]), 2);
    }
    if (!window.joints.empty()) {
      error.joints = std::min(kLostDegrees, std::sqrt(squares / static_cast<double>(window.joints.size())));
    }
    const auto flights = static_cast<double>(window.message.flights.size());
    for (size_t f = 0; f < window.message.flights.size(); ++f) {
      const size_t p = at + window.joints.size() + 7 * f, q = p + 3;
      const auto body = std::ranges::find(bodies_, window.message.flights[f].body, &BodyMeasure::body);
      double metres = 0;
      for (size_t k = 0; k < 3; ++k) metres += std::pow(a[p + k] - b[p + k], 2);
      error.position += std::min(kLostPercent, 100 / body->size * std::sqrt(metres)) / flights;
      error.rotation += kDegrees * rotation_between(quaternion(a, q), quaternion(b, q)).norm() / flights;
    }
    errors.push_back(error);
  }
  return errors;
}

std::vector<WindowError> Windows::sample_errors(const Window& window, const MatchRun& run) const {
  return compare(window, compared(window, run, joints_), window.measured);
}

WindowError Windows::error(const Window& window, const MatchRun& run) const {
  return mean_error(sample_errors(window, run));
}

WindowError Windows::error_at_rest(const Window& window) const {
  const size_t row = window.joints.size() + 7 * window.message.flights.size();
  std::vector<double> still;
  still.reserve(window.measured.size());
  for (size_t i = 0; i < window.measured.size(); ++i) still.push_back(window.measured[i % row]);
  return mean_error(compare(window, still, window.measured));
}

WindowError Windows::distance(const Window& window, const MatchRun& a, const MatchRun& b) const {
  return mean_error(compare(window, compared(window, a, joints_), compared(window, b, joints_)));
}

MatchWindow Windows::perturbed(const Window& window, std::uint64_t seed) const {
  std::mt19937_64 random(seed);
  // Box and Muller: the library's distribution may differ from one to the next
  const auto normal = [&] {
    const double u = (static_cast<double>(random() >> 11) + 0.5) * 0x1p-53;
    const double v = static_cast<double>(random() >> 11) * 0x1p-53;
    return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
  };
  MatchWindow message = window.message;
  for (size_t j = 0; j < window.joints.size(); ++j) {
    const auto at = static_cast<size_t>(window.joints[j]);
    message.position[at] += window.joint_noise[j][0] * normal();
    message.velocity[at] += window.joint_noise[j][1] * normal();
  }
  for (size_t f = 0; f < message.flights.size(); ++f) {
    message.flights[f].offset.clear();
    for (const double sd : window.flight_noise[f]) {
      for (int k = 0; k < 3; ++k) message.flights[f].offset.push_back(sd * normal());
    }
  }
  return message;
}

WindowError mean_error(const std::vector<WindowError>& errors) {
  WindowError mean;
  if (errors.empty()) return mean;
  const auto count = static_cast<double>(errors.size());
  for (const WindowError& error : errors) {
    mean.joints += error.joints * error.joints / count;
    mean.position += error.position / count;
    mean.rotation += error.rotation / count;
    mean.failed |= error.failed;
  }
  mean.joints = std::sqrt(mean.joints);
  return mean;
}

}  // namespace assay::match
