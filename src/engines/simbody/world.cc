// Compiled as C++17: Simbody 3.7's headers are not valid C++20.
#include "world.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include <Simbody.h>

#include "base/errors.h"

namespace assay::simbody {
namespace {

using SimTK::MobilizedBody;
using SimTK::MobilizerQIndex;
using SimTK::MobilizerUIndex;

constexpr int kBallFreedoms = 3;

SimTK::Vec3 simtk(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
SimTK::Rotation simtk(const Quat& q) { return SimTK::Rotation(SimTK::Quaternion(q.w(), q.x(), q.y(), q.z())); }
Vec3 vec3(const SimTK::Vec3& v) { return {v[0], v[1], v[2]}; }
Mat3 mat3(const SimTK::Mat33& m) {
  Mat3 result;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) result(row, column) = m(row, column);
  }
  return result;
}

// Simbody's messages are paragraphs.
std::string one_line(const std::string& text) {
  std::string line = "Simbody: ";
  for (const char c : text) {
    const bool gap = c == '\n' || c == ' ';
    if (!gap) line += c;
    if (gap && line.back() != ' ') line += ' ';
  }
  return line;
}

std::unique_ptr<SimTK::Integrator> make_integrator(Method method, const SimTK::System& system, double timestep) {
  std::unique_ptr<SimTK::Integrator> integrator;
  switch (method) {
    case Method::kSemiExplicitEuler:
      integrator = std::make_unique<SimTK::SemiExplicitEulerIntegrator>(system, timestep);
      break;
    case Method::kVerlet:
      integrator = std::make_unique<SimTK::VerletIntegrator>(system);
      break;
    case Method::kRungeKutta2:
      integrator = std::make_unique<SimTK::RungeKutta2Integrator>(system);
      break;
    case Method::kRungeKutta3:
      integrator = std::make_unique<SimTK::RungeKutta3Integrator>(system);
      break;
    case Method::kRungeKuttaMerson:
      integrator = std::make_unique<SimTK::RungeKuttaMersonIntegrator>(system);
      break;
    case Method::kRungeKuttaFehlberg:
      integrator = std::make_unique<SimTK::RungeKuttaFeldbergIntegrator>(system);
      break;
  }
  integrator->setFixedStepSize(timestep);
  // No step is rejected or shortened: the size is fixed. What the accuracy still decides: Verlet iterates to a tenth of
  // it, and Runge-Kutta does not touch the quaternions where it estimates an error far beyond it.
  integrator->setAccuracy(method == Method::kVerlet ? 1e-11 : 0.999);
  integrator->setConstraintTolerance(1e-12);  // quaternions' length
  // a call of stepTo is one step
  integrator->setReturnEveryInternalStep(true);
  return integrator;
}

SimTK::Transform transform(const Quat& q, const Vec3& p) { return {simtk(q), simtk(p)}; }

// A ball joint's coordinates: Simbody's rotation is from the pose X_PB, its speeds the relative angular velocity in the
// parent's axes at that pose.
BallCoordinates read_ball(const MobilizedBody& ball, const SimTK::State& state) {
  const auto q = [&](int k) { return ball.getOneQ(state, k); };
  const auto u = [&](int k) { return ball.getOneU(state, k); };
  BallCoordinates result;
  result.rotation = Quat(q(0), q(1), q(2), q(3)).normalized();
  result.velocity = result.rotation.conjugate() * Vec3(u(0), u(1), u(2));
  return result;
}

// The same of a torque in child axes.
Vec3 ball_torque(const BallJoint& joint, const BallCoordinates& at) {
  return at.rotation * ball_spring_torque(joint, at.rotation, at.velocity);
}

}  // namespace

struct World::Parts {
  Parts(Model source, const Options& settings)
      : model(std::move(source)), options(settings), matter(system), forces(system), torques(forces, matter) {
    model.keyframes.clear();
  }

