#include "world.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"
#include "convert.h"
#include "model/actuator_force.h"

namespace assay::mujoco {
namespace {

using Matrix3Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// MuJoCo goes on after any of these; each means that the result is no longer a valid state of the model.
constexpr std::array kFailures = {std::pair{mjWARN_BADQACC, "an acceleration is not a number or above 1e10"},
                                  std::pair{mjWARN_BADQVEL, "a velocity is not a number or above 1e10"},
                                  std::pair{mjWARN_BADQPOS, "a position is not a number or above 1e10"},
                                  std::pair{mjWARN_INERTIA, "the inertia matrix is singular"},
                                  std::pair{mjWARN_CONTACTFULL, "too many contacts for its memory"},
                                  std::pair{mjWARN_CNSTRFULL, "too many constraints for its memory"}};

}  // namespace

MujocoSimulation::MujocoSimulation(std::shared_ptr<const Compiled> compiled, const State& state, double timestep)
    : compiled_(std::move(compiled)),
      model_(mj_copyModel(nullptr, compiled_->mujoco.get())),
      clock_{state.time, timestep} {
  model_->opt.timestep = timestep;
  data_.reset(mj_makeData(model_.get()));
  if (data_ == nullptr) throw EngineError("MuJoCo: no memory for the simulation's data");
  set_state(state);
  for (size_t i = 0; i < compiled_->actuator_control.size(); ++i) {
    controls_follow_time_ = controls_follow_time_ || follows_time(compiled_->model.actuators[i]);
  }
  set_controls(clock_.time() + timestep / 2);
}

void MujocoSimulation::set_torques(std::span<const double> torques) {
  const std::vector<int>& dof = compiled_->joint_dof;
  mjtNum* applied = data_->qfrc_applied;
  for (size_t j = 0; j < torques.size(); ++j) applied[dof[j]] = torques[j];
  if (compiled_->explicit_springs) add_springs(torques);
  if (controls_follow_time_) set_controls(clock_.time() + clock_.timestep / 2);
  torques_set_ = torques_fresh_ = true;
}

void MujocoSimulation::advance(int count) {
  if (count <= 0) return;
  if (torques_set_ && !torques_fresh_) clear_torques();
  torques_fresh_ = false;
  mj_step(model_.get(), data_.get());
  if (count > 1) {
    if (torques_set_) clear_torques();
    for (int i = 1; i < count; ++i) mj_step(model_.get(), data_.get());
  }
  clock_.steps += count;
  check_warnings();
}

void MujocoSimulation::read_state(State& out) const {
  const Model& model = compiled_->model;
  out.time = clock_.time();
  out.bodies.resize(model.bodies.size());
  out.position.resize(model.joints.size());
  out.velocity.resize(model.joints.size());
  for (size_t j = 0; j < model.joints.size(); ++j) {
    out.position[j] = data_->qpos[compiled_->joint_qpos[j]];
    out.velocity[j] = data_->qvel[compiled_->joint_dof[j]];
  }
  // a free joint's coordinates: origin and rotation of the body frame; its velocity: the origin's in the world, the
  // angular one in the body
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    if (!body.is_free()) continue;
    const mjtNum* qpos = data_->qpos + compiled_->body_qpos[i];
    const mjtNum* qvel = data_->qvel + compiled_->body_dof[i];
    BodyState& s = out.bodies[i];
    s.q_WB = Quat(qpos[3], qpos[4], qpos[5], qpos[6]);
    s.w_WB = s.q_WB * Vec3(qvel[3], qvel[4], qvel[5]);
    const Vec3 p_BoBcm_W = s.q_WB * body.p_BBcm;
    s.p_WBcm = Vec3(qpos[0], qpos[1], qpos[2]) + p_BoBcm_W;
    s.v_WBcm = Vec3(qvel[0], qvel[1], qvel[2]) + s.w_WB.cross(p_BoBcm_W);
  }
  balls_.resize(model.balls.size());
  for (size_t b = 0; b < balls_.size(); ++b) balls_[b] = ball_motion(compiled_->balls[b]);
  bodies_from_joints(model, balls_, out);
}

