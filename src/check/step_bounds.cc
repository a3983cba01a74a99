#include "check/step_bounds.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <fmt/format.h>

#include "check/islands.h"
#include "measures/reference/dynamics.h"
#include "model/joint.h"

namespace assay {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// A force -(stiffness x + damping dx/dt) along each column of `directions`, x = directions^T q.
struct Element {
  ExplicitSpring spring;
  MatrixXd directions;  // one column; three of a ball joint
};

double largest_eigenvalue(const MatrixXd& symmetric) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(symmetric, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

// The largest step of a spring and a damper at one inertia: rate = B / I, omega2 = K / I.
double largest_step(double rate, double omega2) {
  const double sum = rate + std::sqrt(rate * rate + 4 * omega2);
  return sum > 0 ? 4 / sum : kInfinite;
}

class Bounds {
 public:
  Bounds(const Model& model, const State& state) : model_(model), dynamics_(model) {
    inertia_ = dynamics_.mass_matrix(state);
    find_coupled();
    basis_ = free_directions();
    const MatrixXd reduced = basis_.transpose() * inertia_ * basis_;
    // scaled to a unit diagonal, so that grams and kilograms are alike
    const VectorXd scale = reduced.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
    const Eigen::LLT<MatrixXd> factor(scale.asDiagonal() * reduced * scale.asDiagonal());
    constexpr double kSingular = 1e-6;  // of a pivot's square root
    singular_ = factor.info() != Eigen::Success || MatrixXd(factor.matrixL()).diagonal().minCoeff() < kSingular;
    if (singular_ || reduced.size() == 0) return;
    // columns of `whitened_` are velocities of unit kinetic energy (times two) and orthogonal
    const MatrixXd unit = MatrixXd::Identity(reduced.rows(), reduced.cols());
    whitened_ = basis_ * scale.asDiagonal() * factor.matrixU().solve(unit);
  }

  bool singular() const { return singular_; }

  StepBound of(std::vector<Element> elements) const {
    StepBound bound;
    const Eigen::Index n = whitened_.cols();
    MatrixXd K = MatrixXd::Zero(n, n), D = MatrixXd::Zero(n, n);
    std::vector<MatrixXd> seen;  // the elements' directions in those velocities
    for (Element& element : elements) {
      seen.emplace_back(whitened_.transpose() * element.directions);
      const MatrixXd outer = seen.back() * seen.back().transpose();
      K += element.spring.stiffness * outer;
      D += element.spring.damping * outer;
      const double mobility = largest_eigenvalue(seen.back().transpose() * seen.back());
      element.spring.inertia = mobility > 0 ? 1 / mobility : kInfinite;
      element.spring.held_inertia = held_inertia(element.directions);
    }
    if (!elements.empty()) {
      const double omega2 = std::max(0.0, largest_eigenvalue(K));
      bound.decay = std::max(0.0, largest_eigenvalue(D));
      bound.frequency = std::sqrt(omega2) / (2 * std::numbers::pi);
      bound.largest = critical_step(K, D, bound.decay, omega2);
      share(elements, seen, K, D, bound.largest);
    }
    for (Element& element : elements) bound.springs.push_back(std::move(element.spring));
    std::ranges::stable_sort(bound.springs, {}, &ExplicitSpring::step);
    return bound;
  }

  std::vector<Element> joint_springs() const {
    std::vector<Element> elements;
    each_joint(model_, [&](const auto& joint) {
      add(elements,
          {.element = fmt::format("joint '{}'", joint.name), .stiffness = joint.stiffness, .damping = joint.damping},
          unit_columns(dynamics_.first_of(joint.body), speeds_of(joint)));
    });
    for (const Tendon& tendon : model_.tendons) {
      add(elements,
          {.element = fmt::format("tendon '{}'", tendon.name),
           .stiffness = tendon.stiffness,
           .damping = tendon.damping},
          column_of(tendon.terms));
    }
    return elements;
  }

  // Position and velocity servos; what drives away from the set point has no bound.
  std::vector<Element> feedback() const {
    std::vector<Element> elements;
    for (const Actuator& actuator : model_.actuators) {
      add(elements,
          {.element = fmt::format("actuator '{}'", actuator.name),
           .stiffness = std::max(0.0, -actuator.bias[1]),
           .damping = std::max(0.0, -actuator.bias[2])},
          column_of(actuator.terms));
    }
    return elements;
  }

 private:
  static void add(std::vector<Element>& elements, ExplicitSpring spring, MatrixXd directions) {
    if (spring.stiffness > 0 || spring.damping > 0) elements.push_back({std::move(spring), std::move(directions)});
  }

  MatrixXd unit_columns(int first, int count) const {
    MatrixXd columns = MatrixXd::Zero(dynamics_.size(), count);
    columns.middleRows(first, count).setIdentity();
    return columns;
  }

  VectorXd column_of(const std::vector<JointTerm>& terms) const {
    VectorXd column = VectorXd::Zero(dynamics_.size());
    for (const JointTerm& term : terms) {
      column[dynamics_.first_of(model_.joints[term.joint].body)] += term.coefficient;
    }
    return column;
  }

  // Of one joint that others do not have to follow: with a force along `directions`, which may be scaled by a gear.
  double held_inertia(const MatrixXd& directions) const {
    if (directions.cols() != 1 || (directions.array() != 0).count() != 1) return 0;
    Eigen::Index row = 0;
    const double gear = directions.col(0).cwiseAbs().maxCoeff(&row);
    return coupled_[static_cast<size_t>(row)] ? 0 : inertia_(row, row) / (gear * gear);
  }

  void find_coupled() {
    coupled_.assign(static_cast<size_t>(dynamics_.size()), false);
    const auto mark = [&](int joint) {
      coupled_[static_cast<size_t>(dynamics_.first_of(model_.joints[joint].body))] = true;
    };
    for (const Coupling& coupling : model_.couplings) {
      mark(coupling.joint);
      for (const JointTerm& term : coupling.terms) mark(term.joint);
    }
  }

  // A basis of the velocities that couplings allow.
  MatrixXd free_directions() const {
    const int n = dynamics_.size();
    if (model_.couplings.empty()) return MatrixXd::Identity(n, n);
    MatrixXd constraints(model_.couplings.size(), n);
    for (size_t c = 0; c < model_.couplings.size(); ++c) {
      const Coupling& coupling = model_.couplings[c];
      constraints.row(static_cast<Eigen::Index>(c)) =
          column_of({{.joint = coupling.joint, .coefficient = -1}}) + column_of(coupling.terms);
    }
    return Eigen::FullPivLU<MatrixXd>(constraints).kernel();
  }

  // Where 4 - 2 h D - h^2 K stops being positive definite.
  static double critical_step(const MatrixXd& K, const MatrixXd& D, double decay, double omega2) {
    double stable = largest_step(decay, omega2);
    double unstable = std::min(largest_step(decay, 0), largest_step(0, omega2));
    if (!std::isfinite(unstable)) return kInfinite;
    const MatrixXd four = 4 * MatrixXd::Identity(K.rows(), K.cols());
    constexpr double kRelative = 1e-9;
    while (unstable - stable > kRelative * unstable) {
      const double h = (stable + unstable) / 2;
      const bool holds = Eigen::LLT<MatrixXd>(four - 2 * h * D - h * h * K).info() == Eigen::Success;
      (holds ? stable : unstable) = h;
    }
    return stable;
  }

  // Which springs and dampers make the critical mode.
  static void share(std::vector<Element>& elements, const std::vector<MatrixXd>& seen, const MatrixXd& K,
                    const MatrixXd& D, double h) {
    if (!std::isfinite(h)) return;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(2 * h * D + h * h * K);
    const VectorXd mode = solver.eigenvectors().col(solver.eigenvectors().cols() - 1);
    double sum = 0;
    for (size_t e = 0; e < elements.size(); ++e) {
      ExplicitSpring& spring = elements[e].spring;
      spring.share = (2 * h * spring.damping + h * h * spring.stiffness) * (seen[e].transpose() * mode).squaredNorm();
      sum += spring.share;
    }
    for (Element& element : elements) element.spring.share /= sum;
  }

  const Model& model_;
  Dynamics dynamics_;
  MatrixXd inertia_, basis_, whitened_;
  std::vector<bool> coupled_;  // by generalized velocity
  bool singular_ = false;
};

}  // namespace

double ExplicitSpring::damper_step() const { return largest_step(damping / inertia, 0); }
double ExplicitSpring::spring_step() const { return largest_step(0, stiffness / inertia); }
double ExplicitSpring::step() const { return largest_step(damping / inertia, stiffness / inertia); }

const ExplicitSpring* StepBound::critical() const {
  const auto found = std::ranges::max_element(springs, {}, &ExplicitSpring::share);
  return found == springs.end() ? nullptr : &*found;
}

double ExplicitSpring::held_damper_step() const {
  return held_inertia > 0 ? largest_step(damping / held_inertia, 0) : kInfinite;
}

namespace {

StepBounds bounds_of_island(const Model& model, const State& state) {
  StepBounds bounds;
  const Bounds of(model, state);
  bounds.singular = of.singular();
  if (bounds.singular) return bounds;
  std::vector<Element> elements = of.joint_springs();
  const std::vector<Element> feedback = of.feedback();
  bounds.has_feedback = !feedback.empty();
  bounds.joints = of.of(elements);
  elements.insert(elements.end(), feedback.begin(), feedback.end());
  bounds.with_feedback = of.of(std::move(elements));
  return bounds;
}

// The springs of two parts that do not touch: the part with the lower bound has the critical mode.
void unite(StepBound& bound, StepBound other) {
  for (ExplicitSpring& spring : (other.largest < bound.largest ? bound : other).springs) spring.share = 0;
  bound.largest = std::min(bound.largest, other.largest);
  bound.frequency = std::max(bound.frequency, other.frequency);
  bound.decay = std::max(bound.decay, other.decay);
  std::ranges::move(other.springs, std::back_inserter(bound.springs));
}

}  // namespace

StepBounds step_bounds(const Model& model, const State& state) {
  StepBounds bounds;
  for (const Model& island : islands(model, state)) {
    StepBounds own = bounds_of_island(island, island.initial);
    if (own.singular) return own;
    bounds.has_feedback = bounds.has_feedback || own.has_feedback;
    unite(bounds.joints, std::move(own.joints));
    unite(bounds.with_feedback, std::move(own.with_feedback));
  }
  for (StepBound* bound : {&bounds.joints, &bounds.with_feedback}) {
    std::ranges::stable_sort(bound->springs, {}, &ExplicitSpring::step);
  }
  return bounds;
}

}  // namespace assay
