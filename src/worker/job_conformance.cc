// The conformance suite on one contender.
#include "conformance/conformance.h"
#include "worker/job_parts.h"

namespace assay::jobs {

JobDone do_job(const ConformanceJob& job, const Report& report) {
  ConformanceOptions options;
  options.tests = job.tests;
  options.on_result = [&](const ConformanceResult& result) {
    report(TestResult{result.test, std::string(status_text(result.status)), result.figure, result.tolerance,
                      result.unit, result.note});
  };
  run_conformance(contender_of(job.contender), options);
  return job_done({}, 0);
}

}  // namespace assay::jobs
