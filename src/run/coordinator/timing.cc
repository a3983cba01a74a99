#include "run/coordinator/timing.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "measures/statistics.h"
#include "measures/step_time.h"
#include "measures/windows.h"
#include "results/store/timing_samples.h"
#include "run/coordinator/timing_values.h"

namespace assay {
namespace {

// The bounds within which a turn counts as undisturbed. A turn that lost more of its core to others than this is taken
// again: its wall time is not the engine's.
constexpr double kLeastCpuShare = 0.98;
constexpr double kMostSteal = 0.02;
constexpr double kMostSwitchesPerSecond = 50;

// How often a round's turn is taken in all, and how many of a cell's turns may be repetitions.
constexpr int kTurnsOfARound = 3;
constexpr double kMostRepeated = 0.5;

// Passes over short windows go on until a turn has this share of the mean turn.
constexpr double kLeastTurn = 0.2;
constexpr double kMostPasses = 50;

}  // namespace

// What has been measured of one cell.
struct TimingPass::Tally : SessionTally {
  // A turn that counts.
  struct Turn {
    RoundFacts facts;
    double wall_s = 0, input_us = 0;
    std::vector<double> step_us;

    bool disturbed() const {
      return facts.cpu_share < kLeastCpuShare || facts.steal > kMostSteal ||
             facts.switches > std::max(1.0, kMostSwitchesPerSecond * wall_s);
    }
  };

  double step_s = 0;  // as prepared
  TurnPlan how;
  WindowLayout layout;
  std::vector<TimingWindow> windows;
  int rounds = 1;  // of each process
  double clock_share = 0, clock_s = 0;
  std::vector<Turn> turns;
  int repeated = 0;
  std::optional<SingleSteps> single;

  std::vector<SampleSeries> samples() const {
    std::vector<std::vector<double>> rounds_us;
    std::vector<RoundFacts> facts;
    for (const Turn& turn : turns) {
      rounds_us.push_back(turn.step_us);
      facts.push_back(turn.facts);
    }
    return timing_samples(windows, rounds_us, facts);
  }

