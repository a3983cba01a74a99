// The adapter's settings, read once from assay's Settings.
#pragma once

#include <vector>

#include <LinearMath/btScalar.h>

#include "engines/adapter.h"
#include "model/massless.h"

namespace assay::bullet {

#ifdef BT_USE_DOUBLE_PRECISION
inline constexpr bool kDoublePrecision = true;
#else
inline constexpr bool kDoublePrecision = false;
#endif

enum class Solver { kSequentialImpulse, kDantzig };

// What settings() declares, typed. The meaning of each is in its declaration in options.cc.
struct Options {
  double timestep = 1e-3;  // s
  bool multibody = false;
  bool rk4 = false;
  Solver solver = Solver::kSequentialImpulse;
  int iterations = 50;
  btScalar residual = 0;
  btScalar erp = btScalar{0.2}, contact_erp = btScalar{0.2}, cfm = 0;
  bool split_impulse = true;
  btScalar split_impulse_depth = 0;  // m
  btScalar linear_slop = 0;          // m
  btScalar warmstarting = btScalar{0.85};
  int gyroscopic = 0;  // btRigidBodyFlags
  int friction_directions = 2;
  bool friction_cone = true;
  bool frame_offset = true;
  bool randomize_order = false;
  int solver_batch = 128;
  double lent_share = kLentShare;
  ContactCompliance compliance;
  Restitution restitution;
  double mass_unit = 1;  // what Bullet's numbers of mass count, 1/kg; not a setting: see make_rigid()

  // Whether contacts have torsional and rolling friction: Bullet solves both where it has a circular cone.
  bool turns_resist() const { return multibody && solver == Solver::kSequentialImpulse && friction_cone; }
};

std::vector<Setting> declared_settings();
Options read_options(const Settings& settings);

}  // namespace assay::bullet
