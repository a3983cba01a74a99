// States of a run in a file of its own under the results directory, addressed by what they follow from, so that every
// measure reads the same run.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/state.h"

namespace assay {

struct Trajectory {
  std::vector<State> states;  // ascending in time, all of the same model
};

// `dir`/`address`.bin.
std::string trajectory_path(const std::string& dir, const std::string& address);

// Writes the file whole or not at all (a temporary file, synced, then renamed); makes `dir`. Throws SystemError.
void write_trajectory(const std::string& dir, const std::string& address, const Trajectory& trajectory);

// Empty when there is no such file or when its content is damaged (its checksum is wrong): then it has to be computed
// again. Throws SystemError when the file is there and cannot be read.
std::optional<Trajectory> read_trajectory(const std::string& dir, const std::string& address);

bool has_trajectory(const std::string& dir, const std::string& address);

// How many states the file says that it holds; 0 when there is none. Its content is not looked at.
size_t count_states(const std::string& dir, const std::string& address);

}  // namespace assay
