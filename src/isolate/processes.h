// Other processes: what is below one, and ends that say nothing of the engine or the file that a process was busy with.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <sys/types.h>
#include <vector>

#include "base/errors.h"

namespace assay {

// Signals by which somebody else ends a process: a user, a scheduler, the kernel's out-of-memory killer. An engine's
// faults send others, and so do assay's limits of time and memory.
bool is_from_outside(int signal);

// The same of an end as waitpid() gives it.
bool ended_from_outside(int status);

// "WHAT was ended from outside (SIGKILL), ...: start the same command again".
class EndedFromOutside : public SystemError {
 public:
  EndedFromOutside(std::string_view what, int signal);
};

// From now on this process and those that it starts are there for one engine or one file alone (a worker): what ends a
// part of it from outside ends it too. A program that has assay as a library does not call it.
void be_expendable();

// To be called with the end of a process that this one needs (as waitpid() gives it). After an end from outside, an
// expendable process ends itself by the same signal, so that its parent sees what has happened. Else it returns.
void share_end(int status);

// The processes whose parent `process` is now, those that it inherited among them (PR_SET_CHILD_SUBREAPER). Empty where
// the kernel does not say.
std::vector<pid_t> children_of(pid_t process);

// Ends (SIGKILL) and reaps all processes below this one. It has to inherit what they leave (PR_SET_CHILD_SUBREAPER).
void end_descendants();

// The same of those children only that `is_one` names, and of what is below them.
void end_children(const std::function<bool(pid_t child)>& is_one);

}  // namespace assay
