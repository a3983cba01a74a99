// The parts into which a plan is divided for several machines. The division follows from the campaign and the program
// alone, so that machines agree on it without a word.
#pragma once

#include <map>
#include <string>
#include <utility>

#include "campaign/plan.h"

namespace assay {

inline constexpr int kMostShards = 10000;  // into which a campaign is divided

// "2/8", or "auto/8" for the part that a scheduler's variables in the environment name, or "auto" where these tell the
// number of parts, too. They tell the length of an array, which is less where parts are measured again; an array of one
// job is refused, and the record of the results directory finds the others. Throws InputError for anything else, and
// where the environment names no part or an impossible one.
//   ASSAY_SHARD                                       "2/8": before all others
//   SLURM_ARRAY_TASK_ID, _MIN, _MAX, _COUNT           Slurm, `sbatch --array=1-8`
//   JOB_COMPLETION_INDEX                              Kubernetes, an indexed job: from 0, without a count
//   PBS_ARRAY_INDEX, LSB_JOBINDEX(_END), SGE_TASK_ID (_LAST)   from 1
//   AWS_BATCH_JOB_ARRAY_INDEX                         from 0
Shard parse_shard(const std::string& text);

// "all", "accuracy", "timing", "runs" or "after-runs". Throws InputError.
ShardCells parse_shard_cells(const std::string& text);
std::string shard_text(const Shard& shard);           // "2/8"
std::string_view shard_cells_text(ShardCells cells);  // "all", ...

// Microseconds of a step of each contender on each system, as far as known before anything is measured: the time on a
// system of this name on another machine (step_costs.csv), else times per body there, which depend on whether there are
// contacts, else a usual time.
std::map<std::pair<int, int>, double> expected_step_us(const Campaign& campaign);

// Cells that read a run of their own timestep and not the fine-step run. All measures of such a run stay together.
bool stands_alone(const PlannedCell& cell);

// Sets each cell's shard, so that all shards take about as long: the longest group goes to the least loaded shard, then
// the next. Cells of one group stay together: a system's timings, because machines differ in speed; a family's scaling
// cells; the accuracy cells of one contender and system, which share a fine-step run; a system's cells of agreement. Of
// accuracy cells that are more than a quarter of a shard's mean, those that do not read the fine-step run form groups
// by timestep, so that the longest group is a fine-step run with its pieces.
// Where the runs are made before (kAfterRuns), groups are by timestep as well, and the first shards have only cells
// that stand alone, which need not wait for the runs. Of kRuns each part has runs of few contenders, because each
// contender costs a suite and a start.
void divide(const Campaign& campaign, Plan& plan, int shards, ShardCells cells);

// The runs that the plan's accuracy cells and timings read, by contender, reference solutions first.
std::vector<PlannedRun> runs_of(const Campaign& campaign, const std::vector<PlannedCell>& cells);

// What is left to do of the cell where its runs are there (ShardCells::kAfterRuns).
PlannedCell after_runs(PlannedCell cell);

// Expected seconds of such a run with one worker.
double run_seconds(const Plan& plan, const PlannedRun& run, const std::map<std::pair<int, int>, double>& step_us);

// Expected seconds of each shard with one worker.
std::map<int, double> shard_seconds(const Campaign& campaign, const Plan& plan);

}  // namespace assay
