// Work that an engine can crash, in a process of its own.
#pragma once

#include <functional>
#include <string>

namespace assay::cli {

struct ChildEnd {
  int status = 0;      // what the work returned, or the status of what it threw (its message is printed already)
  std::string signal;  // what ended it instead, as in "SIGSEGV (Segmentation fault)"; empty for an orderly end
};

// Sends one line of text (without line breaks in it) to the parent.
using Send = std::function<void(const std::string&)>;

// Runs `work` in a forked process and returns how it ended. `on_line` gets in this process what `work` sends. SIGINT
// and SIGTERM are passed on. The child ends with its parent.
ChildEnd run_in_child(const std::function<int(const Send&)>& work, const Send& on_line = {});

}  // namespace assay::cli
