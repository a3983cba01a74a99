#include "world.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "convert.h"

namespace assay::ode {
namespace {

// A hinge whose spring and damper are its stops: both at the rest angle, soft by ERP and CFM.
bool is_spring_stop(const Joint& hinge, const Options& options) { return options.native_springs && hinge.has_spring(); }

// The hinge angle at which ODE's own angle is zero. ODE wraps its angle at +-pi, so limited hinges count from the
// middle of their range: every range below a full turn then works, wherever it lies. Springs count from their rest.
double zero_angle(const Joint& hinge, const Options& options) {
  return middle_of_range(hinge, is_spring_stop(hinge, options) ? hinge.spring_reference : hinge.reference);
}

void set_joint_param(dxJoint* joint, int parameter, double value) {
  if (dJointGetType(joint) == dJointTypeSlider) {
    dJointSetSliderParam(joint, parameter, value);
  } else {
    dJointSetHingeParam(joint, parameter, value);
  }
}

double get_param(dxJoint* joint, int parameter) {
  return dJointGetType(joint) == dJointTypeSlider ? dJointGetSliderParam(joint, parameter)
                                                  : dJointGetHingeParam(joint, parameter);
}

}  // namespace

OdeSimulation::OdeSimulation(Model model, const State& state, const Options& options)
    : options_(options),
      clock_{state.time, options.timestep},
      rows_(model, options.timestep, {}),
      lent_(lend_mass(without_wide_ranges(std::move(model)), options.lent_share)),
      model_(lent_.model),
      world_(dWorldCreate(), {&failed_}),
      collision_(world_.get(), &failed_) {
  lent_.model.keyframes.clear();
  set_up_world();
  create_bodies();
  create_joints();
  if (!model_.contacts.empty()) collision_.create_shapes(model_, bodies_, options_);
  State start = state;
  lent_.to_copy(start);
  set_state(start);
  has_explicit_springs_ = (model_.has_springs() && !options_.native_springs) ||
                          std::ranges::any_of(model_.balls, &BallJoint::has_spring) ||
                          std::ranges::any_of(model_.tendons, &Tendon::has_spring) || rows_.any();
  last_angle_ = state.position;
  // the number of this step counted from time zero, so that a run continued in the middle draws the same seeds
  first_step_ = std::llround(state.time / options_.timestep);
}

void OdeSimulation::set_up_world() {
  dxWorld* world = world_.get();
  dWorldSetGravity(world, model_.gravity.x(), model_.gravity.y(), model_.gravity.z());
  dWorldSetERP(world, options_.erp);
  dWorldSetCFM(world, options_.cfm);
  dWorldSetQuickStepNumIterations(world, options_.iterations);
  dWorldSetQuickStepW(world, options_.over_relaxation);
  const double max_velocity = options_.max_correcting_velocity;
  dWorldSetContactMaxCorrectingVel(world, max_velocity > 0 ? max_velocity : dInfinity);
  dWorldSetContactSurfaceLayer(world, options_.surface_layer);
  dWorldSetAutoDisableFlag(world, 0);
  dWorldSetDamping(world, 0, 0);
  dWorldSetMaxAngularSpeed(world, dInfinity);
  dWorldSetStepIslandsProcessingMaxThreadCount(world, 1);
}

// ODE's body frame: origin in the centre of mass, axes of the MJCF frame, so the full inertia tensor goes in as it
// is.
void OdeSimulation::create_bodies() {
  bodies_.reserve(model_.bodies.size());
  for (const Body& body : model_.bodies) {
    const Mat3& I = body.I_BBcm_B;
    dMass mass;
    dMassSetParameters(&mass, body.mass, 0, 0, 0, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
    dxBody* created = dBodyCreate(world_.get());
    dBodySetMass(created, &mass);
    dBodySetFiniteRotationMode(created, options_.finite_rotation ? 1 : 0);
    dBodySetGyroscopicMode(created, options_.gyroscopic ? 1 : 0);
    bodies_.push_back(created);
  }
}

// Attaching stores relative frames, so all joints are made in the configuration where ODE's angles are zero.
void OdeSimulation::create_joints() {
  State zero = reference_state(model_);
  for (size_t j = 0; j < model_.joints.size(); ++j) zero.position[j] = zero_angle(model_.joints[j], options_);
  bodies_from_joints(model_, zero);
  set_state(zero);

  joints_.reserve(model_.joints.size());
  for (size_t j = 0; j < model_.joints.size(); ++j) {
    const int index = static_cast<int>(j);
    joints_.push_back(model_.joints[j].is_slide() ? create_slider(zero, index) : create_hinge(zero, index));
  }
  create_balls(zero);
  drives_.create(world_.get(), model_, bodies_, joints_, options_);
  create_connects(zero);
  create_welds();
}

dxJoint* OdeSimulation::create_hinge(const State& zero, int index) {
  const Joint& hinge = model_.joints[index];
  const JointFrames frames = joint_frames(model_, zero, index);
  const Vec3& p = frames.p_WJ_child;
  const Vec3& axis = frames.axis_W_child;
  dxJoint* joint = dJointCreateHinge(world_.get(), nullptr);
  dJointAttach(joint, bodies_[hinge.body], ode_body(model_.bodies[hinge.body].parent));  // child first: angle grows
  dJointSetHingeAnchor(joint, p.x(), p.y(), p.z());                                      // with its rotation
  dJointSetHingeAxis(joint, axis.x(), axis.y(), axis.z());
  set_stops(joint, hinge);
  return joint;
}

dxJoint* OdeSimulation::create_slider(const State& zero, int index) {
  const Joint& slide = model_.joints[index];
  const Vec3 axis = joint_frames(model_, zero, index).axis_W_child;
  dxJoint* joint = dJointCreateSlider(world_.get(), nullptr);
  dJointAttach(joint, bodies_[slide.body], ode_body(model_.bodies[slide.body].parent));
  dJointSetSliderAxis(joint, axis.x(), axis.y(), axis.z());
  set_stops(joint, slide);
  return joint;
}

void OdeSimulation::create_balls(const State& zero) {
  for (const BallJoint& ball : model_.balls) {
    const Body& body = model_.bodies[ball.body];
    const Vec3 p = body_pose(body, zero.bodies[ball.body]) * ball.p_BJ;
    dxJoint* joint = dJointCreateBall(world_.get(), nullptr);
    dJointAttach(joint, bodies_[ball.body], ode_body(body.parent));
    dJointSetBallAnchor(joint, p.x(), p.y(), p.z());
  }
}

void OdeSimulation::create_connects(const State& zero) {
  for (const Connect& connect : model_.connects) {
    const bool swapped = connect.body_a == kWorld;
    const int first = swapped ? connect.body_b : connect.body_a, second = swapped ? connect.body_a : connect.body_b;
    const Vec3 p1 = body_pose(model_.bodies[first], zero.bodies[first]) * (swapped ? connect.p_B : connect.p_A);
    // ODE takes the second anchor in the second body's own frame
    Vec3 p2 = swapped ? connect.p_A : connect.p_B;
    if (second != kWorld) p2 -= model_.bodies[second].p_BBcm;
    dxJoint* joint = dJointCreateBall(world_.get(), nullptr);
    dJointAttach(joint, bodies_[first], ode_body(second));
    dJointSetBallAnchor(joint, p1.x(), p1.y(), p1.z());
    dJointSetBallAnchor2(joint, p2.x(), p2.y(), p2.z());
  }
}

// A fixed joint keeps the relative pose that it is made in, so the two bodies are put there first.
void OdeSimulation::create_welds() {
  for (const Weld& weld : model_.welds) {
    const bool swapped = weld.body_a == kWorld;
    const int first = swapped ? weld.body_b : weld.body_a, second = swapped ? weld.body_a : weld.body_b;
    set_pose(first, swapped ? weld.X_AB : weld.X_AB.inverse());
    if (second != kWorld) set_pose(second, {});
    dxJoint* joint = dJointCreateFixed(world_.get(), nullptr);
    dJointAttach(joint, bodies_[first], ode_body(second));
    dJointSetFixed(joint);
  }
}

void OdeSimulation::set_pose(int body, const Pose& X_WB) {
  const Vec3 p = X_WB * model_.bodies[body].p_BBcm;
  const std::array<dReal, 4> q = ode_quaternion(X_WB.q);
  dBodySetPosition(bodies_[body], p.x(), p.y(), p.z());
  dBodySetQuaternion(bodies_[body], q.data());
}

void OdeSimulation::set_stops(dxJoint* joint, const Joint& hinge) const {
  if (hinge.limited) {
    const double half_range = (hinge.upper - hinge.lower) / 2;
    set_joint_param(joint, dParamLoStop, -half_range);
    set_joint_param(joint, dParamHiStop, half_range);
    set_joint_param(joint, dParamStopERP, options_.limit_erp);
    set_joint_param(joint, dParamStopCFM, options_.limit_cfm);
    set_joint_param(joint, dParamBounce, 0);
  } else if (is_spring_stop(hinge, options_)) {
    make_spring_stop(joint, hinge);
  }
}

// Both stops at the rest angle, where ODE's angle is zero. A row v + CFM f = -(ERP / h) angle then is the torque
// f = -k (angle + h v) - b v of the angle and rate at the step's end.
void OdeSimulation::make_spring_stop(dxJoint* joint, const Joint& hinge) const {
  const double yielding = options_.timestep * hinge.stiffness + hinge.damping;
  set_joint_param(joint, dParamLoStop, 0);
  set_joint_param(joint, dParamHiStop, 0);
  set_joint_param(joint, dParamStopERP, options_.timestep * hinge.stiffness / yielding);
  set_joint_param(joint, dParamStopCFM, 1 / yielding);
  set_joint_param(joint, dParamBounce, 0);
}

void OdeSimulation::set_state(const State& state) {
  for (size_t i = 0; i < bodies_.size(); ++i) {
    const BodyState& body = state.bodies[i];
    const std::array<dReal, 4> q = ode_quaternion(body.q_WB);
    dBodySetPosition(bodies_[i], body.p_WBcm.x(), body.p_WBcm.y(), body.p_WBcm.z());
    dBodySetQuaternion(bodies_[i], q.data());
    dBodySetLinearVel(bodies_[i], body.v_WBcm.x(), body.v_WBcm.y(), body.v_WBcm.z());
    dBodySetAngularVel(bodies_[i], body.w_WB.x(), body.w_WB.y(), body.w_WB.z());
  }
}

void OdeSimulation::set_torques(std::span<const double> torques) {
  if (has_explicit_springs_) read_copy(scratch_);
  // ODE empties its accumulators after a step, but adds up what is applied between two; a second call replaces the
  // first
  if (torques_set_) {
    for (dxBody* body : bodies_) {
      dBodySetForce(body, 0, 0, 0);
      dBodySetTorque(body, 0, 0, 0);
    }
  }
  torques_set_ = true;
  const bool joint_springs = has_explicit_springs_ && !options_.native_springs;
  collect_torques(model_, torques, joint_springs ? &scratch_ : nullptr, torques_);
  if (has_explicit_springs_) {
    add_tendon_tensions(model_, scratch_, torques_);
    rows_.add(model_, scratch_, torques_);
    add_ball_springs();
  }
  for (size_t j = 0; j < joints_.size(); ++j) {
    if (torques_[j] == 0) continue;
    if (model_.joints[j].is_slide()) {
      dJointAddSliderForce(joints_[j], torques_[j]);
    } else {
      dJointAddHingeTorque(joints_[j], torques_[j]);
    }
  }
}

void OdeSimulation::add_ball_springs() {
  for (size_t b = 0; b < model_.balls.size(); ++b) {
    const BallJoint& ball = model_.balls[b];
    if (!ball.has_spring()) continue;
    const int index = static_cast<int>(b);
    const Vec3 torque =
        scratch_.bodies[ball.body].q_WB *
        ball_spring_torque(ball, ball_rotation(model_, scratch_, index), ball_velocity(model_, scratch_, index));
    dBodyAddTorque(bodies_[ball.body], torque.x(), torque.y(), torque.z());
    if (dxBody* parent = ode_body(model_.bodies[ball.body].parent)) {
      dBodyAddTorque(parent, -torque.x(), -torque.y(), -torque.z());
    }
  }
}

void OdeSimulation::advance(int count) {
  const unsigned long callers_seed = dRandGetSeed();  // one global of the library, which others may use too
  lcp_failures = 0;
  torques_set_ = false;
  try {
    for (int i = 0; i < count; ++i) {
      drives_.update();
      collision_.detect();
      int done = 0;
      if (options_.exact) {
        done = dWorldStep(world_.get(), options_.timestep);
      } else {
        dRandSetSeed(options_.seed + 0x9e3779b9U * static_cast<std::uint32_t>(first_step_ + clock_.steps));
        done = dWorldQuickStep(world_.get(), options_.timestep);
      }
      if (done == 0) throw EngineError("ODE could not allocate the memory of a step");
      collision_.clear();
      ++clock_.steps;
    }
  } catch (...) {
    failed_ = true;
    dRandSetSeed(callers_seed);
    throw;
  }
  dRandSetSeed(callers_seed);
  if (lcp_failures > 0 && !options_.ignore_lcp_failures) {
    throw EngineError(
        fmt::format("ODE's exact solver gave up on constraints {} in the {} before t = {:g} s (LCP internal error)",
                    lcp_failures == 1 ? "once" : fmt::format("{} times", lcp_failures),
                    count == 1 ? "step" : fmt::format("{} steps", count), clock_.time()));
  }
}

void OdeSimulation::read_state(State& out) const {
  read_copy(out);
  lent_.to_original(out);
}

void OdeSimulation::read_copy(State& out) const {
  out.time = clock_.time();
  out.bodies.resize(bodies_.size());
  for (size_t i = 0; i < bodies_.size(); ++i) {
    BodyState& body = out.bodies[i];
    const dReal* q = dBodyGetQuaternion(bodies_[i]);
    body.p_WBcm = vec3(dBodyGetPosition(bodies_[i]));
    body.q_WB = Quat(q[0], q[1], q[2], q[3]);
    body.v_WBcm = vec3(dBodyGetLinearVel(bodies_[i]));
    body.w_WB = vec3(dBodyGetAngularVel(bodies_[i]));
  }
  out.position = last_angle_;
  joints_from_bodies(model_, out);
  last_angle_ = out.position;
}

EngineView OdeSimulation::view() const {
  EngineView view;
  view.bodies.reserve(bodies_.size());
  for (dxBody* body : bodies_) {
    dMass mass;
    dBodyGetMass(body, &mass);
    Mat3 I_B, R_WB;
    const dReal* R = dBodyGetRotation(body);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        I_B(row, column) = mass.I[4 * row + column];
        R_WB(row, column) = R[4 * row + column];
      }
    }
    view.bodies.push_back({mass.mass, vec3(dBodyGetPosition(body)), R_WB * I_B * R_WB.transpose()});
  }
  view.joints.reserve(joints_.size());
  for (size_t j = 0; j < joints_.size(); ++j) {
    dVector3 anchor, axis;
    if (model_.joints[j].is_slide()) {
      const dReal* p = dBodyGetPosition(bodies_[model_.joints[j].body]);
      std::copy_n(p, 3, anchor);
      dJointGetSliderAxis(joints_[j], axis);
    } else {
      dJointGetHingeAnchor(joints_[j], anchor);
      dJointGetHingeAxis(joints_[j], axis);
    }
    const double zero = zero_angle(model_.joints[j], options_);
    const double lower = get_param(joints_[j], dParamLoStop);
    const double upper = get_param(joints_[j], dParamHiStop);
    EngineJoint hinge{vec3(anchor), vec3(axis), lower < upper && (lower > -dInfinity || upper < dInfinity)};
    if (hinge.limited) {
      hinge.lower = zero + lower;
      hinge.upper = zero + upper;
    }
    view.joints.push_back(hinge);
  }
  dVector3 gravity;
  dWorldGetGravity(world_.get(), gravity);
  view.gravity = vec3(gravity);
  return_lent_mass(lent_, view);
  return view;
}

}  // namespace assay::ode
