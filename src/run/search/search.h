// Finds the fastest contender and timestep within limits without measuring a whole campaign. It begins with a few
// contenders, by expected speed and by how much of the robot they approximate, one of an engine, and measures the
// fastest of them to its end, so that there is an answer. Then time goes in equal parts to first looks at the others at
// one timestep, each time twice as many, and for each goal to the points that may be faster than the best one so far,
// the fastest first, their cheap cells before the dear ones. Contenders whose engine takes long to start have their
// turn last. When nothing is left that could win among the usual timesteps, the search goes on beyond them, as far as
// the campaign has more: to a larger one where an answer is at the largest, to a smaller one where nothing is within
// the limits and an error at the smallest is why. What was found is stored as it comes, so a search that ends early has
// an answer, and the same call goes on where it stopped.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "results/recommend.h"
#include "run/coordinator/run.h"

namespace assay {

struct SearchOptions {
  RunOptions run;  // where to and with what; its parts of a campaign are the search's own
  double budget_s = 600;
  std::vector<Limits> goals;  // each is searched for
  // One sentence now and then: what was done, what is ahead.
  std::function<void(const std::string&)> tell;
};

struct SearchSummary {
  double wall_s = 0, cpu_s = 0;                     // of this call
  size_t contenders = 0;                            // that take part
  size_t cells = 0, measured = 0;                   // of the whole campaign; stored
  std::vector<std::string> undecided;               // contenders that could still win when the budget ended
  std::vector<Missing> failed_gate, without_truth;  // as in RunSummary
  bool ended_early = false;                         // nothing was left that could win
  bool interrupted = false;                         // by the user
  int signal = 0;
};

// Throws as run_campaign().
SearchSummary search(const Campaign& campaign, const SearchOptions& options);

}  // namespace assay
