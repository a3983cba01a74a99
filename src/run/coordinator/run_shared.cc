#include "run/coordinator/run_shared.h"

#include <algorithm>
#include <thread>

#include <fmt/format.h>

#include "base/paths.h"
#include "base/text.h"
#include "campaign/shards.h"

namespace assay {

RunShared::RunShared(const Campaign& of, const RunOptions& how)
    : campaign(of),
      options(how),
      progress(how.progress != nullptr ? *how.progress : silent),
      program(how.program.empty() ? program_path() : how.program),
      store(Store::create(how.out, {of.name, of.hash()})),
      jobs(how.jobs > 0 ? how.jobs : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()))) {}

std::string RunShared::title(const PlannedCell& cell) const {
  return fmt::format("{} {} {} {} ms", cell.measure, system(cell).name, contender(cell).resolved.name,
                     timestep_label(cell.timestep_ms));
}

Cell RunShared::cell_of(const PlannedCell& planned, const Ending& ending) const {
  Cell cell;
  cell.key = planned.key;
  cell.system = system(planned).name;
  cell.contender = contender(planned).resolved.name;
  cell.timestep_ms = planned.timestep_ms;
  cell.measure = planned.measure;
  cell.outcome = ending.outcome;
  cell.reason = ending.reason;
  return cell;
}

PlannedCell RunShared::ahead_of(const PlannedCell& cell) const {
  return options.shard.cells == ShardCells::kAfterRuns ? after_runs(cell) : cell;
}

}  // namespace assay
