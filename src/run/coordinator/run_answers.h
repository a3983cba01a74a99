// Cells of a campaign's run: stored, counted and told as they end.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "run/coordinator/run_time_left.h"

namespace assay {

class Answers {
 public:
  Answers(RunShared& run, TimeLeft& time_left) : run_(run), time_left_(time_left) {}

  // An answer has a result for each measure. Cells that are one under two contenders' names get the same result.
  void put(const std::vector<const PlannedCell*>& cells, const JobEnd& end);
  // Of cells that are timed together, by key; others among them are not the campaign's, and only stored.
  void put_timed(const std::vector<MeasuredCell>& cells, const std::map<std::string, const PlannedCell*>& planned);
  void put_failed(const PlannedCell& planned, const Ending& failure);
  // Of a contender that failed the conformance suite: the time left has none of it.
  void put_unscored(const PlannedCell& planned, const Ending& failure);

  int stored() const { return stored_; }
  double engine_s() const { return engine_s_; }  // inside engine steps

 private:
  void note_stored(const Cell& cell);

  RunShared& run_;
  TimeLeft& time_left_;
  int stored_ = 0;
  double engine_s_ = 0;
};

}  // namespace assay
