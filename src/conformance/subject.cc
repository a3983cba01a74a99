#include "conformance/subject.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include <fmt/format.h>

#include "base/text.h"
#include "model/joint_rows.h"
#include "model/state_faults.h"

namespace assay::conformance {
namespace {

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) throw EngineError(fmt::format("{} numbers were read, {} expected", a.size(), b.size()));
  double largest = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const double difference = std::abs(a[i] - b[i]);
    if (!std::isfinite(difference)) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, difference);
  }
  return largest;
}

// A figure in tolerances; for a tolerance of 0 always more than any check that passes.
double in_tolerances(double figure, double tolerance) {
  if (figure <= tolerance) return tolerance > 0 ? figure / tolerance : 0;
  if (!std::isfinite(figure)) return std::numeric_limits<double>::infinity();
  return tolerance > 0 ? figure / tolerance : 1 + figure;
}

// The limit h -> 0 of a method of order q from results at 2h and h.
std::vector<double> extrapolated(const std::vector<double>& coarse, const std::vector<double>& fine, int q) {
  std::vector<double> limit(fine);
  const double factor = std::exp2(q) - 1;
  for (size_t i = 0; i < limit.size(); ++i) limit[i] += (fine[i] - coarse[i]) / factor;
  return limit;
}

// Whether set_torques() has to be called before every step: it adds explicit springs.
bool needs_torques(const Model& model) {
  return model.has_springs() || std::ranges::any_of(model.balls, &BallJoint::has_spring) ||
         std::ranges::any_of(model.tendons, &Tendon::has_spring) || has_joint_rows(model);
}

}  // namespace

void Checks::add(double figure, double tolerance, const std::string& what) {
  if (!worst_.note.empty() && in_tolerances(figure, tolerance) <= in_tolerances(worst_.figure, worst_.tolerance))
    return;
  worst_.figure = figure;
  worst_.tolerance = tolerance;
  worst_.note = what;
}

void Checks::add_at(double timestep, double figure, double tolerance, const std::string& what) {
  add(figure, tolerance, fmt::format("{} at {} ms", what, shortest(1e3 * timestep)));
  const auto at = std::ranges::find(worst_.timesteps, timestep, &TimestepVerdict::timestep);
  if (at == worst_.timesteps.end()) {
    worst_.timesteps.push_back({timestep, figure, tolerance, what});
    std::ranges::sort(worst_.timesteps, std::greater(), &TimestepVerdict::timestep);
  } else if (in_tolerances(figure, tolerance) > in_tolerances(at->figure, at->tolerance)) {
    *at = {timestep, figure, tolerance, what};
  }
}

bool Subject::is_compliant() const {
  const std::vector<Setting> declared = contender_.engine->settings();
  const Setting* stiffness = setting_with_role(declared, SettingRole::kContactStiffness);
  return stiffness != nullptr && contender_.settings.get<double>(stiffness->name) > 0;
}

std::optional<ResolvedContender> Subject::with_compliance(double stiffness, double damping) const {
  const std::vector<Setting> declared = contender_.engine->settings();
  ResolvedContender compliant = contender_;
  for (const auto& [role, value] :
       {std::pair(SettingRole::kContactStiffness, stiffness), std::pair(SettingRole::kContactDamping, damping)}) {
    const Setting* setting = setting_with_role(declared, role);
    if (setting == nullptr || !missing_condition(*setting, contender_.settings).empty()) return std::nullopt;
    compliant.settings.values[setting->name] = value;
  }
  return compliant;
}

std::optional<ResolvedContender> Subject::with_restitution(double coefficient) const {
  const std::vector<Setting> declared = contender_.engine->settings();
  const auto setting = std::ranges::find(declared, "restitution", &Setting::name);
  if (setting == declared.end()) return std::nullopt;
  ResolvedContender elastic = contender_;
  elastic.settings.values[setting->name] = coefficient;
  return elastic;
}

bool Subject::is_exact(Feature feature) const {
  const Capabilities can = capabilities();
  const FeatureSupport* support = can.support(feature);
  return support != nullptr && support->fidelity == Fidelity::kExact;
}

bool Subject::accepts(Feature feature) const {
  const Capabilities can = capabilities();
  const FeatureSupport* support = can.support(feature);
  return support != nullptr && support->fidelity != Fidelity::kRefused;
}

bool Subject::refuses(const Model& model) const {
  return std::ranges::any_of(contender_.engine->check(model, contender_.settings),
                             [](const Limitation& limitation) { return limitation.fidelity == Fidelity::kRefused; });
}

double Subject::epsilon() const {
  return capabilities().precision == Precision::kSingle ? std::numeric_limits<float>::epsilon()
                                                        : std::numeric_limits<double>::epsilon();
}

double Subject::coarse_timestep() const {
  const Capabilities can = capabilities();
  return can.precision == Precision::kSingle || can.order > 1 ? 4e-3 : 1e-3;
}

std::unique_ptr<Simulation> Subject::create(const Model& model, const State& state, double timestep) const {
  Settings settings = contender_.settings;
  settings.timestep = timestep;
  return contender_.engine->create(model, state, settings);
}

void Subject::read(const Simulation& simulation, const Model& model, double not_before_s, State& out) {
  simulation.read_state(out);
  std::string fault = state_shape_fault(out, model.bodies.size(), model.joints.size());
  if (fault.empty()) fault = state_value_fault(out, &model);
  constexpr double kRounding = 1e-6;  // of an adapter that keeps its time in single precision
  if (fault.empty() && out.time < not_before_s - kRounding * (1 + std::abs(not_before_s))) {
    fault = fmt::format("the time {:.6g} s after {:.6g} s", out.time, not_before_s);
  }
  if (!fault.empty()) throw EngineError(fmt::format("the engine gave {}", fault));
}

