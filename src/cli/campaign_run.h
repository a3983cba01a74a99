// What `assay run` and `assay paper` have in common.
#pragma once

#include <string>

#include "cli/cli.h"

namespace assay::cli {

struct RunRequest {
  std::string campaign;  // file or name
  std::string out;       // results directory
  std::string jobs;      // as given, "" for one a core
  std::string shard;     // as given, "" for all
  std::string command;   // what resumes it
};

// Runs the campaign and prints what came out. True when all of it is there, false when it was interrupted.
bool run_and_summarize(const RunRequest& request);

// Writes `dir`/report.html and prints where it is.
void write_report_of(const std::string& dir);

}  // namespace assay::cli
