// The robots of a folder, each read and checked in a process of its own, several at a time.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "check/dataset/dataset.h"
#include "load/load_options.h"

namespace assay::dataset {

struct How {
  LoadOptions load = {};
  std::string repair_into = {};  // the folder for repaired files; empty for none
  int jobs = 1;                  // files at a time
  double limit_s = 60;           // of each file
  // Folders that the processes may write: caches of models, and `repair_into`.
  std::vector<std::string> writable = {};
};

// What is to be checked, and a Report without findings, but for folders that cannot be listed.
struct Robots {
  std::vector<std::string> files = {};  // below the folder, sorted by their bytes
  Report report = {};
};

// `folder` as its user named it. Throws InputError where it has no robot, and says what it has instead.
Robots find_robots(const std::string& folder, const How& how);

// Checks all of them and adds their findings to the report, which is returned. `on_file` gets each file in the order of
// Robots::files, as soon as those before it are done; it may change the findings (Baseline::mark). `on_end` gets the
// number of files that are done, whenever one is.
Report check_robots(Robots robots, const How& how, const std::function<void(FileReport&)>& on_file,
                    const std::function<void(size_t done)>& on_end);

}  // namespace assay::dataset
