// match.toml: what the columns of measured logs are, what drives the robot in them, and what is to be fitted.
//
// Each quantity has one name, which is also the name of its column where the file says nothing else:
//   JOINT, JOINT.velocity, JOINT.torque, JOINT.target              of a hinge or slide
//   BODY.x .y .z, BODY.qw .qx .qy .qz, BODY.vx .vy .vz, BODY.wx .wy .wz   of a free body
//
//   [columns]                      # quantity = "column of the file"
//   time = "time"
//   motion = "toss"                # a column that names the motion of each row, in a file with several
//   body = "cube"                  # columns x, y, ..., wz without a body's name are this body's; where the model has
//                                  # only one free body, they are without this line
//   shoulder = "pos_meas1"
//   "shoulder.torque" = "tau_meas1"
//   ignore = ["temperature"]       # columns that are left out, also one with a quantity's name; "*": all that are no
//                                  # quantity. Other unknown ones are refused
//   [units]
//   time = "s"                     # s, ms, us, ns
//   angle = "rad"                  # rad, deg; angular_velocity follows it unless it is given, too
//   angular_velocity = "rad/s"     # rad/s, deg/s, rpm
//   length = "m"                   # m, cm, mm; of linear velocities the same per second
//   torque = "Nm"                  # Nm, mNm, Nmm, Ncm
//   [frames]
//   angular_velocity = "world"     # axes of a free body's wx, wy, wz: world or body
//   velocity = "world"             # axes of its vx, vy, vz
//   point = "frame"                # what x, y, z are of: the body's frame or its centre_of_mass
//   [scale]                        # times what the file has, after its unit: a gear, a sign
//   "elbow.torque" = -6
//   [offset]                       # added after the scale; rad, m
//   elbow = 3.14159
//   [drive]
//   law = "torque"                 # torque, pd, none; without it torque where a log has torques, else none
//   stiffness = 30                 # pd: N m/rad, one for all joints or a table {shoulder = 30, elbow = 10}
//   damping = 1                    # pd: N m s/rad
//   median = 9                     # samples of the median that removes glitches of the torque; odd, 1: none
//   [rows]                         # times (s) of each log that count; a name may have * and ?
//   "double_pendulum_06" = [[0, 4.2], [7.9, 16]]
//   [held_out]
//   logs = ["*_03"]                # names of logs or motions; or
//   share = 0.33                   # of all logs, chosen by `seed`; or
//   leave_one_out = true
//   seed = 1
//   [windows]
//   fit_s = 0.5
//   report_s = 2
//   whole = false                  # whole motions, as where there are impacts; without it by the model's contacts
//   [fit]                          # PARAMETER or PARAMETER:ELEMENT = true, false or [lower, upper]
//   damping = [0, 0.1]
//   "mass:upper" = true
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace assay::match {

inline constexpr double kDegree = 0.017453292519943295;  // rad

enum class DriveLaw { kNone, kTorque, kPd };

struct FitRequest {
  std::string parameter;               // as written: "damping", "mass:upper"
  bool fit = true;                     // false: keep the model's value
  std::optional<double> lower, upper;  // in the parameter's unit; without them its own bounds
  int line = 0;                        // of the configuration's file
};

struct MatchConfig {
  std::string path;                  // "" without a file
  std::map<std::string, int> lines;  // of "columns.elbow", "rows.*_06": where it is in the file, for messages

  // [columns]: quantity -> column. Without an entry the column has the quantity's name.
  std::map<std::string, std::string> columns;
  std::string time_column = "time";
  std::string motion_column;         // "": each file is one motion
  std::string body;                  // whose columns have no prefix; "": none
  std::vector<std::string> ignored;  // columns, patterns with * and ?

  // Factors from the file's units to SI.
  double time_scale = 1, angle_scale = 1, angular_velocity_scale = 1, length_scale = 1, torque_scale = 1;
  bool angular_velocity_in_body = false, velocity_in_body = false;
  bool point_is_centre_of_mass = false;
  std::map<std::string, double> scale, offset;  // quantity -> number

  std::optional<DriveLaw> law;                       // empty: kTorque where a log has torques, else kNone
  std::map<std::string, double> stiffness, damping;  // of a joint; "" for all joints that have none of their own
  int torque_median = 9;                             // samples, odd, for without_glitches(); 1: none

  // [rows]: pattern of names of logs -> spans of time that count, s. Logs that no pattern matches count whole.
  std::vector<std::pair<std::string, std::vector<std::pair<double, double>>>> rows;

  std::vector<std::string> held_out;  // patterns of names; empty: by `held_out_share`
  double held_out_share = 1.0 / 3;
  bool leave_one_out = false;
  std::uint64_t seed = 1;

  double fit_window_s = 0.5, report_window_s = 2;
  std::optional<bool> whole_motions;  // empty: whole where the model has contact pairs

  std::vector<FitRequest> fit;  // in the file's order; empty: a default set
};

// Reads match.toml; "" gives the defaults. What needs the model (names of joints and bodies) or the logs (columns,
// names) is checked by read_logs(). Throws InputError with file and line.
MatchConfig read_match_config(const std::string& path);
MatchConfig parse_match_config(std::string_view text, const std::string& path);

// "match.toml:12" of a key of `lines`; the file alone for another.
std::string config_place(const MatchConfig& config, const std::string& key);

// Of `stiffness` or `damping`: that of the joint, or of all that have none of their own; else 0.
double gain_of(const std::map<std::string, double>& gains, const std::string& joint);

// Whether `name` fits a pattern with * and ?.
bool matches_pattern(const std::string& name, const std::string& pattern);

}  // namespace assay::match
