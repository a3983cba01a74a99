// Between assay's vectors and ODE's.
#pragma once

#include <array>

#include <ode/ode.h>

#include "model/geometry.h"

namespace assay::ode {

inline Vec3 vec3(const dReal* v) { return {v[0], v[1], v[2]}; }

inline std::array<dReal, 4> ode_quaternion(const Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }

}  // namespace assay::ode
