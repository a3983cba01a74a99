// `assay run`: measures a campaign, or resumes it.
#include <fmt/format.h>

#include "cli/campaign_run.h"
#include "cli/cli.h"

namespace assay::cli {

void add_run(CLI::App& app, Action& action) {
  CLI::App* command =
      add_command(app, "run", "Measure a campaign: systems x contenders x timesteps x measures",
                  {{"assay run campaigns/quick.toml --out results", "after Ctrl-C or a kill the same command resumes"},
                   {"assay run my_campaign.toml --out results --jobs 4", "four accuracy workers at a time"},
                   {"assay run paper --out part2 --shard 2/8", "the second of eight parts, for a cluster"}});
  const auto request = std::make_shared<RunRequest>();
  command->add_option("CAMPAIGN", request->campaign, "TOML file, or the name of one in campaigns/")
      ->required()
      ->type_name("");
  command->add_option("--out", request->out, "Results directory; created if missing")->required()->type_name("DIR");
  command->add_option("--jobs", request->jobs, "Accuracy workers at a time (default: one per core)")->type_name("N");
  command->add_option("--shard", request->shard, "Measure only part I of N of the campaign")->type_name("I/N");
  add_references(*command, *request);
  command->callback([&action, request] {
    action = [request] {
      request->command = fmt::format("assay run {} --out {}", request->campaign, request->out);
      if (request->shard) request->command += fmt::format(" --shard {}", *request->shard);
      return run_and_summarize(*request) ? kDone : kFailed;
    };
  });
}

}  // namespace assay::cli
