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
  long long steps = 0;  // engine steps that it takes, timing aside
  int shard = 1;        // whose work it is
  std::string final_state = {};  // content address of the last state that the cell keeps of its run, "" for none
};

struct Plan {
  // by system, contender, then reference, consistency, truth, drift, violation, grasp, agreement, scaling, raw_speed
  std::vector<PlannedCell> cells;
};

// A run whose time is the figure is repeated up to this often, until this much time was spent in engine steps.
inline constexpr int kScalingMostRuns = 5;
inline constexpr double kScalingEnoughSeconds = 2;

// Cells whose figure is a time: measured alone on the machine.
inline bool is_timed(const PlannedCell& cell) { return cell.measure == "raw_speed" || cell.measure == "scaling"; }

// Each system's contenders that are not absent; `shards` says among how many the work is divided. Cells that compare
// contenders' speeds on a system stay in one shard (a machine's speed is not another's), those of a family of systems
// too, and so do the accuracy cells of one contender and system, which share a reference run, and a system's cells of
// agreement; within that the shards' loads are evened out.
Plan make_plan(const Campaign& campaign, int shards = 1);

// The time of a step on a system of `size` bodies, from the positive times on others of its family, by number of
// bodies: logarithmically between its neighbours; beyond them it goes on as between the last two, with one alone in
// proportion. 0 when none is known.
double step_us_at(const std::map<double, double>& known, double size);

// Seconds that `cells` of the plan will take with `jobs` accuracy workers. `step_us` is the measured time of one step
// for each (system, contender).
double estimate_seconds(const Campaign& campaign, const std::vector<PlannedCell>& cells,
                        const std::map<std::pair<int, int>, double>& step_us, int jobs);

}  // namespace assay
