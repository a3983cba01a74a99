// How a model is read (load/load_options.h), as keys of a campaign's [[system]].
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "campaign/section.h"
#include "load/load_options.h"

namespace assay {

// What load_options_of() reads.
std::vector<std::string> load_key_names();

// Throws InputError, also for external files to which the user has not agreed.
LoadOptions load_options_of(const Section& section);

// The lines of [[system]] that load_options_of() reads as `load`. `place` says how the file names a path. Throws
// InputError for texts that are not UTF-8.
std::vector<std::string> load_lines(const LoadOptions& load,
                                    const std::function<std::string(const std::string&)>& place);

}  // namespace assay
