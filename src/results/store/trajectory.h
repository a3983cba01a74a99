// States of a run in a file of its own under the results directory, addressed by what they follow from, so that every
// measure reads the same run.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/state.h"
#include "model/state_faults.h"

namespace assay {

struct Trajectory {
  std::vector<State> states;  // ascending in time, all of the same model
};

// `dir`/`address`.bin.
std::string trajectory_path(const std::string& dir, const std::string& address);

// Writes the file whole or not at all (a temporary file, synced, then renamed); makes `dir`. Throws SystemError.
void write_trajectory(const std::string& dir, const std::string& address, const Trajectory& trajectory);

// Empty when there is no such file or when trajectory_fault() finds something: then it has to be computed again. Files
// of an older format, which do not say their address, are read. Throws SystemError when a regular file is there and
// cannot be read. At most 4 GiB are read, and only of a file whose size is that of the states that it counts.
std::optional<Trajectory> read_trajectory(const std::string& dir, const std::string& address);

// What keeps the file from being the run of this address, as the end of a sentence about it: "is damaged (its checksum
// is wrong)", "holds the run ...", "is of an older format, which does not say whose run it holds". "" for a sound file
// and for none. Throws SystemError as above.
std::string trajectory_fault(const std::string& dir, const std::string& address);

// What keeps states that a file held from being a run of a system with so many bodies and joints (hinges and slides),
// in the words of trajectory_fault(): "has no states", "is another system's", "has times that do not increase". "" for
// nothing: then all states have these shapes, times lie at least 1 ns apart and within 1e9 s of 0.
std::string run_fault(const Trajectory& trajectory, size_t bodies, std::optional<size_t> joints = std::nullopt);

// read_trajectory() of results that may be a stranger's: empty where run_fault() finds something, too.
std::optional<Trajectory> read_run(const std::string& dir, const std::string& address, size_t bodies,
                                   std::optional<size_t> joints = std::nullopt);

bool has_trajectory(const std::string& dir, const std::string& address);

// How many states the file says that it holds; 0 when there is none, or its size is another. Its content is not looked
// at.
size_t count_states(const std::string& dir, const std::string& address);

}  // namespace assay
