// The text of an MJCF file beside MuJoCo's parser: the faults that keep MuJoCo from compiling it and have one obvious
// mend, all of them with their lines, where MuJoCo names the first.
#pragma once

#include <string>
#include <vector>

#include "model/problems.h"
#include "model/repair.h"

namespace assay {

// Inertias that are not positive or break the triangle inequality, and ranges whose bounds are swapped, in the file at
// `path` and those that it includes. `path` is where relative names count from.
std::vector<Problem> mjcf_faults(const std::string& text, const std::string& path);

// The text without those faults, for mended_model().
std::string mend_mjcf(const std::string& text, const std::string& path, const std::string& out,
                      std::vector<Mend>& mends);

}  // namespace assay
