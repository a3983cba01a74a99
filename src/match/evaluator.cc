#include "match/evaluator.h"

#include <algorithm>
#include <deque>
#include <optional>

#include <fmt/format.h>
#include <poll.h>

#include "base/errors.h"
#include "base/paths.h"
#include "base/text.h"
#include "run/coordinator/process.h"

namespace assay::match {

struct Evaluator::Worker {
  std::unique_ptr<WorkerProcess> process;
  std::optional<Task> task;
  TimeLimit limit = TimeLimit(0);
};

Evaluator::Evaluator(MatchJob job, int workers, double limit_s, const Interrupts& interrupts)
    : job_(std::move(job)), limit_s_(limit_s), interrupts_(interrupts) {
  for (int i = 0; i < std::max(1, workers); ++i) workers_.push_back(std::make_unique<Worker>());
}

Evaluator::~Evaluator() = default;

bool Evaluator::start(Worker& worker) const {
  worker.process =
      std::make_unique<WorkerProcess>(program_path(), WorkerLimits::of_share(static_cast<int>(workers_.size())));
  worker.process->send(job_);
  const auto reply = worker.process->wait_reply(limit_s_, interrupts_.descriptor());
  if (reply) throw_worker_error(*reply);
  return reply && std::holds_alternative<SessionReady>(*reply);
}

std::vector<std::vector<MatchRun>> Evaluator::simulate(const std::vector<Candidate>& candidates,
                                                       const std::vector<size_t>& windows,
                                                       const std::vector<std::vector<double>>& offsets) {
  std::vector<std::vector<MatchRun>> found(candidates.size(), std::vector<MatchRun>(windows.size()));
  // few candidates are cut, so that all workers have some; what a window gives does not depend on it
  const size_t parts = candidates.size() >= 2 * workers_.size() ? 1 : std::min(workers_.size(), windows.size());
  std::vector<Task> tasks;
  for (size_t c = 0; c < candidates.size(); ++c) {
    for (size_t part = 0; part < parts; ++part) {
      Task task{c, {}};
      for (size_t i = part; i < windows.size(); i += parts) task.positions.push_back(i);
      if (!task.positions.empty()) tasks.push_back(std::move(task));
    }
  }
  work(std::move(tasks), candidates, windows, offsets, found);
  runs_ += static_cast<long long>(candidates.size());
  return found;
}

void Evaluator::work(std::vector<Task> tasks, const std::vector<Candidate>& candidates,
                     const std::vector<size_t>& windows, const std::vector<std::vector<double>>& offsets,
                     std::vector<std::vector<MatchRun>>& found) {
  std::deque<Task> waiting(tasks.begin(), tasks.end());
  // A task whose worker did not survive is done window by window; a single window's failure is the outcome.
  const auto lose = [&](Worker& worker, const Ending& ending) {
    const Task task = std::move(*worker.task);
    worker.task.reset();
    worker.process.reset();
    if (task.positions.size() == 1) {
      found[task.candidate][task.positions.front()].ending = ending;
      return;
    }
    for (const size_t position : task.positions) waiting.push_back({task.candidate, {position}});
  };
  const auto take = [&](Worker& worker) {
    WorkerProcess& process = *worker.process;
    process.read_available();
    if (const auto reply = process.take_reply()) {
      throw_worker_error(*reply);
      const auto* simulated = std::get_if<MatchSimulated>(&*reply);
      if (simulated == nullptr || simulated->runs.size() != worker.task->positions.size()) {
        const auto* crash = std::get_if<JobCrash>(&*reply);
        lose(worker, {Outcome::kCrashed, crash != nullptr ? crash->reason : "the worker gave another answer"});
        return;
      }
      for (size_t i = 0; i < simulated->runs.size(); ++i) {
        found[worker.task->candidate][worker.task->positions[i]] = simulated->runs[i];
      }
      engine_s_ += simulated->engine_s;
      worker.task.reset();
    } else if (process.gone()) {
      lose(worker, {Outcome::kCrashed, process.end()});
    } else if (worker.limit.over()) {
      process.end();
      lose(worker, {Outcome::kTimeout, fmt::format("not done after {}", duration_label(limit_s_))});
    }
  };
  const auto busy = [](const std::unique_ptr<Worker>& worker) { return worker->task.has_value(); };
  while (!waiting.empty() || std::ranges::any_of(workers_, busy)) {
    if (interrupts_.signal() != 0) throw SystemError("interrupted: start the same command again to go on");
    for (const auto& worker : workers_) {
      if (worker->task || waiting.empty()) continue;
      worker->task = std::move(waiting.front());
      waiting.pop_front();
      if (!worker->process && !start(*worker)) {
        const std::string how = worker->process->end();
        lose(*worker, {Outcome::kCrashed, how});
        continue;
      }
      MatchCommand command;
      const Candidate& candidate = candidates[worker->task->candidate];
      command.changes = change_texts(candidate.changes);
      command.settings = candidate.settings;
      for (const size_t position : worker->task->positions) {
        command.windows.push_back(static_cast<int>(windows[position]));
        if (!offsets.empty()) command.offsets.push_back(offsets[position]);
      }
      worker->process->send(command);
      worker->limit = worker->process->limit(limit_s_);
    }
    std::vector<pollfd> polled = {{interrupts_.descriptor(), POLLIN, 0}};
    for (const auto& worker : workers_) {
      if (!worker->task) continue;
      polled.push_back({worker->process->socket(), POLLIN, 0});
      polled.push_back({worker->process->output(), POLLIN, 0});
      polled.push_back({worker->process->status(), POLLIN, 0});
    }
    constexpr int kWaitMs = 1000;
    if (polled.size() > 1) ::poll(polled.data(), polled.size(), kWaitMs);
    for (const auto& worker : workers_) {
      if (worker->task) take(*worker);
    }
  }
}

}  // namespace assay::match
