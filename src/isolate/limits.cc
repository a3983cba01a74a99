#include "isolate/limits.h"

#include <algorithm>
#include <filesystem>
#include <string>
#include <sys/resource.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

namespace assay {
namespace {

void limit(int resource, std::uint64_t most) {
  rlimit before{};
  if (most == 0 || ::getrlimit(static_cast<__rlimit_resource>(resource), &before) != 0) return;
  const rlim_t value = before.rlim_max == RLIM_INFINITY ? most : std::min<rlim_t>(most, before.rlim_max);
  const rlimit limited = {value, value};
  ::setrlimit(static_cast<__rlimit_resource>(resource), &limited);
}

// Processes and threads of this process's user.
std::uint64_t tasks_of_user() {
  namespace fs = std::filesystem;
  std::uint64_t tasks = 0;
  std::error_code error;
  for (fs::directory_iterator it("/proc", error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename();
    struct stat facts{};
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    if (::stat(it->path().c_str(), &facts) != 0 || facts.st_uid != ::getuid()) continue;
    std::error_code gone;
    for (fs::directory_iterator task(it->path() / "task", gone); !gone && task != end; task.increment(gone)) ++tasks;
  }
  return tasks;
}

}  // namespace

WorkerLimits WorkerLimits::of_machine() {
  constexpr std::uint64_t kMoreTasks = 512;
  const auto pages = static_cast<std::uint64_t>(std::max(0L, ::sysconf(_SC_PHYS_PAGES)));
  const auto page = static_cast<std::uint64_t>(std::max(0L, ::sysconf(_SC_PAGESIZE)));
  WorkerLimits limits;
  limits.memory_bytes = pages * page / 5 * 4;
  limits.tasks = tasks_of_user() + kMoreTasks;
  return limits;
}

WorkerLimits WorkerLimits::of_share(int jobs) {
  constexpr std::uint64_t kGiB = std::uint64_t{1} << 30;
  WorkerLimits limits = of_machine();
  limits.memory_bytes = std::clamp(limits.memory_bytes / static_cast<std::uint64_t>(std::max(1, jobs)), kGiB, 4 * kGiB);
  return limits;
}

void WorkerLimits::apply() const {
#ifndef __SANITIZE_ADDRESS__  // its shadow memory counts
  limit(RLIMIT_DATA, memory_bytes);
#endif
  limit(RLIMIT_FSIZE, file_bytes);
  limit(RLIMIT_NPROC, tasks);
}

void write_no_core_file() {
  const rlimit none = {0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
}

}  // namespace assay
