// Commands that read strangers' models and load plugins, in a process of their own: whatever becomes of that, the user
// gets one sentence and a status.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace assay {

// Runs `work`, a whole command, in a forked process and returns its status. Work that crashes, hangs or ends the
// process is status kFailed, or kWrongInput where an Activity (isolate/activity.h) was reading a file, with a sentence
// on standard error; what somebody else ends (isolate/processes.h) is kFailed. SIGINT, SIGTERM and SIGHUP reach the
// work; the child ends with its parent. It may read files, and write only into the folders `writable`
// (isolate/sandbox.h); without that list it may do what the user may.
int contained(const std::function<int()>& work, const std::optional<std::vector<std::string>>& writable);

// Runs `work` in a forked process, prints nothing, and throws what it throws: InputError with its text, and for any
// other exception SystemError. Work that crashes, hangs, ends the process or takes too much memory is an InputError.
// Work that somebody else ends is tried again; after the third time that is an EndedFromOutside (isolate/processes.h).
// It may write only into the folders `writable`. Where nothing is thrown, the caller can do the same work himself.
// `what` begins the sentence where no Activity does: "reading the campaign 'x'".
void rehearse(const std::string& what, const std::function<void()>& work, const std::vector<std::string>& writable);

}  // namespace assay
