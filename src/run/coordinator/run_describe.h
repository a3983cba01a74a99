// What the store says about a campaign's run besides its cells: systems, contenders, scenes, this machine's part of the
// work, the manifest, and the summary at the end.
#pragma once

#include <string>
#include <vector>

#include "run/coordinator/run_timing.h"
#include "run/coordinator/run_work.h"

namespace assay {

// What a run has done, besides what is stored.
struct RunDone {
  int cells = 0;        // stored now
  double engine_s = 0;  // inside engine steps, of these
  double wall_s = 0, cpu_s = 0;
  TimingNotes timing;
  std::string lack;                    // as in RunSummary
  std::vector<Missing> without_truth;  // as in RunSummary
};

class RunDescription {
 public:
  RunDescription(RunShared& run, const Work& work) : run_(run), work_(work) {}

  void begin();               // before anything is measured; names this machine as the store's node
  void run_ended(bool made);  // of those that this part makes for others
  int runs_ended() const { return runs_made_ + runs_failed_; }
  RunSummary finish(const RunDone& done);  // also derives values that follow from several cells

 private:
  struct Spent {
    double timing_wall_s = 0, accuracy_cpu_s = 0;
  };

  void describe_scenes();
  void describe_runs();
  void describe_contenders();
  void describe_plan();
  void describe_node(const RunDone* done);  // null: not finished
  void describe_campaign();
  Spent sum_up_cells(RunSummary& summary) const;
  void describe_end(const RunDone& done, const RunSummary& summary, const Spent& spent);

  RunShared& run_;
  const Work& work_;
  NodeRow node_;  // this machine and its part of the work
  int runs_made_ = 0, runs_failed_ = 0;
};

}  // namespace assay
