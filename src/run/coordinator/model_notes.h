// What the models of a campaign are without, in words, for whoever runs it.
#pragma once

#include <string>
#include <vector>

#include "campaign/campaign.h"

namespace assay {

// A line for each note of each model, with its systems: "hold, random: sensors are left out". Systems of one robot
// share their lines. Of many notes the first ones and their number: the results keep all of them.
std::vector<std::string> model_notes(const Campaign& campaign);

}  // namespace assay
