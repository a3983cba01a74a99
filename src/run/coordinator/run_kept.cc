#include "run/coordinator/run_kept.h"

#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "base/text.h"
#include "results/store/trajectory.h"

namespace assay {

bool KeptRuns::has(const std::string& address) {
  const auto known = known_.find(address);
  if (known != known_.end()) return known->second;
  if (const std::string fault = trajectory_fault(dir_, address); !fault.empty()) {
    damaged_.push_back(fmt::format("'{}' {}", trajectory_path(dir_, address), fault));
    std::error_code error;
    std::filesystem::remove(trajectory_path(dir_, address), error);
  }
  return known_[address] = has_trajectory(dir_, address) || references_.fetch(address, dir_);
}

bool KeptRuns::others_have(const std::string& address) const {
  if (references_.fetch(address, dir_)) return true;
  std::error_code error;
  std::filesystem::remove(trajectory_path(dir_, address), error);
  return false;
}

void KeptRuns::say_damaged() const {
  if (damaged_.empty()) return;
  run_.progress.message(fmt::format("{} stored {} not used and made again: {}", damaged_.size(),
                                    damaged_.size() == 1 ? "run is" : "runs are", join(damaged_, "; ")));
}

}  // namespace assay
