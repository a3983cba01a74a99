#include "coordinator/timing.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <random>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "coordinator/process.h"
#include "measures/statistics.h"

namespace assay {
namespace {

using Clock = std::chrono::steady_clock;

// The same order on every machine.
template <typename T>
void shuffle(std::vector<T>& items, std::mt19937_64& random) {
  for (size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[(random() >> 32) * i >> 32]);
}

Value inverse(const std::string& name, const std::string& unit, double scale, const Interval& interval) {
  return {name, unit, scale / interval.value, scale / interval.high, scale / interval.low};
}

}  // namespace

struct TimingPass::Session {
  explicit Session(const std::string& program) : worker(program, WorkerLimits::of_share(1)) {}
  WorkerProcess worker;
};

// What has been measured of one cell.
struct TimingPass::Tally {
  Cell cell;
  CpuTimes stolen_from;
  double stolen = 0, total = 0;  // ticks
  bool over = false;             // no more samples: it failed
  int lost = 0;                  // workers that somebody else ended
  bool outside = false;          // so many of them that nothing is known of the contender
  RoundPlan how;
  double clock_share = 0;
  std::vector<std::vector<double>> rounds;          // samples of each, us a step
  std::vector<double> processes, steal, cpu_share;  // one a round

  std::vector<SampleSeries> samples() const {
    SampleSeries all = {"step_time_us", {}}, medians = {"round_step_time_us", {}};
    for (const std::vector<double>& round : rounds) {
      all.values.insert(all.values.end(), round.begin(), round.end());
      medians.values.push_back(median(round));
    }
    return {all, medians, {"process", processes}, {"steal", steal}, {"cpu_share", cpu_share}};
  }

  // Median over all samples; the bootstrap draws processes with all of their rounds, or rounds when there is one
  // process.
  std::vector<Value> values(std::uint64_t seed) const {
    std::map<double, std::vector<double>> by_process;
    for (size_t round = 0; round < rounds.size(); ++round) {
      std::vector<double>& pooled = by_process[processes[round]];
      pooled.insert(pooled.end(), rounds[round].begin(), rounds[round].end());
    }
    std::vector<std::vector<double>> groups;
    groups.reserve(by_process.size());
    for (const auto& [process, pooled] : by_process) groups.push_back(pooled);
    const Interval step = bootstrap_median_of_rounds(groups.size() > 1 ? groups : rounds, seed);
    std::vector<Value> found = {{"step_time", "us", step.value, step.low, step.high},
                                {"sample_steps", "1", static_cast<double>(how.sample_steps), {}, {}},
                                {"clock_share", "1", clock_share, {}, {}},
                                {"engine_share", "1", cell.engine_s / cell.wall_s, {}, {}}};
    if (step.low > 0) {
      found.push_back(inverse("raw_speed", "kHz", 1e3, step));
      found.push_back(inverse("realtime_factor", "1", 1e3 * cell.timestep_ms, step));
    }
    return found;
  }

  void fail(Outcome outcome, std::string reason) {
    cell.outcome = outcome;
    cell.reason = std::move(reason);
    over = true;
  }

