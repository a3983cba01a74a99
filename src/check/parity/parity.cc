#include "check/parity/parity.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include <Eigen/QR>
#include <fmt/format.h>

#include "base/errors.h"
#include "check/parity/causes.h"
#include "model/joint.h"

namespace assay::parity {
namespace {

// Joints and free bodies with the speeds that belong to them.
struct Element {
  std::string name;
  int first = 0, count = 1;
};

std::vector<Element> elements_of(const Bench& bench) {
  const Model& model = bench.with_gravity;
  std::vector<Element> elements;
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    const Body& body = model.bodies[b];
    elements.push_back(
        {body.is_free() ? fmt::format("free body '{}'", body.name) : fmt::format("joint '{}'", joint_name(model, body)),
         bench.layout.first[b], speeds_of(body)});
  }
  return elements;
}

using Forces = std::function<Eigen::VectorXd(size_t)>;  // by experiment

// Forces of one random configuration by kind. `of` is linear in the forces, so the same sums serve residuals, noise
// and the model's own forces.
struct Kinds {
  Eigen::VectorXd springs, coriolis, damping, dry, gravity;
};

Kinds kinds_of(const Bench& bench, int sample, const Forces& of) {
  const auto find = [&](Load load) {
    for (size_t e = 0; e < bench.experiments.size(); ++e) {
      if (bench.experiments[e].sample == sample && bench.experiments[e].load == load) return of(e);
    }
    return Eigen::VectorXd(Eigen::VectorXd::Zero(bench.layout.count));
  };
  const Eigen::VectorXd motion = find(Load::kMotion), reversed = find(Load::kReversed);
  const Eigen::VectorXd doubled = find(Load::kDoubled), doubled_reversed = find(Load::kDoubledReversed);
  // even in the velocity: springs + Coriolis, which grows with its square; odd: damping, and dry friction, which
  // depends on its sign
  const Eigen::VectorXd even = (motion + reversed) / 2, even2 = (doubled + doubled_reversed) / 2;
  const Eigen::VectorXd odd = (motion - reversed) / 2, odd2 = (doubled - doubled_reversed) / 2;
  Kinds kinds;
  kinds.coriolis = (even2 - even) / 3;
  kinds.springs = even - kinds.coriolis;
  kinds.damping = odd2 - odd;
  kinds.dry = 2 * odd - odd2;
  kinds.gravity = find(Load::kGravity) - motion;
  return kinds;
}

const Eigen::VectorXd& kind(const Kinds& kinds, Part part) {
  switch (part) {
    case Part::kCoriolis:
      return kinds.coriolis;
    case Part::kGravity:
      return kinds.gravity;
    case Part::kDamping:
      return kinds.damping;
    case Part::kDryFriction:
      return kinds.dry;
    case Part::kSprings:
    case Part::kInertia:
    case Part::kArmature:
    case Part::kTorque:
      break;
  }
  return kinds.springs;
}

double largest(const Eigen::VectorXd& of, const Element& element) {
  return of.segment(element.first, element.count).cwiseAbs().maxCoeff();
}

// Of one hinge or slide: the share of its inertia that its residual has with its own acceleration, and the gain that it
// has with its torque, both at once, in the least squares sense over all experiments.
void put_own_row(const Bench& bench, const std::vector<Response>& responses, int joint, JointErrors& errors) {
  const int u = bench.layout.of_joint[joint];
  const auto count = static_cast<Eigen::Index>(responses.size());
  Eigen::MatrixXd columns(count, 2);
  Eigen::VectorXd residual(count), noise(count);
  for (Eigen::Index e = 0; e < count; ++e) {
    const Response& response = responses[static_cast<size_t>(e)];
    columns(e, 0) = bench.inertia[u] * (2 * response.fine.acceleration[u] - response.middle.acceleration[u]);
    columns(e, 1) = bench.experiments[static_cast<size_t>(e)].torques[joint];
    residual[e] = response.residual[u];
    noise[e] = response.noise[u];
  }
  const Eigen::MatrixXd inverse = columns.completeOrthogonalDecomposition().pseudoInverse();
  const Eigen::VectorXd found = (inverse * residual).cwiseAbs(), open = inverse.cwiseAbs() * noise;
  errors.parts[static_cast<size_t>(Part::kArmature)] = {found[0], open[0]};
  errors.parts[static_cast<size_t>(Part::kTorque)] = {found[1], open[1]};
}

std::vector<JointErrors> errors_of(const Bench& bench, const std::vector<Response>& responses) {
  constexpr double kNone = 1e-3;  // forces below this share of the scale are no forces of that kind
  const std::vector<Element> elements = elements_of(bench);
  std::vector<JointErrors> errors;
  errors.reserve(elements.size());
  for (const Element& element : elements) errors.push_back({element.name, std::vector<PartError>(kParts)});
  const auto put = [&](size_t row, Part part, double error, double noise, double reference) {
    const double scale = largest(bench.scale, elements[row]);
    const double by = reference > kNone * scale ? reference : scale;
    PartError& entry = errors[row].parts[static_cast<size_t>(part)];
    entry.error = std::max(entry.error, error / by);
    entry.noise = std::max(entry.noise, noise / by);
  };

  // unit torques: what each adds to the forces of the motion alone
  const int samples = bench.experiments.back().sample + 1;
  Model like = bench.with_gravity;
  for (int sample = 0; sample < samples; ++sample) {
    size_t motion = 0;
    for (size_t e = 0; e < bench.experiments.size(); ++e) {
      const Experiment& experiment = bench.experiments[e];
      if (experiment.sample != sample) continue;
      if (experiment.load == Load::kMotion) motion = e;
      if (experiment.load != Load::kTorque) continue;
      const Eigen::VectorXd error = responses[e].residual - responses[motion].residual;
      const Eigen::VectorXd noise = responses[e].noise + responses[motion].noise;
      for (size_t row = 0; row < elements.size(); ++row) {
        put(row, Part::kInertia, largest(error, elements[row]), largest(noise, elements[row]), 0);
      }
    }
  }

  const auto residual = [&](size_t e) { return responses[e].residual; };
  const auto noise = [&](size_t e) { return responses[e].noise; };
  const auto own = [&](size_t e) -> Eigen::VectorXd {
    const Step still{bench.experiments[e].state, Eigen::VectorXd::Zero(bench.layout.count)};
    return bench.forces(like, bench.experiments[e], still);
  };
  std::vector<Kinds> wrong, open, reference;
  for (int sample = 0; sample < samples; ++sample) {
    wrong.push_back(kinds_of(bench, sample, residual));
    open.push_back(kinds_of(bench, sample, noise));
    reference.push_back(kinds_of(bench, sample, own));
  }
  for (const Part part : {Part::kCoriolis, Part::kGravity, Part::kSprings, Part::kDamping, Part::kDryFriction}) {
    for (size_t row = 0; row < elements.size(); ++row) {
      double most = 0;
      for (const Kinds& kinds : reference) most = std::max(most, largest(kind(kinds, part), elements[row]));
      for (int sample = 0; sample < samples; ++sample) {
        put(row, part, largest(kind(wrong[sample], part), elements[row]),
            largest(kind(open[sample], part), elements[row]), most);
      }
    }
  }
  const Model& model = bench.with_gravity;
  for (size_t b = 0; b < model.bodies.size(); ++b) {  // elements are in the order of the bodies
    if (model.bodies[b].joint >= 0) put_own_row(bench, responses, model.bodies[b].joint, errors[b]);
  }
  return errors;
}

// In maximal coordinates bodies move as the engine's own joints let them: the relative angular velocity of a hinge's
// two bodies lies along the engine's axis. An axis off the model's in all experiments is a cause that no force shows as
// well.
std::vector<Cause> axis_causes(const Bench& bench, const std::vector<Response>& responses, bool single_precision) {
  const double least = single_precision ? 5e-3 : 1e-4;  // rad
  constexpr double kSlowest = 0.2;                      // rad/s, of a direction that is worth looking at
  const Model& model = bench.with_gravity;
  std::vector<Cause> causes;
  for (const Joint& joint : model.joints) {
    const Body& child = model.bodies[joint.body];
    const bool chained = child.parent != kWorld && model.bodies[child.parent].is_massless();
    if (is_slide(joint) || child.is_massless() || chained) continue;
    Vec3 sum = Vec3::Zero();
    double squares = 0;
    int count = 0;
    for (const Response& response : responses) {
      const State& state = response.fine.state;
      const BodyState& body = state.bodies[joint.body];
      const Vec3 parent = child.parent == kWorld ? Vec3(Vec3::Zero()) : state.bodies[child.parent].w_WB;
      const Vec3 w_B = body.q_WB.conjugate() * (body.w_WB - parent);
      if (w_B.norm() < kSlowest) continue;
      const Vec3 off = w_B.normalized() * (w_B.dot(joint.axis_B) < 0 ? -1 : 1) - joint.axis_B;
      sum += off;
      squares += off.squaredNorm();
      ++count;
    }
    if (count < 3) continue;
    const double mean = (sum / count).norm();
    const double spread = std::sqrt(std::max(0.0, (squares / count) - (mean * mean)));
    if (mean < std::max(least, 3 * spread)) continue;
    causes.push_back({.element = fmt::format("joint '{}'", joint.name),
                      .parameter = "axis",
                      .seen = fmt::format("turned by {:.3g} degrees", mean * 180 / std::numbers::pi),
                      .change = mean,
                      .effect = 0,
                      .explains = 1});
  }
  std::ranges::sort(causes, std::ranges::greater{}, &Cause::change);
  return causes;
}

// A limit that acts elsewhere is a cause of its own.
void add_limit_causes(const Model& model, const std::vector<LimitPlace>& places, std::vector<Cause>& causes) {
  constexpr double kAllowed = 2e-3;  // of the range
  for (const LimitPlace& place : places) {
    const Joint& joint = model.joints[place.joint];
    const double range = joint.upper - joint.lower;
    if (!place.found || std::abs(place.place - place.expected) <= kAllowed * range) continue;
    causes.push_back(
        {.element = fmt::format("joint '{}'", joint.name),
         .parameter = place.upper ? "upper limit" : "lower limit",
         .seen = fmt::format("{:.5g} {} instead of {:.5g}", place.place, units_of(joint).position, place.expected),
         .change = (place.place - place.expected) / range,
         .effect = 0,
         .explains = 1});
  }
}

}  // namespace

