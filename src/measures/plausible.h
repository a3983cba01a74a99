// Whether a state can belong to the model's motion: separates the outcomes `unstable` and `diverged` from a large
// error.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"

namespace assay {

// The version of these rules, stored with results: results/soundness.h judges older ones again. 1: not stored, a hinge
// may pass its limit any number of times or once (versions before 0.3). 2: all scales are positive, ball joints count.
// 3: how deep a shape may lie below the ground scales with the robot, not with the body.
inline constexpr int kSoundnessRules = 3;
// In the reason of a shape that lies below the ground.
inline constexpr const char* kBelowGround = "lies wholly below the ground";

// What a contender computes with: it bounds the motion that rounding makes of rest.
struct Arithmetic {
  bool single_precision = true;
  double timestep_s = 1e-3;
};

// Bounds that follow from a model and its initial state. `work`, J, is the most energy that a control can have added.
// All scales are positive for every model: also where joints pass through centres of mass, and at rest without gravity.
class Plausibility {
 public:
  Plausibility(const Model& model, const State& start, double duration_s, double work = 0,
               const Arithmetic& arithmetic = {});

  // Why the run has diverged: a non-finite number, or a body farther from the origin than 1000 times its reach. "" when
  // the run may continue.
  std::string divergence(const State& state) const;

  // Why no motion of the model reaches this finite state: more than kEnergyFactor times the available kinetic energy, a
  // joint torn apart by more than the model's size(), a hinge more than a turn beyond its limit, or a body's shape that
  // lies as a whole below the ground that it collides with, by more than kGroundShare of the robot's length with all
  // joints stretched, or of size() where that is more: less deep it is a penetration, which has a measure of its own.
  // "" for a possible state.
  std::string impossibility(const State& state) const;

  double reach() const { return reach_; }                        // m
  double available_energy() const { return available_energy_; }  // J
  // The energy of a model at rest as far as the contender's arithmetic can tell: each point moves by the rounding of
  // its position in each step, and what the start violates is corrected in one. J, positive.
  double rest_energy() const { return rest_energy_; }
  // The largest distance of a joint's anchor and the centre of mass of a body that it connects; at least the largest
  // radius of gyration of these bodies, and kSizeShare of the model's length with all joints stretched. m, positive.
  double size() const { return size_; }

  // Corresponds to twice the possible speed, far beyond the drift of a working method.
  static constexpr double kEnergyFactor = 4;
  static constexpr double kSizeShare = 0.01;
  static constexpr double kGroundShare = 0.02;

 private:
  // How far rounding alone may put a point at this distance from the origin, m.
  double rounding(const Vec3& p_W) const { return 1e3 * unit_ * p_W.norm(); }
  void find_size(const std::vector<double>& far);
  void find_rest(const State& start, const std::vector<double>& far, const Arithmetic& arithmetic);
  std::string torn(const State& state) const;
  std::string below_ground(const State& state) const;

  const Model& model_;
  double reach_ = 0;
  double available_energy_ = 0, rest_energy_ = 0;
  double size_ = 0;
  double length_ = 0;  // of the longest stretched chain, m
  double unit_ = 0;    // rounding of the contender's numbers, relative
};

}  // namespace assay
