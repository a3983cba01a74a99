// What a worker may do on its machine (isolate/sandbox.h). In front of the job: read files, and write only into the
// job's folder of trajectories and its own scratch folder (TMPDIR). In front of the first engine: read only what
// engines are made of.
#pragma once

#include "run/messages/messages.h"

namespace assay {

void confine_worker(const Request& job);

// Call it after the job's files are read.
void confine_engine();

}  // namespace assay
