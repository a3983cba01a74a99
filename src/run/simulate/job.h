// One run of one contender: what is asked for, read and checked before the first step.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controls/control.h"
#include "engines/registry.h"
#include "load/load_options.h"
#include "model/model.h"

namespace assay {

// Numbers are texts, because sentences about them show them as the user wrote them.
struct SimulateRequest {
  std::string model;  // a file or a system's name
  LoadOptions load;
  std::string contender, timestep, duration;  // ms, s
  std::optional<std::string> sample;          // ms; default: the timestep
  std::string contacts = "on", gravity = "on";
  ControlSpec control;
  std::vector<std::string> settings;  // of the contender: KEY=VALUE
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

// Reads and checks the request and loads the model. Throws InputError.
SimulateJob prepare(const SimulateRequest& request);

// Throws InputError for what the engine refuses; says on standard error what it approximates.
void check_fidelity(const SimulateJob& job);

}  // namespace assay
