#include "run/coordinator/subject.h"

namespace assay {

ModelSpec model_spec(const CampaignSystem& system) {
  return {system.model_path, system.model.hash, system.load, system.variant};
}

ContenderSpec contender_spec(const CampaignContender& contender) {
  return {contender.resolved.name, contender.resolved.base, contender.overrides};
}

SubjectSpec subject_spec(const CampaignSystem& system, const CampaignContender& contender) {
  return {model_spec(system),    system.control, contender_spec(contender), system.duration_s, system.sample_ms,
          system.initial_states, system.pushes,  system.push_sample_ms};
}

}  // namespace assay
