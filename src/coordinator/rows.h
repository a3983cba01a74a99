// The store's rows for a campaign's contenders and systems.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "campaign/campaign.h"
#include "store/store.h"

namespace assay {

// {"model_hash", "dof", "bodies", "hinges", "shapes", "contact_pairs", "mass_kg", "gravity": [x, y, z]}
nlohmann::json model_facts(const Model& model);

ContenderRow contender_row(const CampaignContender& contender);
SystemRow system_row(const CampaignSystem& system);
SceneRow scene_row(const CampaignSystem& system);

}  // namespace assay
