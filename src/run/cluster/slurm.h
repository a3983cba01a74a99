// A campaign as jobs of Slurm. In the results directory OUT:
//   OUT/shards/accuracy-I, timing-I   results of the parts
//   OUT/references                    fine-step runs and reference solutions, which these parts read
//   OUT/runs/I                        of the parts that make them
//   OUT/jobs/runs.sh, accuracy.sh, timing.sh
//                                     arrays of jobs, one element a part; finish.sh: after all, in a job of its own
//   OUT/jobs/request.json             what was asked for and which jobs that made, so that a later job can go on
//   OUT/jobs/*.log                    what the jobs said
//   OUT/assay.sqlite, report.html     the union
// The file system has to be one that all nodes share. Accuracy parts share nodes, timings have theirs alone. The last
// job finds parts that were lost (killed, a node that failed), submits these again, at most `tries` times in all, and
// unites what there is. A part that waits or runs is not lost. What the parts of the runs have not made, those that
// read it make themselves.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace assay {

// The parts of a kind, as numbers from 1, ascending.
struct Parts {
  std::vector<int> accuracy, timing;
  std::vector<int> runs;  // never lost
  bool empty() const { return accuracy.empty() && timing.empty() && runs.empty(); }
  bool operator==(const Parts&) const = default;
};

enum class JobKind { kRuns, kAccuracy, kTiming, kFinish };

struct SubmittedJob {
  std::string id;  // Slurm's number
  JobKind kind = JobKind::kFinish;
  std::vector<int> parts;  // elements of its array
};

// What a part is expected to be, before it is begun.
struct PartPlan {
  size_t cells = 0;
  double seconds = 0;  // of one worker
  bool waits = true;   // reads runs that the parts of the runs make
};

struct SlurmRequest {
  std::string program;              // assay, as the nodes find it
  std::string campaign;             // its file, absolute
  std::string out;                  // absolute
  std::string partition;            // "": Slurm's default
  std::string account, time_limit;  // "": Slurm's default
  int accuracy_parts = 0, timing_parts = 0;
  int runs_parts = 0;                                // 0: accuracy parts make their runs themselves
  int cpus = 1;                                      // of an accuracy part
  int nodes = 1;                                     // at most so many are used at a time for timings
  int tries = 3;                                     // how often a part is submitted
  std::vector<std::string> options;                  // more options of sbatch, see parse_sbatch_option()
  std::vector<PartPlan> accuracy_plan, timing_plan;  // by part; empty where it was not stored
  std::vector<PartPlan> runs_plan;                   // with runs in the place of cells
  std::vector<SubmittedJob> jobs;                    // that may still wait or run

  const char* accuracy_cells() const { return runs_parts > 0 ? "after-runs" : "accuracy"; }  // as --cells has it

  nlohmann::json to_json() const;
  static SlurmRequest from_json(const nlohmann::json& from);
};

inline constexpr int kMostParts = 10000;  // of a kind, and nodes, and processors of a part

// A line of the script that Slurm reads ends at a newline, and what follows would be a line of its own: throws
// InputError, with the name of the option, for a text with a control character.
void require_one_line(const char* option, const std::string& text);

// Throws InputError for what cannot be a line of a script, and for options that assay sets itself.
std::string parse_sbatch_option(const std::string& text);

Parts all_parts(const SlurmRequest& request);

// Of accuracy parts: those that need not wait for the runs, and the others.
std::pair<std::vector<int>, std::vector<int>> apart(const SlurmRequest& request, const std::vector<int>& parts);

// "1-4,7"
std::string array_text(const std::vector<int>& parts);

// By file name: "runs.sh", "accuracy.sh", "timing.sh", "finish.sh". A kind without parts has no script.
std::map<std::string, std::string> slurm_scripts(const SlurmRequest& request);

// Results directory of a part of "accuracy", "timing" or "runs".
std::string part_dir(const SlurmRequest& request, const std::string& kind, int part);

// What Slurm still has of the request's jobs, without the job that asks.
struct LiveJobs {
  std::vector<SubmittedJob> jobs;  // each with those of its parts that wait or run; all jobs where that is not known
  std::string unknown;             // why Slurm's queue could not be asked, "" where it was
  bool known() const { return unknown.empty(); }
  std::vector<std::string> ids() const;
};
LiveJobs live_jobs(const SlurmRequest& request);

// Parts that are left alone: they wait or run in Slurm, or a process holds the writer's lock of their directory.
Parts busy_parts(const SlurmRequest& request, const LiveJobs& live);

// Parts that are not busy and whose directory lacks cells of its plan, or is not there.
Parts lost_parts(const SlurmRequest& request, const Parts& busy);

struct SlurmJobs {
  std::string runs, timing, finish;   // Slurm's numbers, "" for none
  std::vector<std::string> accuracy;  // of those that wait for no run, and of the others
};

// Writes scripts and request, and submits `parts` and the job that finishes after them and after `live`, as try
// `attempt`. Throws InputError with one sentence where there is no Slurm or where it refuses, SystemError where the
// request cannot be written; what was submitted is cancelled then, and the sentence names jobs that could not be.
SlurmJobs submit_to_slurm(SlurmRequest request, const Parts& parts, int attempt, const LiveJobs& live = {});

// What was asked for in this results directory, if anything. The directory may be a stranger's: what is damaged or
// could not have been asked for is refused (InputError), and the program is this one.
std::optional<SlurmRequest> find_request(const std::string& out);

// What was asked for in this results directory; throws InputError for one that was not submitted.
SlurmRequest read_request(const std::string& out);

}  // namespace assay
