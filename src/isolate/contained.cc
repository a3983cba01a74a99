#include "isolate/contained.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <memory>
#include <new>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <poll.h>

#include "base/console.h"
#include "base/errors.h"
#include "base/exit_status.h"
#include "isolate/activity.h"
#include "isolate/child.h"
#include "isolate/limits.h"
#include "isolate/machine_lack.h"
#include "isolate/processes.h"
#include "isolate/sandbox.h"
#include "isolate/time_limit.h"

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

constexpr int kMostTries = 3;  // of work that somebody else ends

// The whole of a child that prints nothing: what its work throws is noted.
int silent_work(const SharedPage& shared, const std::string& what, const std::function<void()>& work,
                const std::vector<std::string>& writable) {
  const auto noted = [&] {
    try {
      work();
    } catch (const InputError& error) {
      shared->note(Shared::Thrown::kInputError, error.what());
    } catch (const std::bad_alloc&) {
      const std::string doing = activity(*shared, what), limit = inherited_memory_limit();
      if (limit.empty()) {
        shared->note(Shared::Thrown::kInputError,
                     fmt::format("{} takes more than {} GiB of memory", doing, ActivityLimits().memory_bytes >> 30));
      } else {  // that of a shell says nothing of the input
        shared->note(Shared::Thrown::kOther,
                     fmt::format("{} takes more than this shell allows, {}: raise the limit", doing, limit));
      }
    } catch (const std::exception& error) {
      shared->note(Shared::Thrown::kOther, error.what());
    } catch (...) {
      shared->note(Shared::Thrown::kOther, "an engine threw an exception that is not a std::exception");
    }
    return exits::kDone;
  };
  const int nothing = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) ::dup2(nothing, stream);
  return contained_work(shared, noted, writable);
}

// The end of the process that did `work`, as waitpid() gives it.
int rehearsed(const SharedPage& shared, const std::string& what, const std::function<void()>& work,
              const std::vector<std::string>& writable) {
  flush_output();
  return wait_for(start_child([&] { return silent_work(shared, what, work, writable); }));
}

// ---- several pieces --------------------------------------------------------------------------------------------------

constexpr size_t kMostPieceBytes = size_t{64} << 20;

// One that runs. Its process ends with it.
struct RunningPiece {
  RunningPiece() = default;
  ~RunningPiece() {
    if (child <= 0) return;
    ::kill(child, SIGKILL);
    wait_for(child);
  }
  RunningPiece(const RunningPiece&) = delete;
  RunningPiece& operator=(const RunningPiece&) = delete;

  void stop(std::string reason) {
    if (!stopped.empty()) return;
    if (child > 0) ::kill(child, SIGKILL);  // -1, after its end, would be everybody
    stopped = std::move(reason);
  }

  size_t piece = 0;
  int tries = 1;
  SharedPage shared;
  pid_t child = -1;
  Descriptor results;
  std::unique_ptr<TimeLimit> limit;
  std::string text;     // the result so far
  std::string stopped;  // why this process ended it
  bool too_long = false;
};

std::unique_ptr<RunningPiece> start_piece(const Pieces& pieces, size_t piece, int tries, const WorkerLimits& limits) {
  auto started = std::make_unique<RunningPiece>();
  started->piece = piece;
  started->tries = tries;
  Pipe pipe = make_pipe();
  flush_output();
  started->child = start_child([&] {
    pipe.reading.close();
    limits.apply();
    return silent_work(
        started->shared, pieces.what(piece),
        [&] {
          if (!write_all(pipe.writing.get(), pieces.work(piece))) throw SystemError("the parent process takes no more");
        },
        pieces.writable);
  });
  started->results = std::move(pipe.reading);
  ::fcntl(started->results.get(), F_SETFL, O_NONBLOCK);  // NOLINT(*-vararg)
  started->limit = std::make_unique<TimeLimit>(pieces.limit_s, started->child);
  return started;
}

// Takes what has come of the result. False when no more will come.
bool take_results(RunningPiece& running) {
  constexpr size_t kMostAtOnce = size_t{4} << 20;
  const bool more = read_available(running.results.get(), running.text, kMostAtOnce);
  if (running.text.size() > kMostPieceBytes) running.stop("gave a result of more than 64 MiB");
  return more && running.text.size() <= kMostPieceBytes;
}

