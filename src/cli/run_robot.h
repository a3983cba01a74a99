// `assay run ROBOT` and campaigns that are searched: the programme, the search and the answer.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/campaign_run.h"
#include "cli/control_options.h"
#include "cli/model_options.h"
#include "cli/recommend.h"

namespace assay::cli {

struct RobotRequest {
  RunRequest run;      // its campaign: the robot, as given
  ModelOptions model;  // how it is read
  LimitOptions limits;
  std::optional<std::string> minutes;  // as given; default: 10
  std::optional<std::string> control;  // as given; default: what suits the robot
  PolicyOptions policy;
  // Of a run under a policy, as given.
  std::optional<std::string> seeds, seconds, push, push_every, push_joint;
  std::vector<std::string> timesteps;
  std::vector<std::string> contenders;  // names or patterns; default: all
  std::string like_real;                // folder of a match; "": none
  bool plan_only = false;               // write the programme, measure nothing
};

// Whether `run` is given a model rather than a campaign: a URDF or MJCF file by its ending or its first character, a
// robot of the packages, or the name of a system that is no campaign's.
bool is_robot(const std::string& given);

// Writes a programme for the robot into the results directory, searches it and prints the answer. The status.
int run_robot(const RobotRequest& request);

// Times what a match found to move as measured, and prints the fastest of it. The status.
int run_like_real(const RobotRequest& request);

// Searches a campaign that has a table [search], and prints the answer. The status.
int run_searched(const RunRequest& request);

}  // namespace assay::cli
