// Commands that read strangers' models and load plugins, in a process of their own: whatever becomes of that, the user
// gets one sentence and a status.
#pragma once

#include <cstddef>
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

// How a piece of work ended (run_pieces()).
struct PieceEnd {
  enum class Kind {
    kDone,     // `text` is its result
    kThrew,    // `text` is the message of what it threw
    kTooLong,  // it was stopped at a limit of time, the piece's or an Activity's; `text` is a sentence without its end
    kCrashed,  // it ended the process, was ended from outside three times, or gave a result of more than 64 MiB; alike
  };
  Kind kind = Kind::kCrashed;
  std::string text = {};
};

// Pieces of work that do not depend on each other: one crashes or hangs, the others go on.
struct Pieces {
  size_t count = 0;
  int jobs = 1;         // at a time
  double limit_s = 60;  // of each, without what it waits for a processor (isolate/time_limit.h)
  std::function<std::string(size_t piece)> what;                  // begins a sentence: "checking 'robot.xml'"
  std::function<std::string(size_t piece)> work;                  // its result, in a process of its own
  std::function<void(size_t piece, const PieceEnd& end)> on_end;  // in this process, in the order of their ends
  std::vector<std::string> writable = {};                         // folders, as of rehearse()
};

// Runs each piece as rehearse() runs its work, `jobs` of them at a time; each may take its share of the machine's
// memory (WorkerLimits::of_share), what an Activity may take in any case. What `on_end` throws ends all of them. Throws
// SystemError where no process can be started.
void run_pieces(const Pieces& pieces);

}  // namespace assay