const char* part_name(Part part) {
  switch (part) {
    case Part::kInertia:
      return "inertia";
    case Part::kCoriolis:
      return "Coriolis";
    case Part::kGravity:
      return "gravity";
    case Part::kSprings:
      return "springs";
    case Part::kDamping:
      return "damping";
    case Part::kDryFriction:
      return "dry friction";
    case Part::kArmature:
      return "armature";
    case Part::kTorque:
      return "torque";
  }
  return "";
}

double Certificate::tolerance() const {
  const double rounding = single_precision ? 2e-3 : 1e-7;
  return std::max(rounding, 4 * noise);
}

bool Certificate::settled() const {
  constexpr double kHides = 0.05, kPlain = 10;
  if (!failure.empty()) return false;
  return tolerance() <= kHides || (!beside.empty() && error >= kPlain * tolerance());
}

Certificate examine(const Model& model, const Bench& bench, const ResolvedContender& contender,
                    const ResolvedContender* beside) {
  Certificate certificate;
  if (beside != nullptr) certificate.beside = beside->name;
  certificate.contender = contender.name;
  certificate.engine = contender.engine->name();
  certificate.single_precision = contender.engine->capabilities(contender.settings).precision == Precision::kSingle;
  // what the contender refuses of contacts and constraints does not matter here
  for (const Limitation& limitation : contender.engine->check(bench.with_gravity, contender.settings)) {
    const std::string text = fmt::format("{}: {}", limitation.element, limitation.how);
    if (limitation.fidelity == Fidelity::kRefused) {
      certificate.failure = "refused: " + text;
      return certificate;
    }
    if (limitation.fidelity == Fidelity::kApproximated) certificate.differences.push_back(text);
  }
  try {
    const Settings settings = exact_settings(contender, certificate.raised);
    std::vector<Response> responses = respond(bench, contender, settings);
    if (beside != nullptr) {
      std::string raised;
      take_off(responses, respond(bench, *beside, exact_settings(*beside, raised)));
    }
    for (const Response& response : responses) {
      if (!response.residual.allFinite()) throw EngineError("an acceleration is not a finite number");
      certificate.error =
          std::max(certificate.error, response.residual.cwiseQuotient(bench.scale).lpNorm<Eigen::Infinity>());
      certificate.noise =
          std::max(certificate.noise, response.noise.cwiseQuotient(bench.scale).lpNorm<Eigen::Infinity>());
    }
    certificate.joints = errors_of(bench, responses);
    const bool maximal = contender.engine->capabilities(contender.settings).coordinates == Coordinates::kMaximal;
    if (maximal && beside == nullptr) certificate.causes = axis_causes(bench, responses, certificate.single_precision);
    if (certificate.settled() && certificate.causes.empty()) {
      certificate.causes = find_causes(bench, responses, certificate.tolerance(), certificate.unexplained);
    }
    if (beside == nullptr && contender.engine->capabilities(contender.settings).joint_limits) {
      try {
        certificate.limits = find_limits(model, contender, settings);
        add_limit_causes(model, certificate.limits, certificate.causes);
      } catch (const UnsupportedError& error) {
        certificate.differences.push_back(fmt::format("limits were not looked for: {}", error.what()));
      }
    }
  } catch (const std::exception& error) {
    certificate.failure = error.what();
  }
  return certificate;
}

}  // namespace assay::parity
