// What a campaign's jobs simulate, as workers are told.
#pragma once

#include "campaign/campaign.h"
#include "run/messages/messages.h"

namespace assay {

ModelSpec model_spec(const CampaignSystem& system);
ContenderSpec contender_spec(const CampaignContender& contender);
SubjectSpec subject_spec(const CampaignSystem& system, const CampaignContender& contender);

}  // namespace assay
