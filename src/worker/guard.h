// The process above a worker. Engines start processes of their own, and some of those leave the worker's group or
// session: the guard is their reaper (PR_SET_CHILD_SUBREAPER), and ends all of them when the worker ends, when its
// parent dies, and at SIGTERM. It does nothing while the worker works. The worker gets a folder for temporary files
// (TMPDIR), which the guard removes.
#pragma once

#include <functional>

namespace assay {

inline constexpr const char* kScratchPrefix = "assay-worker-";  // of the folder's name

// Runs `work` in a child, which ends with this process, and ends everything after it. Writes the child's status, as
// waitpid() gives it, to kWorkerStatus. Does not return in this process; in the child the result of `work` is the exit
// status.
[[noreturn]] void run_guarded(const std::function<int()>& work);

}  // namespace assay
