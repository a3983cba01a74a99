// The store's rows for a campaign's contenders and systems.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "campaign/campaign.h"
#include "load/drawing.h"
#include "results/store/store.h"

namespace assay {

// {"model_hash", "dof", "bodies", "hinges", "shapes", "contact_pairs", "mass_kg", "gravity": [x, y, z]}
nlohmann::json model_facts(const Model& model);

ContenderRow contender_row(const CampaignContender& contender);
SystemRow system_row(const CampaignSystem& system);
// results/store/scene.h's text; shapes that are only drawn have "collides": false there. `drawing` is what the model's
// file draws beside its shapes: simplified it becomes "pictures" (results/store/pictures.h).
SceneRow scene_row(const CampaignSystem& system, const Drawing& drawing);

}  // namespace assay
