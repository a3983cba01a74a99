// Runs that are there already: in the results directory, or kept for other campaigns (results/store/references.h).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "results/store/references.h"
#include "run/coordinator/run_shared.h"

namespace assay {

// Each by its address.
class KeptRuns {
 public:
  explicit KeptRuns(RunShared& run)
      : run_(run), dir_(run.store.trajectories_dir()), references_(run.options.references) {}

  // Whether the trajectory is in the results directory or could be fetched from another campaign. A file that is
  // damaged or holds another run is removed: it is made again like one that is missing.
  bool has(const std::string& address);
  // What others read has to be where they look. What lies only here is made again: see where runs are kept.
  bool others_have(const std::string& address) const;
  // One that was made now.
  void keep(const std::string& address) const { references_.keep(address, dir_); }

  void say_damaged() const;  // all of them at once

 private:
  RunShared& run_;
  std::string dir_;
  References references_;
  std::map<std::string, bool> known_;  // as it was found first
  std::vector<std::string> damaged_;   // a text each
};

}  // namespace assay
