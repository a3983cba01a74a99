// The conformance suite on one contender.
#include "conformance/conformance.h"
#include "isolate/activity.h"
#include "run/worker/job_parts.h"

namespace assay::jobs {
// Ends after the test that leaves too little memory for others; the answers tell which tests were run.
JobDone do_job(const ConformanceJob& job, const Report& report) {
  ConformanceOptions options;
  options.on_result = [&](const ConformanceResult& result) {
    report(TestResult{result.test, std::string(status_text(result.status)), result.figure, result.tolerance,
                      result.unit, result.note});
  };
  const ResolvedContender contender = contender_of(job.contender);
  for (const std::string& test : job.tests) {
    options.tests = {test};
    run_conformance(contender, options);
    if (is_half_full()) break;
  }
  return job_done({}, 0);
}

}  // namespace assay::jobs