  void make_bodies();
  void make_joint_forces(const Joint& joint, const MobilizedBody& mobilized);
  void make_constraints();
  void make_rotors();
  double position(const SimTK::State& state, int joint) const;
  double tension(const SimTK::State& state, const Tendon& tendon) const;
  void set_limit_stiffness(SimTK::State& state) const;
  void set_state(SimTK::State& out, const State& state) const;
  const MobilizedBody& body(size_t i) const { return matter.getMobilizedBody(index[i]); }
  const MobilizedBody& jointed(const Joint& joint) const { return body(joint.body); }
  MobilizedBody& end(int body) {
    return body == kWorld ? static_cast<MobilizedBody&>(matter.updGround()) : matter.updMobilizedBody(index[body]);
  }

  Model model;  // our own copy: the caller's need not live on
  Options options;
  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter;
  SimTK::GeneralForceSubsystem forces;
  SimTK::Force::DiscreteForces torques;
  std::unique_ptr<SimTK::Force::Gravity> gravity;  // null: there is none
  std::vector<SimTK::MobilizedBodyIndex> index;    // of each body
  struct Rotor {
    SimTK::MobilizedBodyIndex rotor, jointed;
    int speeds;
  };
  std::vector<Rotor> rotors;
  std::vector<std::pair<int, SimTK::Force::MobilityLinearStop>> stops;  // with their joints
  std::unique_ptr<SimTK::Integrator> integrator;
  bool torques_set = false;
  int failures = 0;
};

namespace {

// Springs and dampers that Simbody has no force for, evaluated in every stage.
class SpringForces final : public SimTK::Force::Custom::Implementation {
 public:
  explicit SpringForces(const World::Parts& parts) : parts_(parts) {}

  void calcForce(const SimTK::State& state, SimTK::Vector_<SimTK::SpatialVec>& /*bodies*/,
                 SimTK::Vector_<SimTK::Vec3>& /*particles*/, SimTK::Vector& mobilities) const override {
    for (const BallJoint& ball : parts_.model.balls) {
      if (!ball.has_spring()) continue;
      const MobilizedBody& mobilized = parts_.body(ball.body);
      const Vec3 torque = ball_torque(ball, read_ball(mobilized, state));
      for (int k = 0; k < kBallFreedoms; ++k) {
        mobilized.applyOneMobilityForce(state, MobilizerUIndex(k), torque[k], mobilities);
      }
    }
    for (const Tendon& tendon : parts_.model.tendons) {
      if (!tendon.has_spring()) continue;
      const double tension = parts_.tension(state, tendon);
      for (const JointTerm& term : tendon.terms) {
        parts_.jointed(parts_.model.joints[term.joint])
            .applyOneMobilityForce(state, MobilizerUIndex(0), term.coefficient * tension, mobilities);
      }
    }
  }
  SimTK::Real calcPotentialEnergy(const SimTK::State& /*state*/) const override { return 0; }  // asked by nobody

 private:
  const World::Parts& parts_;
};

bool needs_spring_forces(const Model& model) {
  const auto has_spring = [](const auto& element) { return element.has_spring(); };
  return std::any_of(model.balls.begin(), model.balls.end(), has_spring) ||
         std::any_of(model.tendons.begin(), model.tendons.end(), has_spring);
}

}  // namespace

double World::Parts::position(const SimTK::State& state, int joint) const {
  return jointed(model.joints[joint]).getOneQ(state, 0) + model.joints[joint].reference;
}

double World::Parts::tension(const SimTK::State& state, const Tendon& tendon) const {
  double length = 0, speed = 0;
  for (const JointTerm& term : tendon.terms) {
    length += term.coefficient * position(state, term.joint);
    speed += term.coefficient * jointed(model.joints[term.joint]).getOneU(state, 0);
  }
  return tendon_tension(tendon, length, speed);
}

