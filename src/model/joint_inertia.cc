#include "model/joint_inertia.h"

#include <vector>

#include <Eigen/Cholesky>

#include "model/kinematics.h"

namespace assay {
namespace {

// The state at rest, to which single rates are given in turn.
State at_rest(const Model& model, State state) {
  state.velocity.assign(model.joints.size(), 0.0);
  for (BodyState& body : state.bodies) body.v_WBcm = body.w_WB = Vec3::Zero();
  bodies_from_joints(model, state);
  return state;
}

}  // namespace

Eigen::MatrixXd joint_inertia(const Model& model, const State& state) {
  const State rest = at_rest(model, state);
  const auto bodies = static_cast<Eigen::Index>(model.bodies.size());
  const auto joints = static_cast<Eigen::Index>(model.joints.size());
  // Momenta in units in which the kinetic energy is half of their square: 6 rows a body, a column for each rate, first
  // the joints', then those of free bodies and ball joints.
  std::vector<Eigen::VectorXd> columns;
  std::vector<Mat3> root_inertia;
  root_inertia.reserve(model.bodies.size());
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    const Mat3 R = rest.bodies[b].q_WB.toRotationMatrix();
    const Eigen::LDLT<Mat3> factors(R * model.bodies[b].I_BBcm_B * R.transpose());
    const Mat3 lower = factors.matrixL();
    root_inertia.emplace_back(factors.vectorD().cwiseMax(0).cwiseSqrt().asDiagonal() * lower.transpose() *
                              Mat3(factors.transpositionsP() * Mat3::Identity()));
  }
  const auto add = [&](State moving) {
    bodies_from_joints(model, moving);
    Eigen::VectorXd& column = columns.emplace_back(6 * bodies);
    for (Eigen::Index b = 0; b < bodies; ++b) {
      const BodyState& body = moving.bodies[static_cast<size_t>(b)];
      column.segment<3>(6 * b) = std::sqrt(model.bodies[static_cast<size_t>(b)].mass) * body.v_WBcm;
      column.segment<3>(6 * b + 3) = root_inertia[static_cast<size_t>(b)] * body.w_WB;
    }
  };
  for (size_t j = 0; j < model.joints.size(); ++j) {
    State moving = rest;
    moving.velocity[j] = 1;
    add(std::move(moving));
  }
  std::vector<double> armature;  // of the rates after the joints'
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    const Body& body = model.bodies[b];
    for (int axis = 0; axis < 3 && (body.is_free() || body.ball >= 0); ++axis) {
      State moving = rest;
      moving.bodies[b].w_WB[axis] = 1;
      add(std::move(moving));
      armature.push_back(body.ball >= 0 ? model.balls[static_cast<size_t>(body.ball)].armature : 0);
    }
    for (int axis = 0; axis < 3 && body.is_free(); ++axis) {
      State moving = rest;
      moving.bodies[b].v_WBcm[axis] = 1;
      add(std::move(moving));
      armature.push_back(0);
    }
  }
  Eigen::MatrixXd all(6 * bodies, static_cast<Eigen::Index>(columns.size()));
  for (size_t c = 0; c < columns.size(); ++c) all.col(static_cast<Eigen::Index>(c)) = columns[c];
  Eigen::MatrixXd inertia = all.transpose() * all;
  for (Eigen::Index j = 0; j < joints; ++j) inertia(j, j) += model.joints[static_cast<size_t>(j)].armature;
  const Eigen::Index others = inertia.rows() - joints;
  for (Eigen::Index i = 0; i < others; ++i) inertia(joints + i, joints + i) += armature[static_cast<size_t>(i)];
  if (others == 0) return inertia;
  const Eigen::MatrixXd coupling = inertia.bottomLeftCorner(others, joints);
  const Eigen::LDLT<Eigen::MatrixXd> following(inertia.bottomRightCorner(others, others));
  return inertia.topLeftCorner(joints, joints) - coupling.transpose() * following.solve(coupling);
}

}  // namespace assay
