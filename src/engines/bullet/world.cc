#include "world.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyMLCPConstraintSolver.h>
#include <BulletDynamics/MLCPSolvers/btDantzigSolver.h>
#include <BulletDynamics/MLCPSolvers/btMLCPSolver.h>

#include "convert.h"

namespace assay::bullet {
namespace {

std::unique_ptr<btSequentialImpulseConstraintSolver> make_solver(bool multibody, btMLCPSolverInterface* lcp) {
  if (multibody && lcp != nullptr) return std::make_unique<btMultiBodyMLCPConstraintSolver>(lcp);
  if (multibody) return std::make_unique<btMultiBodyConstraintSolver>();
  if (lcp != nullptr) return std::make_unique<btMLCPSolver>(lcp);
  return std::make_unique<btSequentialImpulseConstraintSolver>();
}

void configure(btContactSolverInfo& info, const Options& options) {
  info.m_numIterations = options.iterations;
  info.m_leastSquaresResidualThreshold = options.residual;
  info.m_erp = options.erp;
  info.m_erp2 = options.contact_erp;
  info.m_globalCfm = options.cfm;
  info.m_splitImpulse = static_cast<int>(options.split_impulse);
  info.m_splitImpulsePenetrationThreshold = -options.split_impulse_depth;
  info.m_linearSlop = options.linear_slop;
  info.m_warmstartingFactor = options.warmstarting;
  info.m_restitution = 0;
  info.m_restitutionVelocityThreshold = real(options.restitution.threshold);
  info.m_maxGyroscopicForce = SIMD_INFINITY;
  info.m_minimumSolverBatchSize = options.solver_batch;
  const auto flag = [&info](int bit, bool on) {
    info.m_solverMode = on ? info.m_solverMode | bit : info.m_solverMode & ~bit;
  };
  flag(SOLVER_USE_WARMSTARTING, options.warmstarting > 0);
  flag(SOLVER_USE_2_FRICTION_DIRECTIONS, options.friction_directions == 2);
  flag(SOLVER_DISABLE_IMPLICIT_CONE_FRICTION, !options.friction_cone);
  flag(SOLVER_RANDMIZE_ORDER, options.randomize_order);
}

bool has_explicit_springs(const Model& model) {
  return model.has_springs() || std::ranges::any_of(model.balls, &BallJoint::has_spring) ||
         std::ranges::any_of(model.tendons, &Tendon::has_spring);
}

}  // namespace

double nearest_turn(double angle, double guess) {
  constexpr double kTurn = 2 * std::numbers::pi;
  return angle + kTurn * std::round((guess - angle) / kTurn);
}

BulletSimulation::BulletSimulation(const Model& model, const State& state, const Options& options)
    : rows_(model, options.timestep, {.couplings = !options.multibody, .wide_ranges = !options.multibody}),
      model_(options.multibody ? model : without_wide_ranges(model)),
      options_(options),
      start_(with_joint_coordinates(model, state)),
      collision_(model, options.turns_resist(),
                 {options.mass_unit * options.compliance.stiffness, options.mass_unit * options.compliance.damping},
                 options.restitution),
      last_(start_),
      springs_(has_explicit_springs(model) || rows_.any()),
      ball_torques_(model.balls.size(), Vec3::Zero()),
      clock_{state.time, options.timestep} {
  make_world();
}

void BulletSimulation::make_world() {
  // for flat faces on a plane, three more points a step until there are three: only boxes and hulls take them
  configuration_.setPlaneConvexMultipointIterations();
  // spheres on height fields as all other shapes: Bullet's own algorithm for them leaves out the field's margin
  btCollisionAlgorithmCreateFunc* convex =
      configuration_.getCollisionAlgorithmCreateFunc(CONVEX_SHAPE_PROXYTYPE, CONVEX_SHAPE_PROXYTYPE);
  dispatcher_.registerCollisionCreateFunc(SPHERE_SHAPE_PROXYTYPE, TRIANGLE_SHAPE_PROXYTYPE, convex);
  dispatcher_.registerCollisionCreateFunc(TRIANGLE_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE, convex);
  if (options_.solver == Solver::kDantzig) lcp_ = std::make_unique<btDantzigSolver>();
  auto solver = make_solver(options_.multibody, lcp_.get());
  solver->setRandSeed(0);
  if (options_.multibody) {
    world_ = std::make_unique<btMultiBodyDynamicsWorld>(
        &dispatcher_, &broadphase_, static_cast<btMultiBodyConstraintSolver*>(solver.get()), &configuration_);
  } else {
    world_ = std::make_unique<btDiscreteDynamicsWorld>(&dispatcher_, &broadphase_, solver.get(), &configuration_);
  }
  solver_ = std::move(solver);
  configure(world_->getSolverInfo(), options_);
  world_->setGravity(to_bt(model_.gravity));
  Collision::install_hooks();
  world_->getPairCache()->setOverlapFilterCallback(const_cast<Collision*>(&collision_));
  for (const auto& object : collision_.world_objects()) {
    world_->addCollisionObject(object.get(), btBroadphaseProxy::StaticFilter, btBroadphaseProxy::AllFilter);
  }
}

void BulletSimulation::advance(int count) {
  const auto h = real(options_.timestep);
  for (int i = 0; i < count; ++i) world_->stepSimulation(h, 0);
  clock_.steps += count;
}

void BulletSimulation::read_state(State& out) const {
  read(last_);
  last_.time = clock_.time();
  out = last_;
  finish(out);
}

void BulletSimulation::set_torques(std::span<const double> torques) {
  if (springs_) read(last_);
  if (options_.mass_unit != 1) {
    scaled_.assign(torques.begin(), torques.end());
    for (double& torque : scaled_) torque *= options_.mass_unit;
    torques = scaled_;
  }
  collect_torques(model_, torques, springs_ ? &last_ : nullptr, torques_);
  if (springs_) {
    add_tendon_tensions(model_, last_, torques_);
    rows_.add(model_, last_, torques_);
    for (size_t i = 0; i < ball_torques_.size(); ++i) {
      const int ball = static_cast<int>(i);
      ball_torques_[i] =
          ball_spring_torque(model_.balls[i], ball_rotation(model_, last_, ball), ball_velocity(model_, last_, ball));
    }
  }
  apply(torques_, ball_torques_);
}

bool BulletSimulation::keep_contacts() {
  contacts_kept_ = true;
  return true;
}

// Bullet leaves a step's impulses in its contact points. Split impulse, which moves bodies apart without a velocity, is
// none of them.
void BulletSimulation::read_contacts(std::vector<ContactForce>& out) const {
  out.clear();
  if (!contacts_kept_ || clock_.steps == 0) return;
  for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
    const btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(m);
    for (int i = 0; i < manifold.getNumContacts(); ++i) {
      const btManifoldPoint& point = manifold.getContactPoint(i);
      const int first = collision_.shape_of(*manifold.getBody0(), point.m_index0);
      const int second = collision_.shape_of(*manifold.getBody1(), point.m_index1);
      if (first < 0 || second < 0) continue;
      // on the first body; the normal points to it
      btVector3 impulse = point.m_appliedImpulse * point.m_normalWorldOnB;
      impulse += point.m_appliedImpulseLateral1 * point.m_lateralFrictionDir1;
      if (options_.friction_directions == 2) impulse += point.m_appliedImpulseLateral2 * point.m_lateralFrictionDir2;
      const double sign = first > second ? 1 : -1;
      out.push_back({.shape_a = std::min(first, second),
                     .shape_b = std::max(first, second),
                     .p_W = from_bt(point.getPositionWorldOnB()),
                     .n_W = sign * from_bt(point.m_normalWorldOnB),
                     .gap = point.getDistance(),
                     .impulse_W = sign / options_.mass_unit * from_bt(impulse)});
    }
  }
}

EngineView BulletSimulation::view() const {
  EngineView out;
  out.bodies.resize(model_.bodies.size());
  out.joints.resize(model_.joints.size());
  out.gravity = from_bt(world_->getGravity());
  view_parts(out);
  return out;
}

}  // namespace assay::bullet
