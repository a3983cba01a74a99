#include "isolate/processes.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include <fmt/format.h>

namespace assay {
namespace {

// In the environment, because plugins have their own copy of this file.
constexpr const char* kExpendable = "ASSAY_EXPENDABLE_PROCESS";

[[noreturn]] void end_by(int signal) {
  std::signal(signal, SIG_DFL);
  sigset_t only;
  ::sigemptyset(&only);
  ::sigaddset(&only, signal);
  ::pthread_sigmask(SIG_UNBLOCK, &only, nullptr);
  std::raise(signal);
  std::abort();
}

void add_with_descendants(pid_t process, std::set<pid_t>& to) {
  if (!to.insert(process).second) return;
  for (const pid_t child : children_of(process)) add_with_descendants(child, to);
}

}  // namespace

bool is_from_outside(int signal) {
  constexpr std::array kOutside = {SIGKILL, SIGTERM, SIGINT, SIGHUP, SIGQUIT, SIGPWR};
  return std::ranges::find(kOutside, signal) != kOutside.end();
}

bool ended_from_outside(int status) { return WIFSIGNALED(status) && is_from_outside(WTERMSIG(status)); }

EndedFromOutside::EndedFromOutside(std::string_view what, int signal)
    : SystemError(fmt::format(
          "{} was ended from outside (SIG{}), as by the kernel when memory is short: start the same command again",
          what, ::sigabbrev_np(signal))) {}

void be_expendable() { ::setenv(kExpendable, "1", 1); }

void share_end(int status) {
  if (ended_from_outside(status) && std::getenv(kExpendable) != nullptr) end_by(WTERMSIG(status));
}

std::vector<pid_t> children_of(pid_t process) {
  namespace fs = std::filesystem;
  std::vector<pid_t> found;
  std::error_code error;
  // a child is listed with the thread that started it
  for (fs::directory_iterator it(fmt::format("/proc/{}/task", process), error), end; !error && it != end;
       it.increment(error)) {
    std::ifstream children(it->path() / "children");
    for (pid_t child = 0; children >> child;) found.push_back(child);
  }
  return found;
}

// Children of what is ended here become children of this process: until there are none.
void end_descendants() {
  constexpr int kMostRounds = 10000;
  for (int round = 0; round < kMostRounds; ++round) {
    const std::vector<pid_t> children = children_of(::getpid());
    for (const pid_t child : children) ::kill(child, SIGKILL);
    if (::waitpid(-1, nullptr, children.empty() ? WNOHANG : 0) < 0 && errno == ECHILD) return;
    if (children.empty()) return;
  }
}

void end_children(const std::function<bool(pid_t child)>& is_one) {
  constexpr auto kPause = std::chrono::milliseconds(2);
  constexpr int kMostRounds = 5000;
  std::set<pid_t> theirs;
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<pid_t> found;
    for (const pid_t child : children_of(::getpid())) {
      if (!theirs.contains(child) && !is_one(child)) continue;
      found.push_back(child);
      add_with_descendants(child, theirs);
    }
    if (found.empty()) return;
    for (const pid_t each : theirs) ::kill(each, SIGKILL);
    std::this_thread::sleep_for(kPause);
    for (const pid_t child : found) {
      if (::waitpid(child, nullptr, WNOHANG) == child) theirs.erase(child);
    }
  }
}

}  // namespace assay
