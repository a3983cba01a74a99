// Several runs in one worker. It loads the engines once and gives each run a process of its own, forked from it.
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <new>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "base/errors.h"
#include "engines/registry.h"
#include "worker/job_parts.h"

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

[[noreturn]] void be_run(const RunJob& run, unsigned limit_s, int fd, pid_t worker) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != worker) ::_exit(1);
  ::alarm(limit_s);
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

// What the process of a run wrote, and how it ended.
std::pair<std::string, int> apart(const RunJob& run, unsigned limit_s) {
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0) throw SystemError(fmt::format("cannot make a pipe: {}", std::strerror(errno)));
  const pid_t worker = ::getpid(), child = ::fork();
  if (child < 0) throw SystemError(fmt::format("cannot start a process: {}", std::strerror(errno)));
  if (child == 0) {
    ::close(ends[0]);
    be_run(run, limit_s, ends[1], worker);
  }
  ::close(ends[1]);
  std::string text;
  std::array<char, 1 << 14> buffer{};
  while (true) {
    const ssize_t got = ::read(ends[0], buffer.data(), buffer.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    text.append(buffer.data(), static_cast<size_t>(got));
  }
  ::close(ends[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return {text, status};
}

CellResult cell_of(const RunJob& run, unsigned limit_s) {
  const auto [text, status] = apart(run, limit_s);
  CellResult cell = {run.measures.front(), {Outcome::kCrashed, ""}, {}, {}};
  if (!text.empty() && text.back() == '\n') {
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
  } else if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) {
    cell.ending = {Outcome::kTimeout, fmt::format("not done after {} s", limit_s)};
  } else if (WIFSIGNALED(status)) {
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
    done.cells.push_back(cell_of(run, static_cast<unsigned>(job.limit_s)));
    report(TestResult{.test = run.save, .status = "run", .figure = {}, .tolerance = {}, .unit = "", .note = ""});
  }
  done.cpu_s = cpu_seconds();
  return done;
}

}  // namespace assay::jobs
