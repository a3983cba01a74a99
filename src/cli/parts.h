// Parts of a campaign in several results directories.
#pragma once

#include <string>
#include <vector>

#include "store/store.h"

namespace assay::cli {

// The results directories that `dirs` name: each itself, or, where it holds no results, the directories in it that do,
// by name; "shards" in it counts too. Throws InputError for one without results.
std::vector<std::string> parts_of(const std::vector<std::string>& dirs);

// What the plan has and the results lack, a phrase each: "part 3 of 4", "12 cells of part 2".
std::vector<std::string> missing_parts(const Store& store);

// The same for results that lie in several directories.
std::vector<std::string> missing_parts(const std::vector<std::string>& dirs);

// Opens a results directory for writing, under the campaign that it holds.
Store open_to_write(const std::string& dir);

}  // namespace assay::cli
