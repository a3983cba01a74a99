// `assay report`: a results directory as one page.
#include "report/report.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/text.h"
#include "cli/campaign_run.h"
#include "cli/cli.h"
#include "cli/compare.h"
#include "report/replays.h"
#include "report/views.h"
#include "results/compare/history.h"
#include "results/line_up.h"
#include "results/results.h"
#include "results/store/store.h"
#include "results/store/trajectory.h"
#include "run/coordinator/rerun.h"

namespace assay::cli {
namespace {

struct ReportOptions {
  std::string dir;
  std::vector<std::string> replays;  // timesteps as given
  std::optional<std::string> against;
  std::vector<std::string> history, systems;
  std::optional<std::string> size;
  CompareFlags compare;
  bool json = false;
};

// Sections about other results than the page's own.
nlohmann::json sections(const ReportOptions& options) {
  nlohmann::json more = nlohmann::json::object();
  const CompareOptions how = compare_options(options.compare);
  if (options.against) {
    more["changes"] = comparison_json(compare(Store::open(*options.against), Store::open(options.dir), how));
  }
  if (options.history.empty()) return more;
  std::vector<std::string> dirs = options.history;
  const auto is_this = [&](const std::string& dir) {
    std::error_code error;
    return std::filesystem::equivalent(dir, options.dir, error);
  };
  if (std::ranges::none_of(dirs, is_this)) dirs.push_back(options.dir);
  more["history"] = history_json(history(dirs, how));
  return more;
}

// What the page shows, for programs that draw: without what only the page can draw, and with the paper's line-up.
int print_data(const ReportOptions& options) {
  if (!options.replays.empty()) throw InputError("--json and --replays were both given: choose one");
  const nlohmann::json more = sections(options);
  const Store store = Store::open(options.dir);
  nlohmann::json data = report_data(store, {.systems = options.systems, .most_bytes = SIZE_MAX});
  for (const char* part : {"pictures", "replays"}) data.erase(part);
  for (nlohmann::json& cell : data["cells"]) cell.erase("samples");
  data.update(more);
  data["papers"] = Results(store).papers();
  data["paper_figures"] = paper_figures_data();
  print(dump_json(data, 1) + "\n");
  return kDone;
}

}  // namespace

Store open_to_write(const std::string& dir) {
  const Store store = Store::open(dir);
  return Store::create(dir, {store.manifest("campaign").value_or(""), store.manifest("campaign_hash").value_or("")});
}

void add_replays(CLI::App& command, std::vector<std::string>& replays) {
  command
      .add_option("--replays", replays,
                  "Timesteps in ms: runs the replayed contenders again at these and keeps their states in DIR")
      ->delimiter(',')
      ->type_name("MS,...")
      ->allow_extra_args(false);
}

std::vector<double> parse_replays(const std::vector<std::string>& replays) {
  std::vector<double> timesteps;
  timesteps.reserve(replays.size());
  for (const std::string& text : replays) timesteps.push_back(parse_positive("--replays", text, "milliseconds"));
  return timesteps;
}

void keep_replays(const std::string& dir, const std::vector<double>& timesteps) {
  if (timesteps.empty()) return;
  Store store = open_to_write(dir);
  for (const SceneRow& scene : store.scenes()) {
    std::vector<std::string> kept;
    for (const RunRow& run : store.runs()) {
      if (run.system == scene.system && count_states(store.trajectories_dir(), run.address) > 1 &&
          std::ranges::find(kept, run.contender) == kept.end()) {
        kept.push_back(run.contender);
      }
    }
    if (kept.empty()) continue;
    for (const double timestep : timesteps) {
      if (!fits_samples(store, scene.system, timestep)) {
        message(fmt::format("{} has no replay at {} ms, because that does not divide the time between its states",
                            scene.system, timestep_label(timestep)));
        continue;
      }
      const size_t added = keep_runs(store, scene.system, line_up(kept, ReplayOptions{}.most_contenders), timestep);
      if (added > 0) {
        message(fmt::format("{}: {} at {} ms", scene.system, counted(added, "run"), timestep_label(timestep)));
      }
    }
  }
}

void add_report(CLI::App& app, Action& action) {
  CLI::App* command =
      add_command(app, "report", "Write DIR/report.html, one file that works offline, and the paper's figures",
                  {{"assay report results", "also while the campaign is running: shows the results so far"},
                   {"assay report results --replays 1,4,16", "also replays runs at these timesteps"},
                   {"assay report after --against before", "with a section on what changed"}});
  const auto options = std::make_shared<ReportOptions>();
  command->add_option("DIR", options->dir, "Results directory")->required()->type_name("");
  add_replays(*command, options->replays);
  command->add_option("--against", options->against, "Earlier results: adds a section on what changed since then")
      ->type_name("DIR");
  command
      ->add_option("--history", options->history,
                   "Other results of the same campaign: adds the contenders' courses over all")
      ->type_name("DIR");
  command->add_option("--systems", options->systems, "Systems to show (default: all, or those that fit into --size)")
      ->delimiter(',')
      ->type_name("NAME,...")
      ->allow_extra_args(false);
  command
      ->add_option("--size", options->size,
                   "Largest size of the page (default: 10); beyond it go distributions of samples, then replays, then "
                   "systems")
      ->type_name("MB");
  add_compare_flags(*command, options->compare);
  command->add_flag("--json", options->json, "Print what the page shows as JSON, without pictures; write nothing")
      ->disable_flag_override();
  command->callback([&action, options] {
    action = [options] {
      if (options->json) return print_data(*options);
      assay::ReportOptions page{.systems = options->systems};
      if (options->size)
        page.most_bytes = static_cast<size_t>(std::min(1e6 * parse_positive("--size", *options->size, "MB"), 1e12));
      const nlohmann::json more = sections(*options);  // refused before anything is written
      keep_replays(options->dir, parse_replays(options->replays));
      write_report_of(options->dir, more, page);
      return kDone;
    };
  });
}

}  // namespace assay::cli
