#include "measures/reference/dynamics.h"

#include <cassert>

#include "measures/reference/system.h"

namespace assay {
namespace {

using reference::Flat;
using reference::Group;
using reference::Matrix;
using reference::Part;
using reference::Vector;

}  // namespace

struct Dynamics::Parts {
  explicit Parts(const Model& model) : system(model, {}) {}

  // calls use(group, inertia, force) for each group of bodies, with or without springs
  template <typename Use>
  void each_group(const State& state, bool applied, const Use& use) {
    const Flat y = system.flatten(state);
    system.prepare(y, state.time);
    Matrix inertia;
    Vector force;
    for (const Group& group : system.groups()) {
      system.assemble(group, y, applied, inertia, force);
      use(group, inertia, force);
    }
  }

  // calls use(k, column) for each speed of a group and its place in v
  template <typename Use>
  void each_speed(const Group& group, const Use& use) const {
    for (const int body : group.bodies) {
      const Part& part = system.parts()[body];
      for (int k = 0; k < part.speeds(); ++k) use(part.group_speed + k, system.column(part) + k);
    }
  }

  Eigen::VectorXd forces(const State& state, bool applied) {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(system.speeds());
    each_group(state, applied, [&](const Group& group, const Matrix&, const Vector& force) {
      each_speed(group, [&](int k, int column) { out[column] = static_cast<double>(force[k]); });
    });
    return out;
  }

  reference::System system;
};

Dynamics::Dynamics(const Model& model) : parts_(std::make_unique<Parts>(model)) {}
Dynamics::~Dynamics() = default;

int Dynamics::size() const { return parts_->system.speeds(); }

int Dynamics::first_of(int body) const { return parts_->system.column(parts_->system.parts()[body]); }

Eigen::VectorXd Dynamics::velocities(const State& state) const {
  const Flat y = parts_->system.flatten(state);
  Eigen::VectorXd v(size());
  const size_t first = y.size() - static_cast<size_t>(size());
  for (int k = 0; k < size(); ++k) v[k] = static_cast<double>(y[first + static_cast<size_t>(k)]);
  return v;
}

Eigen::MatrixXd Dynamics::mass_matrix(const State& state) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(size(), size());
  parts_->each_group(state, false, [&](const Group& group, const Matrix& inertia, const Vector&) {
    parts_->each_speed(group, [&](int i, int row) {
      parts_->each_speed(group, [&](int k, int column) { out(row, column) = static_cast<double>(inertia(i, k)); });
    });
  });
  return out;
}

Eigen::VectorXd Dynamics::bias_forces(const State& state) { return -parts_->forces(state, false); }

Eigen::VectorXd Dynamics::spring_forces(const State& state) {
  const Flat y = parts_->system.flatten(state);
  Vector springs = Vector::Zero(size());
  parts_->system.add_springs(y, springs);
  return springs.cast<double>();
}

Eigen::VectorXd Dynamics::accelerations(const State& state, std::span<const double> forces) {
  assert(forces.empty() || static_cast<int>(forces.size()) == size());
  Vector springs = Vector::Zero(size());
  parts_->system.add_springs(parts_->system.flatten(state), springs);
  Eigen::VectorXd out(size());
  parts_->each_group(state, false, [&](const Group& group, const Matrix& inertia, const Vector& force) {
    Vector total = force;
    parts_->each_speed(group, [&](int k, int column) {
      total[k] += springs[column];
      if (!forces.empty()) total[k] += static_cast<reference::Real>(forces[static_cast<size_t>(column)]);
    });
    const Vector acceleration = parts_->system.accelerations(group, inertia, total);
    parts_->each_speed(group, [&](int k, int column) { out[column] = static_cast<double>(acceleration[k]); });
  });
  return out;
}

}  // namespace assay
