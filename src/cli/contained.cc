#include "cli/contained.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <new>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/paths.h"
#include "cli/cli.h"
#include "engines/engine_files.h"
#include "isolate/activity.h"
#include "isolate/processes.h"
#include "isolate/sandbox.h"

namespace assay::cli {
namespace {

SystemError failure(const char* what) { return SystemError{fmt::format("{} failed: {}", what, std::strerror(errno))}; }

// What both processes see.
struct Shared {
  ActivityBoard board;
  bool done = false;  // the work came to its end
  // What it threw instead of a result, if it did.
  enum class Thrown { kNothing, kInputError, kOther } thrown = Thrown::kNothing;
  std::array<char, 16384> text{};

  void note(Thrown what, const std::string& why) {
    thrown = what;
    const size_t size = std::min(why.size(), text.size() - 1);
    std::memcpy(text.data(), why.data(), size);
    text.at(size) = '\0';
  }
};

class SharedPage {
 public:
  SharedPage() : page_(::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) {
    if (page_ == MAP_FAILED) throw failure("sharing memory");
    new (page_) Shared;
  }
  ~SharedPage() { ::munmap(page_, sizeof(Shared)); }
  SharedPage(const SharedPage&) = delete;
  SharedPage& operator=(const SharedPage&) = delete;
  Shared* operator->() const { return static_cast<Shared*>(page_); }
  const Shared& operator*() const { return *operator->(); }

 private:
  void* page_;
};

// A handler has nothing but globals.
volatile pid_t contained_child = -1;

// A terminal interrupts both processes; what somebody sends to this one is passed on.
void pass_on(int signal, siginfo_t* info, void* /*context*/) {
  if (info->si_code <= 0 && contained_child > 0) ::kill(contained_child, signal);
}

constexpr std::array<int, 3> kPassedOn = {SIGINT, SIGTERM, SIGHUP};

// Results of --decompose are kept there for the next time, and kernels that engines compile.
std::vector<std::string> with_cache(std::vector<std::string> writable) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path cache = cache_dir(), hulls = cache / "hulls";
  if (!cache.empty() && fs::is_directory(cache / "libraries", error) && fs::create_directories(hulls, error))
    error = {};
  if (fs::is_directory(hulls, error)) writable.push_back(hulls);
  for (std::string& folder : engine_caches()) writable.push_back(std::move(folder));
  return writable;
}

[[noreturn]] void be_child(const SharedPage& shared, const std::function<int()>& work, pid_t parent,
                           const std::optional<std::vector<std::string>>& writable) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(kFailed);
  const rlimit no_core = {0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  if (writable) enter_sandbox({.read_everything = true, .writable = with_cache(*writable)});
  watch_activities(&shared->board);
  be_expendable();
  int status = kFailed;
  try {
    status = work();
  } catch (...) {  // NOLINT(bugprone-empty-catch): nothing of this process may run the parent's clean-up
  }
  std::fflush(nullptr);
  shared->done = true;
  ::_exit(status);
}

std::string activity(const Shared& shared, const std::string& what) {
  return shared.board.text.front() == '\0' ? what : shared.board.text.data();
}

// "reading 'x.xml' ended with SIGSEGV (Segmentation fault): ..."
std::string what_happened(const Shared& shared, const std::string& what, int result) {
  const std::string doing = activity(shared, what);
  if (!WIFSIGNALED(result)) {
    return fmt::format("{} ended the process early, with status {}: a library or plugin did that, not assay", doing,
                       WEXITSTATUS(result));
  }
  const int signal = WTERMSIG(result);
  const ActivityLimits limits;
  if (signal == SIGXCPU || signal == SIGALRM) {
    return fmt::format("{} was stopped: it takes more than {} s{}", doing,
                       signal == SIGXCPU ? limits.cpu_s : limits.wall_s, signal == SIGXCPU ? " of processor time" : "");
  }
  return fmt::format("{} ended with SIG{} ({}): it cannot be used", doing, ::sigabbrev_np(signal), ::strsignal(signal));
}

// The end of the process that did `work`, as waitpid() gives it.
int rehearsed(const SharedPage& shared, const std::string& what, const std::function<void()>& work) {
  flush_output();
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child < 0) throw failure("starting a process");
  if (child == 0) {
    const int nothing = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) ::dup2(nothing, stream);
    be_child(
        shared,
        [&] {
          try {
            work();
          } catch (const InputError& error) {
            shared->note(Shared::Thrown::kInputError, error.what());
          } catch (const std::bad_alloc&) {
            const std::string doing = shared->board.text.data();
            shared->note(Shared::Thrown::kInputError,
                         fmt::format("{} takes more than {} GiB of memory", doing.empty() ? what : doing,
                                     ActivityLimits().memory_bytes >> 30));
          } catch (const std::exception& error) {
            shared->note(Shared::Thrown::kOther, error.what());
          } catch (...) {
            shared->note(Shared::Thrown::kOther, "an engine threw an exception that is not a std::exception");
          }
          return kDone;
        },
        parent, std::vector<std::string>{});
  }
  int result = 0;
  while (::waitpid(child, &result, 0) < 0 && errno == EINTR) {
  }
  return result;
}

}  // namespace

