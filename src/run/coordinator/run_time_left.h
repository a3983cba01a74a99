// What a run of a campaign costs, and how much of its time is left.
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "run/coordinator/run_work.h"

namespace assay {

// How fast each contender is, by (system, contender), as far as it is known.
struct Speeds {
  std::map<std::pair<int, int>, double> step_us;
  StartTimes starts;
};

// All costs are seconds of one worker.
class TimeLeft {
 public:
  // Of what is to do, but for contenders that failed the conformance suite. The accuracy pass begins now.
  TimeLeft(const RunShared& run, const Work& work, Speeds speeds);

  // "capsules-27: reference 14, consistency 112, raw_speed 56 cells; about 3 min", a line for each system.
  std::vector<std::string> outline() const;
  double estimate_s() const;                             // of all cells, with all workers
  double accuracy_s() const { return accuracy_.all_s; }  // the accuracy pass's cost

  double cost(const PlannedCell& cell) const;
  double run_cost(const PlannedCell& cell) const;  // of one of the runs that the cell's cost is of
  double run_cost(const PlannedRun& planned) const;

  // What is left of both passes, each corrected by its own speed so far.
  double seconds() const;

  void begin_timing();                                          // at its first cell
  void finished(const PlannedCell& cell);                       // or another of the runs that its cost is of
  void finished_run(double cost) { accuracy_.done_s += cost; }  // that is no part of a cell
  void spare_run(const PlannedCell& cell);                      // one of its runs is there
  void under_way(double cost) { timing_.under_way_s = cost; }   // done of timings that are not finished

 private:
  using Clock = std::chrono::steady_clock;

  // Of a pass and of what is done of it.
  struct Share {
    double all_s = 0, done_s = 0;
    double under_way_s = 0;
    Clock::time_point since = {};
  };

  double left_s(const Share& share, double workers) const;

  const RunShared& run_;
  const Work& work_;
  Speeds speeds_;
  std::vector<PlannedCell> ahead_;
  Share accuracy_, timing_;
};

}  // namespace assay
