// What a run of a campaign has to do, and what of it cannot be done.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "campaign/plan.h"
#include "run/coordinator/run_shared.h"

namespace assay {

struct Work {
  // Which cells belong to this shard, and which of them are still to do. With RunOptions::retry it removes damaged
  // cells from the store.
  explicit Work(RunShared& run);
  Work(const Work&) = delete;  // the lists point into the plan
  Work& operator=(const Work&) = delete;
  ~Work() = default;

  bool none() const { return todo.empty() && runs.empty(); }
  size_t done_before() const { return mine.size() - todo.size() - out_of_reach; }
  bool is_scored(const CampaignContender& contender) const { return !unscored.contains(contender.resolved.name); }

  Plan plan;
  std::vector<const PlannedCell*> mine, todo;
  size_t out_of_reach = 0;  // cells taken out of `todo`: the machine could not hold their contenders' suites
  std::vector<const PlannedRun*> runs;    // that this part makes for others (ShardCells::kRuns)
  std::set<std::string> suite_again;      // contenders whose conformance suite is tried again
  std::set<std::string> timed_elsewhere;  // keys of stored timings of another machine

  std::map<std::string, Ending> unscored;     // by contender: it failed the conformance suite
  std::map<std::string, Ending> failed_runs;  // by address
  std::set<std::string> lost_runs;            // somebody else ended their workers: what needs them is not measured now
};

}  // namespace assay
