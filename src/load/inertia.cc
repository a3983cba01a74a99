#include "load/inertia.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>

namespace assay {
namespace {

constexpr double kRounding = 1e-9;  // of the largest moment

}  // namespace

RigidPart joined(const RigidPart& a, const RigidPart& b) {
  if (a.mass == 0 && a.I.isZero(0)) return b;
  if (b.mass == 0 && b.I.isZero(0)) return a;
  RigidPart whole;
  whole.mass = a.mass + b.mass;
  whole.p = whole.mass > 0 ? Vec3((a.mass * a.p + b.mass * b.p) / whole.mass) : Vec3::Zero();
  for (const RigidPart* part : {&a, &b}) {
    const Vec3 d = part->p - whole.p;
    whole.I += part->I + part->mass * (d.squaredNorm() * Mat3::Identity() - d * d.transpose());
  }
  return whole;
}

Vec3 principal_moments(const Mat3& I) {
  return Eigen::SelfAdjointEigenSolver<Mat3>(I, Eigen::EigenvaluesOnly).eigenvalues();
}

bool inertia_valid(const Mat3& I) {
  const Vec3 m = principal_moments(I);
  return m[0] > 0 && m[0] > kRounding * 1e-3 * m[2] && m[0] + m[1] >= m[2] * (1 - kRounding);
}

bool inertia_possible(const Mat3& I) {
  const Vec3 m = principal_moments(I);
  return m[2] >= 0 && m[0] >= -kRounding * m[2] && m[0] + m[1] >= m[2] * (1 - kRounding);
}

Mat3 nearest_valid_inertia(const Mat3& I, double mass) {
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(I);
  Vec3 m = solver.eigenvalues();
  constexpr double kLeastRadius = 1e-3;
  const double floor = std::max(1e-6 * m.cwiseAbs().maxCoeff(), 0.4 * mass * kLeastRadius * kLeastRadius * 1e-6);
  // an inertia without any extent: a ball of water
  constexpr double kDensity = 1000;
  const double radius = std::cbrt(mass / kDensity * 3 / (4 * std::numbers::pi));
  const double least = m.maxCoeff() <= 0 ? 0.4 * mass * radius * radius : floor;
  m = m.cwiseMax(least);
  constexpr double kMargin = 1e-6;  // of the largest, against rounding in text
  // the nearest point of the plane m0 + m1 = m2; only the largest moment can exceed the sum of the others
  if (const double excess = m[2] * (1 + kMargin) - m[0] - m[1]; excess > 0) {
    m[0] += excess / 3;
    m[1] += excess / 3;
    m[2] -= excess / 3;
  }
  return solver.eigenvectors() * m.asDiagonal() * solver.eigenvectors().transpose();
}

}  // namespace assay