void World::Parts::make_bodies() {
  for (const Body& body : model.bodies) {
    const Mat3& I = body.I_BBcm_B;
    const SimTK::Inertia central(I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
    const SimTK::Vec3 com = simtk(body.p_BBcm);
    const SimTK::MassProperties mass(body.mass, com, central.shiftFromMassCenter(com, body.mass));
    SimTK::Body rigid = SimTK::Body::Rigid(mass);
    if (body.is_massless()) rigid = SimTK::Body::Massless();
    if (body.is_free()) {
      // the coordinates are the centre of mass's, which flies on a parabola
      const MobilizedBody::Free made(matter.updGround(), SimTK::Transform(), rigid, SimTK::Transform(com));
      index.push_back(made);
      continue;
    }
    MobilizedBody& parent = end(body.parent);
    if (body.ball >= 0) {
      const Vec3& p_BJ = model.balls[body.ball].p_BJ;
      const MobilizedBody::Ball made(parent, transform(body.X_PB.q, body.X_PB * p_BJ), rigid,
                                     SimTK::Transform(simtk(p_BJ)));
      index.push_back(made);
      continue;
    }
    // a pin turns about the z axis of both its frames, a slider moves along their x axis
    const Joint& joint = model.joints[body.joint];
    const Quat q_BM = Quat::FromTwoVectors(joint.is_slide() ? Vec3::UnitX() : Vec3::UnitZ(), joint.axis_B);
    const Vec3 p_PJ = body.X_PB * joint.p_BJ;
    const SimTK::Transform X_PF = transform(Quat(body.X_PB.q * q_BM), p_PJ), X_BM = transform(q_BM, joint.p_BJ);
    if (joint.is_slide()) {
      const MobilizedBody::Slider slider(parent, X_PF, rigid, X_BM);
      index.push_back(slider);
      make_joint_forces(joint, slider);
    } else {
      const MobilizedBody::Pin pin(parent, X_PF, rigid, X_BM);
      index.push_back(pin);
      make_joint_forces(joint, pin);
    }
  }
  // Simbody owns it
  if (options.native_pd && needs_spring_forces(model)) SimTK::Force::Custom(forces, new SpringForces(*this));
}

void World::Parts::make_constraints() {
  for (const Coupling& coupling : model.couplings) {
    // coordinates are counted from the reference
    const int count = static_cast<int>(coupling.terms.size()) + 1;
    SimTK::Vector coefficients(count + 1);
    SimTK::Array_<SimTK::MobilizedBodyIndex> bodies(count);
    SimTK::Array_<MobilizerQIndex> coordinates(count, MobilizerQIndex(0));
    coefficients[0] = 1;
    bodies[0] = index[model.joints[coupling.joint].body];
    double constant = model.joints[coupling.joint].reference - coupling.offset;
    for (int i = 1; i < count; ++i) {
      const JointTerm& term = coupling.terms[i - 1];
      coefficients[i] = -term.coefficient;
      bodies[i] = index[model.joints[term.joint].body];
      constant -= term.coefficient * model.joints[term.joint].reference;
    }
    coefficients[count] = constant;
    SimTK::Constraint::CoordinateCoupler(matter, new SimTK::Function::Linear(coefficients), bodies, coordinates);
  }
  for (const Connect& connect : model.connects) {
    SimTK::Constraint::Ball(end(connect.body_a), simtk(connect.p_A), end(connect.body_b), simtk(connect.p_B));
  }
  for (const Weld& weld : model.welds) {
    SimTK::Constraint::Weld(end(weld.body_a), transform(weld.X_AB.q, weld.X_AB.p), end(weld.body_b),
                            SimTK::Transform());
  }
}

// Armature: a wheel on the ground that turns as fast as the joint. Its energy is a u^2 / 2; on the joint's parent it
// would have the parent's spin too. For a ball joint it is a ball.
void World::Parts::make_rotors() {
  const auto add = [this](int on, int speeds, const MobilizedBody& rotor) {
    rotors.push_back({rotor.getMobilizedBodyIndex(), index[on], speeds});
    SimTK::Vector equal(3, 0.0);
    equal[0] = 1;
    equal[1] = -1;
    for (int k = 0; k < speeds; ++k) {
      SimTK::Array_<SimTK::MobilizedBodyIndex> bodies(1, rotor.getMobilizedBodyIndex());
      bodies.push_back(index[on]);
      const SimTK::Array_<MobilizerUIndex> same(2, MobilizerUIndex(k));
      SimTK::Constraint::SpeedCoupler(matter, new SimTK::Function::Linear(equal), bodies, same);
    }
  };
  const auto wheel = [](double armature) {
    return SimTK::Body::Rigid(SimTK::MassProperties(armature, SimTK::Vec3(0), SimTK::Inertia(armature)));
  };
  for (const Joint& joint : model.joints) {
    if (joint.armature == 0) continue;
    const MobilizedBody::Pin rotor(matter.updGround(), wheel(joint.armature));
    add(joint.body, 1, rotor);
  }
  for (const BallJoint& ball : model.balls) {
    if (ball.armature == 0) continue;
    const MobilizedBody::Ball rotor(matter.updGround(), wheel(ball.armature));
    add(ball.body, kBallFreedoms, rotor);
  }
}

void World::Parts::make_joint_forces(const Joint& joint, const MobilizedBody& mobilized) {
  if (joint.stiffness != 0 && options.native_pd) {
    SimTK::Force::MobilityLinearSpring(forces, mobilized, MobilizerQIndex(0), joint.stiffness,
                                       joint.spring_reference - joint.reference);
  }
  if (joint.damping != 0 && options.native_pd) {
    SimTK::Force::MobilityLinearDamper(forces, mobilized, MobilizerUIndex(0), joint.damping);
  }
  if (joint.limited) {
    const int number = model.bodies[joint.body].joint;
    stops.emplace_back(
        number, SimTK::Force::MobilityLinearStop(forces, mobilized, MobilizerQIndex(0), 1, options.limit_dissipation,
                                                 joint.lower - joint.reference, joint.upper - joint.reference));
  }
}

// A stop is a spring. Its frequency is a fixed part of the step's, from the inertia that a torque in the joint meets in
// the reference configuration.
void World::Parts::set_limit_stiffness(SimTK::State& state) const {
  if (stops.empty()) return;
  set_state(state, reference_state(model));
  system.realize(state, SimTK::Stage::Position);
  SimTK::Matrix inverse;
  matter.calcMInv(state, inverse);
  const double frequency = options.limit_frequency / options.timestep;
  for (const auto& [number, stop] : stops) {
    const int u = static_cast<int>(jointed(model.joints[number]).getFirstUIndex(state));
    const double inertia = (1 / inverse(u, u)) + model.joints[number].armature;
    stop.setMaterialProperties(state, frequency * frequency * inertia, options.limit_dissipation);
  }
}

void World::Parts::set_state(SimTK::State& out, const State& state) const {
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const MobilizedBody& mobilized = body(i);
    if (const int number = model.bodies[i].ball; number >= 0) {
      const Quat rotation = ball_rotation(model, state, number);
      const Vec3 speeds = rotation * ball_velocity(model, state, number);
      const double q[4] = {rotation.w(), rotation.x(), rotation.y(), rotation.z()};
      for (int k = 0; k < 4; ++k) mobilized.setOneQ(out, k, q[k]);
      for (int k = 0; k < kBallFreedoms; ++k) mobilized.setOneU(out, k, speeds[k]);
      continue;
    }
    if (!model.bodies[i].is_free()) {
      const int number = model.bodies[i].joint;
      mobilized.setOneQ(out, 0, state.position[number] - model.joints[number].reference);
      mobilized.setOneU(out, 0, state.velocity[number]);
      continue;
    }
    const BodyState& s = state.bodies[i];
    const double q[7] = {s.q_WB.w(), s.q_WB.x(), s.q_WB.y(), s.q_WB.z(), s.p_WBcm.x(), s.p_WBcm.y(), s.p_WBcm.z()};
    for (int k = 0; k < 7; ++k) mobilized.setOneQ(out, k, q[k]);
    for (int k = 0; k < 3; ++k) {
      mobilized.setOneU(out, k, s.w_WB[k]);
      mobilized.setOneU(out, 3 + k, s.v_WBcm[k]);
    }
  }
  for (const Rotor& each : rotors) {
    const MobilizedBody &rotor = matter.getMobilizedBody(each.rotor), &jointed = matter.getMobilizedBody(each.jointed);
    for (int k = 0; k < each.speeds; ++k) rotor.setOneU(out, k, jointed.getOneU(out, k));
  }
}

