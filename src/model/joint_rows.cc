#include "model/joint_rows.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

#include "model/joint_inertia.h"
#include "model/kinematics.h"

namespace assay {
namespace {

constexpr double kSpeed = 0.8;      // part of the row's speed that a step takes
constexpr double kPosition = 0.25;  // part of its error that a step takes, times kSpeed
constexpr double kTurnKept = 0.2;   // rad, that a range has to leave of a turn
constexpr double kMoved = 0.1;      // rad, or of the model's size: after that the inertia is computed again

struct Push {
  Eigen::Index row = 0;
  int sign = 0;  // of the force; 0 for any
  double change = 0;
};

}  // namespace

bool is_wide(const Joint& joint) {
  return joint.limited && !joint.is_slide() && joint.upper - joint.lower > 2 * std::numbers::pi - kTurnKept;
}

Model without_wide_ranges(Model model) {
  for (Joint& joint : model.joints) {
    if (is_wide(joint)) joint.limited = false;
  }
  return model;
}

bool has_joint_rows(const Model& model) {
  return !model.couplings.empty() || std::ranges::any_of(model.tendons, &Tendon::limited) ||
         std::ranges::any_of(model.joints, is_wide);
}

JointRows::JointRows(const Model& model, double timestep, Parts parts) : timestep_(timestep) {
  if (parts.couplings) {
    for (const Coupling& coupling : model.couplings) {
      Row row{.terms = {{coupling.joint, 1}}, .lower = coupling.offset, .upper = coupling.offset};
      for (const JointTerm& term : coupling.terms) row.terms.push_back({term.joint, -term.coefficient});
      rows_.push_back(std::move(row));
    }
  }
  if (parts.tendon_limits) {
    for (const Tendon& tendon : model.tendons) {
      if (tendon.limited) rows_.push_back({tendon.terms, tendon.lower, tendon.upper});
    }
  }
  if (parts.wide_ranges) {
    for (size_t j = 0; j < model.joints.size(); ++j) {
      const Joint& joint = model.joints[j];
      if (is_wide(joint)) rows_.push_back({{{static_cast<int>(j), 1}}, joint.lower, joint.upper});
    }
  }
  if (rows_.empty()) return;
  for (const Body& body : model.bodies) size_ += body.X_PB.p.norm();
}

bool JointRows::is_far_from_last(const Model& model, const State& state) const {
  if (position_.empty()) return true;
  for (size_t j = 0; j < position_.size(); ++j) {
    const double way = std::abs(state.position[j] - position_[j]);
    if (way > (model.joints[j].is_slide() ? kMoved * size_ : kMoved)) return true;
  }
  for (size_t b = 0; b < rotations_.size(); ++b) {
    if (rotations_[b].angularDistance(ball_rotation(model, state, static_cast<int>(b))) > kMoved) return true;
  }
  return false;
}

void JointRows::refresh(const Model& model, const State& state) {
  if (!is_far_from_last(model, state)) return;
  position_ = state.position;
  rotations_.clear();
  rotations_.reserve(model.balls.size());
  for (size_t b = 0; b < model.balls.size(); ++b) {
    rotations_.push_back(ball_rotation(model, state, static_cast<int>(b)));
  }
  Eigen::MatrixXd terms =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(model.joints.size()), static_cast<Eigen::Index>(rows_.size()));
  for (size_t r = 0; r < rows_.size(); ++r) {
    for (const JointTerm& term : rows_[r].terms) terms(term.joint, static_cast<Eigen::Index>(r)) += term.coefficient;
  }
  inverse_ = terms.transpose() * Eigen::LDLT<Eigen::MatrixXd>(joint_inertia(model, state)).solve(terms);
  inverse_.diagonal() *= 1 + 1e-9;  // rows may say the same twice
}

void JointRows::add(const Model& model, const State& state, std::vector<double>& torques) {
  std::vector<Push> pushes;
  for (size_t r = 0; r < rows_.size(); ++r) {
    const Row& row = rows_[r];
    const double length = sum_of_terms(row.terms, state.position), speed = sum_of_terms(row.terms, state.velocity);
    const auto index = static_cast<Eigen::Index>(r);
    // the speed at which the row may arrive at its bound, or has to come back to it
    const auto towards = [&](double bound) { return (bound - length) / timestep_; };
    if (row.lower == row.upper) {
      pushes.push_back({index, 0, kPosition * towards(row.lower) - speed});
      continue;
    }
    const double up = towards(row.upper), down = towards(row.lower);
    const double fastest = up < 0 ? kPosition * up : up, slowest = down > 0 ? kPosition * down : down;
    if (speed > fastest) pushes.push_back({index, -1, fastest - speed});
    if (speed < slowest) pushes.push_back({index, 1, slowest - speed});
  }
  if (pushes.empty()) return;
  refresh(model, state);
  // limits that would pull are left out, one round after the other
  Eigen::VectorXd forces;
  for (bool pulls = true; pulls && !pushes.empty();) {
    const auto count = static_cast<Eigen::Index>(pushes.size());
    Eigen::MatrixXd inverse(count, count);
    Eigen::VectorXd change(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      change[i] = kSpeed / timestep_ * pushes[static_cast<size_t>(i)].change;
      for (Eigen::Index k = 0; k < count; ++k) {
        inverse(i, k) = inverse_(pushes[static_cast<size_t>(i)].row, pushes[static_cast<size_t>(k)].row);
      }
    }
    forces = Eigen::LDLT<Eigen::MatrixXd>(inverse).solve(change);
    std::vector<Push> kept;
    for (Eigen::Index i = 0; i < count; ++i) {
      const Push& push = pushes[static_cast<size_t>(i)];
      if (push.sign * forces[i] >= 0) kept.push_back(push);
    }
    pulls = kept.size() < pushes.size();
    pushes = std::move(kept);
  }
  for (size_t i = 0; i < pushes.size(); ++i) {
    for (const JointTerm& term : rows_[static_cast<size_t>(pushes[i].row)].terms) {
      torques[static_cast<size_t>(term.joint)] += term.coefficient * forces[static_cast<Eigen::Index>(i)];
    }
  }
}

}  // namespace assay
