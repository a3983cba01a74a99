// Compiled as C++17, because Simbody 3.7's headers are not valid C++20.
#include "simbody_solution.h"

#include <vector>

#include <Simbody.h>

#include "model/kinematics.h"

namespace assay {
namespace {

SimTK::Vec3 simtk(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
SimTK::Rotation simtk(const Quat& q) { return SimTK::Rotation(SimTK::Quaternion(q.w(), q.x(), q.y(), q.z())); }

}  // namespace

State simbody_solution(const Model& model, const State& start, double duration) {
  using SimTK::MobilizedBody;
  using SimTK::Transform;
  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter(system);
  SimTK::GeneralForceSubsystem forces(system);
  if (model.gravity.norm() > 0) SimTK::Force::Gravity(forces, matter, simtk(model.gravity));

  std::vector<SimTK::MobilizedBodyIndex> index;
  for (const Body& body : model.bodies) {
    const Mat3& I = body.I_BBcm_B;
    const SimTK::Inertia central(I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
    const SimTK::Vec3 com = simtk(body.p_BBcm);
    const SimTK::Body::Rigid rigid(SimTK::MassProperties(body.mass, com, central.shiftFromMassCenter(com, body.mass)));
    MobilizedBody& parent = body.parent == kWorld ? static_cast<MobilizedBody&>(matter.updGround())
                                                  : matter.updMobilizedBody(index[body.parent]);
    if (body.is_free()) {
      index.push_back(MobilizedBody::Free(parent, Transform(), rigid, Transform()));
      continue;
    }
    // a pin turns about the z axis of both its frames
    const Joint& hinge = model.joints[body.joint];
    const Quat q_BM = Quat::FromTwoVectors(Vec3::UnitZ(), hinge.axis_B);
    const Vec3 p_PJ = body.X_PB * hinge.p_BJ;
    const MobilizedBody::Pin pin(parent, Transform(simtk(Quat(body.X_PB.q * q_BM)), simtk(p_PJ)), rigid,
                                 Transform(simtk(q_BM), simtk(hinge.p_BJ)));
    index.push_back(pin);
    if (hinge.stiffness != 0) {
      SimTK::Force::MobilityLinearSpring(forces, pin, SimTK::MobilizerQIndex(0), hinge.stiffness,
                                         hinge.spring_reference - hinge.reference);
    }
    if (hinge.damping != 0) {
      SimTK::Force::MobilityLinearDamper(forces, pin, SimTK::MobilizerUIndex(0), hinge.damping);
    }
  }

  system.realizeTopology();
  SimTK::State state = system.getDefaultState();
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const MobilizedBody& mobilized = matter.getMobilizedBody(index[i]);
    if (body.is_free()) {
      const BodyState& s = start.bodies[i];
      const Pose X_WB = body_pose(body, s);
      mobilized.setQToFitTransform(state, Transform(simtk(X_WB.q), simtk(X_WB.p)));
      system.realize(state, SimTK::Stage::Position);
      const Vec3 v_origin = s.v_WBcm - s.w_WB.cross(X_WB.q * body.p_BBcm);
      mobilized.setUToFitVelocity(state, SimTK::SpatialVec(simtk(s.w_WB), simtk(v_origin)));
    } else {
      mobilized.setOneQ(state, 0, start.position[body.joint] - model.joints[body.joint].reference);
      mobilized.setOneU(state, 0, start.velocity[body.joint]);
    }
  }

  SimTK::RungeKuttaMersonIntegrator integrator(system);
  integrator.setAccuracy(1e-12);
  SimTK::TimeStepper stepper(system, integrator);
  stepper.initialize(state);
  stepper.stepTo(duration);
  const SimTK::State& end = integrator.getState();
  system.realize(end, SimTK::Stage::Velocity);

  State result;
  result.bodies.resize(model.bodies.size());
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const MobilizedBody& mobilized = matter.getMobilizedBody(index[i]);
    const SimTK::Vec3 p = mobilized.findStationLocationInGround(end, simtk(model.bodies[i].p_BBcm));
    const SimTK::Quaternion q = mobilized.getBodyRotation(end).convertRotationToQuaternion();
    result.bodies[i].p_WBcm = {p[0], p[1], p[2]};
    result.bodies[i].q_WB = Quat(q[0], q[1], q[2], q[3]);
  }
  return result;
}

}  // namespace assay
