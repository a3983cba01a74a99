// A body's state as a row of numbers, as arrays hold it outside of C++.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "model/state.h"

namespace assay {

// Position of the centre of mass (m), orientation (w, x, y, z), velocity of the centre of mass (m/s), angular velocity
// (rad/s), all in the world frame.
inline constexpr size_t kBodyRow = 13;

inline void put_body(const BodyState& body, double* row) {
  const Vec3 &p = body.p_WBcm, &v = body.v_WBcm, &w = body.w_WB;
  const Quat& q = body.q_WB;
  const std::array<double, kBodyRow> values = {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(),
                                               v.x(), v.y(), v.z(), w.x(), w.y(), w.z()};
  std::ranges::copy(values, row);
}

// The orientation is normalised.
inline BodyState body_of(const double* row) {
  return {.p_WBcm = {row[0], row[1], row[2]},
          .q_WB = Quat(row[3], row[4], row[5], row[6]).normalized(),
          .v_WBcm = {row[7], row[8], row[9]},
          .w_WB = {row[10], row[11], row[12]}};
}

inline std::vector<double> rows_of(const std::vector<BodyState>& bodies) {
  std::vector<double> rows(kBodyRow * bodies.size());
  for (size_t i = 0; i < bodies.size(); ++i) put_body(bodies[i], &rows[kBodyRow * i]);
  return rows;
}

}  // namespace assay
