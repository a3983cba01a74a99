#include "run/coordinator/batch.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <fmt/format.h>

#include "engines/batch.h"
#include "measures/batch.h"
#include "measures/statistics.h"
#include "run/coordinator/timing_values.h"

namespace assay {
namespace {

struct BatchTally : SessionTally {
  BatchPrepared prepared;
  std::vector<double> step_us, latency_us, steal;  // of each round

  std::vector<SampleSeries> samples() const {
    return {{"batch_step_time_us", step_us}, {"batch_latency_us", latency_us}, {"steal", steal}};
  }

  std::vector<Value> values(int worlds, std::uint64_t seed) const {
    std::vector<Value> found = {value_of("batch_worlds", "1", worlds)};
    if (prepared.compared > 0) {
      found.push_back(value_of("batch_equivalence", "m", prepared.equivalence_m));
      found.push_back(value_of("batch_bound", "m", prepared.bound_m));
      found.push_back(value_of("batch_compared", "1", prepared.compared));
    }
    if (over || step_us.empty()) return found;
    const Interval step = bootstrap_median(step_us, seed);
    found.push_back(inverse("batch_rate", "1/s", 1e6 * worlds, step));
    found.push_back(value_of("batch_step_time", "us", step));
    found.push_back(value_of("batch_latency", "us", bootstrap_median(latency_us, seed)));
    if (prepared.memory_bytes > 0) found.push_back(value_of("batch_memory", "B", prepared.memory_bytes));
    found.push_back(value_of("batch_compile_time", "s", prepared.compile_s));
    if (prepared.processes > 0) found.push_back(value_of("batch_processes", "1", prepared.processes));
    return found;
  }
};

// Graphics memory is no memory of a process, but a driver maps all of it.
WorkerLimits limits_of(const std::string& device) {
  WorkerLimits limits = WorkerLimits::of_machine();
  if (device != "cpu") limits.memory_bytes = 0;
  return limits;
}

BatchSampleCommand plan_turn(const Campaign& campaign, const CampaignSystem& system, double timestep_ms,
                             const std::vector<BatchTally>& tallies) {
  std::vector<double> step_s;
  for (const BatchTally& tally : tallies) {
    if (!tally.over) step_s.push_back(tally.prepared.step_s);
  }
  BatchSampleCommand how;
  if (step_s.empty()) return how;
  constexpr double kMostSingleSteps = 16;
  const double run = std::floor(1e3 * system.duration_s / timestep_ms + 0.5);
  const double in_turn = 1e-3 * campaign.timing.batch_ms / mean(step_s);
  how.single_steps = static_cast<int>(std::clamp(in_turn, 1.0, std::min(kMostSingleSteps, run / 8)));
  const double most = run - campaign.timing.warmup - how.single_steps;
  how.steps = static_cast<long long>(std::clamp(in_turn, 1.0, std::max(1.0, most)));
  return how;
}

std::string said_of(const BatchPrepared& prepared, const std::string& device) {
  const DeviceFacts facts = device_facts(device);
  const std::string name = prepared.device.empty() ? facts.name : prepared.device;
  const std::string driver = prepared.driver.empty() ? facts.driver : prepared.driver;
  return driver.empty() ? name : fmt::format("{}, {}", name, driver);
}

}  // namespace

void measure_batch(const Campaign& campaign, const CampaignSystem& system, const std::string& program,
                   const Interrupts& interrupts, const std::vector<BatchContender>& contenders,
                   std::map<std::string, std::string>& said, const TimingPass::Started& started,
                   const std::function<void(const std::vector<MeasuredCell>&)>& put) {
  const int worlds = contenders.front().session.worlds;
  const double timestep_ms = contenders.front().session.timestep_ms;
  const std::string title = fmt::format("batch-{} {} at {} ms", worlds, system.name, timestep_label(timestep_ms));
  std::map<std::string, Sessions> sessions;  // by device
  const auto session = [&](const BatchContender& contender) -> Sessions& {
    const std::string& device = contender.session.device;
    return sessions.try_emplace(device, program, campaign.time_limit_s, limits_of(device), interrupts).first->second;
  };
  std::vector<BatchTally> tallies(contenders.size());
  for (size_t i = 0; i < contenders.size(); ++i) {
    const BatchContender& contender = contenders[i];
    BatchTally& tally = tallies[i];
    tally.cell.key = contender.key;
    tally.cell.system = system.name;
    tally.cell.contender = contender.name;
    tally.cell.timestep_ms = timestep_ms;
    tally.cell.measure = batch_name({worlds, contender.session.device});
    tally.cell.started = unix_time();
    started(fmt::format("{}, setting up {}", title, contender.name), 0);
    const auto answer = session(contender).command<BatchPrepared>(contender.name, 0, contender.session,
                                                                  PrepareCommand{timestep_ms}, tally);
    if (interrupts.signal() != 0) return;
    if (!answer) continue;
    tally.prepared = *answer;
    const std::string text = said_of(*answer, contender.session.device);
    if (!text.empty()) said[contender.session.device] = text;
  }
  const BatchSampleCommand how = plan_turn(campaign, system, timestep_ms, tallies);
  std::mt19937_64 random(static_cast<std::uint64_t>(campaign.seed) * 1000003 + static_cast<std::uint64_t>(worlds));
  for (int round = 0; round < campaign.timing.rounds; ++round) {
    started(fmt::format("{}, round {} of {}", title, round + 1, campaign.timing.rounds),
            static_cast<double>(round) / campaign.timing.rounds);
    std::vector<size_t> order;
    for (size_t i = 0; i < tallies.size(); ++i) {
      if (!tallies[i].over) order.push_back(i);
    }
    shuffle(order, random);
    for (const size_t i : order) {
      BatchTally& tally = tallies[i];
      const double stolen = tally.stolen, total = tally.total;
      const auto answer =
          session(contenders[i]).command<BatchSampled>(contenders[i].name, 0, contenders[i].session, how, tally);
      if (interrupts.signal() != 0) return;
      if (!answer || tally.over) continue;
      tally.step_us.push_back(answer->step_us);
      tally.latency_us.push_back(answer->latency_us);
      tally.steal.push_back(tally.total > total ? (tally.stolen - stolen) / (tally.total - total) : 0);
    }
  }
  std::vector<MeasuredCell> measured;
  for (BatchTally& tally : tallies) {
    if (tally.outside) continue;
    tally.cell.finished = unix_time();
    tally.cell.steal = tally.total > 0 ? tally.stolen / tally.total : 0;
    tally.cell.values = tally.values(worlds, static_cast<std::uint64_t>(campaign.seed));
    measured.push_back({std::move(tally.cell), tally.samples()});
  }
  put(measured);
}

}  // namespace assay
