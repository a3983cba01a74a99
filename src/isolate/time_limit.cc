#include "isolate/time_limit.h"

#include <algorithm>
#include <fstream>

#include <fmt/format.h>

namespace assay {
namespace {

// A limit beyond the clock's range is none.
TimeLimit::Clock::duration duration(double s) {
  constexpr double kMostSeconds = 1e9;
  return std::chrono::duration_cast<TimeLimit::Clock::duration>(
      std::chrono::duration<double>(std::min(s, kMostSeconds)));
}

double longest_wait_s(pid_t process, int generation) {
  constexpr int kMostGenerations = 8;
  constexpr double kNanosecond = 1e-9;
  double running = 0, waiting = 0;  // ns
  std::ifstream(fmt::format("/proc/{}/schedstat", process)) >> running >> waiting;
  double longest = waiting * kNanosecond;
  if (generation == kMostGenerations) return longest;
  std::ifstream children(fmt::format("/proc/{0}/task/{0}/children", process));
  for (pid_t child = 0; children >> child;) longest = std::max(longest, longest_wait_s(child, generation + 1));
  return longest;
}

}  // namespace

double processor_wait_s(pid_t process) { return process > 0 ? longest_wait_s(process, 0) : 0; }

TimeLimit::TimeLimit(double seconds, pid_t process)
    : start_(Clock::now()),
      end_(start_ + duration(seconds)),
      seconds_(seconds),
      waited_before_(processor_wait_s(process)),
      process_(process) {}

bool TimeLimit::over() {
  if (Clock::now() < end_) return false;
  const double waited = std::max(0.0, processor_wait_s(process_) - waited_before_);
  end_ = std::max(end_, start_ + duration(std::min(seconds_ + waited, kMostFactor * seconds_)));
  return Clock::now() >= end_;
}

}  // namespace assay
