// Joint-space dynamics of a model at one state, independent of every engine: inertia matrix, bias forces and
// accelerations. The same equations as the reference solution's (smooth.h), in extended precision.
//
// Generalized velocities v, in the order of Model::bodies: of a free body the velocity of its centre of mass and its
// angular velocity (6, world axes); of a ball joint the relative angular velocity (3, child axes); of a hinge or slide
// its rate (1). Generalized forces go with them: N and Nm. Contacts, limits and dry friction are not part of it.
#pragma once

#include <memory>
#include <span>

#include <Eigen/Core>

#include "model/model.h"

namespace assay {

class Dynamics {
 public:
  // `model` has to outlive this.
  explicit Dynamics(const Model& model);
  ~Dynamics();
  Dynamics(const Dynamics&) = delete;
  Dynamics& operator=(const Dynamics&) = delete;

  // Number of generalized velocities: Model::dof().
  int size() const;
  // Where the velocities of a body's joint begin in v.
  int first_of(int body) const;
  // v of a state.
  Eigen::VectorXd velocities(const State& state) const;

  // Joint-space inertia M(q), armature included, size x size, symmetric.
  Eigen::MatrixXd mass_matrix(const State& state);
  // Bias h(q, v) of M v' + h = f: Coriolis, centrifugal and gyroscopic forces less gravity's.
  Eigen::VectorXd bias_forces(const State& state);
  // Forces of the springs and dampers of joints, ball joints and tendons.
  Eigen::VectorXd spring_forces(const State& state);
  // v' = M^-1 (f - h + springs), on the equality constraints. `forces` has size() numbers, or none for zero.
  Eigen::VectorXd accelerations(const State& state, std::span<const double> forces = {});

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace assay
