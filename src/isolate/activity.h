// What this process is doing with a stranger's file or plugin, where another process waits for it
// (isolate/contained.h): that one can then say what went wrong. Without one an Activity costs and limits nothing.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace assay {

// Memory that both processes see.
struct ActivityBoard {
  std::array<char, 1024> text{};  // what is done now, as the beginning of a sentence: "reading 'robot.xml'"; "" between
};

struct ActivityLimits {
  double cpu_s = 10;                                // processor time
  double wall_s = 30;                               // for what waits: a pipe that nobody writes
  std::size_t memory_bytes = std::size_t{2} << 30;  // beyond what the process has
};

// Writable memory of this process, as RLIMIT_DATA counts it; 0 where the system does not tell.
std::size_t data_bytes();

// Whether half of what this process may take of it (RLIMIT_DATA) is taken. Engines that compile code for each model
// keep it: the models of a whole suite are GiB in some.
bool is_half_full();

// From now on this process's activities are written to `board` and limited: one that takes too long is ended by SIGXCPU
// or SIGALRM. Null ends that.
void watch_activities(ActivityBoard* board);

// From construction to destruction. Within another one it only replaces the text.
class Activity {
 public:
  explicit Activity(std::string_view what, const ActivityLimits& limits = {});
  ~Activity();
  Activity(const Activity&) = delete;
  Activity& operator=(const Activity&) = delete;

 private:
  std::array<char, 1024> before_{};
  bool outermost_ = false;
};

}  // namespace assay
