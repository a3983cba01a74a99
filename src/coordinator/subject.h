// What a job simulates, as its worker is told.
#pragma once

#include <nlohmann/json.hpp>

#include "campaign/campaign.h"

namespace assay {

// The part of a job that says what is simulated. `Subject` is its counterpart in the worker.
nlohmann::json subject_json(const CampaignSystem& system, const CampaignContender& contender);

}  // namespace assay
