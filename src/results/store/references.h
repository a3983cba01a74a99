// Trajectories that outlive a results directory: a folder of files named by a hash of what they depend on (model,
// settings, the engine's build), so that a later campaign need not compute them again. Any number of processes may use
// one folder at once: files appear and go as a whole, and a damaged one is computed again.
#pragma once

#include <cstdint>
#include <string>

namespace assay {

class References {
 public:
  // `dir` is made when something is kept; "" keeps nothing. `most_bytes` bounds the folder, see prune().
  explicit References(std::string dir, std::uintmax_t most_bytes = kMostBytes);

  // Puts the trajectory into `results` (a results directory's trajectories) if it is kept here. False when it is not,
  // or is damaged: then it is removed. Throws SystemError when `results` cannot be written.
  bool fetch(const std::string& address, const std::string& results) const;

  // Keeps the trajectory that `results` holds. A folder that cannot be written keeps nothing, which only costs time.
  void keep(const std::string& address, const std::string& results) const;

  // Removes the least recently used files until the rest fits. Results directories keep theirs.
  void prune() const;

  static constexpr std::uintmax_t kMostBytes = std::uintmax_t{4} << 30;

 private:
  std::string dir_;
  std::uintmax_t most_bytes_;
};

}  // namespace assay
