#include "worker/guard.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <stdlib.h>  // NOLINT(*-deprecated-headers): mkdtemp
#include <string>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "messages/messages.h"

namespace assay {
namespace {

// A handler has nothing but globals.
volatile pid_t guarded_worker = -1;

void end_worker(int /*signal*/) {
  if (guarded_worker > 0) ::kill(guarded_worker, SIGKILL);
}

// This process's children, among them those that it has inherited. Empty where the kernel does not say.
std::string list_of_children() {
  std::string text;
  const std::string path = fmt::format("/proc/self/task/{}/children", ::getpid());
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return text;
  std::array<char, 4096> buffer{};
  for (ssize_t got = 0; (got = ::read(file, buffer.data(), buffer.size())) > 0;) {
    text.append(buffer.data(), static_cast<size_t>(got));
  }
  ::close(file);
  return text;
}

// Children of what is ended here become children of this process: until there are none.
void end_descendants() {
  constexpr int kMostRounds = 10000;
  for (int round = 0; round < kMostRounds; ++round) {
    const std::string children = list_of_children();
    for (const char* at = children.c_str(); *at != '\0';) {
      char* end = nullptr;
      const long child = std::strtol(at, &end, 10);
      if (end == at) break;
      if (child > 1) ::kill(static_cast<pid_t>(child), SIGKILL);
      at = end;
    }
    if (::waitpid(-1, nullptr, children.empty() ? WNOHANG : 0) < 0 && errno == ECHILD) return;
    if (children.empty()) return;
  }
}

// A folder of its own for what the worker and its engine write beside results.
std::string make_scratch() {
  std::error_code error;
  std::string name = (std::filesystem::temp_directory_path(error) / (std::string(kScratchPrefix) + "XXXXXX")).string();
  if (error || ::mkdtemp(name.data()) == nullptr) return "";
  ::setenv("TMPDIR", name.c_str(), 1);
  return name;
}

}  // namespace

void run_guarded(const std::function<int()>& work) {
  constexpr int kFailed = 1;
  const pid_t parent = ::getppid();
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  sigset_t ours, before;
  ::sigemptyset(&ours);
  ::sigaddset(&ours, SIGTERM);
  ::sigprocmask(SIG_BLOCK, &ours, &before);
  struct sigaction action{};
  action.sa_handler = end_worker;
  ::sigemptyset(&action.sa_mask);
  ::sigaction(SIGTERM, &action, nullptr);
  const std::string scratch = make_scratch();
  const pid_t guard = ::getpid();
  const pid_t worker = ::fork();
  if (worker < 0) {
    // as the last line that it has printed it reaches the user
    std::perror("starting a process");
    ::_exit(kFailed);
  }
  if (worker == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != guard) ::_exit(kFailed);
    ::signal(SIGTERM, SIG_DFL);
    ::sigprocmask(SIG_SETMASK, &before, nullptr);
    ::close(kWorkerStatus);
    ::_exit(work());
  }
  guarded_worker = worker;
  ::close(kWorkerSocket);
  // Until now a dead parent has ended this process at once.
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) ::kill(worker, SIGKILL);
  ::sigprocmask(SIG_SETMASK, &before, nullptr);
  int status = 0;
  // What the worker's own children leave behind is reaped on the way.
  for (pid_t ended = 0; ended != worker;) {
    ended = ::waitpid(-1, &status, 0);
    if (ended < 0 && errno != EINTR) break;
  }
  guarded_worker = -1;
  end_descendants();
  std::error_code ignored;
  if (!scratch.empty()) std::filesystem::remove_all(scratch, ignored);
  [[maybe_unused]] const ssize_t written = ::write(kWorkerStatus, &status, sizeof status);
  ::_exit(0);
}

}  // namespace assay
