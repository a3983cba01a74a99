// A contender's course over results that were measured one after the other, and where it changed.
//
// Times: the logarithms of a contender's step times over the runs are divided into segments of equal level
// (change_points.h). The noise is that between neighbouring runs, at least that within them; the penalty for a change
// grows with the logarithms of the number of runs and of courses, so that few changes are found where nothing changed.
// A segment has at least two runs: what happened in the last run alone is for compare(). Changes below the practical
// threshold are left out. Accuracy is deterministic: it changed where its value did, by at least the threshold.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "results/compare/compare.h"

namespace assay {

struct CoursePoint {
  size_t run = 0;  // index into History::runs
  Interval value;
  std::string outcome;  // "ok", ...; the value is 0 where it is not
};

struct CourseChange {
  size_t run = 0;    // the first one that is different
  double ratio = 1;  // the level after over that before; 0 where an outcome changed
  Change change = Change::kOther;
  std::string text;  // "+5.1 % slower", "ok → diverged"
};

struct Course {
  std::string system, contender, measure, value, unit;
  double timestep_ms = 0;
  bool time = false;
  std::vector<CoursePoint> points;
  std::vector<CourseChange> changes;
};

struct HistoryRun {
  std::string dir, started, commit;  // as stored
};

struct History {
  std::vector<HistoryRun> runs;  // in the order of time
  std::vector<Course> courses;   // those with at least two points
  size_t other_windows = 0;      // times that are left out: not of the windows that the first run timed
  size_t without_control = 0;    // times that are left out: the control has none beside them
  size_t too_short = 0;          // courses of times with too few runs for two levels
  CompareOptions options;
};

// Throws InputError that names the first difference when the runs cannot be compared (compare.h), for fewer than two,
// for one that is named twice,
// and for a control that none of them has timed or that is the harness.
History history(const std::vector<std::string>& dirs, const CompareOptions& options);

// How costly a change is among so many runs and courses.
double change_penalty(size_t runs, size_t courses);

std::string history_markdown(const History& history);  // changes, then levels
nlohmann::json history_json(const History& history);

}  // namespace assay
