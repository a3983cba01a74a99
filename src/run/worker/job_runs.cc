// Several runs in one worker. It loads the engines once and gives each run a process of its own, forked from it.
#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <new>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <poll.h>

#include "base/errors.h"
#include "base/text.h"
#include "engines/registry.h"
#include "isolate/processes.h"
#include "isolate/time_limit.h"
#include "run/worker/job_parts.h"

namespace assay::jobs {
namespace {

Reply answer_to(const RunJob& run) {
  try {
    return do_job(run);
  } catch (const InputError& error) {
    return JobError{error.what(), true};
  } catch (const SystemError& error) {
    return JobError{error.what(), false};
  } catch (const std::bad_alloc&) {
    return JobCrash{"out of memory: it takes more than a worker may"};
  } catch (const std::exception& error) {
    return JobCrash{fmt::format("exception: {}", error.what())};
  } catch (...) {
    return JobCrash{"exception: of a type that is no std::exception"};
  }
}

[[noreturn]] void be_run(const RunJob& run, int fd, pid_t worker) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != worker) ::_exit(1);
  const std::string line = to_line(answer_to(run));
  for (size_t at = 0; at < line.size();) {
    const ssize_t written = ::write(fd, line.data() + at, line.size() - at);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) break;
    at += static_cast<size_t>(written);
  }
  // no destructors: an engine that crashes in them must not spoil the answer
  ::_exit(0);
}

// The process of a run.
struct Apart {
  std::string text;  // that it wrote
  int status = 0;    // of its end
  bool timed_out = false;
};

// False when the limit is over first.
bool readable(int fd, TimeLimit& limit) {
  while (!limit.over()) {
    const double left = std::chrono::duration<double>(limit.end() - TimeLimit::Clock::now()).count();
    pollfd polled = {fd, POLLIN, 0};
    if (::poll(&polled, 1, static_cast<int>(std::clamp(left * 1000 + 1, 0.0, 1e9))) > 0) return true;
  }
  return false;
}

Apart apart(const RunJob& run, double limit_s) {
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0) throw SystemError(fmt::format("cannot make a pipe: {}", std::strerror(errno)));
  const pid_t worker = ::getpid(), child = ::fork();
  if (child < 0) throw SystemError(fmt::format("cannot start a process: {}", std::strerror(errno)));
  if (child == 0) {
    ::close(ends[0]);
    be_run(run, ends[1], worker);
  }
  ::close(ends[1]);
  Apart ended;
  TimeLimit limit(limit_s, child);
  std::array<char, 1 << 14> buffer{};
  while (true) {
    if (!readable(ends[0], limit)) {
      ended.timed_out = true;
      ::kill(child, SIGKILL);
      break;
    }
    const ssize_t got = ::read(ends[0], buffer.data(), buffer.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    ended.text.append(buffer.data(), static_cast<size_t>(got));
  }
  ::close(ends[0]);
  while (::waitpid(child, &ended.status, 0) < 0 && errno == EINTR) {
  }
  return ended;
}

CellResult cell_of(const RunJob& run, double limit_s) {
  const auto [text, status, timed_out] = apart(run, limit_s);
  CellResult cell = {run.measures.front(), {Outcome::kCrashed, ""}, {}, {}};
  if (timed_out) {
    cell.ending = {Outcome::kTimeout, fmt::format("not done after {}", duration_label(limit_s))};
  } else if (!text.empty() && text.back() == '\n') {
    const Reply reply = parse_reply(text);
    if (const auto* error = std::get_if<JobError>(&reply)) {
      if (error->input) throw InputError(error->text);
      throw SystemError(error->text);
    }
    if (const auto* done = std::get_if<JobDone>(&reply); done != nullptr && !done->cells.empty()) {
      return done->cells.front();
    }
    const auto* crash = std::get_if<JobCrash>(&reply);
    cell.ending.reason = crash != nullptr ? crash->reason : "it gave another answer";
  } else if (WIFSIGNALED(status)) {
    share_end(status);
    const int signal = WTERMSIG(status);
    cell.ending.reason = fmt::format("SIG{} ({})", ::sigabbrev_np(signal), ::strsignal(signal));
  } else {
    cell.ending.reason = fmt::format("exit status {}", WEXITSTATUS(status));
  }
  return cell;
}

}  // namespace

JobDone do_job(const RunsJob& job, const Report& report) {
  static_cast<void>(Registry::instance());  // for all of the processes
  JobDone done;
  for (const RunJob& run : job.runs) {
    done.cells.push_back(cell_of(run, job.limit_s));
    report(TestResult{.test = run.save, .status = "run", .figure = {}, .tolerance = {}, .unit = "", .note = ""});
  }
  done.cpu_s = cpu_seconds();
  return done;
}

}  // namespace assay::jobs
