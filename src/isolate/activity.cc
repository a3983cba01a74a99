#include "isolate/activity.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

namespace assay {
namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr bool kLimitsData = false;  // the sanitizer's shadow memory would count
#else
constexpr bool kLimitsData = true;
#endif

ActivityBoard* watched = nullptr;
int depth = 0;

double cpu_seconds_so_far() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

// Soft limits, which this process may raise again, as they were before the outermost activity.
rlimit cpu_before{}, data_before{};

void limit(__rlimit_resource resource, rlimit& before, rlim_t most) {
  if (::getrlimit(resource, &before) != 0) return;
  const rlimit now = {std::min(most, before.rlim_cur), before.rlim_max};
  ::setrlimit(resource, &now);
}

void limit_wall(double seconds) {
  itimerval timer{};
  timer.it_value.tv_sec = static_cast<time_t>(seconds);
  ::setitimer(ITIMER_REAL, &timer, nullptr);
}

}  // namespace

std::size_t data_bytes() {
  std::ifstream pages("/proc/self/statm");
  std::size_t size = 0, resident = 0, shared = 0, text = 0, lib = 0, data = 0;
  pages >> size >> resident >> shared >> text >> lib >> data;
  return data * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

bool is_half_full() {
  rlimit limit = {};
  return ::getrlimit(RLIMIT_DATA, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY && data_bytes() > limit.rlim_cur / 2;
}

void watch_activities(ActivityBoard* board) { watched = board; }

Activity::Activity(std::string_view what, const ActivityLimits& limits) {
  if (watched == nullptr) return;
  before_ = watched->text;
  const std::size_t size = std::min(what.size(), watched->text.size() - 1);
  std::memcpy(watched->text.data(), what.data(), size);
  watched->text.at(size) = '\0';
  outermost_ = depth++ == 0;
  if (!outermost_) return;
  limit(RLIMIT_CPU, cpu_before, static_cast<rlim_t>(std::ceil(cpu_seconds_so_far() + limits.cpu_s)));
  if (kLimitsData) limit(RLIMIT_DATA, data_before, data_bytes() + limits.memory_bytes);
  limit_wall(limits.wall_s);
}

Activity::~Activity() {
  if (watched == nullptr) return;
  watched->text = before_;
  --depth;
  if (!outermost_) return;
  ::setrlimit(RLIMIT_CPU, &cpu_before);
  if (kLimitsData) ::setrlimit(RLIMIT_DATA, &data_before);
  limit_wall(0);
}

}  // namespace assay
