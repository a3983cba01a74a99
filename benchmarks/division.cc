// How a campaign is divided into parts, for benchmarks/record.py and scale.py: the cells as CSV, and on standard error
// the seconds that planning took.
#include <chrono>
#include <cstdio>
#include <string>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <fmt/format.h>

#include "base/errors.h"
#include "campaign/plan.h"
#include "campaign/shards.h"

int main(int argc, char** argv) {
  using namespace assay;
  std::string file, kind = "all";
  int shards = 1;
  CLI::App app("Prints how a campaign is divided into parts.");
  app.add_option("CAMPAIGN", file, "A campaign's file")->required();
  app.add_option("--shards", shards)->check(CLI::PositiveNumber);
  app.add_option("--cells", kind, "as of assay run");
  CLI11_PARSE(app, argc, argv);
  try {
    const Campaign campaign = load_campaign(file);
    const auto start = std::chrono::steady_clock::now();
    const Plan plan = make_plan(campaign, shards, parse_shard_cells(kind));
    const std::chrono::duration<double> planning = std::chrono::steady_clock::now() - start;
    const auto step_us = expected_step_us(campaign);
    fmt::print("key,shard,system,contender,timestep_ms,measure,alone,expected_s\n");
    for (const PlannedCell& cell : plan.cells) {
      fmt::print("{},{},{},{},{},{},{},{:.4f}\n", cell.key, cell.shard,
                 campaign.systems[static_cast<size_t>(cell.system)].name,
                 campaign.contenders[static_cast<size_t>(cell.contender)].resolved.name, cell.timestep_ms, cell.measure,
                 stands_alone(cell) ? 1 : 0, estimate_seconds(campaign, {cell}, step_us, 1));
    }
    for (const PlannedRun& run : plan.runs) {
      const bool solution = run.contender < 0;
      const CampaignSystem& system = campaign.systems[static_cast<size_t>(plan.cells[run.cell].system)];
      const CampaignContender* of = solution ? nullptr : &campaign.contenders[static_cast<size_t>(run.contender)];
      fmt::print("{},{},{},{},{},{},1,{:.4f}\n", run.address, run.shard, system.name, solution ? "" : of->resolved.name,
                 solution ? 0 : system.reference_of(*of), solution ? "solution" : fmt::format("state {}", run.state),
                 run_seconds(plan, run, step_us));
    }
    fmt::print(stderr, "{} cells planned in {:.3f} s\n{}\n{}\n", plan.cells.size(), planning.count(), campaign.name,
               campaign.hash());
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
