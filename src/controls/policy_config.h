// The configuration of a policy: the conventions under which it was trained, in the terms of the field. One TOML file:
//
//   network = "policy.onnx"           # beside this file; a CSV file is a recorded sequence of actions (policy.h)
//   output = "actions"                # of a network with several outputs
//   trained_in = "mujoco-euler"       # contender that the others are compared with
//   base = "trunk"                    # body whose frame observations are in; default: the only free body
//   joints = ["FL_hip", "FL_thigh"]   # order of joints in observations and actions; default: the robot's
//   default_joint_pos = {"*_hip" = 0.1, "*_thigh" = 0.8}    # rad, m; default: the robot's initial state
//
//   [control]
//   timestep_ms = 5                   # of the engine in training
//   decimation = 4                    # engine steps in a control step there: the control period is 20 ms here too
//   period_ms = 20                    # in place of both, or to check them
//   delay = 0                         # control steps from an observation to the first torque that it decides
//
//   [observations]
//   history = 1                       # control steps
//   history_order = "oldest_first"    # or newest_first
//   history_layout = "term"           # each term's history in turn; or "step": all terms of a step in turn
//   history_start = "first"           # before the first step: its observation; or "zero"
//   clip = 100                        # of every number, after its scale: a number or [low, high]
//   [[observations.terms]]            # in the network's order
//   term = "base_ang_vel"             # see policy_terms()
//   scale = 0.25                      # a number, or one for each
//   clip = 10                         # before the scale
//   joints = ["FL_hip"]               # of joint terms: others than `joints`, or another order
//
//   [actions]
//   type = "joint_position"           # joint_velocity, joint_effort
//   joints = ["FL_hip"]               # others than `joints`, or another order
//   clip = 100                        # of the network's numbers; last_action is what remains
//   scale = 0.25                      # target = offset + scale action: rad, m; rad/s, m/s; Nm, N
//   offset = "default"                # the default of joint_position: default_joint_pos; else 0
//
//   [pd]                              # not for joint_effort
//   law = "explicit"                  # torque = stiffness (target - position) - damping rate, of each step's start; or
//                                     # "engine": stiffness and damping are springs of the engine, without a clamp
//   stiffness = {"*" = 25}            # Nm/rad, N/m
//   damping = 0.5                     # Nms/rad, Ns/m
//   effort_limit = 23.7               # Nm, N; inf for none; default: the robot's
//
//   [hold]                            # springs of the engine on joints without targets: no actions, or efforts
//   joints = ["arm_shoulder"]
//   position = 0                      # rad, m, at which the springs are at rest; default: default_joint_pos
//   stiffness = 40                    # Nm/rad, N/m; added to the robot's own, as the damping
//   damping = 1                       # Nms/rad, Ns/m
//
//   [command]
//   velocity = [0.5, 0, 0]            # forward, left (m/s) and turning (rad/s), in the base's heading
//
//   [termination]                     # the robot has fallen
//   base_height_below = 0.2           # m, of the base frame's origin
//   base_tilt_above = 0.8             # rad, between the base's z axis and its direction in the initial state
//   joint_outside = {hinge = [-0.5, 0.5]}    # rad, m
//
// What is a number for each joint is a number for all, a list in their order, or a table of patterns with * and ?, of
// which exactly one matches each joint.
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "model/model.h"

namespace assay {

enum class TermKind {
  kBaseLinearVelocity,
  kBaseAngularVelocity,
  kProjectedGravity,
  kBaseQuaternion,
  kBaseHeight,
  kCommand,
  kJointPositionRelative,
  kJointPosition,
  kJointVelocity,
  kLastAction,
  kPhase,
  kConstant,
};

// The terms' names, in the order of the enumeration. Vectors are in the base's axes.
//   base_lin_vel        of the base frame's origin, m/s (3)
//   base_ang_vel        rad/s (3)
//   projected_gravity   unit vector along gravity (3)
//   base_quat_wxyz      orientation of the base in the world, its first number not negative (4)
//   base_height         z of the base frame's origin, m (1)
//   velocity_commands   of [command] (3)
//   joint_pos_rel       position minus default_joint_pos, rad or m
//   joint_pos           position
//   joint_vel_rel       rate, rad/s or m/s
//   last_action         what the network gave in the step before, clipped, 0 in the first one
//   phase               sine and cosine of 2 pi t / `period_s` (2)
//   constant            the numbers of `values`
const std::vector<std::string>& policy_terms();

struct Range {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  bool operator==(const Range&) const = default;
};

struct ObservationTerm {
  TermKind kind = TermKind::kConstant;
  std::vector<int> joints;         // of joint terms
  std::vector<double> joint_zero;  // that is taken off each joint's position
  std::vector<double> values;      // constant
  double period_s = 0;             // phase
  Range clip;
  std::vector<double> scale;  // one for each number of the term

  size_t size() const { return scale.size(); }
};

enum class ActionType { kPosition, kVelocity, kEffort };

struct PolicyConfig {
  std::string path, hash;       // of the file
  std::string network;          // path; empty: not given
  std::string output;           // of the network; empty: its only one
  std::string trained_in;       // empty: not given
  double period_s = 0;          // of control
  double train_timestep_s = 0;  // 0: not given
  int delay = 0;                // control steps
  int base = -1;                // index into Model::bodies; -1: the robot has none, and no term needs one

  std::vector<ObservationTerm> terms;
  int history = 1;
  bool newest_first = false, by_step = false, zero_start = false;
  Range clip;

  ActionType type = ActionType::kPosition;
  std::vector<int> joints;  // of each action, indices into Model::joints
  Range action_clip;
  std::vector<double> scale, offset;  // of each action
  bool engine_drives = false;
  std::vector<double> stiffness, damping, effort_limit;  // of each action

  std::vector<int> held;  // indices into Model::joints; the next three have one number for each
  std::vector<double> held_position, held_stiffness, held_damping;

  std::vector<double> command;  // forward, left, turning; empty: none

  double fallen_height = -std::numeric_limits<double>::infinity();  // m
  double fallen_tilt = std::numeric_limits<double>::infinity();     // rad
  std::vector<std::pair<int, Range>> joint_range;

  size_t observations() const;  // of one control step
  size_t inputs() const { return observations() * static_cast<size_t>(history); }
};

// Reads and checks the configuration against the robot. Throws InputError with file and line: what the file has, what
// the robot has, and how to mend it.
PolicyConfig read_policy_config(const Model& model, const std::string& path);
// The same of a text; `path` is for messages and for what stands beside it.
PolicyConfig parse_policy_config(const Model& model, std::string_view text, const std::string& path);

}  // namespace assay
