// What `assay run` and `assay paper` have in common.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/cli.h"

namespace assay::cli {

struct RunRequest {
  std::string campaign;                   // file or name
  std::string out;                        // results directory
  std::optional<std::string> jobs;        // as given; one a core when it was not
  std::optional<std::string> shard;       // as given; all when it was not
  std::optional<std::string> references;  // as given; see add_references()
  std::string command;                    // what resumes it
};

// Adds --references: where runs are kept for later campaigns. By default ASSAY_CACHE/references, else
// XDG_CACHE_HOME/assay/references, else ~/.cache/assay/references; "off" keeps none.
void add_references(CLI::App& command, RunRequest& request);

// Adds --replays: timesteps at which keep_replays() runs contenders again. They are read by parse_replays(), which
// throws InputError.
void add_replays(CLI::App& command, std::vector<std::string>& replays);
std::vector<double> parse_replays(const std::vector<std::string>& replays);

// Of each system in `dir` runs the contenders that the report replays at each of `timesteps` (ms) that fits its
// samples, and keeps their states. What is kept already is not run again.
void keep_replays(const std::string& dir, const std::vector<double>& timesteps);

// Runs the campaign and prints what came out. True when all of it is there, false when it was interrupted.
bool run_and_summarize(const RunRequest& request);

// Prints a line for each of the paper's claims: number, verdict, title, figures.
void print_claims(const std::string& dir);

// Writes `dir`/report.html and prints where it is.
void write_report_of(const std::string& dir);

}  // namespace assay::cli
