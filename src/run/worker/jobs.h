// What a worker does: one run, one cell's pieces, the conformance suite, a timing session.
#pragma once

#include <functional>
#include <optional>

#include "run/messages/messages.h"

namespace assay {

// Does the job and returns its answer. `report` sends replies on the way. A timing session goes on until `next` has no
// command any more.
JobDone do_job(const Request& job, const std::function<void(const Reply&)>& report,
               const std::function<std::optional<Request>()>& next);

}  // namespace assay
