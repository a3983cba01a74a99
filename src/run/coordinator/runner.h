// One run of a campaign: does and stores what of the plan is still to do. Internal to run_campaign().
#pragma once

#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/paths.h"
#include "base/text.h"
#include "engines/registry.h"
#include "results/store/references.h"
#include "results/store/store.h"
#include "run/coordinator/machine.h"
#include "run/coordinator/pool.h"
#include "run/coordinator/run.h"
#include "run/coordinator/subject.h"
#include "run/coordinator/timing.h"

namespace assay {

using Clock = std::chrono::steady_clock;

// Its parts: run.cc (what there is to do, and the whole), run_describe.cc (manifest and summary), run_conformance.cc
// (the conformance suite and the speed estimate), run_accuracy.cc, run_timing.cc (scaling and the timing pass).
class Runner {
 public:
  Runner(const Campaign& campaign, const RunOptions& options)
      : campaign_(campaign),
        options_(options),
        progress_(options.progress != nullptr ? *options.progress : silent_),
        program_(options.program.empty() ? program_path() : options.program),
        store_(Store::create(options.out, {campaign.name, campaign.hash()})),
        references_(options.references),
        jobs_(options.jobs > 0 ? options.jobs : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()))) {}

  RunSummary run();

 private:
  // An accuracy job that waits for trajectories.
  struct Waiting {
    Job job;
    std::set<std::string> needs;
    std::vector<const PlannedCell*> cells;
    std::vector<const PlannedCell*> part_of = {};  // cells whose cost includes it
    double run_s = 0;                              // its cost, of a run that no cell of this part reads
    bool is_made = true;                           // and not read from the results
  };

  const CampaignSystem& system(const PlannedCell& cell) const {
    return campaign_.systems[static_cast<size_t>(cell.system)];
  }
  const CampaignContender& contender(const PlannedCell& cell) const {
    return campaign_.contenders[static_cast<size_t>(cell.contender)];
  }
  std::string title(const PlannedCell& cell) const {
    return fmt::format("{} {} {} {} ms", cell.measure, system(cell).name, contender(cell).resolved.name,
                       timestep_label(cell.timestep_ms));
  }

  void describe();
  void describe_scenes();
  void describe_node(bool finished, double wall_s, double cpu_s);
  void choose();
  bool has_work() const { return !todo_.empty() || !runs_.empty(); }
  std::set<const CampaignContender*> contenders_ahead() const;
  void time_again_elsewhere(std::set<std::pair<int, double>>& timed_again, std::set<int>& scaled_again);
  std::vector<std::string> retried();
  void conformance();
  std::string suite_file(const std::string& content) const;  // "" where no verdicts are kept
  bool fetch_suite(const std::string& content);
  void keep_suite(const std::string& content) const;
  void run_suite(const std::string& content, const std::vector<std::string>& tests, Pool& pool, int lost = 0);
  void probe();
  void accuracy();
  void plan_references(std::map<std::string, Waiting>& producers);
  void plan_truths(std::map<std::string, Waiting>& producers);
  void made_for_others(double seconds, bool made);
  RunJob run_job(const PlannedCell& cell, double timestep_ms) const;  // without measures
  std::vector<Waiting> plan_measures();
  void plan_agreement(std::vector<Waiting>& jobs);
  static void leave_truth_out(std::vector<Waiting>& waiting, const std::string& address);
  bool has_run(const std::string& address);
  bool others_have(const std::string& address);
  void say_damaged_runs();
  void scaling();
  void timing();
  void batches();
  std::vector<std::string> outline(const std::vector<PlannedCell>& ahead) const;
  TimingJob session_job(const CampaignSystem& timed, const CampaignContender& contender,
                        const std::string& reference) const;
  void time_system(TimingPass& pass, int system_index);
  std::optional<double> stored_share(const std::string& system, double timestep_ms) const;
  static std::optional<double> share_in(const std::vector<Cell>& cells, const std::string& system, double timestep_ms);
  void finish(RunSummary& summary, double wall_s, double cpu_s);

  std::uint64_t seed() const { return static_cast<std::uint64_t>(campaign_.seed); }
  Cell cell_of(const PlannedCell& planned, const Ending& ending) const;
  void note_stored(const Cell& cell);
  void put_failed(const PlannedCell& planned, const Ending& failure);
  void put_answer(const std::vector<const PlannedCell*>& cells, const JobEnd& end);
  double cost(const PlannedCell& cell) const;
  PlannedCell ahead_of(const PlannedCell& cell) const;  // what is to do of it, as far as is expected
  double run_cost(const PlannedCell& cell) const;
  void count(const PlannedCell& cell);
  double remaining_s() const;
  void take_back_failed();
  bool interrupted() const { return interrupts_.signal() != 0; }

  const Campaign& campaign_;
  const RunOptions& options_;
  Progress silent_;
  Progress& progress_;
  std::string program_;
  Interrupts interrupts_;
  Store store_;
  References references_;
  int jobs_;
  Plan plan_;
  std::vector<const PlannedCell*> mine_, todo_;
  std::vector<const PlannedRun*> runs_;  // that this part makes for others (ShardCells::kRuns)
  int runs_made_ = 0, runs_failed_ = 0;
  std::map<std::string, Ending> failed_gate_;        // by contender: it failed the conformance suite
  std::map<std::string, Ending> failed_trajectory_;  // by address
  // Of runs, suites (by contender's content) whose workers somebody else ended: what needs them is not measured now.
  std::set<std::string> lost_trajectory_, lost_suite_;
  std::string lack_;                          // as in RunSummary
  std::set<std::string> crashed_suite_;       // with a test that ended its worker, by content
  std::set<std::string> suite_again_;         // contenders whose conformance suite is tried again
  std::map<std::string, bool> run_is_there_;  // by address, as it was found first
  std::vector<std::string> damaged_runs_;     // a text each
  std::vector<Missing> without_truth_;        // as in RunSummary
  std::map<std::pair<int, int>, double> step_us_;
  StartTimes starts_;
  std::map<std::string, std::vector<ConformanceRow>> suite_rows_;  // by contender's content
  int tests_ = 0, tests_done_ = 0;                                 // of the suites that run now
  TimingFacts timing_facts_;
  std::vector<Cell> windows_of_;                // of RunOptions::windows_of
  std::map<std::string, std::string> devices_;  // what engines say of them, by name
  NodeRow node_;                                // this machine and its part of the work
  std::set<std::string> timed_elsewhere_;       // keys of stored timings of another machine
  int done_now_ = 0;
  double engine_now_s_ = 0;  // inside engine steps, of the cells that were done now
  Clock::time_point start_ = Clock::now();
  // Estimated seconds of one worker, of a pass and of what is done of it.
  struct Share {
    double all_s = 0, done_s = 0;
    double under_way_s = 0;  // done of cells that are not finished
    Clock::time_point since;
  };
  Share accuracy_, timing_;
};

}  // namespace assay
