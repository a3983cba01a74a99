// What a contender does with a model, seen from outside: accelerations from small steps at seeded random states,
// put into Newton and Euler's equations of the model (inverse_dynamics.h). What is left over, force by force, is where
// the contender's robot differs from the file's.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "check/parity/inverse_dynamics.h"
#include "engines/registry.h"

namespace assay::parity {

enum class Load {
  kMotion,    // velocities, no gravity, no torques
  kReversed,  // the same velocities, all reversed
  kDoubled,   // twice those velocities
  kDoubledReversed,
  kGravity,     // kMotion with gravity
  kTorque,      // kMotion with a torque on one joint
  kAllTorques,  // kMotion with seeded random torques on all joints
};

// One initial state with its load. Contacts, limits and equality constraints are off.
struct Experiment {
  Load load = Load::kMotion;
  int sample = 0;  // number of the random configuration; experiments of one share positions and velocities
  int joint = -1;  // kTorque: index into Model::joints
  State state;
  std::vector<double> torques;  // by Model::joints
};

// One step of a contender: where it began, and the mean acceleration of the generalized speeds over it.
struct Step {
  State state;
  Eigen::VectorXd acceleration;
};

// What the contender answered, at three timesteps.
struct Response {
  Step middle, fine;         // h/2, h/4
  Eigen::VectorXd residual;  // forces that the model needs for that acceleration, less those that were given;
                             // extrapolated to a timestep of 0
  Eigen::VectorXd noise;     // of the residual: its change when the steps are halved
  Eigen::VectorXd change;    // the same with its sign
  Eigen::VectorXd own;       // part of the residual that was taken off because another contender has it, too
};

struct ExperimentOptions {
  int samples = 6;  // random configurations; joints' torques are tried one by one in the first two of them
  unsigned long seed = 1;
};

// The model as experiments use it: without contacts, limits and equality constraints, and (copy) without gravity.
struct Bench {
  Bench(const Model& model, const ExperimentOptions& options);

  Model with_gravity, without_gravity;
  SpeedLayout layout;
  std::vector<Experiment> experiments;
  Eigen::VectorXd inertia;  // by speed: the joint-space inertia's diagonal in the first configuration, with armature
  Eigen::VectorXd scale;    // by speed: forces that count as large there, N or Nm: what the experiments ask for
  double stiff_step = 0;    // s, that the springs and dampers of joints allow there; infinite without any

  const Model& model_of(const Experiment& experiment) const {
    return experiment.load == Load::kGravity ? with_gravity : without_gravity;
  }
  // Forces that the model `like` (a variant of with_gravity) needs for a step of an experiment.
  Eigen::VectorXd forces(Model& like, const Experiment& experiment, const Step& step) const;
  // The same extrapolated to a timestep of 0, from the two finer steps of a response.
  Eigen::VectorXd forces(Model& like, const Experiment& experiment, const Response& response) const;
};

// The settings that parity uses: the contender's, with an iterative solver's iterations raised as far as the engine
// allows up to 2000, because its model is examined here and not its convergence. `raised` names what was changed.
Settings exact_settings(const ResolvedContender& contender, std::string& raised);

// Runs every experiment. Throws what the engine throws.
std::vector<Response> respond(const Bench& bench, const ResolvedContender& contender, const Settings& settings);

// Takes the residuals of `others`, responses of another contender of the same engine, off those of `responses`: what is
// left is what the two do differently, and the noise what the steps leave open of that.
void take_off(std::vector<Response>& responses, const std::vector<Response>& others);

// Where a limit acts: the position nearest to it from which the contender pulls the joint back, found at rest within
// 3 % of the range around it. Not found: no reaction there at all, or everywhere.
struct LimitPlace {
  int joint = 0;
  bool upper = false;
  double expected = 0;
  bool found = false;
  double place = 0;
};
std::vector<LimitPlace> find_limits(const Model& model, const ResolvedContender& contender, const Settings& settings);

}  // namespace assay::parity
