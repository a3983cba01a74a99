// One run of one contender as a table of states, in a process of its own.
#pragma once

#include <string>

#include "run/simulate/job.h"

namespace assay {

// Writes the samples to `out` ("-": standard output) as CSV (results/store/state_rows.h), each before the next begins,
// and says on standard error what the engine approximates and how far it is; with `time` also the time inside the
// engine's own step calls. Returns a status of base/exit_status.h. Throws InputError for what is refused, EngineError
// for a run that fails or diverges, and SystemError where it is interrupted before its first sample.
int simulate(const SimulateRequest& request, const std::string& out, bool time);

}  // namespace assay
