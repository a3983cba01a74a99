// The adapter's settings in MuJoCo's terms.
#pragma once

#include <array>
#include <string>
#include <vector>

#include <mujoco/mujoco.h>

#include "engines/adapter.h"

namespace assay::mujoco {

std::vector<Setting> declared_settings();

// Timestep, solvers and flags. The meaning of each setting is in its declaration in options.cc.
void set_options(const Settings& settings, const Vec3& gravity, mjOption& option);

// Springs and dampers are torques of the adapter's instead of MuJoCo's own.
// Whether the actuators of a model become MuJoCo's own.
bool has_own_actuators(const Settings& settings);

bool has_explicit_pd(const Settings& settings);

// The solver's name in words.
const char* solver_text(const Settings& settings);

struct Softness {
  std::array<mjtNum, mjNREF> reference;
  std::array<mjtNum, mjNIMP> impedance;
};
// Of "contact", "limit" or "equality".
Softness softness(const Settings& settings, const std::string& kind);
// Makes a contact of two bodies with this sum of inverse masses (1/kg, as MuJoCo reckons with them) a spring and
// damper.
void make_compliant(const ContactCompliance& compliance, double inverse_mass, mjtNum* reference, mjtNum* impedance,
                    mjtNum* friction_reference);
// A constraint of a velocity: only its time constant and impedance at no violation count.
Softness dry_friction_softness(const Settings& settings);

}  // namespace assay::mujoco
