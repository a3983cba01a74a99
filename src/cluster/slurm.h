// A campaign as jobs of Slurm. In the results directory OUT:
//   OUT/shards/accuracy-I, timing-I   results of the parts
//   OUT/references                    fine-step runs that the accuracy parts leave for the timings
//   OUT/jobs/accuracy.sh, timing.sh   arrays of jobs, one element a part; finish.sh: after both, in a job of its own
//   OUT/jobs/request.json             what was asked for, so that a later job can go on
//   OUT/jobs/*.log                    what the jobs said
//   OUT/assay.sqlite, report.html     the union
// The file system has to be one that all nodes share. Accuracy parts share nodes, timings have theirs alone. The last
// job finds parts that were lost (killed, a node that failed), submits these again, at most `tries` times in all, and
// unites what there is.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace assay {

struct SlurmRequest {
  std::string program;              // assay, as the nodes find it
  std::string campaign;             // its file, absolute
  std::string out;                  // absolute
  std::string partition;            // "": Slurm's default
  std::string account, time_limit;  // "": Slurm's default
  int accuracy_parts = 0, timing_parts = 0;
  int cpus = 1;   // of an accuracy part
  int nodes = 1;  // at most so many are used at a time for timings
  int tries = 3;  // how often a part is submitted

  nlohmann::json to_json() const;
  static SlurmRequest from_json(const nlohmann::json& from);
};

// The parts of a kind, as numbers from 1.
struct Parts {
  std::vector<int> accuracy, timing;
  bool empty() const { return accuracy.empty() && timing.empty(); }
};
Parts all_parts(const SlurmRequest& request);

// "1-4,7"
std::string array_text(const std::vector<int>& parts);

// By file name: "accuracy.sh", "timing.sh", "finish.sh". A kind without parts has no script.
std::map<std::string, std::string> slurm_scripts(const SlurmRequest& request);

// Results directory of a part.
std::string part_dir(const SlurmRequest& request, const std::string& kind, int part);

// Parts whose directory lacks cells of its plan, or is not there.
Parts lost_parts(const SlurmRequest& request);

struct SlurmJobs {
  std::string accuracy, timing, finish;  // Slurm's numbers, "" for none
};

// Writes scripts and request, and submits `parts` and the job that finishes, as try `attempt`. Throws InputError with
// one sentence where there is no Slurm or where it refuses; nothing stays submitted then.
SlurmJobs submit_to_slurm(const SlurmRequest& request, const Parts& parts, int attempt);

// What was asked for in this results directory; throws InputError for one that was not submitted.
SlurmRequest read_request(const std::string& out);

}  // namespace assay
