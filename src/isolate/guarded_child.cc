#include "isolate/guarded_child.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <fcntl.h>
#include <limits>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <poll.h>

#include "base/console.h"
#include "base/errors.h"
#include "base/exit_status.h"
#include "base/text.h"
#include "isolate/child.h"
#include "isolate/guard.h"
#include "isolate/interruption.h"
#include "isolate/limits.h"
#include "isolate/processes.h"
#include "isolate/time_limit.h"

namespace assay {
namespace {

constexpr size_t kMostLineBytes = size_t{64} << 20;

// The whole of a worker below its guard.
int guarded_work(const std::function<int(const Send&)>& work, int to) {
  int status = exits::kFailed;
  try {
    status = guarded([&] {
      return work([to](const std::string& line) {
        if (!write_all(to, line + "\n")) throw SystemError("the parent process takes no more");
      });
    });
  } catch (...) {  // NOLINT(bugprone-empty-catch): nothing of this process may run the parent's clean-up
  }
  std::fflush(stderr);
  return status;
}

// Takes lines from a descriptor that does not block. False when no more will come, or more than anybody sends.
bool take_lines(int from, std::string& pending, const Send& on_line) {
  constexpr size_t kMostAtOnce = size_t{4} << 20;  // a child that sends without end must not hold its parent
  const bool more = read_available(from, pending, kMostAtOnce);
  for (size_t end = pending.find('\n'); end != std::string::npos; end = pending.find('\n')) {
    const std::string line = pending.substr(0, end);
    pending.erase(0, end + 1);
    if (on_line) on_line(line);
  }
  return more && pending.size() <= kMostLineBytes;
}

// The status that the guard has written, as waitpid() gives it. Of a guard that was ended itself its own: then this
// process does the rest, with all children but those that it had before.
int end_of_guarded(pid_t guard, int told, const std::vector<pid_t>& before) {
  int status = 0;
  const bool has_told = read_all(told, &status, sizeof status);
  const int of_guard = wait_for(guard);
  if (has_told) return status;
  end_children([&](pid_t child) { return std::ranges::find(before, child) == before.end(); });
  return of_guard;
}

}  // namespace

ChildEnd run_in_child(const std::function<int(const Send&)>& work, const Send& on_line, double limit_s) {
  flush_output();
  Pipe lines = make_pipe(), told = make_pipe();
  watch_for_interruption();
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  const WorkerLimits limits = WorkerLimits::of_share(1);
  const std::vector<pid_t> before = children_of(getpid());
  const pid_t guard = start_child([&]() -> int {
    setpgid(0, 0);  // what is sent to the group reaches the parent alone: SIGTERM has the guard end the work at once
    lines.reading.close();
    told.reading.close();
    run_guarded(
        [&] {
          watch_for_interruption(/*once=*/false);
          be_expendable();
          limits.apply();
          return guarded_work(work, lines.writing.get());
        },
        told.writing.get(), {lines.writing.get()});
  });
  lines.writing.close();
  told.writing.close();
  fcntl(lines.reading.get(), F_SETFL, O_NONBLOCK);  // NOLINT(*-vararg)

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
    std::array<pollfd, 2> polled = {pollfd{lines.reading.get(), POLLIN, 0}, pollfd{told.reading.get(), POLLIN, 0}};
    if (poll(polled.data(), polled.size(), kWaitMs) < 0 && errno != EINTR)
      throw SystemError("cannot wait for a process");
    if (interrupted() && !std::exchange(passed_on, true)) kill(guard, SIGINT);
    if (polled[0].revents != 0) {
      if (!take_lines(lines.reading.get(), pending, on_line)) {
        if (pending.size() > kMostLineBytes)
          stop(fmt::format("it sent a line of more than {} MiB", kMostLineBytes >> 20));
        lines.reading.close();
      }
      if (limit_s > 0) limit = TimeLimit(limit_s, guard);
    }
    if (polled[1].revents != 0) break;
    if (end.stopped.empty() && limit.over()) stop(fmt::format("not done after {}", duration_label(limit_s)));
  }
  if (lines.reading.is_open()) take_lines(lines.reading.get(), pending, on_line);
  const int result = end_of_guarded(guard, told.reading.get(), before);
  if (!WIFSIGNALED(result)) {
    end.status = WEXITSTATUS(result);
    return end;
  }
  if (WTERMSIG(result) == SIGPIPE) raise(SIGPIPE);
  end.status = exits::kFailed;
  end.signal = WTERMSIG(result);
  return end;
}

std::string ChildEnd::signal_text() const { return assay::signal_text(signal); }

bool ChildEnd::from_outside() const { return stopped.empty() && is_from_outside(signal); }

}  // namespace assay
