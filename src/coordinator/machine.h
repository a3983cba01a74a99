// The machine and the build that results come from.
#pragma once

#include <vector>

#include "store/store.h"

namespace assay {

// "cpu", "cores", "governor", "kernel", "memory", "assay_version", "commit", "compiler", "flags", "build_type".
std::vector<ManifestEntry> machine_facts();

}  // namespace assay
