// A campaign as a list of cells with content-addressed keys: the same campaign, models and engine builds give the same
// keys on every machine, so that a run can be resumed and shards be joined.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "campaign/campaign.h"

namespace assay {

struct Shard {
  int index = 1, count = 1;  // 1 <= index <= count
};
// "2/8". Throws InputError for anything else.
Shard parse_shard(const std::string& text);

struct PlannedCell {
  std::string key;
  int system = 0, contender = 0;  // indices into the campaign
  double timestep_ms = 0;
  std::string measure;  // as stored; "reference" for the reference run
  std::string
      trajectory;       // content address of the run from the initial state that the cell makes or reads, "" for none
  long long steps = 0;  // engine steps that it takes, without timing
  int shard = 1;        // that measures it
  std::string final_state = {};  // content address of the last state that the cell keeps of its run, "" for none
  // Content addresses of the reference runs from the system's other initial states that the cell reads.
  std::vector<std::string> other_states = {};
};

struct Plan {
  // by system, contender, then reference, consistency, truth, drift, violation, grasp, agreement, scaling, raw_speed
  std::vector<PlannedCell> cells;
};

// A run for scaling is repeated up to this often, until this much time was spent in engine steps.
inline constexpr int kScalingMostRuns = 5;
inline constexpr double kScalingEnoughSeconds = 2;

// Cells whose figure is a time: measured alone on the machine.
inline bool is_timed(const PlannedCell& cell) { return cell.measure == "raw_speed" || cell.measure == "scaling"; }

// The cells of each system's contenders that are not absent, divided into `shards` of about equal load. These stay in
// one shard: a system's timings, because machines differ in speed; a family's scaling cells; the accuracy cells of one
// contender and system, which share a reference run; a system's cells of agreement.
Plan make_plan(const Campaign& campaign, int shards = 1);

// The time of a step on a system of `size` bodies, from the positive times on others of its family, by number of
// bodies: interpolated in logarithms, and extrapolated as between the last two. In proportion to the size when one time
// is known, 0 when none is.
double step_us_at(const std::map<double, double>& known, double size);

// Seconds that `cells` of the plan will take with `jobs` accuracy workers. `step_us` is the measured time of one step
// for each (system, contender).
double estimate_seconds(const Campaign& campaign, const std::vector<PlannedCell>& cells,
                        const std::map<std::pair<int, int>, double>& step_us, int jobs);

}  // namespace assay
