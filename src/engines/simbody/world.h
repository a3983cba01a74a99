// One running Simbody system, behind an interface that is valid C++17 too: Simbody 3.7's headers are not valid C++20.
#pragma once

#include <memory>
#include <vector>

#include "model/kinematics.h"
#include "model/model.h"
#include "options.h"

namespace assay::simbody {

// What the engine holds, as EngineView wants it.
struct HeldBody {
  double mass = 0;
  Vec3 p_WBcm = Vec3::Zero();
  Mat3 I_BBcm_W = Mat3::Zero();
};
struct HeldJoint {
  Vec3 p_WJ = Vec3::Zero(), axis_W = Vec3::UnitZ();
  bool limited = false;
  double lower = 0, upper = 0;
};
struct Held {
  std::vector<HeldBody> bodies;
  std::vector<HeldJoint> joints;
  Vec3 gravity = Vec3::Zero();
};

class World {
 public:
  World(const Model& model, const State& state, const Options& options);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  // One torque per hinge and force per slide, or null: none. Acts in the next step.
  void set_torques(const double* torques);
  void advance(int count);
  // Positions and velocities of hinges and slides, coordinates of ball joints, and free bodies; the other bodies follow
  // from them.
  void read_joints(State& out, std::vector<BallCoordinates>& balls) const;
  Held held() const;

  struct Parts;  // Simbody's objects

 private:
  std::unique_ptr<Parts> parts_;
};

}  // namespace assay::simbody
