// Conditions between joint coordinates that an engine has no constraint for, as joint torques of its adapter:
// couplings, limits of tendons, and ranges of hinges that an engine which knows angles within one turn cannot hold.
//
// Each row is a spring and a damper between its joints, as stiff as an explicit step stands with a margin: of the
// row's effective inertia m and the timestep h, stiffness m / (5 h^2) and damping 0.8 m / h. Under a load that would
// accelerate the row by a, it gives way by 5 h^2 a (5 micrometres of 1 m/s^2 at 1 ms);
// tests/unit/model/joint_rows_test.cc measures it. A limit acts in one direction and does not throw back. Contacts and
// other constraints of the engine only raise the effective inertia, which leaves the step stable.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "model/model.h"

namespace assay {

// Whether a hinge's range leaves so little of a turn that an engine which knows its angle within one turn would take a
// limit that is passed for the other one.
bool is_wide(const Joint& joint);

// `model` without the limits of wide hinges, for an engine whose adapter holds them by rows.
Model without_wide_ranges(Model model);

// Whether rows may act on a model: set_torques() then has to be called before every step.
bool has_joint_rows(const Model& model);

class JointRows {
 public:
  // Which parts of a model become rows.
  struct Parts {
    bool couplings = true, tendon_limits = true, wide_ranges = true;
  };
  JointRows(const Model& model, double timestep, Parts parts);

  bool any() const { return !rows_.empty(); }

  // Adds the rows' torques in `state` to one number a joint. `model` is the one that the engine has, with the joints of
  // the constructor's; `state` has its joint coordinates and its ball joints' bodies.
  void add(const Model& model, const State& state, std::vector<double>& torques);

 private:
  struct Row {
    std::vector<JointTerm> terms;
    double lower = 0, upper = 0;  // of the sum of the terms; equal for a coupling
  };
  // The rows' mutual inverse inertia, of the last configuration that it was computed in.
  void refresh(const Model& model, const State& state);
  bool is_far_from_last(const Model& model, const State& state) const;

  std::vector<Row> rows_;
  double timestep_;
  double size_ = 0;               // m, of the model: what ways along slides are compared with
  Eigen::MatrixXd inverse_;       // rows by rows
  std::vector<double> position_;  // of the configuration of inverse_; empty before the first
  std::vector<Quat> rotations_;   // its ball joints'
};

}  // namespace assay
