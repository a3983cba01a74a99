// `assay report`: a results directory as one page.
#include "cli/campaign_run.h"
#include "cli/cli.h"

namespace assay::cli {

void add_report(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "report", "Write DIR/report.html, one file that works offline, and the paper's figures in DIR/figures",
      {{"assay report results", "also while the campaign is running: what is there is shown"}});
  const auto dir = std::make_shared<std::string>();
  command->add_option("DIR", *dir, "Results directory")->required()->type_name("");
  command->callback([&action, dir] {
    action = [dir] {
      write_report_of(*dir);
      return kDone;
    };
  });
}

}  // namespace assay::cli