  // Why the worker's `reply`, if there is one, is not the one that was awaited; ends the worker.
  void fail(WorkerProcess& worker, const std::optional<Reply>& reply, const std::string& too_long) {
    const bool gone = worker.gone();
    std::string end = worker.end();
    if (gone && worker.ended_from_outside()) {
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
};

// The contender's worker, started when there is none. Null when it does not get ready: then the tally says why.
TimingPass::Session* TimingPass::session(const TimedContender& contender, int process, Tally& tally) {
  std::shared_ptr<Session>& held = sessions_[{contender.name, process}];
  if (held) return held.get();
  held = std::make_shared<Session>(program_);
  held->worker.send(contender.session);
  const auto reply = held->worker.wait_reply(campaign_.time_limit_s, interrupts_.descriptor());
  if (reply) throw_worker_error(*reply);
  if (const auto* ready = reply ? std::get_if<SessionReady>(&*reply) : nullptr) {
    facts_.core = ready->core;
    facts_.clock_s = std::max(facts_.clock_s, ready->clock_s);
    return held.get();
  }
  if (interrupts_.signal() == 0) {
    tally.fail(held->worker, reply, fmt::format("not ready after {}", duration_label(campaign_.time_limit_s)));
  }
  held.reset();
  return nullptr;
}

// Sends a command and waits for its answer. All of that is the cell's wall time, except the start of a worker, which
// serves all timesteps. Empty when there is no answer.
template <typename Answer>
std::optional<Answer> TimingPass::command(const TimedContender& contender, int process, const Request& message,
                                          Tally& tally) {
  const int lost = tally.lost;
  Session* held = session(contender, process, tally);
  const Clock::time_point start = Clock::now();
  const CpuTimes before = CpuTimes::now();
  std::optional<Answer> answer;
  if (held != nullptr) {
    held->worker.send(message);
    auto reply = held->worker.wait_reply(campaign_.time_limit_s, interrupts_.descriptor());
    if (reply) throw_worker_error(*reply);
    if (auto* awaited = reply ? std::get_if<Answer>(&*reply) : nullptr) {
      answer = std::move(*awaited);
    } else if (interrupts_.signal() == 0) {
      tally.fail(held->worker, reply, fmt::format("no sample after {}", duration_label(campaign_.time_limit_s)));
      sessions_.erase({contender.name, process});
    }
  }
  const CpuTimes after = CpuTimes::now();
  tally.stolen += after.steal - before.steal;
  tally.total += after.total - before.total;
  tally.cell.wall_s += std::chrono::duration<double>(Clock::now() - start).count();
  // Somebody else ended the worker: once more with another one.
  if (!answer && tally.lost > lost && !tally.over) return command<Answer>(contender, process, message, tally);
  if (!answer) return answer;
  tally.cell.engine_s += answer->engine_s;
  if constexpr (std::is_same_v<Answer, Sampled>) tally.cell.cpu_s += answer->cpu_s;
  const auto& [outcome, reason] = answer->ending;
  if (outcome == Outcome::kUnstable) {  // its figures count all the same
    tally.cell.outcome = outcome;
    tally.cell.reason = reason;
  } else if (outcome != Outcome::kOk) {
    tally.fail(outcome, reason);
  }
  return answer;
}

void TimingPass::measure(const CampaignSystem& system, const std::vector<TimedContender>& contenders,
                         double timestep_ms, const std::map<std::string, std::string>& keys, const std::string& harness,
                         const Started& started, const Put& put) {
  std::vector<Tally> tallies(contenders.size());
  long long shortest = 0;
  for (size_t i = 0; i < contenders.size(); ++i) {
    Tally& tally = tallies[i];
    tally.cell.key = keys.at(contenders[i].name);
    tally.cell.system = system.name;
    tally.cell.contender = contenders[i].name;
    tally.cell.timestep_ms = timestep_ms;
    tally.cell.measure = "raw_speed";
    tally.cell.started = unix_time();
  }
  // The harness comes last: its samples are as short as the shortest of the others.
  std::vector<size_t> order;
  order.reserve(contenders.size());
  for (const bool last : {false, true}) {
    for (size_t i = 0; i < contenders.size(); ++i) {
      if ((contenders[i].name == harness) == last) order.push_back(i);
    }
  }
  for (const size_t i : order) {
    const bool is_harness = contenders[i].name == harness;
    started(fmt::format("raw_speed {} at {} ms, setting up {}", system.name, timestep_label(timestep_ms),
                        contenders[i].name));
    const PrepareCommand prepare = {timestep_ms, is_harness ? std::max(1LL, shortest) : 0};
    const auto answer = command<Prepared>(contenders[i], 0, prepare, tallies[i]);
    if (interrupts_.signal() != 0) return;
    if (!answer || tallies[i].over) continue;
    tallies[i].how = answer->how;
    const long long steps = answer->how.sample_steps;
    shortest = shortest == 0 ? steps : std::min(shortest, steps);
  }
  std::mt19937_64 random(static_cast<std::uint64_t>(campaign_.seed) * 1000003 +
                         static_cast<std::uint64_t>(std::llround(timestep_ms * 1e6)));
  for (int round = 0; round < campaign_.timing.rounds; ++round) {
    started(fmt::format("raw_speed {} at {} ms, round {} of {}", system.name, timestep_label(timestep_ms), round + 1,
                        campaign_.timing.rounds));
    shuffle(order, random);
    for (const size_t i : order) {
      Tally& tally = tallies[i];
      if (tally.over) continue;
      const double stolen = tally.stolen, total = tally.total;
      // A process's place in memory changes its speed a little for its whole life, so there are several processes.
      const int process = round % campaign_.timing.processes;
      const auto answer = command<Sampled>(contenders[i], process, SampleCommand{tally.how}, tally);
      if (interrupts_.signal() != 0) return;
      if (!answer || tally.over) continue;
      tally.rounds.push_back(answer->step_us);
      tally.processes.push_back(process);
      tally.steal.push_back(tally.total > total ? (tally.stolen - stolen) / (tally.total - total) : 0);
      tally.cpu_share.push_back(answer->cpu_s / answer->wall_s);
      tally.clock_share = std::max(tally.clock_share, answer->clock_share);
    }
  }
  // The harness first: as long as a cell of the campaign is missing, the whole timestep is repeated.
  const auto put_tally = [&](Tally& tally) {
    if (tally.outside) return;
    tally.cell.finished = unix_time();
    tally.cell.steal = tally.total > 0 ? tally.stolen / tally.total : 0;
    std::vector<SampleSeries> samples;
    if (!tally.rounds.empty()) samples = tally.samples();
    if (!tally.over && !tally.rounds.empty()) {
      tally.cell.values = tally.values(static_cast<std::uint64_t>(campaign_.seed));
    }
    put(tally.cell, samples);
  };
  for (const bool first : {true, false}) {
    for (Tally& tally : tallies) {
      if ((tally.cell.contender == harness) == first) put_tally(tally);
    }
  }
}

}  // namespace assay
