#include "run/coordinator/run.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <sys/resource.h>
#include <sys/time.h>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"
#include "campaign/shards.h"
#include "isolate/sandbox.h"
#include "results/store/references.h"
#include "run/coordinator/model_notes.h"
#include "run/coordinator/run_accuracy.h"
#include "run/coordinator/run_answers.h"
#include "run/coordinator/run_conformance.h"
#include "run/coordinator/run_describe.h"
#include "run/coordinator/run_probe.h"
#include "run/coordinator/run_timing.h"

namespace assay {
namespace {

double children_cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

// Sends SIGALRM after some seconds, if any are given.
class Timer {
 public:
  explicit Timer(double seconds) : on_(seconds > 0) {
    if (on_) set(std::max(seconds, 1e-3));
  }
  ~Timer() {
    if (on_) set(0);
  }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

 private:
  static void set(double seconds) {
    itimerval value{};
    value.it_value.tv_sec = static_cast<time_t>(seconds);
    value.it_value.tv_usec = static_cast<suseconds_t>(1e6 * (seconds - std::floor(seconds)));
    ::setitimer(ITIMER_REAL, &value, nullptr);
  }

  bool on_;
};

void say_notes(const RunShared& run) {
  const auto say = [&](const std::string& note) { run.progress.message("note: " + note); };
  for (const std::string& note : run.campaign.notes) say(note);
  for (const std::string& note : model_notes(run.campaign)) say(note);
  if (const std::string lacking = offered_sandbox().lacking; !lacking.empty()) say(lacking);
}

void say_plan(const RunShared& run, const Work& work, const TimeLeft& time_left) {
  run.progress.plan(time_left.outline());
  if (!work.runs.empty()) {
    run.progress.message(fmt::format("{} to make for other parts; about {}", counted(work.runs.size(), "run"),
                                     duration_label(std::max(1.0, time_left.accuracy_s() / run.jobs))));
  }
  if (!run.makes_runs()) {
    run.progress.begin(static_cast<int>(work.todo.size()), static_cast<int>(work.done_before()),
                       time_left.estimate_s());
  }
}

}  // namespace

RunSummary run_campaign(const Campaign& campaign, const RunOptions& options) {
  RunShared run(campaign, options);
  const auto start = std::chrono::steady_clock::now();
  const double cpu_before = children_cpu_seconds();
  const Timer timer(options.budget_s);
  say_notes(run);
  Work work(run);
  RunDescription description(run, work);
  description.begin();
  RunDone done;
  Speeds speeds;
  if (!work.none() && !run.interrupted()) done.lack = score_contenders(run, work);
  if (!work.runs.empty()) speeds.step_us = expected_step_us(campaign);
  if (!work.todo.empty() && !run.interrupted() && options.probe) probe_speeds(run, work, speeds);
  if (!run.interrupted()) {
    TimeLeft time_left(run, work, std::move(speeds));
    say_plan(run, work, time_left);
    Answers answers(run, time_left);
    done.without_truth = measure_accuracy(run, work, time_left, answers, description);
    if (!run.interrupted()) done.timing = measure_times(run, work, time_left, answers);
    References(options.references).prune();
    done.cells = answers.stored();
    done.engine_s = answers.engine_s();
  }
  run.progress.end();
  done.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  done.cpu_s = children_cpu_seconds() - cpu_before;
  return description.finish(done);
}

}  // namespace assay
