// Are two files one robot? Matches joints, bodies and actuators of two models, puts the second into the frames of the
// first, and lists what differs in physical terms, each difference with what it alone does to the motion. It reads
// models, not files: a further format only has to be loaded and to say what it can hold (Format).
//
// Names, frames of bodies, order of elements, drawings and masses of the world do not move a robot, and neither do
// bodies that one file keeps apart and the other joins: loading has fused what no joint separates.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/model.h"

namespace assay::pairing {

// What a file of a format can say. Where one of two cannot, a difference in it is the format's and no finding.
struct Format {
  std::string name = "MJCF";
  bool drives = true;            // laws and gains of actuators; without them joints have motors that the loader adds
  bool contact_friction = true;  // coefficients; without them loading takes MuJoCo's
  bool velocity_limits = false;
};

struct Side {
  std::string file = {};  // as its user named it
  Format format = {};
  Model model = {};
  std::map<std::string, double> velocity_limits = {};  // by joint: rad/s, m/s
  bool base_changed = false;  // loaded with another root joint than the file's, because the other file has that one
};

struct Options {
  std::vector<std::pair<std::string, std::string>> map = {};  // joints, bodies or actuators that are one: A's, B's name
  int samples = 8;                                            // random states
  unsigned long seed = 1;
};

enum class How { kMap, kName, kKinematics, kStructure };
const char* how_text(How how);  // "map", "name", "kinematics", "structure"

struct Match {
  std::string kind;  // "joint", "free body", "actuator"
  std::string a, b;  // names
  How how = How::kName;
  bool reversed = false;  // the joint's axis points the other way, which its limits and drives follow
};

// Something that one file has and the other has not: a sentence without its end.
struct Finding {
  std::string element;  // "joint 'gripper'"
  std::string words;    // "only in A: compared with it locked at 0"
};

struct Difference {
  std::string element = {};    // by A's names: "joint 'knee'", "body 'shin'"
  std::string parameter = {};  // "mass", "centre of mass", "damping", ...
  std::string unit = {};       // of the values, "" for none
  std::optional<double> a = {}, b = {};
  std::string words = {};  // "1.01 kg instead of 1 kg (+1 %)": B's instead of A's
  // What it does when B's value is put into A, relative: of masses, inertias, joints' places, springs, damping, dry
  // friction and armature the change of a joint's force, root mean square over random states (positions within limits,
  // velocities, accelerations of 5 rad/s^2), to that force of A, of the joint where this is largest. Of limits to the
  // joint's range, of actuators, force and velocity limits and contact friction to A's value, of shapes to their size.
  double effect = 0;
  double share = 0;       // of the sum of all effects
  std::string felt = {};  // the joint that feels it most; "" where the effect is no joint's force
};

// Bodies after one second in one engine.
struct Motion {
  std::string contender = {};
  std::string failure = {};  // why there is none; "" otherwise
  double distance = 0;       // m, largest of a matched body's centres of mass within the second
  std::string body = {};     // which
  double travelled = 0;      // m, of that body in A
  std::string note = {};     // what both ran without
};

struct Comparison {
  size_t joints_a = 0, joints_b = 0, joints_matched = 0;  // hinges, slides and ball joints
  double mass_a = 0, mass_b = 0;                          // kg, of what moves and is compared
  std::vector<Match> matches;
  std::vector<Finding> findings;         // structure
  std::vector<Difference> differences;   // largest effect first
  std::vector<std::string> notes;        // what was not compared, or does not move the robot
  std::vector<Finding> format_findings;  // what one format cannot say
  double total = 0;                      // effect of all differences of the joints' forces at once
  Motion motion;

  bool same() const { return findings.empty() && differences.empty(); }
  // Whether anything has an effect of at least `share`; findings always do.
  bool differs_above(double share) const;
};

// Throws InputError for a name of `map` that a file does not have, and for two models that are no pair: "17 of 29
// joints match: give --map A_NAME=B_NAME".
Comparison compare(const Side& a, const Side& b, const Options& options);

// B, in its own frames and under its own names, with A's values wherever its elements match. Throws as compare().
Model agreed(const Side& a, const Side& b, const Options& options);

}  // namespace assay::pairing