World::World(const Model& model, const State& state, const Options& options) try
    : parts_(std::make_unique<Parts>(model, options)) {
  Parts& p = *parts_;
  if (model.gravity.norm() > 0) {
    p.gravity = std::make_unique<SimTK::Force::Gravity>(p.forces, p.matter, simtk(model.gravity));
  }
  p.make_bodies();
  p.make_constraints();
  p.make_rotors();
  p.system.realizeTopology();
  SimTK::State start = p.system.getDefaultState();
  p.system.realizeModel(start);
  p.set_limit_stiffness(start);
  p.set_state(start, state);
  p.integrator = make_integrator(options.method, p.system, options.timestep);
  p.integrator->initialize(start);
  // the first call only says that the run begins
  p.integrator->stepTo(std::numeric_limits<double>::infinity());
} catch (const std::exception& error) {
  throw EngineError(one_line(error.what()));
}

World::~World() = default;

void World::set_torques(const double* torques) {
  Parts& p = *parts_;
  SimTK::State& state = p.integrator->updAdvancedState();
  const bool explicit_springs = !p.options.native_pd;
  std::vector<double> all(p.model.joints.size());
  for (size_t j = 0; j < all.size(); ++j) {
    const Joint& joint = p.model.joints[j];
    const MobilizedBody& mobilized = p.jointed(joint);
    all[j] = torques == nullptr ? 0.0 : torques[j];
    if (explicit_springs) {
      all[j] += spring_torque(joint, mobilized.getOneQ(state, 0) + joint.reference, mobilized.getOneU(state, 0));
    }
  }
  if (explicit_springs) {
    for (const Tendon& tendon : p.model.tendons) {
      if (!tendon.has_spring()) continue;
      const double tension = p.tension(state, tendon);
      for (const JointTerm& term : tendon.terms) all[term.joint] += term.coefficient * tension;
    }
    for (const BallJoint& ball : p.model.balls) {
      if (!ball.has_spring()) continue;
      const MobilizedBody& mobilized = p.body(ball.body);
      const Vec3 torque = ball_torque(ball, read_ball(mobilized, state));
      for (int k = 0; k < kBallFreedoms; ++k) {
        p.torques.setOneMobilityForce(state, mobilized, MobilizerUIndex(k), torque[k]);
      }
    }
  }
  for (size_t j = 0; j < all.size(); ++j) {
    p.torques.setOneMobilityForce(state, p.jointed(p.model.joints[j]), MobilizerUIndex(0), all[j]);
  }
  p.torques_set = !p.model.joints.empty() || !p.model.balls.empty();
}

