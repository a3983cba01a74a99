#include "isolate/guard.h"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

#include "isolate/processes.h"

namespace assay {
namespace {

// A handler has nothing but globals.
volatile pid_t guarded_worker = -1;

void end_worker(int /*signal*/) {
  if (guarded_worker > 0) ::kill(guarded_worker, SIGKILL);
}

void interrupt_worker(int /*signal*/) {
  if (guarded_worker > 0) ::kill(guarded_worker, SIGINT);
}

// A folder of its own for what the worker and its engine write beside results.
std::string make_scratch() {
  const char* const name = std::getenv(kScratchVariable);
  if (name == nullptr || ::mkdir(name, S_IRWXU) != 0) return "";
  ::setenv("TMPDIR", name, 1);
  return name;
}

}  // namespace

void run_guarded(const std::function<int()>& work, int status, const std::vector<int>& of_work) {
  constexpr int kFailed = 1;
  const pid_t parent = ::getppid();
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  sigset_t ours, before;
  ::sigemptyset(&ours);
  ::sigaddset(&ours, SIGTERM);
  ::sigaddset(&ours, SIGINT);
  ::sigprocmask(SIG_BLOCK, &ours, &before);
  struct sigaction action{};
  action.sa_handler = end_worker;
  ::sigemptyset(&action.sa_mask);
  ::sigaction(SIGTERM, &action, nullptr);
  action.sa_handler = interrupt_worker;
  ::sigaction(SIGINT, &action, nullptr);
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
    ::signal(SIGINT, SIG_DFL);
    ::sigprocmask(SIG_SETMASK, &before, nullptr);
    ::close(status);
    ::_exit(work());
  }
  guarded_worker = worker;
  for (const int descriptor : of_work) ::close(descriptor);
  // Until now a dead parent has ended this process at once.
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) ::kill(worker, SIGKILL);
  ::sigprocmask(SIG_SETMASK, &before, nullptr);
  int end = 0;
  // What the worker's own children leave behind is reaped on the way.
  for (pid_t ended = 0; ended != worker;) {
    ended = ::waitpid(-1, &end, 0);
    if (ended < 0 && errno != EINTR) break;
  }
  guarded_worker = -1;
  end_descendants();
  std::error_code ignored;
  if (!scratch.empty()) std::filesystem::remove_all(scratch, ignored);
  [[maybe_unused]] const ssize_t written = ::write(status, &end, sizeof end);
  ::_exit(0);
}

}  // namespace assay