EngineView MujocoSimulation::view() const {
  // poses in mjData belong to the start of the last step: compute those of now without touching the run
  const mjModel& m = *model_;
  const DataPtr now(mj_makeData(&m));
  std::copy_n(data_->qpos, m.nq, now->qpos);
  mj_kinematics(&m, now.get());

  EngineView view;
  view.gravity = Eigen::Map<const Vec3>(m.opt.gravity);
  view.bodies.reserve(compiled_->body_id.size());
  for (const int id : compiled_->body_id) {
    if (id < 0) {
      view.bodies.push_back({.mass = 0});
      continue;
    }
    const Mat3 R_WI = Eigen::Map<const Matrix3Rows>(now->ximat + ptrdiff_t{9} * id);
    view.bodies.push_back({.mass = m.body_mass[id],
                           .p_WBcm = triple(now->xipos, id),
                           .I_BBcm_W = R_WI * triple(m.body_inertia, id).asDiagonal() * R_WI.transpose()});
  }
  view.joints.reserve(compiled_->joint_id.size());
  for (const int id : compiled_->joint_id) {
    const int qpos = m.jnt_qposadr[id];
    const double way = m.jnt_type[id] == mjJNT_SLIDE ? now->qpos[qpos] - m.qpos0[qpos] : 0;
    const Vec3 axis_W = triple(now->xaxis, id);
    view.joints.push_back({.p_WJ = triple(now->xanchor, id) + way * axis_W,
                           .axis_W = axis_W,
                           .limited = m.jnt_limited[id] != 0,
                           .lower = m.jnt_range[ptrdiff_t{2} * id],
                           .upper = m.jnt_range[ptrdiff_t{2} * id + 1]});
  }
  return view;
}

// After a step of one stage MuJoCo's contacts and their forces are those of the state in which it began.
bool MujocoSimulation::keep_contacts() {
  contacts_kept_ = model_->opt.integrator != mjINT_RK4;
  return contacts_kept_;
}

void MujocoSimulation::read_contacts(std::vector<ContactForce>& out) const {
  out.clear();
  if (!contacts_kept_ || clock_.steps == 0) return;
  for (int i = 0; i < data_->ncon; ++i) {
    const mjContact& contact = data_->contact[i];
    int first = compiled_->shape_of_geom[contact.geom[0]], second = compiled_->shape_of_geom[contact.geom[1]];
    if (contact.efc_address < 0 || first < 0 || second < 0) continue;
    std::array<mjtNum, 6> force{};  // in the contact's frame, on the second geom; its first axis is the normal
    mj_contactForce(model_.get(), data_.get(), i, force.data());
    const Mat3 axes_W = Eigen::Map<const Matrix3Rows>(contact.frame).transpose();
    ContactForce& found = out.emplace_back();
    found.p_W = Eigen::Map<const Vec3>(contact.pos);
    found.gap = contact.dist;
    const double sign = first < second ? 1 : -1;
    found.shape_a = std::min(first, second);
    found.shape_b = std::max(first, second);
    found.n_W = sign * axes_W.col(0);
    found.impulse_W = sign * clock_.timestep * (axes_W * Vec3(force[0], force[1], force[2]));
  }
}