  std::vector<Value> values() const {
    const auto timed = timed_rounds(samples());
    if (!timed) return {};  // no round was timed
    const Interval step = step_time(*timed);
    std::vector<double> inputs;
    inputs.reserve(turns.size());
    for (const Turn& turn : turns) inputs.push_back(turn.input_us);
    const long long shortest = std::ranges::min_element(windows, {}, &TimingWindow::steps)->steps;
    std::vector<Value> found = {
        value_of("step_time", "us", step),
        value_of("coverage", "1", coverage(windows, layout)),
        value_of("window_share", "1", layout.share),
        value_of("input_time", "us", median(inputs)),
        value_of("disturbed_rounds", "1", static_cast<double>(std::ranges::count_if(turns, &Turn::disturbed))),
        value_of("repeated_rounds", "1", repeated),
        value_of("sample_steps", "1", static_cast<double>(shortest)),
        value_of("clock_share", "1", clock_share),
        value_of("engine_share", "1", cell.engine_s / cell.wall_s)};
    if (step.value > 0) {
      found.push_back(inverse("raw_speed", "kHz", 1e3, step));
      found.push_back(inverse("realtime_factor", "1", 1e3 * cell.timestep_ms, step));
    }
    if (single && single->p50_us > 0) {
      found.push_back(value_of("step_p50", "us", single->p50_us));
      found.push_back(value_of("step_p99", "us", single->p99_us));
      found.push_back(value_of("step_worst", "us", single->worst_us));
      found.push_back(value_of("step_clock_share", "1", 1e6 * clock_s / single->p50_us));
    }
    return found;
  }
};

// Which windows all contenders time, how often each passes over them in a turn, and in how many rounds.
void TimingPass::plan_turns(const CampaignSystem& system, const std::vector<TimedContender>& contenders,
                            const std::string& harness, std::optional<double> share,
                            std::vector<Tally>& tallies) const {
  const TimingOptions& timing = campaign_.timing;
  const int processes = std::min(timing.processes, timing.rounds);
  const int rounds = (timing.rounds + processes - 1) / processes;
  const double turn_s = 1e-3 * timing.batch_ms;
  const double steps = 1e3 * system.duration_s / tallies.front().cell.timestep_ms;
  std::vector<double> run_s;
  for (size_t i = 0; i < tallies.size(); ++i) {
    if (!tallies[i].over && contenders[i].name != harness) run_s.push_back(steps * tallies[i].step_s);
  }
  if (run_s.empty()) {
    for (Tally& tally : tallies) tally.over = true;  // there is nothing that the harness's time could be compared with
    return;
  }
  const TimingShare planned = timing_share(run_s, turn_s, rounds, share);
  auto of = planned.rounds.begin();
  for (size_t i = 0; i < tallies.size(); ++i) {
    Tally& tally = tallies[i];
    if (tally.over) continue;
    const bool is_harness = contenders[i].name == harness;
    tally.layout = {system.duration_s, system.sample_ms, tally.cell.timestep_ms, timing.windows,
                    timing.warmup,     planned.share,    timing.common_states};
    tally.windows = timing_windows(tally.layout);
    tally.rounds = is_harness ? rounds : *of++;
    const double pass_s = coverage(tally.windows, tally.layout) * steps * tally.step_s;
    const double passes = is_harness ? 1 : std::clamp(std::ceil(kLeastTurn * turn_s / pass_s), 1.0, kMostPasses);
    tally.how = {tally.cell.timestep_ms, timing.windows,           planned.share,
                 timing.common_states,   static_cast<int>(passes), contenders[i].run};
  }
}

// One turn of each contender of `order`; `again`: in place of the one it took last, if it was disturbed less. Returns
// those that were disturbed and may try again.
std::vector<size_t> TimingPass::take_turns(const std::vector<TimedContender>& contenders,
                                           const std::vector<size_t>& order, int process, bool again,
                                           std::vector<Tally>& tallies) {
  std::vector<size_t> disturbed;
  for (const size_t i : order) {
    Tally& tally = tallies[i];
    if (tally.over) continue;
    const double stolen = tally.stolen, total = tally.total;
    auto answer =
        sessions_.command<Sampled>(contenders[i].name, process, contenders[i].session, SampleCommand{tally.how}, tally);
    if (interrupts_.signal() != 0) return {};
    if (!answer || tally.over) continue;
    if (answer->step_us.size() != tally.windows.size()) {
      tally.fail(Outcome::kCrashed, "the worker timed other windows than it was asked for");
      continue;
    }
    Tally::Turn turn;
    turn.facts.process = process;
    turn.facts.steal = tally.total > total ? (tally.stolen - stolen) / (tally.total - total) : 0;
    turn.facts.cpu_share = answer->cpu_s / answer->wall_s;
    turn.facts.switches = static_cast<double>(answer->switches);
    turn.wall_s = answer->wall_s;
    turn.input_us = answer->input_us;
    turn.step_us = std::move(answer->step_us);
    tally.clock_share = std::max(tally.clock_share, answer->clock_share);
    const bool was_disturbed = turn.disturbed();
    if (!again) {
      tally.turns.push_back(std::move(turn));
    } else {
      ++tally.repeated;
      Tally::Turn& kept = tally.turns.back();
      if (!was_disturbed || turn.facts.cpu_share > kept.facts.cpu_share) kept = std::move(turn);
    }
    if (was_disturbed && tally.repeated < kMostRepeated * campaign_.timing.rounds) disturbed.push_back(i);
  }
  return disturbed;
}

void TimingPass::measure(const CampaignSystem& system, const std::vector<TimedContender>& contenders,
                         double timestep_ms, const std::map<std::string, std::string>& keys, const std::string& harness,
                         std::optional<double> share, const Started& started, const Put& put) {
  std::vector<Tally> tallies(contenders.size());
  for (size_t i = 0; i < contenders.size(); ++i) {
    Tally& tally = tallies[i];
    tally.cell.key = keys.at(contenders[i].name);
    tally.cell.system = system.name;
    tally.cell.contender = contenders[i].name;
    tally.cell.timestep_ms = timestep_ms;
    tally.cell.measure = "raw_speed";
    tally.cell.started = unix_time();
    started(fmt::format("raw_speed {} at {} ms, setting up {}", system.name, timestep_label(timestep_ms),
                        contenders[i].name),
            0);
    const auto answer =
        sessions_.command<Prepared>(contenders[i].name, 0, contenders[i].session, PrepareCommand{timestep_ms}, tally);
    if (interrupts_.signal() != 0) return;
    if (answer) tally.step_s = answer->step_s;
  }
  plan_turns(system, contenders, harness, share, tallies);
  std::mt19937_64 random(static_cast<std::uint64_t>(campaign_.seed) * 1000003 +
                         static_cast<std::uint64_t>(std::llround(timestep_ms * 1e6)));
  // A process's place in memory changes its speed a little for its whole life, so there are several processes. Each
  // takes its rounds one after the other: then what the machine does for some time is in few of them, and their mean
  // times differ as much as their interval has to say.
  const int rounds = campaign_.timing.rounds, processes = std::min(campaign_.timing.processes, rounds);
  for (int round = 0; round < rounds; ++round) {
    started(fmt::format("raw_speed {} at {} ms, round {} of {}", system.name, timestep_label(timestep_ms), round + 1,
                        rounds),
            static_cast<double>(round) / rounds);
    const int process = round * processes / rounds;
    const int first = (process * rounds + processes - 1) / processes;  // round of the process
    std::vector<size_t> order;
    for (size_t i = 0; i < contenders.size(); ++i) {
      if (round - first < tallies[i].rounds) order.push_back(i);
    }
    shuffle(order, random);
    for (int turn = 0; turn < kTurnsOfARound && !order.empty(); ++turn) {
      order = take_turns(contenders, order, process, turn > 0, tallies);
      if (interrupts_.signal() != 0) return;
    }
  }
  started(fmt::format("raw_speed {} at {} ms, single steps", system.name, timestep_label(timestep_ms)), 1);
  for (size_t i = 0; i < contenders.size(); ++i) {
    Tally& tally = tallies[i];
    if (tally.over || contenders[i].name == harness) continue;
    tally.clock_s = sessions_.facts().clock_s;
    tally.single = sessions_.command<SingleSteps>(contenders[i].name, 0, contenders[i].session,
                                                  SingleStepsCommand{tally.how}, tally);
    if (interrupts_.signal() != 0) return;
  }
  // All at once: as long as a cell of the campaign is missing, the whole timestep is repeated.
  std::vector<MeasuredCell> measured;
  for (Tally& tally : tallies) {
    if (tally.outside) continue;
    tally.cell.finished = unix_time();
    tally.cell.steal = tally.total > 0 ? tally.stolen / tally.total : 0;
    std::vector<SampleSeries> samples;
    if (!tally.turns.empty()) samples = tally.samples();
    if (!tally.over && !tally.turns.empty()) tally.cell.values = tally.values();
    measured.push_back({std::move(tally.cell), std::move(samples)});
  }
  put(measured);
}

}  // namespace assay
