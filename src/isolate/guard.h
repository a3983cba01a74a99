// The process above a worker. Engines start processes of their own, and some of those leave the worker's group or
// session: the guard is their reaper (PR_SET_CHILD_SUBREAPER), and ends all of them when the worker ends, when its
// parent dies, and at SIGTERM. It does nothing while the worker works. The worker gets a folder for temporary files
// (TMPDIR), which the guard removes. When somebody else ends the guard, the worker ends too, and the parent does the
// rest (run/coordinator/process.cc).
#pragma once

#include <functional>
#include <vector>

namespace assay {

// The variable that names the folder which a worker's guard makes for temporary files, and how the folder's name
// begins. The variable tells the processes of one worker from those of others.
inline constexpr const char* kScratchVariable = "ASSAY_SCRATCH";
inline constexpr const char* kScratchPrefix = "assay-worker-";

// Runs `work` in a child, which ends with this process, and ends everything after it. Writes the child's status, as
// waitpid() gives it, to `status`, which the child does not have; the descriptors `of_work` are the child's alone.
// SIGINT is passed on to the child. Does not return in this process; in the child the result of `work` is the exit
// status.
[[noreturn]] void run_guarded(const std::function<int()>& work, int status, const std::vector<int>& of_work);

}  // namespace assay
