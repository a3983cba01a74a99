// Several runs in one worker. It loads the engines once and gives each run a process of its own, forked from it.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <sys/wait.h>

#include <fmt/format.h>
#include <poll.h>

#include "base/errors.h"
#include "base/text.h"
#include "engines/registry.h"
#include "isolate/child.h"
#include "isolate/processes.h"
#include "isolate/time_limit.h"
#include "run/worker/failures.h"
#include "run/worker/job_parts.h"

namespace assay::jobs {
namespace {

Reply answer_to(const RunJob& run) {
  try {
    return do_job(run);
  } catch (...) {
    return reply_to_exception();
  }
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
  Pipe pipe = make_pipe();
  // no destructors: an engine that crashes in them must not spoil the answer
  const pid_t child = start_child([&] {
    write_all(pipe.writing.get(), to_line(answer_to(run)));
    return 0;
  });
  pipe.writing.close();
  Apart ended;
  TimeLimit limit(limit_s, child);
  do {
    ended.timed_out = !readable(pipe.reading.get(), limit);
    if (ended.timed_out) ::kill(child, SIGKILL);
  } while (!ended.timed_out && read_available(pipe.reading.get(), ended.text, 1));
  ended.status = wait_for(child);
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
    cell.ending.reason = signal_text(WTERMSIG(status));
  } else {
    cell.ending.reason = end_text(status);
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
