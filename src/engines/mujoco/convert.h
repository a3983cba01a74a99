// Between assay's vectors and MuJoCo's arrays.
#pragma once

#include <algorithm>
#include <array>

#include <mujoco/mujoco.h>

#include "model/geometry.h"

namespace assay::mujoco {

inline void copy_quat(const Quat& q, mjtNum* out) { std::ranges::copy(std::array{q.w(), q.x(), q.y(), q.z()}, out); }

// Row `id` of one of MuJoCo's arrays of three numbers.
inline Vec3 triple(const mjtNum* array, int id) { return Eigen::Map<const Vec3>(array + ptrdiff_t{3} * id); }

}  // namespace assay::mujoco
