// What all pieces of a campaign's run share (run.cc): what is measured and how, where results go, what is said
// meanwhile.
#pragma once

#include <cstdint>
#include <string>

#include "campaign/campaign.h"
#include "campaign/plan.h"
#include "results/store/store.h"
#include "run/coordinator/pool.h"
#include "run/coordinator/run.h"

namespace assay {

struct RunShared {
  RunShared(const Campaign& of, const RunOptions& how);

  const CampaignSystem& system(int index) const { return campaign.systems[static_cast<size_t>(index)]; }
  const CampaignSystem& system(const PlannedCell& cell) const { return system(cell.system); }
  const CampaignContender& contender(int index) const { return campaign.contenders[static_cast<size_t>(index)]; }
  const CampaignContender& contender(const PlannedCell& cell) const { return contender(cell.contender); }
  std::string title(const PlannedCell& cell) const;
  Cell cell_of(const PlannedCell& planned, const Ending& ending) const;
  PlannedCell ahead_of(const PlannedCell& cell) const;  // what is to do of it, as far as is expected
  bool makes_runs() const { return options.shard.cells == ShardCells::kRuns; }
  std::uint64_t seed() const { return static_cast<std::uint64_t>(campaign.seed); }
  bool interrupted() const { return interrupts.signal() != 0; }

  const Campaign& campaign;
  const RunOptions& options;
  Progress silent;
  Progress& progress;
  std::string program;  // started as `program worker`
  Interrupts interrupts;
  Store store;
  int jobs;  // accuracy workers at a time
};

}  // namespace assay
