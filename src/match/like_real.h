// What a match (`assay match`) found of contenders at several timesteps, as candidates for the question which of them
// is the fastest that moves as the robot did.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "match/match.h"

namespace assay::match {

// A fitted contender at a timestep.
struct RealPoint {
  std::string contender;
  double timestep_ms = 0;
  ErrorFigures error;  // of held-out motion: the largest at this timestep and all smaller ones
  double score = 0;    // the same of ErrorFigures::score()
  int windows = 0, failed = 0;
};

struct RealContender {
  std::string name, base;                       // `base` with `settings` is what was fitted
  std::map<std::string, std::string> settings;  // that were fitted
};

// A match as its folder has it.
struct RealMatch {
  std::string model_hash;
  double timestep_ms = 0;  // of the fits
  std::vector<RealContender> contenders;
  std::vector<RealPoint> points;  // by contender, then ascending timestep
  double best_high = 0;           // the upper end of the best contender's interval of the score
  std::string best;
  std::vector<std::string> to_do;  // contenders that were not fitted yet
};

// Throws InputError for a folder that is none of a match, or of one that fitted nothing.
RealMatch read_real_match(const std::string& dir);

// "5%" of the body's size, "2deg" of joints and rotations; absent: as good as the best contender, within the interval
// of its error.
struct RealLimit {
  std::optional<double> percent, degrees;
  std::string text;  // as given, or in words
};
// Throws InputError for another unit, and for one that nothing of the match has.
RealLimit real_limit(const std::optional<std::string>& given, const RealMatch& match);

bool is_within(const RealPoint& point, const RealLimit& limit, const RealMatch& match);

// The campaign that times the contenders, with what was fitted of their settings, at every timestep of `points`.
// `model` and `model_lines` as ProgrammeOptions has them (run/search/programme.h), `system` is the model's name.
std::string timing_campaign(const RealMatch& match, const std::vector<RealPoint>& points, const std::string& system,
                            const std::string& model, const std::vector<std::string>& model_lines);

}  // namespace assay::match
