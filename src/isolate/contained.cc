#include "isolate/contained.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <new>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "base/console.h"
#include "base/errors.h"
#include "base/exit_status.h"
#include "isolate/activity.h"
#include "isolate/child.h"
#include "isolate/limits.h"
#include "isolate/processes.h"
#include "isolate/sandbox.h"

namespace assay {
namespace {

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
    if (page_ == MAP_FAILED) throw SystemError(fmt::format("sharing memory failed: {}", std::strerror(errno)));
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

// The whole of the child: its exit status.
int contained_work(const SharedPage& shared, const std::function<int()>& work,
                   const std::optional<std::vector<std::string>>& writable) {
  write_no_core_file();
  if (writable) enter_sandbox({.read_everything = true, .writable = *writable});
  watch_activities(&shared->board);
  be_expendable();
  int status = exits::kFailed;
  try {
    status = work();
  } catch (...) {  // NOLINT(bugprone-empty-catch): nothing of this process may run the parent's clean-up
  }
  std::fflush(nullptr);
  shared->done = true;
  return status;
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
  return fmt::format("{} ended with {}: it cannot be used", doing, signal_text(signal));
}

// The end of the process that did `work`, as waitpid() gives it.
int rehearsed(const SharedPage& shared, const std::string& what, const std::function<void()>& work,
              const std::vector<std::string>& writable) {
  flush_output();
  const auto noted = [&] {
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
    return exits::kDone;
  };
  return wait_for(start_child([&] {
    const int nothing = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) ::dup2(nothing, stream);
    return contained_work(shared, noted, writable);
  }));
}

}  // namespace

int contained(const std::function<int()>& work, const std::optional<std::vector<std::string>>& writable) {
  flush_output();
  const SharedPage shared;
  std::array<struct sigaction, kPassedOn.size()> before{};
  sigset_t passed_on, mask;
  ::sigemptyset(&passed_on);
  for (const int signal : kPassedOn) ::sigaddset(&passed_on, signal);
  ::sigprocmask(SIG_BLOCK, &passed_on, &mask);
  const pid_t child = start_child([&] {
    ::sigprocmask(SIG_SETMASK, &mask, nullptr);
    return contained_work(
        shared,
        [&] {
          return guarded([&] {
            const int status = work();
            flush_output();
            return status;
          });
        },
        writable);
  });
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
  const int result = wait_for(child);
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
    return exits::kFailed;
  }
  message(what_happened(*shared, "the command", result));
  return shared->board.text.front() == '\0' ? exits::kFailed : exits::kWrongInput;
}

void rehearse(const std::string& what, const std::function<void()>& work, const std::vector<std::string>& writable) {
  constexpr int kMostTries = 3;
  for (int tries = 1;; ++tries) {
    const SharedPage shared;
    const int result = rehearsed(shared, what, work, writable);
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

}  // namespace assay
