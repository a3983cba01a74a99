// Work that an engine can crash, in a process of its own.
#pragma once

#include <functional>
#include <string>

namespace assay::cli {

struct ChildEnd {
  int status = 0;  // what the work returned, or the status of what it threw (its message is printed already)
  int signal = 0;  // what ended it instead; 0 for an orderly end

  std::string signal_text() const;  // "SIGSEGV (Segmentation fault)"
};

// Sends one line of text (without line breaks in it) to the parent.
using Send = std::function<void(const std::string&)>;

// Runs `work` in a forked process and returns how it ended. `on_line` gets in this process what `work` sends. SIGINT
// and SIGTERM are passed on; the child ends with its parent, and a SIGPIPE ends both.
ChildEnd run_in_child(const std::function<int(const Send&)>& work, const Send& on_line = {});

}  // namespace assay::cli
