// A campaign for one robot: what is measured follows from what the robot is.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "controls/control.h"
#include "controls/toml_text.h"
#include "engines/registry.h"
#include "measures/pushes.h"
#include "model/model.h"

namespace assay {

struct ProgrammeOptions {
  std::string model;                     // as the campaign's file names it
  std::vector<std::string> model_lines;  // further lines of each [[system]]: how the model is read
  std::vector<std::string> notes;        // what was decided about how the model is read
  std::optional<ControlSpec> control;    // of the first system; default: what suits the robot
  std::vector<std::string> patterns;     // contenders that may take part, with * and ?; all when empty
  double minutes = 10;
  const Control* policy = nullptr;  // `control` as made, where it is a policy: a file's path counts from the campaign
  // Of a policy: how many initial states it starts from, how long a run is, and at which timesteps; empty: half of that
  // of training, that itself and its double, as far as the control period is a whole number of them.
  int states = 20;
  double duration_s = 10;
  Pushes pushes;
  std::vector<double> timesteps_ms;
  std::map<std::string, std::string> limits;  // of the table [search], as written there: error = 1mm
  std::vector<std::string> other_limits;      // its list `limit`: NAME=QUANTITY
  std::string command;                        // that made it
};

// Contenders that do not take part, and the reason.
struct Refusal {
  std::string engine;
  std::vector<std::string> contenders;
  std::string text;  // "refuses joint armature (12 times, first 'knee'): Havok has no joint armature"
};

struct Programme {
  std::string toml;
  std::vector<std::string> systems;  // a sentence each: what is measured and why
  std::vector<std::string> contenders;
  std::vector<Refusal> refusals;
};

// The systems: the robot at work ("drop" from 5 cm onto the ground where a free robot has one, else "hold"), the robot
// without contacts under seeded random torques ("random"), and, where the model has a reference solution, its smooth
// part that swings freely ("swing"). Contenders are all of the registry that refuse nothing of the model. Throws
// InputError for a model that no contender takes, and for a control that it cannot have. Under a policy there is one
// system, "policy", of which everything is measured.
Programme programme_for(const Model& model, const ProgrammeOptions& options,
                        const Registry& registry = Registry::instance());

}  // namespace assay