void World::advance(int count) {
  Parts& p = *parts_;
  constexpr double kNoReport = std::numeric_limits<double>::infinity();
  try {
    int done = 0;
    if (p.torques_set && count > 0) {
      p.integrator->stepTo(kNoReport);
      p.torques.clearAllMobilityForces(p.integrator->updAdvancedState());
      p.torques_set = false;
      done = 1;
    }
    for (; done < count; ++done) p.integrator->stepTo(kNoReport);
  } catch (const std::exception& error) {
    throw EngineError(one_line(error.what()));
  }
  // with a fixed step, Simbody goes on from a step that failed inside, and only counts it
  const int failures = p.integrator->getNumConvergenceTestFailures();
  if (failures > p.failures) {
    const int steps = failures - p.failures;
    p.failures = failures;
    throw EngineError("Simbody: " + std::to_string(steps) + " of " + std::to_string(count) + " steps of the " +
                      p.integrator->getMethodName() + " integrator failed or did not converge");
  }
}

void World::read_joints(State& out, std::vector<BallCoordinates>& balls) const {
  const Parts& p = *parts_;
  const SimTK::State& state = p.integrator->getState();
  out.bodies.resize(p.model.bodies.size());
  out.position.resize(p.model.joints.size());
  out.velocity.resize(p.model.joints.size());
  balls.resize(p.model.balls.size());
  for (size_t i = 0; i < p.model.bodies.size(); ++i) {
    const MobilizedBody& mobilized = p.body(i);
    if (const int number = p.model.bodies[i].ball; number >= 0) {
      balls[number] = read_ball(mobilized, state);
      continue;
    }
    if (!p.model.bodies[i].is_free()) {
      const int number = p.model.bodies[i].joint;
      out.position[number] = mobilized.getOneQ(state, 0) + p.model.joints[number].reference;
      out.velocity[number] = mobilized.getOneU(state, 0);
      continue;
    }
    const auto q = [&](int k) { return mobilized.getOneQ(state, k); };
    const auto u = [&](int k) { return mobilized.getOneU(state, k); };
    BodyState& s = out.bodies[i];
    s.q_WB = Quat(q(0), q(1), q(2), q(3)).normalized();
    s.p_WBcm = {q(4), q(5), q(6)};
    s.w_WB = {u(0), u(1), u(2)};
    s.v_WBcm = {u(3), u(4), u(5)};
  }
}

