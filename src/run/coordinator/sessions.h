// Workers that stay for the commands of a timing: started when they are first needed, started again when somebody else
// ended them.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"
#include "results/store/store.h"
#include "run/coordinator/pool.h"
#include "run/coordinator/process.h"
#include "run/messages/messages.h"

namespace assay {

struct TimingFacts {
  int core = -1;
  double clock_s = 0;
};

// What becomes of one cell that sessions measure.
struct SessionTally {
  Cell cell;
  double stolen = 0, total = 0;  // ticks of the core
  bool over = false;             // no more samples: it failed
  int lost = 0;                  // workers that somebody else ended
  bool outside = false;          // so many of them that nothing is known of the contender

  void fail(Outcome outcome, std::string reason);

  // Why the worker's `reply`, if there is one, is not the one that was awaited; ends the worker.
  void fail(WorkerProcess& worker, const std::optional<Reply>& reply, const std::string& too_long);
};

class Sessions {
 public:
  // `limit_s`: of each answer.
  Sessions(std::string program, double limit_s, const WorkerLimits& limits, const Interrupts& interrupts)
      : program_(std::move(program)), limit_s_(limit_s), limits_(limits), interrupts_(interrupts) {}

  // Sends a command to the session `process` of `contender`, which `job` starts, and waits for its answer. All of that
  // is the cell's wall time, except the start of a worker, which serves many commands. Empty when there is no answer.
  template <typename Answer>
  std::optional<Answer> command(const std::string& contender, int process, const Request& job, const Request& message,
                                SessionTally& tally) {
    const int lost = tally.lost;
    WorkerProcess* worker = session(contender, process, job, tally);
    const auto start = std::chrono::steady_clock::now();
    const CpuTimes before = CpuTimes::now(facts_.core);
    std::optional<Answer> answer;
    if (worker != nullptr) {
      worker->send(message);
      auto reply = worker->wait_reply(limit_s_, interrupts_.descriptor());
      if (reply) throw_worker_error(*reply);
      if (auto* awaited = reply ? std::get_if<Answer>(&*reply) : nullptr) {
        answer = std::move(*awaited);
      } else if (interrupts_.signal() == 0) {
        tally.fail(*worker, reply, fmt::format("no sample after {}", duration_label(limit_s_)));
        sessions_.erase({contender, process});
      }
    }
    const CpuTimes after = CpuTimes::now(facts_.core);
    tally.stolen += after.steal - before.steal;
    tally.total += after.total - before.total;
    tally.cell.wall_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    // Somebody else ended the worker: once more with another one.
    if (!answer && tally.lost > lost && !tally.over) {
      return command<Answer>(contender, process, job, message, tally);
    }
    if (!answer) return answer;
    tally.cell.engine_s += answer->engine_s;
    if constexpr (requires { answer->cpu_s; }) tally.cell.cpu_s += answer->cpu_s;
    const auto& [outcome, reason] = answer->ending;
    if (outcome == Outcome::kUnstable) {  // its figures count all the same
      tally.cell.outcome = outcome;
      tally.cell.reason = reason;
    } else if (outcome != Outcome::kOk) {
      tally.fail(outcome, reason);
    }
    return answer;
  }

  void close() { sessions_.clear(); }
  const TimingFacts& facts() const { return facts_; }

 private:
  WorkerProcess* session(const std::string& contender, int process, const Request& job, SessionTally& tally);

  std::string program_;
  double limit_s_;
  WorkerLimits limits_;
  const Interrupts& interrupts_;
  std::map<std::pair<std::string, int>, std::unique_ptr<WorkerProcess>> sessions_;  // by contender and process
  TimingFacts facts_;
};

}  // namespace assay
