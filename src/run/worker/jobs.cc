#include "run/worker/jobs.h"

#include "base/errors.h"
#include "run/worker/job_parts.h"

namespace assay {

JobDone do_job(const Request& job, const jobs::Report& report, const jobs::Next& next) {
  return std::visit(
      [&](const auto& each) -> JobDone {
        if constexpr (requires { jobs::do_job(each); }) {
          return jobs::do_job(each);
        } else if constexpr (requires { jobs::do_job(each, report); }) {
          return jobs::do_job(each, report);
        } else if constexpr (requires { jobs::do_job(each, report, next); }) {
          return jobs::do_job(each, report, next);
        } else {
          throw SystemError("a worker was sent a command of a timing session before its job");
        }
      },
      job);
}

}  // namespace assay
