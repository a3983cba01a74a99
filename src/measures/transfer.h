// How a run under a policy went: whether the robot stayed up, how well it followed the command, how its feet slipped.
#pragma once

#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "model/model.h"

namespace assay {

// What the policy is to do, and when it has failed.
struct TransferTask {
  int base = -1;                // index into Model::bodies; -1: the robot has none
  std::vector<double> command;  // forward, left (m/s), turning (rad/s) in the base's heading; empty: none
  double fallen_height = -std::numeric_limits<double>::infinity();  // m, of the base frame's origin
  double fallen_tilt = std::numeric_limits<double>::infinity();     // rad, of the base's z axis from the run's start
  struct JointRange {
    int joint = 0;
    double low = 0, high = 0;
  };
  std::vector<JointRange> joints;  // the robot has fallen when one is outside
};

struct Transfer {
  std::optional<double> fell_at;         // s from the run's start, the first sample at which it has fallen
  double up_s = 0;                       // until then, or the whole run
  std::optional<double> velocity_error;  // m/s, mean distance from the commanded planar velocity; of samples when up
  std::optional<double> turning_error;   // rad/s, mean distance from the commanded rate
  std::optional<double> foot_slip;       // m/s, mean horizontal speed of what touches the ground
};

// `states` at equal distances, the initial state first; `ended_early`: the run was to go on, but failed after them. A
// shape touches the ground when its lowest point is within kTouching of a plane that it collides with; its speed is
// that of the body there, which is exact for spheres and for corners and edges that stand.
inline constexpr double kTouching = 2e-3;  // m
Transfer transfer(const Model& model, const std::vector<State>& states, const TransferTask& task, bool ended_early);

}  // namespace assay
