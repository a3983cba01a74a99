// A time limit for a process that is fair on a crowded machine: the time for which the process was ready to run and
// other work had the processors does not count. What hangs, or computes for ever, ends at its limit; what is only
// slowed down by others does not end with a timeout that would be said of an engine.
#pragma once

#include <chrono>
#include <sys/types.h>

namespace assay {

// Seconds for which a process, or one that it started, has waited for a processor since it began: the longest of them,
// by their first threads, as the kernel counts it (/proc/PID/schedstat). 0 where the kernel does not say.
double processor_wait_s(pid_t process);

class TimeLimit {
 public:
  using Clock = std::chrono::steady_clock;

  // From now on. Waiting for a processor moves the end until kMostFactor times the limit at most. `process` -1: plain
  // time.
  explicit TimeLimit(double seconds, pid_t process = -1);

  // Whether the limit is over.
  bool over();

  // Not before this moment. over() may move it.
  Clock::time_point end() const { return end_; }

  static constexpr double kMostFactor = 10;

 private:
  Clock::time_point start_, end_;
  double seconds_, waited_before_;
  pid_t process_;
};

}  // namespace assay
