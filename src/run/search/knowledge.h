// What the cells of a campaign that were measured so far say about each point: a contender at a timestep.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "campaign/plan.h"
#include "results/recommend.h"
#include "results/store/store.h"

namespace assay {

// Cells of one point, by what they cost. A later group is of use only when the earlier ones ended well.
enum class CellGroup { kRuns, kPieces, kTimes };

enum class Verdict {
  kOpen,      // a cell is missing, and nothing measured so far excludes the point
  kFeasible,  // all cells ended well, and every limited value is within its limit
  kOut,       // a cell at this or a smaller timestep failed or exceeds a limit
};

// A contender at a timestep, as indices into the campaign and Knowledge::timesteps_ms().
struct PointAt {
  int contender = 0;
  size_t step = 0;
};

class Knowledge {
 public:
  // All cells of `plan` belong to points, except fine-step runs and what is measured only at timesteps at which no
  // speed is. Both have to outlive this.
  Knowledge(const Campaign& campaign, const Plan& plan);

  // Reads what is stored now.
  void update(const Store& store);

  // Systems whose reference solution there is not: their cells of 'truth' are not waited for.
  void leave_truth_out(const std::string& system) { without_truth_.push_back(system); }

  const std::vector<double>& timesteps_ms() const { return timesteps_ms_; }  // ascending

  // Of a group of the point's cells those that are not stored yet, with the fine-step runs that they need.
  std::vector<const PlannedCell*> missing(const PointAt& point, CellGroup group) const;

  Verdict verdict(const PointAt& point, const Limits& limits) const;

  // Realtime factor of the point: as timed, or from the engine's time in its runs. Empty before it has run.
  std::optional<double> speed(const PointAt& point) const;
  bool timed(const PointAt& point) const;

  // The error against the reference solution at the point, as measured or followed from smaller timesteps: by how it
  // grew between the last two, by first order from one alone, and by no more than the declared order. 0 where nothing
  // is known.
  double expected_error(const PointAt& point) const;

  // How many times an error of the motion is its limit at the point, where nothing else that was measured up to there
  // excludes it: no failure, and no limit of contacts. Absent where something does, or where nothing was measured. 0
  // for errors within their limits.
  std::optional<double> error_excess(const PointAt& point, const Limits& limits) const;

  // Processor time that the cells take, s, as far as the contender's speed is known.
  double cost_s(const std::vector<const PlannedCell*>& cells) const;

 private:
  struct Group {
    std::vector<const PlannedCell*> cells;
  };
  using Key = std::pair<int, size_t>;

  bool counts(const PlannedCell& cell) const;
  std::optional<double> step_s(int system, int contender) const;

  const Campaign& campaign_;
  std::vector<double> timesteps_ms_;
  std::map<Key, std::array<Group, 3>> points_;
  std::map<std::pair<int, int>, const PlannedCell*> references_;  // by system and contender
  std::map<std::string, Cell> stored_;                            // by key
  std::vector<std::string> without_truth_;
};

}  // namespace assay
