// What `assay simulate` is asked to do, read and checked before the first step.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/control_options.h"
#include "cli/model_options.h"
#include "controls/control.h"
#include "engines/registry.h"
#include "model/model.h"

namespace assay::cli {

// As given on the command line.
struct SimulateOptions {
  ModelOptions model;
  std::string engine, timestep, duration, out;
  std::optional<std::string> sample;
  std::string contacts = "on", gravity = "on";
  std::optional<std::string> control;  // default: actuators
  PolicyOptions policy;
  std::vector<std::string> set;
  bool time = false;
};

// Everything that is known before the first step.
struct SimulateJob {
  Model model;
  std::unique_ptr<Control> control;
  bool engine_drives = false;  // the engine computes the control itself: torques are zero (equip_for)
  ResolvedContender contender;
  std::vector<Limitation> feedback;  // what the contender does with that of actuators
  double timestep_ms = 0;
  double duration_s = 0;
  long long steps_per_sample = 1;
  long long steps = 0;  // a whole number of samples
};

// Reads and checks the options and loads the model. Throws InputError.
SimulateJob prepare(const SimulateOptions& options);

// Throws InputError for what the engine refuses; prints what it approximates.
void check_fidelity(const SimulateJob& job);

}  // namespace assay::cli
