#include "world.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace assay::jolt {
namespace {

Vec3 vec3(const double* v) { return {v[0], v[1], v[2]}; }
Quat quat(const double* q) { return {q[0], q[1], q[2], q[3]}; }

}  // namespace

JoltSimulation::JoltSimulation(const Model& model, const State& state, const Options& options)
    : rows_(model, options.world.timestep, {}),
      lent_(lend_mass(without_wide_ranges(model), options.lent_share)),
      model_(lent_.model),
      options_(options),
      clock_{state.time, options.world.timestep},
      frames_(body_frames(model_)),
      joint_springs_(model.has_springs() && !options.native_springs),
      springs_(joint_springs_ || std::ranges::any_of(model.tendons, &Tendon::has_spring) ||
               std::ranges::any_of(model.balls, &BallJoint::has_spring) || rows_.any()),
      world_(make_world(model_, lent_.of_copy(state), frames_, options)),
      torques_(model.joints.size(), 0.0),
      bodies_(model.bodies.size()),
      last_(lent_.of_copy(with_joint_coordinates(model, state))) {
  lent_.model.keyframes.clear();
}

void JoltSimulation::set_torques(std::span<const double> torques) {
  if (springs_) read();
  collect_torques(model_, torques, joint_springs_ ? &last_ : nullptr, torques_);
  if (springs_) {
    add_tendon_tensions(model_, last_, torques_);
    rows_.add(model_, last_, torques_);
  }
  torques_.resize(model_.joints.size() + (3 * (model_.balls.size() + model_.connects.size())), 0.0);
  if (springs_) add_ball_springs();
  jolt_set_torques(world_.get(), torques_.data());
}

void JoltSimulation::add_ball_springs() {
  for (size_t b = 0; b < model_.balls.size(); ++b) {
    const BallJoint& ball = model_.balls[b];
    if (!ball.has_spring()) continue;
    const int index = static_cast<int>(b);
    const Vec3 torque = last_.bodies[ball.body].q_WB * ball_spring_torque(ball, ball_rotation(model_, last_, index),
                                                                          ball_velocity(model_, last_, index));
    std::copy_n(torque.data(), 3, torques_.data() + model_.joints.size() + (3 * b));
  }
}

void JoltSimulation::advance(int count) {
  const int32_t error = jolt_step(world_.get(), count);
  clock_.steps += count;
  if (error == 0) return;
  if (error < 0) throw EngineError("Jolt trapped: out of memory or of bounds");
  throw EngineError(fmt::format("Jolt ran out of room for contacts (EPhysicsUpdateError {})", error));
}

void JoltSimulation::read_state(State& out) const {
  read();
  out = last_;
  lent_.to_original(out);
}

EngineView JoltSimulation::view() const {
  EngineView out;
  std::vector<jolt_body_view> bodies(model_.bodies.size());
  std::vector<jolt_joint_view> hinges(model_.joints.size());
  jolt_view(world_.get(), bodies.data(), hinges.data(), out.gravity.data());
  jolt_read(world_.get(), bodies_.data());
  for (size_t b = 0; b < bodies.size(); ++b) {
    out.bodies.push_back(
        {.mass = bodies[b].mass, .p_WBcm = vec3(bodies_[b].p), .I_BBcm_W = Eigen::Map<const Mat3>(bodies[b].inertia)});
  }
  for (size_t j = 0; j < hinges.size(); ++j) {
    const jolt_body_state& child = bodies_[model_.joints[j].body];
    EngineJoint hinge{.p_WJ = vec3(child.p) + quat(child.q) * vec3(hinges[j].p_child),
                      .axis_W = quat(child.q) * vec3(hinges[j].axis_child),
                      .limited = hinges[j].limited != 0};
    if (hinge.limited) {
      const double zero = zero_angle(model_.joints[j], options_.native_springs);
      hinge.lower = zero + hinges[j].lower;
      hinge.upper = zero + hinges[j].upper;
    }
    out.joints.push_back(hinge);
  }
  return_lent_mass(lent_, out);
  return out;
}

bool JoltSimulation::keep_contacts() {
  if (options_.world.collision_steps > 1) return false;  // only the last of them would be there
  jolt_keep_contacts(world_.get());
  return contacts_kept_ = true;
}

void JoltSimulation::read_contacts(std::vector<ContactForce>& out) const {
  out.clear();
  if (!contacts_kept_ || clock_.steps == 0) return;
  int32_t count = jolt_contacts(world_.get(), contacts_.data(), static_cast<int32_t>(contacts_.size()));
  if (std::cmp_greater(count, contacts_.size())) {
    contacts_.resize(2 * static_cast<size_t>(count));
    count = jolt_contacts(world_.get(), contacts_.data(), static_cast<int32_t>(contacts_.size()));
  }
  if (count < 0) throw EngineError("Jolt trapped: out of memory or of bounds");
  for (int32_t i = 0; i < count; ++i) {
    const jolt_contact& found = contacts_[static_cast<size_t>(i)];
    const double sign = found.shape_a < found.shape_b ? 1 : -1;
    out.push_back({.shape_a = std::min(found.shape_a, found.shape_b),
                   .shape_b = std::max(found.shape_a, found.shape_b),
                   .p_W = vec3(found.p),
                   .n_W = sign * vec3(found.normal),
                   .gap = found.gap,
                   .impulse_W = sign * vec3(found.impulse)});
  }
}

void JoltSimulation::read() const {
  last_.time = clock_.time();
  jolt_read(world_.get(), bodies_.data());
  for (size_t b = 0; b < bodies_.size(); ++b) {
    const jolt_body_state& body = bodies_[b];
    last_.bodies[b] = {.p_WBcm = vec3(body.p),
                       .q_WB = (quat(body.q) * frames_[b].q.conjugate()).normalized(),
                       .v_WBcm = vec3(body.v),
                       .w_WB = vec3(body.w)};
  }
  joints_from_bodies(model_, last_);
}

}  // namespace assay::jolt
