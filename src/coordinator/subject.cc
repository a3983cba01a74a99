#include "coordinator/subject.h"

#include <nlohmann/json.hpp>

namespace assay {

nlohmann::json subject_json(const CampaignSystem& system, const CampaignContender& contender) {
  return {{"model_path", system.model_path},
          {"model_hash", system.model.hash},
          {"contacts", system.contacts},
          {"gravity", system.gravity},
          {"control",
           {{"kind", system.control.kind},
            {"amplitude", system.control.amplitude},
            {"frequency", system.control.frequency},
            {"phase_step", system.control.phase_step}}},
          {"contender",
           {{"name", contender.resolved.name}, {"base", contender.resolved.base}, {"overrides", contender.overrides}}},
          {"duration_s", system.duration_s},
          {"sample_ms", system.sample_ms}};
}

}  // namespace assay
