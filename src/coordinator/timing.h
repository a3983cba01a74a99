// The timing pass: contenders interleaved in rounds, alone on the machine.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "campaign/campaign.h"
#include "campaign/plan.h"
#include "coordinator/pool.h"
#include "coordinator/run.h"
#include "store/store.h"

namespace assay {

// One contender that takes part on a system, and the session that measures it.
struct TimedContender {
  std::string name;
  TimingJob session;
};

struct TimingFacts {
  int core = -1;
  double clock_s = 0;
};

// Measures all of `contenders` on one system at one timestep (`keys`: cells' keys by contender's name). `put` is called
// with all cells after the last round. The contender `harness`, if it is among them, times the same windows and has no
// say in how long they are. `share`: of the run, where others have been timed; else as the campaign's time for a turn
// allows. Returns at an interrupt.
class TimingPass {
 public:
  TimingPass(const Campaign& campaign, std::string program, const Interrupts& interrupts)
      : campaign_(campaign), program_(std::move(program)), interrupts_(interrupts) {}

  using Put = std::function<void(const std::vector<MeasuredCell>&)>;
  using Started = std::function<void(const std::string&)>;
  void measure(const CampaignSystem& system, const std::vector<TimedContender>& contenders, double timestep_ms,
               const std::map<std::string, std::string>& keys, const std::string& harness, std::optional<double> share,
               const Started& started, const Put& put);

  // Ends the sessions that measure() left open for the next timestep of the same system.
  void close() { sessions_.clear(); }

  const TimingFacts& facts() const { return facts_; }

 private:
  struct Session;
  struct Tally;

  Session* session(const TimedContender& contender, int process, Tally& tally);
  template <typename Answer>
  std::optional<Answer> command(const TimedContender& contender, int process, const Request& message, Tally& tally);
  void plan_turns(const CampaignSystem& system, const std::vector<TimedContender>& contenders,
                  const std::string& harness, std::optional<double> share, std::vector<Tally>& tallies) const;
  std::vector<size_t> take_turns(const std::vector<TimedContender>& contenders, const std::vector<size_t>& order,
                                 int process, bool again, std::vector<Tally>& tallies);

  const Campaign& campaign_;
  std::string program_;
  const Interrupts& interrupts_;
  std::map<std::pair<std::string, int>, std::shared_ptr<Session>> sessions_;  // by contender and process
  TimingFacts facts_;
};

}  // namespace assay
