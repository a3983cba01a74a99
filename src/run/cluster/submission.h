// How a campaign is divided into jobs of Slurm, what is said of them, and when it may not be submitted.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "run/cluster/slurm.h"

namespace assay {

inline constexpr int kPartsPerNode = 12;  // so that nodes of unequal speed end together, and wrong estimates even out
// Of a part, so that its start (half a second and a contender's conformance suite) is little of it.
inline constexpr double kLeastPartSeconds = 10;

struct SubmitRequest {
  std::string campaign, out;                   // file or name; results directory
  std::string partition, account, time_limit;  // "": Slurm's default
  std::vector<std::string> sbatch;             // more of its options
  int nodes = 1, cpus = 1;
  std::optional<int> shards;  // default: by the seconds that the plan takes
};

// Reads the campaign and divides it. Throws InputError.
SlurmRequest slurm_request(const SubmitRequest& asked);

// "job 7: 3 parts of runs that others read, job 8: ...; 'assay status OUT' tells how far they are"
std::string jobs_text(const SlurmRequest& request, const Parts& parts, const SlurmJobs& jobs);
// "accuracy parts 1-3, timing parts none"
std::string parts_text(const Parts& parts);
std::string busy_text(const Parts& busy, const LiveJobs& live);
// The scripts, and the commands that would submit them.
std::string dry_run_text(const SlurmRequest& request);

// Says on standard error where Slurm's queue could not be asked.
void tell_unknown(const LiveJobs& live);

// Jobs that were submitted to the same directory and still wait or run would measure the same parts: throws InputError,
// and for another division of the campaign.
void refuse_second(const SlurmRequest& request);

}  // namespace assay
