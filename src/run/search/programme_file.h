// The programme for a robot as the file campaign.toml of its results directory.
#pragma once

#include <functional>
#include <string>

#include "run/search/programme.h"

namespace assay {

// `file` from the folder `dir`, so that both can be moved together. Throws InputError for what cannot be a path.
std::string relative_path(const std::string& file, const std::string& dir);

// Writes the programme into `dir` unless it is there, so that a search goes on, and returns the file's path. `tell`
// gets a sentence when a file that is there is replaced. Throws InputError for another programme, SystemError where it
// cannot be written.
std::string write_programme(const std::string& dir, const Programme& programme,
                            const std::function<void(const std::string&)>& tell);

}  // namespace assay