void MujocoSimulation::set_state(const State& state) {
  const Model& model = compiled_->model;
  const State given = with_joint_coordinates(model, state);
  for (size_t j = 0; j < model.joints.size(); ++j) {
    data_->qpos[compiled_->joint_qpos[j]] = given.position[j];
    data_->qvel[compiled_->joint_dof[j]] = given.velocity[j];
  }
  for (size_t b = 0; b < model.balls.size(); ++b) {
    const BallAddress& address = compiled_->balls[b];
    const Quat rotation = ball_rotation(model, given, static_cast<int>(b));
    copy_quat(address.q_BC.conjugate() * rotation * address.q_BC, data_->qpos + address.qpos);
    Eigen::Map<Vec3>(data_->qvel + address.dof) =
        address.q_BC.conjugate() * ball_velocity(model, given, static_cast<int>(b));
  }
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    if (!body.is_free()) continue;
    const BodyState& s = given.bodies[i];
    const Vec3 p_BoBcm_W = s.q_WB * body.p_BBcm;
    mjtNum* qpos = data_->qpos + compiled_->body_qpos[i];
    mjtNum* qvel = data_->qvel + compiled_->body_dof[i];
    Eigen::Map<Vec3>(qpos + 0) = s.p_WBcm - p_BoBcm_W;
    copy_quat(s.q_WB, qpos + 3);
    Eigen::Map<Vec3>(qvel + 0) = s.v_WBcm - s.w_WB.cross(p_BoBcm_W);
    Eigen::Map<Vec3>(qvel + 3) = s.q_WB.conjugate() * s.w_WB;
  }
  data_->time = state.time;
}

BallCoordinates MujocoSimulation::ball_motion(const BallAddress& address) const {
  const mjtNum* q = data_->qpos + address.qpos;
  const Quat q_MC(q[0], q[1], q[2], q[3]);  // MuJoCo normalises it where it reads it
  return {(address.q_BC * q_MC * address.q_BC.conjugate()).normalized(),
          address.q_BC * triple(data_->qvel + address.dof, 0)};
}

void MujocoSimulation::add_springs(std::span<const double> torques) {
  const Model& model = compiled_->model;
  const std::vector<Joint>& joints = model.joints;
  for (size_t j = 0; j < joints.size(); ++j) {
    const int dof = compiled_->joint_dof[j];
    const double position = data_->qpos[compiled_->joint_qpos[j]];
    data_->qfrc_applied[dof] =
        (j < torques.size() ? torques[j] : 0.0) + spring_torque(joints[j], position, data_->qvel[dof]);
  }
  for (size_t b = 0; b < model.balls.size(); ++b) {
    const BallAddress& address = compiled_->balls[b];
    const BallCoordinates motion = ball_motion(address);
    Eigen::Map<Vec3>(data_->qfrc_applied + address.dof) =
        address.q_BC.conjugate() * ball_spring_torque(model.balls[b], motion.rotation, motion.velocity);
  }
  for (const Tendon& tendon : model.tendons) {
    if (!tendon.has_spring()) continue;
    double length = 0, speed = 0;
    for (const JointTerm& term : tendon.terms) {
      length += term.coefficient * data_->qpos[compiled_->joint_qpos[term.joint]];
      speed += term.coefficient * data_->qvel[compiled_->joint_dof[term.joint]];
    }
    const double tension = tendon_tension(tendon, length, speed);
    for (const JointTerm& term : tendon.terms) {
      data_->qfrc_applied[compiled_->joint_dof[term.joint]] += term.coefficient * tension;
    }
  }
}

// Controls and activations of the middle of the step, which they are held for.
void MujocoSimulation::set_controls(double time) {
  const Model& model = compiled_->model;
  for (size_t i = 0; i < compiled_->actuator_control.size(); ++i) {
    const double control = i < model.control0.size() ? model.control0[i] : 0;
    data_->ctrl[compiled_->actuator_control[i]] = actuator_input(model.actuators[i], control, time);
  }
}

void MujocoSimulation::clear_torques() {
  std::fill_n(data_->qfrc_applied, model_->nv, 0.0);
  torques_set_ = false;
}

void MujocoSimulation::check_warnings() const {
  int count = 0;
  for (const auto& failure : kFailures) count |= data_->warning[failure.first].number;
  if (count != 0) throw_failure();  // apart, for this is inside what the clock measures
}

void MujocoSimulation::throw_failure() const {
  const auto failure = std::ranges::find_if(
      kFailures, [&](mjtWarning warning) { return data_->warning[warning].number > 0; },
      &std::pair<mjtWarning, const char*>::first);
  throw EngineError(fmt::format("MuJoCo: {} (noticed at {} s)", failure->second, shortest(clock_.time())));
}

}  // namespace assay::mujoco
