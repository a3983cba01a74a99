#include "check/parity/causes.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include <Eigen/QR>
#include <fmt/format.h>

#include "base/text.h"
#include "model/joint.h"

namespace assay::parity {
namespace {

// A change of the model by an amount: what one column of the fit stands for.
using Change = std::function<void(Model&, double)>;

// Columns that belong together: one named parameter.
struct Hypothesis {
  std::string element, parameter;
  std::vector<Change> changes;                               // none for a joint's torque
  std::vector<double> small;                                 // a step for each difference quotient
  std::function<std::string(const Eigen::VectorXd&)> words;  // from the amounts
  std::function<double(const Eigen::VectorXd&)> relative;    // size of the change
  int torque_of = -1;                                        // index into Model::joints
};

std::string instead(double value, double expected, const char* unit) {
  return fmt::format("{} {} instead of {}", shortest(std::round(value * 1e6) / 1e6), unit, shortest(expected));
}

double ratio(double change, double expected) { return expected != 0 ? change / expected : change; }

class Hypotheses {
 public:
  explicit Hypotheses(const Bench& bench) : bench_(bench), model_(bench.with_gravity) {
    for (size_t j = 0; j < model_.joints.size(); ++j) joint(static_cast<int>(j));
    for (size_t b = 0; b < model_.balls.size(); ++b) ball(static_cast<int>(b));
    for (size_t b = 0; b < model_.bodies.size(); ++b) {
      if (!model_.bodies[b].is_massless()) body(static_cast<int>(b));
    }
    gravity();
  }
  std::vector<Hypothesis> take() { return std::move(all_); }

 private:
  // One number of a joint.
  void scalar(int j, const char* parameter, const char* unit, double Joint::* member, double small) {
    const double expected = model_.joints[j].*member;
    all_.push_back({.element = fmt::format("joint '{}'", model_.joints[j].name),
                    .parameter = parameter,
                    .changes = {[j, member](Model& m, double x) { m.joints[j].*member += x; }},
                    .small = {small},
                    .words = [=](const Eigen::VectorXd& x) { return instead(expected + x[0], expected, unit); },
                    .relative = [=](const Eigen::VectorXd& x) { return ratio(x[0], expected); }});
  }

  void joint(int j) {
    const Joint& joint = model_.joints[j];
    const JointUnits& units = units_of(joint);
    const double inertia = bench_.inertia[bench_.layout.of_joint[j]];
    scalar(j, "armature", units.inertia, &Joint::armature, inertia);
    scalar(j, "damping", units.damping, &Joint::damping, inertia);
    scalar(j, "dry friction", units.force, &Joint::dry_friction, inertia);
    scalar(j, "stiffness", units.stiffness, &Joint::stiffness, inertia);
    if (joint.stiffness != 0) scalar(j, "spring reference", units.position, &Joint::spring_reference, 1);

    const std::string element = fmt::format("joint '{}'", joint.name);
    all_.push_back({.element = element,
                    .parameter = "torque",
                    .changes = {},
                    .small = {1},
                    .words = [](const Eigen::VectorXd& x) { return fmt::format("acts {:.4g} times", 1 + x[0]); },
                    .relative = [](const Eigen::VectorXd& x) { return x[0]; },
                    .torque_of = j});

    const Vec3 axis = joint.axis_B;
    const Vec3 first = axis.unitOrthogonal(), second = axis.cross(first);
    const auto turn = [j](const Vec3& about) {
      return [j, about](Model& m, double x) {
        m.joints[j].axis_B = (Eigen::AngleAxisd(x, about) * m.joints[j].axis_B).normalized();
      };
    };
    const auto norm = [](const Eigen::VectorXd& x) { return x.norm(); };
    all_.push_back({.element = element,
                    .parameter = "axis",
                    .changes = {turn(first), turn(second)},
                    .small = {1e-4, 1e-4},
                    .words =
                        [](const Eigen::VectorXd& x) {
                          return fmt::format("turned by {:.3g} degrees", x.norm() * 180 / std::numbers::pi);
                        },
                    .relative = norm});
    if (is_slide(joint)) return;
    // a shift along the axis changes nothing
    const auto shift = [j](const Vec3& along) {
      return [j, along](Model& m, double x) {
        // the anchor moves in the parent: the child with it
        Body& child = m.bodies[m.joints[j].body];
        child.X_PB.p += child.X_PB.q * along * x;
      };
    };
    all_.push_back({.element = element,
                    .parameter = "anchor",
                    .changes = {shift(first), shift(second), shift(axis)},
                    .small = {1e-4, 1e-4, 1e-4},
                    .words = [](const Eigen::VectorXd& x) { return fmt::format("{:.3g} m off", x.norm()); },
                    .relative = norm});
  }

