// What the store keeps of a campaign's contenders and systems: rows that the report describes them from.
#pragma once

#include "runs/campaign.h"
#include "store/store.h"

namespace assay {

ContenderRow contender_row(const CampaignContender& contender);
SystemRow system_row(const CampaignSystem& system);
SceneRow scene_row(const CampaignSystem& system);

}  // namespace assay
