// A campaign as a list of cells with content-addressed keys: the same campaign, models and engine builds give the same
// keys on every machine, so that a run can be resumed and shards be joined.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "campaign/campaign.h"

namespace assay {

// Which cells are divided into shards: all, or only one kind, so that a cluster can run accuracy cells side by side on
// shared machines and timings alone on others. kRuns are no cells but what these read: fine-step runs from each initial
// state and reference solutions, for the folder of RunOptions::references. kAfterRuns are the accuracy cells where
// kRuns have been made before: what reads a run need not be with what makes it.
enum class ShardCells { kAll, kAccuracy, kTiming, kRuns, kAfterRuns };

struct Shard {
  int index = 1, count = 1;  // 1 <= index <= count
  ShardCells cells = ShardCells::kAll;
};

struct PlannedCell {
  std::string key;
  int system = 0, contender = 0;  // indices into the campaign
  double timestep_ms = 0;
  std::string measure;  // as stored (measures/measure.h)
  Reads reads = Reads::kRun;
  std::string
      trajectory;       // content address of the run from the initial state that the cell makes or reads, "" for none
  long long steps = 0;  // engine steps that it takes, without timing
  int shard = 1;        // that measures it, 0 for none
  // That `steps` counts: a reference has one from each initial state, of which only the first is a cell.
  int runs = 1;
  std::string final_state = {};  // content address of the last state that the cell keeps of its run, "" for none
  // Content address of the contender's own run at the timestep that a timing starts from, "" for the reference run.
  std::string timed_run = {};
  // Content addresses of the reference runs from the system's other initial states that the cell reads.
  std::vector<std::string> other_states = {};
  // Content address of where the pieces end at the fine-step run's own timestep, which that cell makes and those at
  // other timesteps read, "" for none.
  std::string cold = {};
  // Content addresses of runs that the cell's own are compared with, from each of the system's initial states: those of
  // the contender that a policy was trained in.
  std::vector<std::string> against = {};
  // Content address of the run from CampaignSystem::shown_state() that the cell keeps for replays, "" for none.
  std::string keep = {};
  int worlds = 0;           // Reads::kWorlds
  std::string device = {};  // of these: "cpu" for engines that step one world
};

// A run that cells read.
struct PlannedRun {
  std::string address;  // content address, "" for the reference solution of a system, which the worker names
  size_t cell = 0;      // in Plan::cells: one that reads it, of its system
  int contender = -1;   // whose run it is, -1 for a reference solution
  int state = 0;        // number of the initial state
  long long steps = 0;
  int shard = 1;
};

struct Plan {
  ShardCells kind = ShardCells::kAll;  // what was divided into shards
  std::vector<PlannedRun> runs;        // each once, by contender; only of ShardCells::kRuns
  // by system, contender, then what their measures read, in the order of Reads; those of one run together
  std::vector<PlannedCell> cells;
};

// A run for scaling is repeated up to this often, until this much time was spent in engine steps.
inline constexpr int kScalingMostRuns = 5;
inline constexpr double kScalingEnoughSeconds = 2;

// Cells whose figure is a time: measured alone on the machine.
inline bool is_timed(const PlannedCell& cell) { return is_timed(cell.reads); }

// The cells of each system's contenders that are not absent, divided into `shards` (campaign/shards.h). Cells of the
// kind that `cells` leaves out are in shard 0.
Plan make_plan(const Campaign& campaign, int shards = 1, ShardCells cells = ShardCells::kAll);

// The time of a step, or of making an instance, on a system of `size` bodies, from the positive times on others, by
// number of bodies: interpolated in logarithms, and extrapolated by the power of at most 3 that fits them all. In
// proportion to the size when one time is known, 0 when none is.
double time_at_size(const std::map<double, double>& known, double size);

// What it takes to start, s. What is not there is that of a native engine with primitive shapes.
struct StartTimes {
  std::map<int, double> worker_s;                    // by contender: until a worker has its first step
  std::map<std::pair<int, int>, double> instance_s;  // by (system, contender): each further instance, as of hulls
};

// Seconds that `cells` of the plan will take with `jobs` accuracy workers. `step_us` is the measured time of one step
// for each (system, contender).
double estimate_seconds(const Campaign& campaign, const std::vector<PlannedCell>& cells,
                        const std::map<std::pair<int, int>, double>& step_us, int jobs, const StartTimes& starts = {});

}  // namespace assay
