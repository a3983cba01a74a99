#include "cli/child.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <limits>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <poll.h>

#include "base/errors.h"
#include "base/text.h"
#include "cli/cli.h"
#include "isolate/guard.h"
#include "isolate/processes.h"
#include "isolate/time_limit.h"
#include "run/coordinator/process.h"

namespace assay::cli {
namespace {

SystemError failure(const char* what) {
  const std::string text = fmt::format("{} failed: {}", what, std::strerror(errno));
  return SystemError{text};
}

void write_all(int fd, const std::string& text) {
  for (size_t done = 0; done < text.size();) {
    const ssize_t count = write(fd, text.data() + done, text.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) throw failure("writing to the parent process");
    done += static_cast<size_t>(count);
  }
}

[[noreturn]] void be_child(const std::function<int(const Send&)>& work, int fd) {
  int status = kFailed;
  try {
    status = guarded([&] { return work([fd](const std::string& line) { write_all(fd, line + "\n"); }); });
  } catch (...) {  // NOLINT(bugprone-empty-catch): nothing of this process may run the parent's clean-up
  }
  std::fflush(stderr);
  _exit(status);
}

struct Pipe {
  Pipe() {
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw failure("making a pipe");
  }
  ~Pipe() {
    for (int& end : ends) close_end(end);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  int& reading() { return ends[0]; }
  int& writing() { return ends[1]; }
  static void close_end(int& end) {
    if (end >= 0) close(end);
    end = -1;
  }

  std::array<int, 2> ends = {-1, -1};
};

constexpr size_t kMostBytes = WorkerProcess::kMostReplyBytes;  // of a line

// Takes lines from a descriptor that does not block. False when no more will come, or more than anybody sends.
bool take_lines(int fd, std::string& pending, const Send& on_line) {
  constexpr int kMostReads = 64;  // a child that sends without end must not hold its parent
  std::array<char, 65536> buffer{};
  for (int reads = 0; reads < kMostReads; ++reads) {
    const ssize_t count = read(fd, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return errno == EAGAIN;
    if (count == 0) return false;
    pending.append(buffer.data(), static_cast<size_t>(count));
    for (size_t end = pending.find('\n'); end != std::string::npos; end = pending.find('\n')) {
      const std::string line = pending.substr(0, end);
      pending.erase(0, end + 1);
      if (on_line) on_line(line);
    }
    if (pending.size() > kMostBytes) return false;
  }
  return true;
}

// The status that the guard has written, as waitpid() gives it. Of a guard that was ended itself its own: then this
// process does the rest, with all children but those that it had before.
int end_of_guarded(pid_t guard, int told, const std::vector<pid_t>& before) {
  int status = 0, of_guard = 0;
  ssize_t got = 0;
  do {
    got = read(told, &status, sizeof status);
  } while (got < 0 && errno == EINTR);
  while (waitpid(guard, &of_guard, 0) < 0) {
    if (errno != EINTR) throw failure("waiting for a process");
  }
  if (got == sizeof status) return status;
  end_children([&](pid_t child) { return std::ranges::find(before, child) == before.end(); });
  return of_guard;
}

}  // namespace

ChildEnd run_in_child(const std::function<int(const Send&)>& work, const Send& on_line, double limit_s) {
  flush_output();
  Pipe lines, told;
  watch_for_interruption();
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  const WorkerLimits limits = WorkerLimits::of_share(1);
  const std::vector<pid_t> before = children_of(getpid());
  const pid_t parent = getpid();
  const pid_t guard = fork();
  if (guard < 0) throw failure("starting a process");
  if (guard == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(kFailed);
    setpgid(0, 0);  // what is sent to the group reaches the parent alone: SIGTERM has the guard end the work at once
    Pipe::close_end(lines.reading());
    Pipe::close_end(told.reading());
    run_guarded(
        [&]() -> int {
          watch_for_interruption(/*once=*/false);
          be_expendable();
          limits.apply();
          be_child(work, lines.writing());
        },
        told.writing(), {lines.writing()});
  }
  Pipe::close_end(lines.writing());
  Pipe::close_end(told.writing());
  fcntl(lines.reading(), F_SETFL, O_NONBLOCK);

  ChildEnd end;
  bool passed_on = false;
  const auto stop = [&](std::string why) {
    if (end.stopped.empty()) kill(guard, SIGTERM);
    end.stopped = std::move(why);
  };
  std::string pending;
  TimeLimit limit(limit_s > 0 ? limit_s : std::numeric_limits<double>::max(), guard);
  while (true) {
    // a signal that comes before the wait is seen after it
    constexpr int kWaitMs = 100;
    std::array<pollfd, 2> polled = {pollfd{lines.reading(), POLLIN, 0}, pollfd{told.reading(), POLLIN, 0}};
    if (poll(polled.data(), polled.size(), kWaitMs) < 0 && errno != EINTR) throw failure("waiting for a process");
    if (interrupted() && !std::exchange(passed_on, true)) kill(guard, SIGINT);
    if (polled[0].revents != 0) {
      if (!take_lines(lines.reading(), pending, on_line)) {
        if (pending.size() > kMostBytes) stop(fmt::format("it sent a line of more than {} MiB", kMostBytes >> 20));
        Pipe::close_end(lines.reading());
      }
      if (limit_s > 0) limit = TimeLimit(limit_s, guard);
    }
    if (polled[1].revents != 0) break;
    if (end.stopped.empty() && limit.over()) stop(fmt::format("not done after {}", duration_label(limit_s)));
  }
  if (lines.reading() >= 0) take_lines(lines.reading(), pending, on_line);
  const int result = end_of_guarded(guard, told.reading(), before);
  if (!WIFSIGNALED(result)) {
    end.status = WEXITSTATUS(result);
    return end;
  }
  if (WTERMSIG(result) == SIGPIPE) raise(SIGPIPE);
  end.status = kFailed;
  end.signal = WTERMSIG(result);
  return end;
}

std::string ChildEnd::signal_text() const { return fmt::format("SIG{} ({})", sigabbrev_np(signal), strsignal(signal)); }

bool ChildEnd::from_outside() const { return stopped.empty() && is_from_outside(signal); }

}  // namespace assay::cli
