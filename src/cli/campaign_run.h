// What `assay run` and `assay paper` have in common.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/cli.h"
#include "report/report.h"
#include "results/store/store.h"
#include "run/cluster/parts.h"
#include "run/coordinator/campaign_run.h"
#include "run/coordinator/run.h"

namespace assay::cli {

struct RunRequest {
  std::string campaign;                   // file or name
  std::string out;                        // results directory
  std::optional<std::string> jobs;        // as given; default: one a core
  std::optional<std::string> shard;       // as given; default: all
  std::optional<std::string> cells;       // of which shards are made, as given; default: all
  std::optional<std::string> references;  // as given; see add_references()
  std::optional<std::string> progress;    // as given; see add_progress()
  std::optional<std::string> device;      // of the measure 'batch', as given; default: cpu
  std::string windows_of;                 // see RunOptions
  bool retry = false;                     // see RunOptions
  bool set_up = true;                     // engines that its contenders need and that are absent
  std::string command;                    // what resumes it
};

// Adds --references: where runs are kept for later campaigns. By default ASSAY_CACHE/references, else
// XDG_CACHE_HOME/assay/references, else ~/.cache/assay/references; "off" keeps none.
void add_references(CLI::App& command, RunRequest& request);

// Adds --no-set-up.
void add_set_up(CLI::App& command, RunRequest& request);

// Adds --progress: how far it is, for people ("text", the default) or for programs ("json").
void add_progress(CLI::App& command, RunRequest& request);
// Whether it is for programs. Throws InputError.
bool json_progress(const RunRequest& request);

// Adds --replays: timesteps at which keep_replays() (report/kept_replays.h) runs contenders again. They are read by
// parse_replays(), which throws InputError.
void add_replays(CLI::App& command, std::vector<std::string>& replays);
std::vector<double> parse_replays(const std::vector<std::string>& replays);

// How the coordinator is to run it. Throws InputError.
RunOptions run_options(const RunRequest& request);

// Runs the campaign and prints a summary. True when it is complete, false when it was interrupted or could
// not measure all cells.
bool run_and_summarize(const RunRequest& request);

// Writes `dir`/report.html and prints its path, and what it does not show. `more`, `options`: see report/report.h.
void write_report_of(const std::string& dir, const nlohmann::json& more = nlohmann::json::object(),
                     const ReportOptions& options = {});

}  // namespace assay::cli
