// Compiled as C++17: Simbody 3.7's headers are not valid C++20.
#include "world.h"

#include <limits>
#include <string>
#include <utility>

#include <Simbody.h>

#include "base/errors.h"
#include "model/kinematics.h"

namespace assay::simbody {
namespace {

using SimTK::MobilizedBody;
using SimTK::MobilizerQIndex;
using SimTK::MobilizerUIndex;

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

}  // namespace

struct World::Parts {
  Parts(Model source, const Options& settings)
      : model(std::move(source)), options(settings), matter(system), forces(system), torques(forces, matter) {
    model.keyframes.clear();
  }

  void make_bodies();
  void make_joint_forces(const Joint& hinge, const MobilizedBody& pin);
  void set_limit_stiffness(SimTK::State& state) const;
  void set_state(SimTK::State& out, const State& state) const;
  const MobilizedBody& body(size_t i) const { return matter.getMobilizedBody(index[i]); }
  const MobilizedBody& hinged(const Joint& hinge) const { return body(hinge.body); }

  Model model;  // our own copy: the caller's need not live on
  Options options;
  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter;
  SimTK::GeneralForceSubsystem forces;
  SimTK::Force::DiscreteForces torques;
  std::unique_ptr<SimTK::Force::Gravity> gravity;                       // null: there is none
  std::vector<SimTK::MobilizedBodyIndex> index;                         // of each body
  std::vector<std::pair<int, SimTK::Force::MobilityLinearStop>> stops;  // with their hinges
  std::unique_ptr<SimTK::Integrator> integrator;
  bool torques_set = false;
  int failures = 0;
};

void World::Parts::make_bodies() {
  for (const Body& body : model.bodies) {
    const Mat3& I = body.I_BBcm_B;
    const SimTK::Inertia central(I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
    const SimTK::Vec3 com = simtk(body.p_BBcm);
    const SimTK::Body::Rigid rigid(SimTK::MassProperties(body.mass, com, central.shiftFromMassCenter(com, body.mass)));
    if (body.is_free()) {
      // the coordinates are the centre of mass's, which flies on a parabola
      const MobilizedBody::Free made(matter.updGround(), SimTK::Transform(), rigid, SimTK::Transform(com));
      index.push_back(made);
      continue;
    }
    // a pin turns about the z axis of both its frames
    const Joint& hinge = model.joints[body.joint];
    const Quat q_BM = Quat::FromTwoVectors(Vec3::UnitZ(), hinge.axis_B);
    const Vec3 p_PJ = body.X_PB * hinge.p_BJ;
    MobilizedBody& parent = body.parent == kWorld ? static_cast<MobilizedBody&>(matter.updGround())
                                                  : matter.updMobilizedBody(index[body.parent]);
    const MobilizedBody::Pin pin(parent, SimTK::Transform(simtk(Quat(body.X_PB.q * q_BM)), simtk(p_PJ)), rigid,
                                 SimTK::Transform(simtk(q_BM), simtk(hinge.p_BJ)));
    index.push_back(pin);
    make_joint_forces(hinge, pin);
  }
}

void World::Parts::make_joint_forces(const Joint& hinge, const MobilizedBody& pin) {
  if (hinge.stiffness != 0 && options.native_pd) {
    SimTK::Force::MobilityLinearSpring(forces, pin, MobilizerQIndex(0), hinge.stiffness,
                                       hinge.spring_reference - hinge.reference);
  }
  if (hinge.damping != 0 && options.native_pd) {
    SimTK::Force::MobilityLinearDamper(forces, pin, MobilizerUIndex(0), hinge.damping);
  }
  if (hinge.limited) {
    const int number = model.bodies[hinge.body].joint;
    stops.emplace_back(number,
                       SimTK::Force::MobilityLinearStop(forces, pin, MobilizerQIndex(0), 1, options.limit_dissipation,
                                                        hinge.lower - hinge.reference, hinge.upper - hinge.reference));
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
    const int u = static_cast<int>(hinged(model.joints[number]).getFirstUIndex(state));
    stop.setMaterialProperties(state, frequency * frequency / inverse(u, u), options.limit_dissipation);
  }
}

void World::Parts::set_state(SimTK::State& out, const State& state) const {
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const MobilizedBody& mobilized = body(i);
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
}

World::World(const Model& model, const State& state, const Options& options) try
    : parts_(std::make_unique<Parts>(model, options)) {
  Parts& p = *parts_;
  if (model.gravity.norm() > 0) {
    p.gravity = std::make_unique<SimTK::Force::Gravity>(p.forces, p.matter, simtk(model.gravity));
  }
  p.make_bodies();
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
  for (size_t j = 0; j < p.model.joints.size(); ++j) {
    const Joint& hinge = p.model.joints[j];
    const MobilizedBody& mobilized = p.hinged(hinge);
    double torque = torques == nullptr ? 0.0 : torques[j];
    if (explicit_springs) {
      torque += spring_torque(hinge, mobilized.getOneQ(state, 0) + hinge.reference, mobilized.getOneU(state, 0));
    }
    p.torques.setOneMobilityForce(state, mobilized, MobilizerUIndex(0), torque);
  }
  p.torques_set = !p.model.joints.empty();
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

void World::read_joints(State& out) const {
  const Parts& p = *parts_;
  const SimTK::State& state = p.integrator->getState();
  out.bodies.resize(p.model.bodies.size());
  out.position.resize(p.model.joints.size());
  out.velocity.resize(p.model.joints.size());
  for (size_t i = 0; i < p.model.bodies.size(); ++i) {
    const MobilizedBody& mobilized = p.body(i);
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
    const SimTK::MassProperties& mass = mobilized.getBodyMassProperties(state);
    const Mat3 R = mat3(mobilized.getBodyRotation(state).asMat33());
    const Mat3 I_B = mat3(mass.calcCentralInertia().toMat33());
    held.bodies.push_back({mass.getMass(), vec3(mobilized.findStationLocationInGround(state, mass.getMassCenter())),
                           R * I_B * R.transpose()});
  }
  held.joints.reserve(p.model.joints.size());
  for (const Joint& hinge : p.model.joints) {
    const MobilizedBody& mobilized = p.hinged(hinge);
    const SimTK::Transform X_GM = mobilized.getBodyTransform(state) * mobilized.getOutboardFrame(state);
    held.joints.push_back({vec3(X_GM.p()), vec3(SimTK::Vec3(X_GM.z())), false, 0, 0});
  }
  for (const auto& [number, stop] : p.stops) {
    HeldHinge& hinge = held.joints[number];
    hinge.limited = true;
    hinge.lower = stop.getLowerBound(state) + p.model.joints[number].reference;
    hinge.upper = stop.getUpperBound(state) + p.model.joints[number].reference;
  }
  if (p.gravity) held.gravity = vec3(p.gravity->getGravityVector(state));
  return held;
}

}  // namespace assay::simbody
