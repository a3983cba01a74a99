#include "runs/jobs.h"

#include <fmt/format.h>

#include "base/errors.h"
#include "runs/job_parts.h"

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

nlohmann::json do_job(const nlohmann::json& job, const std::function<void(const nlohmann::json&)>& report,
                      const std::function<nlohmann::json()>& next) {
  const std::string kind = job.at("kind");
  if (kind == "run") return jobs::do_run(job);
  if (kind == "pieces") return jobs::do_pieces(job);
  if (kind == "truth") return jobs::do_truth(job);
  if (kind == "agreement") return jobs::do_agreement(job);
  if (kind == "scaling") return jobs::do_scaling(job);
  if (kind == "gate") return jobs::do_gate(job, report);
  if (kind == "probe") return jobs::do_probe(job);
  if (kind == "timing") return jobs::do_timing(job, report, next);
  throw InputError(fmt::format("a worker has no job '{}'", kind));
}

}  // namespace assay
