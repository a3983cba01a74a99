// Simbody as its user would write it: a chain of pins, an integrator of fixed step. Compiled as C++17.
#include <limits>

#include <Simbody.h>

#include "direct_simbody.h"

namespace assay::benchmarks {
namespace {

SimTK::Vec3 simtk(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
SimTK::Rotation simtk(const Quat& q) { return SimTK::Rotation(SimTK::Quaternion(q.w(), q.x(), q.y(), q.z())); }

class Loop final : public SimbodyLoop {
 public:
  Loop(const Model& model, const State& start, double timestep, bool merson)
      : matter_(system_),
        forces_(system_),
        gravity_(forces_, matter_, simtk(model.gravity)),
        torques_(forces_, matter_) {
    for (const Body& body : model.bodies) {
      const Joint& hinge = model.joints[body.joint];
      const Mat3& I = body.I_BBcm_B;
      const SimTK::Inertia central(I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
      const SimTK::Vec3 com = simtk(body.p_BBcm);
      const SimTK::Body::Rigid rigid(
          SimTK::MassProperties(body.mass, com, central.shiftFromMassCenter(com, body.mass)));
      const Quat q_BM = Quat::FromTwoVectors(Vec3::UnitZ(), hinge.axis_B);
      SimTK::MobilizedBody& parent = body.parent == kWorld ? static_cast<SimTK::MobilizedBody&>(matter_.updGround())
                                                           : matter_.updMobilizedBody(index_[body.parent]);
      index_.push_back(SimTK::MobilizedBody::Pin(
          parent, SimTK::Transform(simtk(Quat(body.X_PB.q * q_BM)), simtk(body.X_PB * hinge.p_BJ)), rigid,
          SimTK::Transform(simtk(q_BM), simtk(hinge.p_BJ))));
    }
    system_.realizeTopology();
    SimTK::State state = system_.getDefaultState();
    for (size_t i = 0; i < index_.size(); ++i) {
      const int hinge = model.bodies[i].joint;
      pin(i).setOneQ(state, 0, start.position[hinge] - model.joints[hinge].reference);
      pin(i).setOneU(state, 0, start.velocity[hinge]);
    }
    if (merson) {
      integrator_ = std::make_unique<SimTK::RungeKuttaMersonIntegrator>(system_);
    } else {
      integrator_ = std::make_unique<SimTK::SemiExplicitEulerIntegrator>(system_, timestep);
    }
    integrator_->setFixedStepSize(timestep);
    integrator_->setAccuracy(0.999);
    integrator_->setConstraintTolerance(1e-12);
    integrator_->setReturnEveryInternalStep(true);
    integrator_->initialize(state);
    step();  // which only says that the run begins
  }

  void run(int count) override {
    for (int i = 0; i < count; ++i) step();
  }

  void run_with_torques(const double* torques, int count) override {
    for (int i = 0; i < count; ++i) {
      SimTK::State& state = integrator_->updAdvancedState();
      for (size_t j = 0; j < index_.size(); ++j) {
        torques_.setOneMobilityForce(state, pin(j), SimTK::MobilizerUIndex(0), torques[j]);
      }
      step();
    }
  }

  std::vector<double> angles() const override {
    std::vector<double> list;
    list.reserve(index_.size());
    for (size_t i = 0; i < index_.size(); ++i) list.push_back(pin(i).getOneQ(integrator_->getState(), 0));
    return list;
  }
  std::vector<double> rates() const override {
    std::vector<double> list;
    list.reserve(index_.size());
    for (size_t i = 0; i < index_.size(); ++i) list.push_back(pin(i).getOneU(integrator_->getState(), 0));
    return list;
  }

 private:
  void step() { integrator_->stepTo(std::numeric_limits<double>::infinity()); }
  const SimTK::MobilizedBody& pin(size_t i) const { return matter_.getMobilizedBody(index_[i]); }

  SimTK::MultibodySystem system_;
  SimTK::SimbodyMatterSubsystem matter_;
  SimTK::GeneralForceSubsystem forces_;
  SimTK::Force::Gravity gravity_;
  SimTK::Force::DiscreteForces torques_;
  std::vector<SimTK::MobilizedBodyIndex> index_;
  std::unique_ptr<SimTK::Integrator> integrator_;
};

}  // namespace

std::unique_ptr<SimbodyLoop> make_simbody_loop(const Model& model, const State& start, double timestep, bool merson) {
  return std::make_unique<Loop>(model, start, timestep, merson);
}

}  // namespace assay::benchmarks
