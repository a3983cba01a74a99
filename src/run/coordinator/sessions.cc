#include "run/coordinator/sessions.h"

#include <algorithm>

#include "isolate/machine_lack.h"

namespace assay {

void SessionTally::fail(Outcome outcome, std::string reason) {
  cell.outcome = outcome;
  cell.reason = std::move(reason);
  over = true;
}

void SessionTally::fail(WorkerProcess& worker, const std::optional<Reply>& reply, const std::string& too_long) {
  const bool gone = worker.gone();
  std::string end = worker.end();
  const bool crashed = gone || reply;
  if (crashed && !inherited_memory_limit().empty()) {  // where memory is short, a crash says nothing of the contender
    outside = over = true;
  } else if (gone && worker.ended_from_outside()) {
    outside = ++lost >= Pool::kMostTries;
    over = outside;
  } else if (const auto* crash = reply ? std::get_if<JobCrash>(&*reply) : nullptr) {
    fail(Outcome::kCrashed, crash->reason);
  } else if (reply) {
    fail(Outcome::kCrashed, fmt::format("the worker answered with '{}'", kind_of(*reply)));
  } else if (gone) {
    fail(Outcome::kCrashed, std::move(end));
  } else {
    fail(Outcome::kTimeout, too_long);
  }
}

// The contender's worker, started when there is none. Null when it does not get ready: then the tally says why.
WorkerProcess* Sessions::session(const std::string& contender, int process, const Request& job, SessionTally& tally) {
  std::unique_ptr<WorkerProcess>& held = sessions_[{contender, process}];
  if (held) return held.get();
  held = std::make_unique<WorkerProcess>(program_, limits_);
  held->send(job);
  const auto reply = held->wait_reply(limit_s_, interrupts_.descriptor());
  if (reply) throw_worker_error(*reply);
  if (const auto* ready = reply ? std::get_if<SessionReady>(&*reply) : nullptr) {
    facts_.core = ready->core;
    facts_.clock_s = std::max(facts_.clock_s, ready->clock_s);
    return held.get();
  }
  if (interrupts_.signal() == 0) {
    tally.fail(*held, reply, fmt::format("not ready after {}", duration_label(limit_s_)));
  }
  held.reset();
  return nullptr;
}

}  // namespace assay
