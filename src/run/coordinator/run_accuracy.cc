#include "run/coordinator/run_accuracy.h"

#include <algorithm>

#include <fmt/format.h>

#include "measures/measure.h"
#include "results/store/trajectory.h"
#include "run/coordinator/run_accuracy_jobs.h"
#include "run/coordinator/run_kept.h"

namespace assay {
namespace {

class AccuracyPass {
 public:
  AccuracyPass(RunShared& run, Work& work, TimeLeft& time_left, Answers& answers, RunDescription& description)
      : run_(run),
        work_(work),
        time_left_(time_left),
        answers_(answers),
        description_(description),
        kept_(run),
        pool_(run.program, run.jobs, run.interrupts) {}

  std::vector<Missing> run();

 private:
  void add_producer(const std::string& address, const AccuracyJob& producer);
  void produced(const std::string& address, const AccuracyJob& producer, const JobEnd& end);
  void add(AccuracyJob& ready);
  void made_pieces(const std::string& address, bool is_made, const JobEnd& end);
  void leave_pieces_out(const std::string& address);
  void release(const std::string& address, const std::optional<Ending>& failure);
  void release_settled(const std::map<std::string, AccuracyJob>& producers);
  void leave_truth_out(const std::string& address, const std::string& why);
  void ended_for_others(bool made, double run_s);