State Subject::run(const Model& model, const State& start, double timestep, double duration,
                   std::span<const double> torques) const {
  const std::unique_ptr<Simulation> simulation = create(model, start, timestep);
  const int steps = static_cast<int>(std::llround(duration / timestep));
  const int stride = std::max(1, static_cast<int>(std::llround(0.01 / timestep)));
  const bool has_input = !torques.empty() || needs_torques(model);
  const std::vector<double> zero(model.joints.size(), 0.0);
  State state;
  for (int done = 0; done < steps;) {
    const int count = std::min(stride, steps - done);
    if (has_input) {
      for (int i = 0; i < count; ++i) simulation->step(torques.empty() ? zero : torques);
    } else {
      simulation->advance(count);
    }
    done += count;
    read(*simulation, model, done == count ? start.time : state.time, state);
  }
  return state;
}

std::vector<State> Subject::record(const Model& model, const State& start, double timestep, double duration,
                                   std::span<const double> torques) const {
  const std::unique_ptr<Simulation> simulation = create(model, start, timestep);
  const int steps = static_cast<int>(std::llround(duration / timestep));
  std::vector<State> states;
  states.reserve(steps + 1);
  State state;
  read(*simulation, model, start.time, state);
  states.push_back(state);
  const bool has_input = !torques.empty() || needs_torques(model);
  const std::vector<double> zero(model.joints.size(), 0.0);
  for (int i = 0; i < steps; ++i) {
    if (has_input) simulation->set_torques(torques.empty() ? zero : torques);
    simulation->advance(1);
    read(*simulation, model, state.time, state);
    states.push_back(state);
  }
  return states;
}

Verdict converges(const Subject& subject, const Measurement& measure, const std::vector<double>& truth,
                  const ConvergenceOptions& options) {
  const int order = options.order > 0 ? options.order : subject.capabilities().order;
  const double h = subject.coarse_timestep() * options.time_scale;
  const std::vector<double> coarse = measure(h), middle = measure(h / 2), fine = measure(h / 4);
  const double error_coarse = distance(coarse, truth), error_middle = distance(middle, truth);
  const double error_fine = distance(fine, truth);

  double figure = std::numeric_limits<double>::infinity();
  for (int q = order; q <= std::max(order, 4); ++q) {
    figure = std::min(figure, distance(extrapolated(middle, fine, q), truth));
  }
  const double estimate = distance(extrapolated(coarse, middle, order), extrapolated(middle, fine, order));
  // an error that changes its sign between two timesteps is small at one of them by accident, but not at all three
  const double leading = std::max({error_fine, error_middle / std::exp2(order), error_coarse / std::exp2(2 * order)});

  double scale = options.scale;
  if (scale == 0) {
    for (const double value : truth) scale = std::max(scale, std::abs(value));
  }
  const double floor = subject.rounding(4 * options.duration / h, scale) + options.floor;
  Verdict verdict;
  verdict.figure = figure;
  verdict.tolerance = std::min(leading / 4, 2 * estimate) + floor;
  verdict.unit = options.unit;
  verdict.note = fmt::format(
      "limit h -> 0 against the reference solution; error {:.3g} at {} ms, {:.3g} at {} ms, observed order {:.2f}",
      error_middle, shortest(h * 500), error_fine, shortest(h * 250),
      std::log2(std::max(error_middle, 1e-300) / std::max(error_fine, 1e-300)));
  return verdict;
}

std::vector<double> positions(const State& state) {
  std::vector<double> numbers;
  numbers.reserve(3 * state.bodies.size());
  for (const BodyState& body : state.bodies) numbers.insert(numbers.end(), body.p_WBcm.begin(), body.p_WBcm.end());
  return numbers;
}

std::vector<double> all_numbers(const State& state) {
  std::vector<double> numbers = {state.time};
  numbers.reserve(1 + 13 * state.bodies.size() + 2 * state.position.size());
  for (const BodyState& body : state.bodies) {
    numbers.insert(numbers.end(), body.p_WBcm.begin(), body.p_WBcm.end());
    numbers.insert(numbers.end(), {body.q_WB.w(), body.q_WB.x(), body.q_WB.y(), body.q_WB.z()});
    numbers.insert(numbers.end(), body.v_WBcm.begin(), body.v_WBcm.end());
    numbers.insert(numbers.end(), body.w_WB.begin(), body.w_WB.end());
  }
  numbers.insert(numbers.end(), state.position.begin(), state.position.end());
  numbers.insert(numbers.end(), state.velocity.begin(), state.velocity.end());
  return numbers;
}

int differing_bits(const State& a, const State& b) {
  const std::vector<double> left = all_numbers(a), right = all_numbers(b);
  if (left.size() != right.size()) return static_cast<int>(std::max(left.size(), right.size()));
  int count = 0;
  for (size_t i = 0; i < left.size(); ++i) {
    count += std::bit_cast<std::uint64_t>(left[i]) != std::bit_cast<std::uint64_t>(right[i]);
  }
  return count;
}

double angle_between(const Quat& a, const Quat& b) {
  const Quat relative = a.conjugate() * b;
  return 2 * std::atan2(relative.vec().norm(), std::abs(relative.w()));
}

}  // namespace assay::conformance
