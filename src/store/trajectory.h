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

// Empty when there is no such file or when trajectory_fault() finds something: then it has to be computed again. Files
// of an older format, which do not say their address, are read. Throws SystemError when a regular file is there and
// cannot be read. At most 4 GiB are read, and only of a file whose size is that of the states that it counts.
std::optional<Trajectory> read_trajectory(const std::string& dir, const std::string& address);

// What keeps the file from being the run of this address, as the end of a sentence about it: "is damaged (its checksum
// is wrong)", "holds the run ...", "is of an older format, which does not say whose run it holds". "" for a sound file
// and for none. Throws SystemError as above.
std::string trajectory_fault(const std::string& dir, const std::string& address);

// What in a state that comes from an engine, or from a file of its states, cannot be; "" for nothing.
// Its shape: "3 bodies where the model has 5". `bodies` and `joints` are the model's.
std::string state_shape_fault(const State& state, size_t bodies, size_t joints);
// Its values: "a non-finite number", "an orientation of length 0".
std::string state_value_fault(const State& state);

bool has_trajectory(const std::string& dir, const std::string& address);

// How many states the file says that it holds; 0 when there is none, or its size is another. Its content is not looked
// at.
size_t count_states(const std::string& dir, const std::string& address);

}  // namespace assay