Held World::held() const {
  const Parts& p = *parts_;
  const SimTK::State& state = p.integrator->getState();
  p.system.realize(state, SimTK::Stage::Velocity);
  Held held;
  held.bodies.reserve(p.model.bodies.size());
  for (size_t i = 0; i < p.model.bodies.size(); ++i) {
    const MobilizedBody& mobilized = p.body(i);
    if (p.model.bodies[i].is_massless()) {
      held.bodies.emplace_back();
      continue;
    }
    const SimTK::MassProperties& mass = mobilized.getBodyMassProperties(state);
    const Mat3 R = mat3(mobilized.getBodyRotation(state).asMat33());
    const Mat3 I_B = mat3(mass.calcCentralInertia().toMat33());
    held.bodies.push_back({mass.getMass(), vec3(mobilized.findStationLocationInGround(state, mass.getMassCenter())),
                           R * I_B * R.transpose()});
  }
  held.joints.reserve(p.model.joints.size());
  for (const Joint& joint : p.model.joints) {
    const MobilizedBody& mobilized = p.jointed(joint);
    const SimTK::Transform X_GM = mobilized.getBodyTransform(state) * mobilized.getOutboardFrame(state);
    const Vec3 axis = vec3(SimTK::Vec3(joint.is_slide() ? X_GM.x() : X_GM.z()));
    held.joints.push_back({vec3(X_GM.p()), axis, false, 0, 0});
  }
  for (const auto& [number, stop] : p.stops) {
    HeldJoint& joint = held.joints[number];
    joint.limited = true;
    joint.lower = stop.getLowerBound(state) + p.model.joints[number].reference;
    joint.upper = stop.getUpperBound(state) + p.model.joints[number].reference;
  }
  if (p.gravity) held.gravity = vec3(p.gravity->getGravityVector(state));
  return held;
}

}  // namespace assay::simbody
