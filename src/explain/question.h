// What `assay explain` is asked: a robot, what drives it, and two contenders, from a model or from results.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controls/changes/swaps.h"
#include "controls/control.h"
#include "explain/runs.h"
#include "load/load_options.h"
#include "measures/initial_states.h"
#include "run/messages/messages.h"

namespace assay {

// Numbers are texts, because sentences about them show them as the user wrote them.
struct ExplainRequest {
  std::string model;  // a file or a system's name, or a results directory
  LoadOptions load;
  std::string load_option;  // the first option that says how the model is read; "" without any
  std::string a, b;         // contenders
  ControlSpec control;
  bool control_given = false, policy_given = false;
  std::optional<std::string> timestep, seconds, seeds, system, jobs;
  std::vector<std::string> changes_a, changes_b;
};

bool holds_results(const std::string& model);  // else it is a model's

struct ExplainQuestion {
  ModelSpec spec;
  Model model;
  ControlSpec control_spec;
  std::unique_ptr<Control> control;
  Side a, b;
  InitialStates states;
  int starts = 1, jobs = 1;
  double timestep_ms = 0, sample_ms = 0;
  long long samples = 0;  // of a run, without its initial state

  double seconds() const { return 1e-3 * sample_ms * static_cast<double>(samples); }
  RunPlan plan() const;  // its progress and what else is told are the caller's
  Pairing pairing() const { return {&model, control_spec, control.get(), a, b, timestep_ms}; }
};

// Reads and checks everything. Throws InputError: for what the results do not hold, for contenders and changes that
// there are not, and for a contender that refuses the robot.
ExplainQuestion explain_question(const ExplainRequest& request);

}  // namespace assay
