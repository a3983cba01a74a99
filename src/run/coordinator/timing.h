// The timing pass: contenders interleaved in rounds, alone on the machine.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "campaign/campaign.h"
#include "campaign/plan.h"
#include "results/store/store.h"
#include "run/coordinator/run.h"
#include "run/coordinator/sessions.h"

namespace assay {

// One contender that takes part on a system, and the session that measures it.
struct TimedContender {
  std::string name;
  TimingJob session;
  std::string run = {};  // PlannedCell::timed_run
};

// Measures all of `contenders` on one system at one timestep (`keys`: cells' keys by contender's name). `put` is called
// with all cells after the last round. The contender `harness`, if it is among them, times the same windows and has no
// say in how long they are. `share`: of the run, where others have been timed; else as the campaign's time for a turn
// allows. Returns at an interrupt.
class TimingPass {
 public:
  TimingPass(const Campaign& campaign, std::string program, const Interrupts& interrupts)
      : campaign_(campaign),
        interrupts_(interrupts),
        sessions_(std::move(program), campaign.time_limit_s, WorkerLimits::of_share(1), interrupts) {}

  using Put = std::function<void(const std::vector<MeasuredCell>&)>;
  using Started = std::function<void(const std::string& what, double done)>;  // done: share of the rounds
  void measure(const CampaignSystem& system, const std::vector<TimedContender>& contenders, double timestep_ms,
               const std::map<std::string, std::string>& keys, const std::string& harness, std::optional<double> share,
               const Started& started, const Put& put);

  // Ends the sessions that measure() left open for the next timestep of the same system.
  void close() { sessions_.close(); }

  const TimingFacts& facts() const { return sessions_.facts(); }

 private:
  struct Tally;

  void plan_turns(const CampaignSystem& system, const std::vector<TimedContender>& contenders,
                  const std::string& harness, std::optional<double> share, std::vector<Tally>& tallies) const;
  std::vector<size_t> take_turns(const std::vector<TimedContender>& contenders, const std::vector<size_t>& order,
                                 int process, bool again, std::vector<Tally>& tallies);

  const Campaign& campaign_;
  const Interrupts& interrupts_;
  Sessions sessions_;
};

}  // namespace assay
