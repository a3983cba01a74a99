// Which contender, with which parameters, moves as a robot was measured to: each is fitted to the same logs with the
// same effort and judged by logs that it has not seen. docs/reality.md has the definitions.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "match/fit.h"
#include "match/kept_motion.h"
#include "match/log_check.h"
#include "measures/statistics.h"
#include "results/answer.h"

namespace assay::match {

struct MatchQuestion {
  ModelSpec spec;
  Model model;
  std::vector<MeasuredLog> logs;
  MatchConfig config;
  LogCheck check;
  std::vector<std::string> contenders;
  double timestep_ms = 1;
  int jobs = 1;
  int budget = 0;  // candidates of one fit; 0: by the kind of motion
  std::string out;
  std::string like = {};                   // the contender that moved in place of a robot; "": the logs are measured
  std::vector<std::string> warnings = {};  // of the question itself
};

// An error in the unit of what was measured; nothing for what was not.
struct ErrorFigures {
  std::optional<double> joints_deg, position_percent, rotation_deg;

  // By which contenders are ranked: the joints' error in degrees, or the mean of a free body's two.
  double score() const;
};
ErrorFigures figures_of(const WindowError& error, const Windows& windows);
// The mean of each figure over those that have it.
ErrorFigures mean_of(const std::vector<ErrorFigures>& all);

// One held-out log, as one contender explains it.
struct LogResult {
  std::string log;
  ErrorFigures untuned, fitted;              // over the windows that are reported
  ErrorFigures untuned_short, fitted_short;  // over those that fits are made of
  ErrorFigures floor;                        // what the noise of the first states makes of it
  ErrorFigures at_rest;                      // of what stays where the windows begin: a fit has to be better
  int windows = 0, unpredictable = 0, failed = 0;
};

struct Phase {
  std::string name;  // "before the first impact", "at it" (50 ms), "after it"
  ErrorFigures fitted;
};

// What a fit is worth at a timestep, over the held-out windows that are reported and predictable.
struct TimestepResult {
  double timestep_ms = 0;
  ErrorFigures error;  // the mean over logs
  Interval score;      // as ContenderResult's
  int windows = 0, failed = 0;
};

struct ContenderResult {
  std::string contender;
  std::string failure;  // why there is no fit; "" where there is
  std::vector<Parameter> parameters;
  Fit fit;                      // to the training logs; with leave_one_out to all of them
  std::vector<LogResult> logs;  // held out
  std::vector<Phase> phases;
  std::vector<TimestepResult> timesteps;  // ascending; the fit's own among them
  Interval score, untuned_score;          // means over logs, bootstrap
  bool as_good_as_best = false;
  std::optional<Interval> behind_best;  // score difference to the best one, paired
  std::vector<std::string> changes;     // of the fitted model
  std::map<std::string, std::string> settings;
  std::vector<std::string> warnings;
  double engine_s = 0;
  int evaluations = 0;

  // Whether the fit explains held-out logs less well than the model as it is.
  bool worse_than_untuned() const;
  // It predicts the motion no better than if nothing moved.
  bool no_better_than_rest() const;
};

struct MatchAnswer {
  std::vector<ContenderResult> contenders;  // best first, failed ones last
  std::vector<std::string> training, held_out;
  std::vector<std::string> unpredictable;  // logs whose windows are all left out, in words
  std::vector<std::string> odd_logs;       // that no contender explains though the others are, in words
  std::vector<std::string> odd_names;      // the same logs
  std::vector<std::string> warnings;
  bool whole = false, leave_one_out = false;
  std::vector<std::string> to_do;  // contenders that were not fitted yet
  std::vector<KeptLog> motion;     // to look at; empty as long as there is something to do, and where all have failed
};

// Throws InputError for what match() would refuse before it fits anything: logs without a usable stretch to fit to or
// to judge by, a drive that they do not have, parameters or bounds that cannot be. With `parameters_alone` nothing is
// asked of the logs.
void check_question(const MatchQuestion& question, bool parameters_alone = false);

// `progress` gets sentences, `so_far` the answer before each contender is fitted. Throws InputError, SystemError
// (interrupted, a full disk).
MatchAnswer match(const MatchQuestion& question, const std::function<void(const std::string&)>& progress,
                  const std::function<void(const MatchAnswer&)>& so_far = {});

// The model with what was fitted, as CONTENDER.xml in `folder`, for each contender with a fit; as CONTENDER.urdf, too,
// where URDF can hold what was fitted of the robot. Returns a sentence for each that MJCF cannot hold. Throws
// SystemError.
std::vector<std::string> write_fitted_models(const MatchQuestion& question, const MatchAnswer& answer,
                                             const std::string& folder);

// Of everything that the answer depends on, but the program.
std::string match_key(const MatchQuestion& question);

// "10.5 % / 11.4 deg"; "-" without figures.
std::string figures_text(const ErrorFigures& figures);

// The answer in two or three sentences.
std::string answer_text(const MatchQuestion& question, const MatchAnswer& answer);

nlohmann::ordered_json match_json(const MatchQuestion& question, const MatchAnswer& answer);
// For people.
Answer match_text(const MatchQuestion& question, const MatchAnswer& answer);

}  // namespace assay::match
