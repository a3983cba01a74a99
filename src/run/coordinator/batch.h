// The pass of the measure 'batch': contenders interleaved in rounds, alone on the machine, as the timing pass.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "campaign/campaign.h"
#include "results/store/store.h"
#include "run/coordinator/sessions.h"
#include "run/coordinator/timing.h"

namespace assay {

struct BatchContender {
  std::string name, key;  // of its cell
  BatchJob session;
};

// Measures all of `contenders` on one system at one timestep in one number of worlds. Every turn takes the same steps
// of the same motion for all of them, as many as take the campaign's time of a turn in the mean over contenders.
// `put` is called with all cells after the last round; at an interrupt it is not called. `said` gets what an engine
// says of its device, by device.
void measure_batch(const Campaign& campaign, const CampaignSystem& system, const std::string& program,
                   const Interrupts& interrupts, const std::vector<BatchContender>& contenders,
                   std::map<std::string, std::string>& said, const TimingPass::Started& started,
                   const std::function<void(const std::vector<MeasuredCell>&)>& put);

}  // namespace assay