// `result` as waitpid() gives it. Nothing for a piece that is to be tried again.
std::optional<PieceEnd> piece_end(RunningPiece& running, const std::string& what, int result) {
  using Kind = PieceEnd::Kind;
  const Shared& shared = *running.shared;
  if (!running.stopped.empty()) {
    return PieceEnd{running.too_long ? Kind::kTooLong : Kind::kCrashed,
                    fmt::format("{} {}", activity(shared, what), running.stopped)};
  }
  if (!shared.done && ended_from_outside(result)) {
    if (running.tries < kMostTries) return std::nullopt;
    return PieceEnd{Kind::kCrashed, EndedFromOutside(activity(shared, what), WTERMSIG(result)).what()};
  }
  if (!shared.done) {
    const bool long_activity = WIFSIGNALED(result) && (WTERMSIG(result) == SIGXCPU || WTERMSIG(result) == SIGALRM);
    return PieceEnd{long_activity ? Kind::kTooLong : Kind::kCrashed, what_happened(shared, what, result)};
  }
  if (shared.thrown != Shared::Thrown::kNothing) return PieceEnd{Kind::kThrew, shared.text.data()};
  return PieceEnd{Kind::kDone, std::move(running.text)};
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

void run_pieces(const Pieces& pieces) {
  using Clock = TimeLimit::Clock;
  WorkerLimits limits = WorkerLimits::of_share(pieces.jobs);
  limits.memory_bytes = std::max<std::uint64_t>(limits.memory_bytes, ActivityLimits().memory_bytes);
  std::vector<std::unique_ptr<RunningPiece>> running;
  std::vector<std::pair<size_t, int>> again;  // a piece and its try
  size_t next = 0;
  while (true) {
    while (running.size() < static_cast<size_t>(std::max(1, pieces.jobs)) && (!again.empty() || next < pieces.count)) {
      std::pair<size_t, int> start = {next, 1};
      if (again.empty()) {
        ++next;
      } else {
        start = again.back();
        again.pop_back();
      }
      running.push_back(start_piece(pieces, start.first, start.second, limits));
    }
    if (running.empty()) return;
    std::vector<pollfd> polled;
    bool ending = false;
    Clock::time_point wake = Clock::now() + std::chrono::seconds(1);
    for (const auto& each : running) {
      polled.push_back({each->results.get(), POLLIN, 0});  // -1, of one that ends, is passed over
      ending = ending || !each->results.is_open();
      wake = std::min(wake, each->limit->end());
    }
    const auto wait = std::chrono::duration_cast<std::chrono::milliseconds>(wake - Clock::now()).count();
    const int wait_ms = ending ? 1 : static_cast<int>(std::clamp<long long>(wait, 0, 1000)) + 1;
    if (::poll(polled.data(), polled.size(), wait_ms) < 0 && errno != EINTR) {
      throw SystemError(fmt::format("cannot wait for processes: {}", std::strerror(errno)));
    }
    for (size_t i = running.size(); i-- > 0;) {
      RunningPiece& each = *running[i];
      if (each.results.is_open() && !take_results(each)) each.results.close();
      int result = 0;
      if (::waitpid(each.child, &result, WNOHANG) != each.child) {
        if (each.stopped.empty() && each.limit->over()) {
          each.too_long = true;
          each.stop(fmt::format("was stopped: it takes more than {:.3g} s", pieces.limit_s));
        }
        continue;
      }
      each.child = -1;
      // what it wrote last; processes that it left may hold the other end
      for (bool more = true; more && each.results.is_open();) {
        const size_t before = each.text.size();
        if (!take_results(each)) each.results.close();
        more = each.text.size() > before;
      }
      const std::string what = pieces.what(each.piece);
      const std::unique_ptr<RunningPiece> ended = std::move(running[i]);
      running.erase(running.begin() + static_cast<std::ptrdiff_t>(i));
      if (const auto end = piece_end(*ended, what, result)) {
        pieces.on_end(ended->piece, *end);
      } else {
        again.emplace_back(ended->piece, ended->tries + 1);
      }
    }
  }
}

}  // namespace assay
