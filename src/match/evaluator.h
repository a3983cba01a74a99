// Simulations of candidates in worker processes. A candidate at which a contender crashes, hangs or diverges is an
// outcome, not an end.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "match/parameters.h"
#include "match/windows.h"
#include "run/coordinator/pool.h"
#include "run/messages/messages.h"

namespace assay::match {

class Evaluator {
 public:
  // Workers start with the first candidate. `job` has the contender, the drives and the windows.
  Evaluator(MatchJob job, int workers, double limit_s, const Interrupts& interrupts);
  ~Evaluator();

  // Of each candidate the runs of these windows (indices into the job's), in their order; `offsets` as in MatchCommand.
  // Throws SystemError when it is interrupted, and what a worker reports of the machine or the input.
  std::vector<std::vector<MatchRun>> simulate(const std::vector<Candidate>& candidates,
                                              const std::vector<size_t>& windows,
                                              const std::vector<std::vector<double>>& offsets = {});

  long long runs() const { return runs_; }
  double engine_s() const { return engine_s_; }

 private:
  struct Worker;
  struct Task {
    size_t candidate = 0;
    std::vector<size_t> positions;  // in `windows`
  };
  void work(std::vector<Task> tasks, const std::vector<Candidate>& candidates, const std::vector<size_t>& windows,
            const std::vector<std::vector<double>>& offsets, std::vector<std::vector<MatchRun>>& found);
  bool start(Worker& worker) const;

  MatchJob job_;
  double limit_s_;
  const Interrupts& interrupts_;
  std::vector<std::unique_ptr<Worker>> workers_;
  long long runs_ = 0;
  double engine_s_ = 0;
};

}  // namespace assay::match