  RunShared& run_;
  Work& work_;
  TimeLeft& time_left_;
  Answers& answers_;
  RunDescription& description_;
  KeptRuns kept_;
  Pool pool_;
  std::vector<AccuracyJob> waiting_;
  std::vector<Missing> without_truth_;
};

// A run of this part's that other parts find in the shared folder, or will have to make themselves.
void AccuracyPass::ended_for_others(bool made, double run_s) {
  time_left_.finished_run(run_s);
  description_.run_ended(made);
}

void AccuracyPass::add(AccuracyJob& ready) {
  ready.job.on_end = [this, cells = ready.cells, makes = ready.makes, is_made = ready.is_made](const JobEnd& end) {
    answers_.put(cells, end);
    if (!makes.empty()) made_pieces(makes, is_made, end);
  };
  pool_.add(std::move(ready.job));
}

// Pieces that others of their contender are compared with, or do without.
void AccuracyPass::made_pieces(const std::string& address, bool is_made, const JobEnd& end) {
  if (end.outside) {  // what needs it is left for the next start
    std::erase_if(waiting_, [&](const AccuracyJob& one) { return one.needs.contains(address); });
    return;
  }
  if (has_trajectory(run_.store.trajectories_dir(), address)) {
    if (is_made) kept_.keep(address);
  } else {
    leave_pieces_out(address);
  }
  release(address, std::nullopt);
}

void AccuracyPass::leave_pieces_out(const std::string& address) {
  for (AccuracyJob& one : waiting_) {
    auto* pieces = std::get_if<PiecesJob>(&one.job.request);
    if (pieces != nullptr && pieces->cold == address) pieces->cold.clear();
  }
}

// What waits for a run goes on or fails with it.
void AccuracyPass::release(const std::string& address, const std::optional<Ending>& failure) {
  for (size_t i = 0; i < waiting_.size();) {
    AccuracyJob& one = waiting_[i];
    const bool needed = one.needs.erase(address) > 0;
    // An agreement does without others' runs, but not without its own.
    auto* agreement = std::get_if<AgreementJob>(&one.job.request);
    bool fails = failure && needed && (agreement == nullptr || agreement->own == address);
    if (needed && failure && !fails)
      std::erase_if(agreement->others, [&](const auto& other) { return other.address == address; });
    // A policy's run does without one to compare it with.
    if (auto* run = std::get_if<RunJob>(&one.job.request);
        fails && run != nullptr && std::ranges::count(run->against, address) > 0) {
      std::ranges::replace(run->against, address, std::string());
      fails = std::ranges::count(run->use, address) > 0;
    }
    if (!needed || (!fails && !one.needs.empty())) {
      ++i;
      continue;
    }
    if (fails) {
      for (const PlannedCell* cell : one.cells) answers_.put_failed(*cell, *failure);
    } else {
      add(one);
    }
    waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

// Runs whose reference solution there is not are measured without it.
void AccuracyPass::leave_truth_out(const std::string& address, const std::string& why) {
  const auto found =
      std::ranges::find_if(waiting_, [&](const AccuracyJob& one) { return one.needs.contains(address); });
  if (found != waiting_.end()) without_truth_.push_back({run_.system(*found->cells.front()).name, why});
  std::erase_if(waiting_, [&](AccuracyJob& one) {
    auto* run = std::get_if<RunJob>(&one.job.request);
    if (run == nullptr || run->truth != address) return false;
    run->truth.clear();
    std::erase_if(run->measures, [](const std::string& measure) { return reads(measure, Reads::kSolution); });
    std::erase_if(one.cells, [](const PlannedCell* cell) { return cell->reads == Reads::kSolution; });
    return one.cells.empty();
  });
}

// `producer` has to stay until the pool has run.
void AccuracyPass::add_producer(const std::string& address, const AccuracyJob& producer) {
  Job job = producer.job;
  job.on_end = [this, &address, &producer](const JobEnd& end) { produced(address, producer, end); };
  pool_.add(std::move(job));
}

void AccuracyPass::produced(const std::string& address, const AccuracyJob& producer, const JobEnd& end) {
  if (end.outside) {  // what needs it is left for the next start
    work_.lost_runs.insert(address);
    std::erase_if(waiting_, [&](const AccuracyJob& one) { return one.needs.contains(address); });
    return;
  }
  answers_.put(producer.cells, end);
  for (const PlannedCell* reference : producer.part_of) time_left_.finished(*reference);
  const std::string& title = producer.job.title;
  if (producer.cells.empty() && producer.run_s == 0) run_.progress.made(title, time_left_.seconds());
  // A reference solution is no cell: it has a result only when there is none.
  const bool is_run = std::holds_alternative<RunJob>(producer.job.request);
  const bool solved = !is_run && end.answer && end.answer->cells.empty();
  Ending failure = solved ? Ending() : end.result(is_run ? kFineRunCell : kTruthJobCell).ending;
  const bool made = failure.outcome == Outcome::kOk || failure.outcome == Outcome::kUnstable;
  if (producer.run_s > 0) {
    ended_for_others(made, producer.run_s);
    run_.progress.made(fmt::format("{}, {}/{} runs", title, description_.runs_ended(), work_.runs.size()),
                       time_left_.seconds());
  }
  if (made) {
    // what lay in the results may be a stranger's, who can give any states a right checksum
    if (producer.is_made) {
      kept_.keep(address);
      if (is_run) {
        for (const std::string& watched : std::get<RunJob>(producer.job.request).watched) kept_.keep(watched);
      }
    }
    release(address, std::nullopt);
  } else if (!is_run && run_.options.truth_optional) {
    leave_truth_out(address, failure.reason);
    release(address, std::nullopt);
  } else {
    failure.reason = fmt::format("its reference run: {}", failure.reason);
    work_.failed_runs[address] = failure;
    release(address, failure);
  }
}

// Of runs that are there, or that are known to fail.
void AccuracyPass::release_settled(const std::map<std::string, AccuracyJob>& producers) {
  std::set<std::string> settled, made;
  for (const AccuracyJob& one : waiting_) made.insert(one.makes);
  for (const AccuracyJob& one : waiting_) {
    for (const std::string& address : one.needs) {
      if (!producers.contains(address) && !made.contains(address)) settled.insert(address);
    }
  }
  for (const std::string& address : settled) {
    const auto failed = work_.failed_runs.find(address);
    release(address, failed == work_.failed_runs.end() ? std::nullopt : std::optional(failed->second));
  }
}

std::vector<Missing> AccuracyPass::run() {
  run_.progress.phase(work_.runs.empty() ? "accuracy" : "runs that other parts read");
  for (const PlannedCell* cell : work_.todo) {
    const auto failed = work_.unscored.find(run_.contender(*cell).resolved.name);
    if (failed != work_.unscored.end()) answers_.put_unscored(*cell, failed->second);
  }
  AccuracyJobs jobs =
      plan_accuracy(run_, work_, kept_, time_left_, [this](bool made, double run_s) { ended_for_others(made, run_s); });
  waiting_ = std::move(jobs.waiting);
  kept_.say_damaged();
  for (const auto& [address, producer] : jobs.producers) add_producer(address, producer);
  release_settled(jobs.producers);
  for (AccuracyJob& one : waiting_) {
    if (one.needs.empty()) add(one);
  }
  std::erase_if(waiting_, [](const AccuracyJob& one) { return one.needs.empty(); });
  pool_.run([&](const std::string& job) { run_.progress.started(job, time_left_.seconds()); });
  return std::move(without_truth_);
}

}  // namespace

std::vector<Missing> measure_accuracy(RunShared& run, Work& work, TimeLeft& time_left, Answers& answers,
                                      RunDescription& description) {
  return AccuracyPass(run, work, time_left, answers, description).run();
}

}  // namespace assay