  void ball(int b) {
    const BallJoint& joint = model_.balls[b];
    const double inertia = bench_.inertia[bench_.layout.first[joint.body]];
    const auto number = [&](const char* parameter, const char* unit, double BallJoint::* member) {
      const double expected = joint.*member;
      all_.push_back({.element = fmt::format("joint '{}'", joint.name),
                      .parameter = parameter,
                      .changes = {[b, member](Model& m, double x) { m.balls[b].*member += x; }},
                      .small = {inertia},
                      .words = [=](const Eigen::VectorXd& x) { return instead(expected + x[0], expected, unit); },
                      .relative = [=](const Eigen::VectorXd& x) { return ratio(x[0], expected); }});
    };
    const JointUnits& units = units_of(joint);
    number("armature", units.inertia, &BallJoint::armature);
    number("damping", units.damping, &BallJoint::damping);
    number("stiffness", units.stiffness, &BallJoint::stiffness);
    number("dry friction", units.force, &BallJoint::dry_friction);
  }

  void body(int b) {
    const Body& body = model_.bodies[b];
    // a body is found by its joint
    std::string element = fmt::format("body '{}'", body.name);
    if (!body.is_free()) element += fmt::format(" of joint '{}'", joint_name(model_, body));
    const double mass = body.mass;
    all_.push_back({.element = element,
                    .parameter = "mass",
                    .changes = {[b](Model& m, double x) { m.bodies[b].mass += x; }},
                    .small = {mass},
                    .words = [=](const Eigen::VectorXd& x) { return instead(mass + x[0], mass, "kg"); },
                    .relative = [=](const Eigen::VectorXd& x) { return x[0] / mass; }});
    const Mat3 whole = body.I_BBcm_B;
    const auto of_inertia = [](const Eigen::VectorXd& x) { return x[0]; };
    all_.push_back({.element = element,
                    .parameter = "inertia",
                    .changes = {[b, whole](Model& m, double x) { m.bodies[b].I_BBcm_B += x * whole; }},
                    .small = {1},
                    .words = [](const Eigen::VectorXd& x) { return fmt::format("{:.4g} times the model's", 1 + x[0]); },
                    .relative = of_inertia});
    all_.push_back({.element = element,
                    .parameter = "mass and inertia",
                    .changes = {[b, whole, mass](Model& m, double x) {
                      m.bodies[b].I_BBcm_B += x * whole;
                      m.bodies[b].mass += x * mass;
                    }},
                    .small = {1},
                    .words = [](const Eigen::VectorXd& x) { return fmt::format("{:.4g} times the model's", 1 + x[0]); },
                    .relative = of_inertia});
    Hypothesis entries{
        .element = element,
        .parameter = "entries of the inertia",
        .changes = {},
        .small = {},
        .words =
            [](const Eigen::VectorXd& x) { return fmt::format("off by up to {:.3g} kg m^2", x.cwiseAbs().maxCoeff()); },
        .relative = [trace = whole.trace()](const Eigen::VectorXd& x) { return x.cwiseAbs().maxCoeff() / trace; }};
    for (int r = 0; r < 3; ++r) {
      for (int c = r; c < 3; ++c) {
        entries.changes.emplace_back([b, r, c](Model& m, double x) {
          m.bodies[b].I_BBcm_B(r, c) += x;
          if (r != c) m.bodies[b].I_BBcm_B(c, r) += x;
        });
        entries.small.push_back(whole.trace());
      }
    }
    all_.push_back(std::move(entries));
    Hypothesis centre{.element = element,
                      .parameter = "centre of mass",
                      .changes = {},
                      .small = {},
                      .words = [](const Eigen::VectorXd& x) { return fmt::format("{:.3g} m off", x.norm()); },
                      .relative = [](const Eigen::VectorXd& x) { return x.norm(); }};
    if (!body.is_free()) {  // of a free body it is the point that the state reports
      for (int k = 0; k < 3; ++k) {
        centre.changes.emplace_back([b, k](Model& m, double x) { m.bodies[b].p_BBcm[k] += x; });
        centre.small.push_back(1e-5);
      }
      all_.push_back(std::move(centre));
    }
  }

