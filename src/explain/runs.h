// The runs of an explanation, in worker processes as those of a campaign: a contender that crashes is an outcome.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "explain/explain.h"
#include "run/messages/messages.h"

namespace assay {

struct RunPlan {
  ModelSpec model;
  ControlSpec control;
  double duration_s = 0, timestep_ms = 0;                     // the timestep of a side that does not change it
  double sample_ms = 0;                                       // a whole number of every timestep that there will be
  InitialStates states;                                       // their number does not matter here
  bool policy = false;                                        // whether the control is one: it is asked for falls
  int jobs = 1;                                               // workers at a time
  double limit_s = 300;                                       // of the runs of one side
  std::function<void(size_t done, size_t of)> progress = {};  // processes of the sides that are run now
  // The states of a run, before only their track is kept: the side's place among those that are run now, and the start.
  std::function<void(size_t side, int start, const std::vector<State>& states)> on_run = {};
};

// What it returns throws SystemError when it is interrupted, InputError and SystemError that a worker reports.
MakeRuns worker_runner(RunPlan plan);

}  // namespace assay