int contained(const std::function<int()>& work, const std::optional<std::vector<std::string>>& writable) {
  flush_output();
  const SharedPage shared;
  const pid_t parent = ::getpid();
  std::array<struct sigaction, kPassedOn.size()> before{};
  sigset_t passed_on, mask;
  ::sigemptyset(&passed_on);
  for (const int signal : kPassedOn) ::sigaddset(&passed_on, signal);
  ::sigprocmask(SIG_BLOCK, &passed_on, &mask);
  const pid_t child = ::fork();
  if (child < 0) throw failure("starting a process");
  if (child == 0) {
    ::sigprocmask(SIG_SETMASK, &mask, nullptr);
    be_child(
        shared,
        [&] {
          return guarded([&] {
            const int status = work();
            flush_output();
            return status;
          });
        },
        parent, writable);
  }
  contained_child = child;
  struct sigaction action{};
  action.sa_sigaction = pass_on;
  action.sa_flags = SA_SIGINFO | SA_RESTART;
  ::sigemptyset(&action.sa_mask);
  for (size_t i = 0; i < kPassedOn.size(); ++i) {
    ::sigaction(kPassedOn[i], nullptr, &before[i]);
    if (before[i].sa_handler != SIG_IGN) ::sigaction(kPassedOn[i], &action, nullptr);
  }
  ::sigprocmask(SIG_SETMASK, &mask, nullptr);
  int result = 0;
  while (::waitpid(child, &result, 0) < 0 && errno == EINTR) {
  }
  contained_child = -1;
  for (size_t i = 0; i < kPassedOn.size(); ++i) ::sigaction(kPassedOn[i], &before[i], nullptr);
  if (shared->done) return WEXITSTATUS(result);
  if (WIFSIGNALED(result)) {
    // ended by the user, as this process would have been
    const int signal = WTERMSIG(result);
    for (const int ending : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGQUIT}) {
      if (signal == ending) ::raise(ending);
    }
  }
  if (ended_from_outside(result)) {
    message(EndedFromOutside(activity(*shared, "the command"), WTERMSIG(result)).what());
    return kFailed;
  }
  message(what_happened(*shared, "the command", result));
  return shared->board.text.front() == '\0' ? kFailed : kWrongInput;
}

void rehearse(const std::string& what, const std::function<void()>& work) {
  constexpr int kMostTries = 3;
  for (int tries = 1;; ++tries) {
    const SharedPage shared;
    const int result = rehearsed(shared, what, work);
    if (!shared->done && ended_from_outside(result)) {
      if (tries == kMostTries) throw EndedFromOutside(activity(*shared, what), WTERMSIG(result));
      continue;
    }
    if (!shared->done) throw InputError(what_happened(*shared, what, result));
    if (shared->thrown == Shared::Thrown::kInputError) throw InputError(shared->text.data());
    if (shared->thrown == Shared::Thrown::kOther) throw SystemError(shared->text.data());
    return;
  }
}

}  // namespace assay::cli