  void gravity() {
    const Vec3 g = model_.gravity;
    Hypothesis whole{.element = "the model",
                     .parameter = "gravity",
                     .changes = {},
                     .small = {1, 1, 1},
                     .words =
                         [g](const Eigen::VectorXd& x) {
                           const Vec3 seen = g + x;
                           return fmt::format("({:.4g}, {:.4g}, {:.4g}) m/s^2", seen.x(), seen.y(), seen.z());
                         },
                     .relative = [g](const Eigen::VectorXd& x) { return ratio(x.norm(), g.norm()); }};
    for (int k = 0; k < 3; ++k) {
      whole.changes.emplace_back([k](Model& m, double x) { m.gravity[k] += x; });
    }
    all_.push_back(std::move(whole));
  }

  const Bench& bench_;
  const Model& model_;
  std::vector<Hypothesis> all_;
};

// Residuals of all experiments in one vector, each row relative to its speed's scale.
Eigen::VectorXd stacked(const Bench& bench, const std::function<Eigen::VectorXd(size_t)>& of) {
  const Eigen::Index rows = bench.layout.count;
  Eigen::VectorXd out(rows * static_cast<Eigen::Index>(bench.experiments.size()));
  for (size_t e = 0; e < bench.experiments.size(); ++e) {
    out.segment(static_cast<Eigen::Index>(e) * rows, rows) = of(e).cwiseQuotient(bench.scale);
  }
  return out;
}

// How the stacked residual changes with each amount of a hypothesis, around `model`.
Eigen::MatrixXd columns(const Bench& bench, const std::vector<Response>& responses, const Model& model,
                        const Hypothesis& hypothesis) {
  const auto rows = static_cast<Eigen::Index>(bench.experiments.size()) * bench.layout.count;
  if (hypothesis.torque_of >= 0) {
    const int u = bench.layout.of_joint[hypothesis.torque_of];
    return stacked(bench, [&](size_t e) -> Eigen::VectorXd {
      return Eigen::VectorXd::Unit(bench.layout.count, u) * -bench.experiments[e].torques[hypothesis.torque_of];
    });
  }
  Eigen::MatrixXd result(rows, static_cast<Eigen::Index>(hypothesis.changes.size()));
  for (size_t k = 0; k < hypothesis.changes.size(); ++k) {
    Model more = model, less = model;
    hypothesis.changes[k](more, hypothesis.small[k]);
    hypothesis.changes[k](less, -hypothesis.small[k]);
    result.col(static_cast<Eigen::Index>(k)) = stacked(bench, [&](size_t e) -> Eigen::VectorXd {
      return (bench.forces(more, bench.experiments[e], responses[e]) -
              bench.forces(less, bench.experiments[e], responses[e])) /
             (2 * hypothesis.small[k]);
    });
  }
  return result;
}

struct Fit {
  const Hypothesis* hypothesis = nullptr;
  Eigen::VectorXd amounts;
  double left = 0;  // squared residual after it
  double score = std::numeric_limits<double>::infinity();
};

// What of as many amounts explains as much as `best`, in words.
std::vector<std::string> alike(const std::vector<Fit>& fits, const Fit& best, double floor) {
  constexpr double kSame = 1.0001;
  std::vector<std::string> found;
  for (const Fit& fit : fits) {
    const Hypothesis& other = *fit.hypothesis;
    if (fit.hypothesis == best.hypothesis || fit.amounts.size() != best.amounts.size()) continue;
    if (fit.left + floor > kSame * (best.left + floor)) continue;
    found.push_back(fmt::format("{}: {} {}", other.element, other.parameter, other.words(fit.amounts)));
  }
  return found;
}

}  // namespace

std::vector<Cause> find_causes(const Bench& bench, const std::vector<Response>& responses, double tolerance,
                               double& unexplained) {
  constexpr size_t kMostCauses = 8;
  constexpr double kGoodPart = 0.5;  // a cause has to explain at least this share of the squared residual
  constexpr double kAlike = 1.05;    // fits whose residuals differ by less are the same to the eye
  const std::vector<Hypothesis> all = Hypotheses(bench).take();
  Model model = bench.with_gravity;
  std::vector<double> gains(model.joints.size(), 1.0);
  const auto residual = [&] {
    return stacked(bench, [&](size_t e) -> Eigen::VectorXd {
      Eigen::VectorXd forces = bench.forces(model, bench.experiments[e], responses[e]) - responses[e].own;
      for (size_t j = 0; j < gains.size(); ++j) {
        forces[bench.layout.of_joint[j]] -= gains[j] * bench.experiments[e].torques[j];
      }
      return forces;
    });
  };

  std::vector<Cause> causes;
  Eigen::VectorXd now = residual();
  const Eigen::VectorXd noise = stacked(bench, [&](size_t e) { return responses[e].noise; });
  const double floor = std::max(noise.squaredNorm(), 1e-20 * static_cast<double>(noise.size()));
  while (causes.size() < kMostCauses && now.lpNorm<Eigen::Infinity>() > tolerance) {
    const double before = now.squaredNorm();
    Fit best;
    std::vector<Fit> fits;
    for (const Hypothesis& hypothesis : all) {
      const Eigen::MatrixXd A = columns(bench, responses, model, hypothesis);
      if (A.squaredNorm() == 0) continue;
      Fit fit{.hypothesis = &hypothesis, .amounts = A.colPivHouseholderQr().solve(-now), .left = 0};
      fit.left = (now + A * fit.amounts).squaredNorm();
      // fewer amounts win where the residual is the same within noise
      fit.score = std::log(fit.left + floor) + (0.5 * std::log(kAlike) * static_cast<double>(fit.amounts.size()));
      if (fit.score < best.score) best = fit;
      fits.push_back(std::move(fit));
    }
    if (best.hypothesis == nullptr || best.left > (1 - kGoodPart) * before + floor) break;
    const Hypothesis& chosen = *best.hypothesis;
    if (chosen.torque_of >= 0) {
      gains[chosen.torque_of] += best.amounts[0];
    } else {
      for (size_t k = 0; k < chosen.changes.size(); ++k) {
        chosen.changes[k](model, best.amounts[static_cast<Eigen::Index>(k)]);
      }
    }
    const Eigen::VectorXd next = residual();
    if (next.squaredNorm() >= before) break;  // too far from linear to be understood
    causes.push_back({.element = chosen.element,
                      .parameter = chosen.parameter,
                      .seen = chosen.words(best.amounts),
                      .change = chosen.relative(best.amounts),
                      .effect = (now - next).lpNorm<Eigen::Infinity>(),
                      .explains = 1 - (next.squaredNorm() / before),
                      .alike = alike(fits, best, floor)});
    now = next;
  }
  unexplained = now.lpNorm<Eigen::Infinity>();
  return causes;
}

}  // namespace assay::parity
