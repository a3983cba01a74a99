// Which jobs the accuracy pass of a campaign's run has, before any of them runs.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "run/coordinator/run_kept.h"
#include "run/coordinator/run_time_left.h"

namespace assay {

// A job that may wait for runs, or that makes one.
struct AccuracyJob {
  Job job;
  std::set<std::string> needs;  // addresses
  std::vector<const PlannedCell*> cells;
  std::vector<const PlannedCell*> part_of = {};  // cells whose cost includes it
  double run_s = 0;                              // its cost, of a run that no cell of this part reads
  bool is_made = true;                           // and not read from the results
  std::string makes = {};                        // address of what others of `waiting` wait for, "" for nothing
};

struct AccuracyJobs {
  std::map<std::string, AccuracyJob> producers;  // by address of what they make: nothing has to be there before
  std::vector<AccuracyJob> waiting;
};

// Told of a run for others: whether it is there for them, and its cost.
using RunForOthers = std::function<void(bool made, double run_s)>;

// Looks for every run that a cell reads, and takes those that are there from `time_left`. `ended` hears of runs for
// others for which there is nothing to do.
AccuracyJobs plan_accuracy(const RunShared& run, const Work& work, KeptRuns& kept, TimeLeft& time_left,
                           const RunForOthers& ended);

}  // namespace assay
