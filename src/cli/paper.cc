// `assay paper`: the paper's campaign, the report, and the verdicts on the paper's claims.
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/text.h"
#include "cli/campaign_run.h"
#include "cli/commands.h"
#include "cli/report_parts.h"
#include "report/kept_replays.h"
#include "results/claims/claims.h"
#include "run/coordinator/set_up.h"

namespace assay::cli {
namespace {

// The engines of the paper's line-up; others take part where they are there.
void obtain_line_up(const std::string& campaign) {
  const std::optional<std::string> claims = paper_claims_file();
  if (!claims) return;
  std::vector<std::string> names;
  for (const auto& [engine, contenders] : load_claims(*claims).engines) {
    names.insert(names.end(), contenders.begin(), contenders.end());
  }
  obtain_engines(load_campaign(find_campaign(campaign)), &names);
}

}  // namespace

void add_paper(CLI::App& app, Action& action) {
  CLI::App* command =
      add_command(app, "paper", "Measure the paper's campaign, write the report, judge its claims",
                  {{"assay paper --quick --out results",
                    "a few minutes: fewer timesteps, shorter runs; then open results/report.html"},
                   {"assay paper --out results", "the whole campaign; after Ctrl-C or a kill the same command resumes"},
                   {"assay paper --out results --replays 1,4,16", "the report also replays runs at these timesteps"}});
  const auto request = std::make_shared<RunRequest>();
  const auto quick = std::make_shared<bool>(false);
  const auto replays = std::make_shared<std::vector<std::string>>();
  command->add_flag("--quick", *quick, "The short campaign, a few minutes on two cores")->disable_flag_override();
  command->add_option("--out", request->out, "Results directory; created if missing")->required()->type_name("DIR");
  command->add_option("--jobs", request->jobs, "Accuracy workers at a time (default: one per core)")->type_name("N");
  add_references(*command, *request);
  add_set_up(*command, *request);
  add_progress(*command, *request);
  add_replays(*command, *replays);
  command->callback([&action, request, quick, replays] {
    action = [request, quick, replays] {
      const std::vector<double> timesteps = parse_replays(*replays);
      static_cast<void>(json_progress(*request));  // refused before anything is read
      request->campaign = *quick ? "quick" : "paper";
      request->command = fmt::format("assay paper {}{}--out {}", *quick ? "--quick " : "",
                                     request->set_up ? "" : "--no-set-up ", request->out);
      if (!replays->empty()) request->command += " --replays " + join(*replays, ",");
      rehearse_campaign(request->campaign);
      if (request->set_up) obtain_line_up(request->campaign);
      if (!run_and_summarize(*request)) return kFailed;
      keep_replays(request->out, timesteps);
      write_report_of(request->out);
      print_claims(request->out);
      return kDone;
    };
  });
}

}  // namespace assay::cli
