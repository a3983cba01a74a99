// Does a file mean the same robot in every engine? Black-box accelerations of each contender against Newton and Euler's
// equations of the model: a table of errors by joint and kind of force, and the parameters that explain them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "check/parity/experiments.h"

namespace assay::parity {

// Kinds of force that the experiments tell apart. Armature and torque are what a joint's own row shows in all
// experiments at once: how much of its residual goes with its own acceleration, and how much with the torque that its
// actuators give it.
enum class Part { kInertia, kCoriolis, kGravity, kSprings, kDamping, kDryFriction, kArmature, kTorque };
inline constexpr int kParts = 8;
const char* part_name(Part part);  // "inertia", ...

// One error of a joint or free body: of the force, relative to the largest force of that kind there; of armature,
// relative to the joint's inertia; of the torque, of its gain.
struct PartError {
  double error = 0;  // relative; 0 where the model has no such force and the contender neither
  double noise = 0;  // of the same unit: what the extrapolation leaves open
};

struct JointErrors {
  std::string element;           // "joint 'knee'", "body 'torso'"
  std::vector<PartError> parts;  // by Part
};

// A parameter that explains what was seen.
struct Cause {
  std::string element;    // "joint 'ankle'", "body 'foot'"
  std::string parameter;  // "armature", "axis", "mass", "torque", "upper limit", ...
  std::string seen;       // in words: "0.0099 kg m^2 instead of 0.01", "turned by 0.57 degrees"
  double change = 0;      // relative to the model's value where it has one, else absolute
  double effect = 0;      // the largest force error that it explains, relative to the joint's inertia times 20 rad/s^2
  double explains = 0;    // share of the squared error that was left before it
  // Other parameters that would explain it as well, with what would be seen of them: "body 'upper arm': inertia 3 times
  // the model's". An inertia about a hinge that the world holds acts as its armature does.
  std::vector<std::string> alike = {};
};

struct Certificate {
  std::string contender, engine;
  std::string beside;                    // the contender that it was compared with in place of the model, "" for none
  std::string raised;                    // solver settings that were raised for the examination; "" for none
  std::vector<std::string> differences;  // what the adapter declares for this model: approximated, "element: how"
  std::string failure;                   // why it could not be examined: refused or the engine's message; "" otherwise
  std::vector<JointErrors> joints;
  std::vector<LimitPlace> limits;
  std::vector<Cause> causes;    // first cause first; empty when the robots agree
  double error = 0, noise = 0;  // largest residual and its noise, relative to the bench's scale
  double unexplained = 0;       // largest residual after the causes

  // Its own error hides nothing that matters: it is small, or in a comparison of two of one engine, which have it in
  // common, small beside what is seen.
  bool settled() const;
  bool agrees() const { return failure.empty() && causes.empty() && error <= tolerance(); }
  // Errors up to this are not told from rounding and the extrapolation's remainder.
  double tolerance() const;
  bool single_precision = false;
};

// Refusals and engine failures end in Certificate::failure. With `beside`, another contender of the same engine, the
// question is whether the robot is the same in both: the error that the engine's small steps have in both is no part of
// the answer, which may settle what no comparison with the model does. Limits are left out then.
Certificate examine(const Model& model, const Bench& bench, const ResolvedContender& contender,
                    const ResolvedContender* beside = nullptr);

}  // namespace assay::parity
