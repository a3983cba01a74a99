#include "worker/jobs.h"

#include <fmt/format.h>

#include "base/errors.h"
#include "worker/job_parts.h"

namespace assay {

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
