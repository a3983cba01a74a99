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
  std::optional<double> foot_slip;       // m/s, mean speed along the ground of what touches it
};

// `states` at equal distances, the initial state first; `ended_early`: the run was to go on, but failed after them. A
// shape touches the ground when its lowest point is within kTouching of a plane that it collides with, a sphere also
// when it is that near to a sphere or capsule of the world; its speed is that of the body there, which is exact for
// spheres and for corners and edges that stand.
inline constexpr double kTouching = 2e-3;  // m
Transfer transfer(const Model& model, const std::vector<State>& states, const TransferTask& task, bool ended_early);

// Where two runs from one state part.
struct FirstParting {
  double time_s = 0;     // from the start until a body's centre of mass is more than kPartedMetres from the other run's
  int body = 0;          // the first such body: index into Model::bodies
  int joint = -1;        // that moves bodies apart the most then: index into Model::joints; -1: a free base itself does
  bool contact = false;  // at that sample or the one before, a shape touches the ground in one of the runs only
};

// The same number of samples at the same times (assert). A joint moves bodies apart by the difference of its positions,
// of a hinge times the distance from its anchor of the farthest centre of mass that it carries. Empty for runs that
// never part.
std::optional<FirstParting> first_parting(const Model& model, const std::vector<State>& run,
                                          const std::vector<State>& other);

// Samples of a cell of the measure, a number for each initial state: FirstParting's members, the time kNeverParted for
// a run that never parts and kNotCompared for one that has no other.
inline constexpr const char* kPartingTimes = "parting_s of states";
inline constexpr const char* kPartingBodies = "parting_body of states";
inline constexpr const char* kPartingJoints = "parting_joint of states";
inline constexpr const char* kPartingContacts = "parting_contact of states";
inline constexpr double kNeverParted = -1, kNotCompared = -2;

}  // namespace assay
