// Work that an engine can crash, in a process of its own.
#pragma once

#include <functional>
#include <string>

namespace assay {

struct ChildEnd {
  int status = 0;  // what the work returned, or the status of what it threw (its message is printed already)
  int signal = 0;  // what ended it instead; 0 for an orderly end
  // Why this process ended it: "not done after 5 min"; "" where it did not.
  std::string stopped = {};

  std::string signal_text() const;  // "SIGSEGV (Segmentation fault)"
  // Somebody else ended it, which says nothing of an engine.
  bool from_outside() const;
};

// Sends one line of text (without line breaks in it) to the parent.
using Send = std::function<void(const std::string&)>;

// Runs `work` in a forked process below a guard (isolate/guard.h), with the limits of a worker that has the machine
// to itself, and returns how it ended; what it has started has ended, too. `on_line` gets in this process what `work`
// sends. With `limit_s`, work that sends nothing for that long is ended (isolate/time_limit.h). SIGINT and SIGTERM are
// passed on as SIGINT, those of a terminal too; the child ends with its parent, and a SIGPIPE ends both.
ChildEnd run_in_child(const std::function<int(const Send&)>& work, const Send& on_line = {}, double limit_s = 0);

}  // namespace assay
