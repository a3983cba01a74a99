// The machine and the build that results come from.
#pragma once

#include <string>
#include <vector>

#include "results/store/store.h"

namespace assay {

// "cpu" (its name, which comes first), "cpu_model", "cpu_mhz", "cpu_cache", "cpu_vectors", "turbo", "cores",
// "governor", "virtual_machine", "memory", "kernel", "sandbox" (what workers are confined by), "assay_version",
// "commit", "compiler", "flags", "build_type". What the machine does not say is "unknown".
std::vector<ManifestEntry> machine_facts();

// What this machine is called in results: ASSAY_NODE, else the name that Slurm (SLURMD_NODENAME) or a manifest of
// Kubernetes (NODE_NAME) gives it, else the host's.
std::string node_name();

// "2026-11-27 13:05:09 UTC", as results have times.
std::string date_text(double unix_seconds);

}  // namespace assay
