#include "campaign/plan.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/hash.h"
#include "base/json.h"
#include "base/text.h"
#include "campaign/shards.h"
#include "engines/batch.h"
#include "measures/batch.h"
#include "measures/run_measures.h"

namespace assay {
namespace {

// Raised when a measure or the way a run is made changes, so that old results are not taken for new ones.
constexpr int kResultVersion = 3;

nlohmann::json run_content(const CampaignSystem& system, const std::string& control, const CampaignContender& contender,
                           double timestep_ms, double sample_ms) {
  nlohmann::json content = {{"version", kResultVersion}, {"model", system.model.hash},
                            {"control", control},        {"duration_s", system.duration_s},
                            {"sample_ms", sample_ms},    {"contender", contender.content()},
                            {"timestep_ms", timestep_ms}};
  if (system.pushes.any()) content["push"] = pushes_content(system.pushes);
  return content;
}

// Whether a measure's cells take a run from every initial state.
bool reads_states(const std::string& measure) {
  return measure == "consistency" || measure == "grasp" || measure == "transfer" ||
         find_run_measure(measure) != nullptr;
}

// Simulated steps of the pieces of all lengths that a timestep has (run/worker/job_accuracy.cc).
long long piece_steps(const CampaignSystem& system, double timestep_ms) {
  double simulated_ms = system.pieces * system.piece_ms;
  for (const double length : system.more_pieces_ms) {
    if (length > system.piece_ms) simulated_ms += std::max(length, system.pieces * system.piece_ms);
  }
  return std::llround(simulated_ms / timestep_ms);
}

long long steps_of(double length_ms, double timestep_ms) { return std::llround(length_ms / timestep_ms); }

// Seconds of wall time that timing a cell takes: a look at the time of a step, the rounds and the single steps, and for
// each saved state an instance and its untimed steps. In the mean over contenders: one that is slow takes longer turns.
double timing_seconds(const Campaign& campaign, double step_s, double instance_s) {
  constexpr double kSearchSeconds = 2e-2, kPassesOfSingleSteps = 3;
  const TimingOptions& timing = campaign.timing;
  const double start_s = instance_s + step_s * timing.warmup;
  return kSearchSeconds + (timing.rounds + kPassesOfSingleSteps) * (1e-3 * timing.batch_ms + timing.windows * start_s);
}

// The same of many worlds: starting them, the run of one world and those that are compared, and the rounds. A step of
// all worlds may take longer than a turn.
double batch_seconds(const Campaign& campaign, double step_s, int worlds) {
  constexpr double kStartSeconds = 3, kWorldSeconds = 5e-4, kStepsOfATurn = 2;
  const TimingOptions& timing = campaign.timing;
  const double turn_s = std::max(2e-3 * timing.batch_ms, kStepsOfATurn * step_s * worlds);
  return kStartSeconds + kWorldSeconds * worlds + timing.rounds * turn_s;
}

}  // namespace

Plan make_plan(const Campaign& campaign, int shards, ShardCells cells) {
  Plan plan;
  for (size_t s = 0; s < campaign.systems.size(); ++s) {
    const CampaignSystem& system = campaign.systems[s];
    const std::string control = make_control(system.model, system.control)->description();
    const auto run_of = [&](const CampaignContender& contender, double timestep_ms) {
      return run_content(system, control, contender, timestep_ms, system.sample_ms);
    };
    const InitialStates& states_of = system.initial_states;
    const auto reference_of = [&](const CampaignContender& contender, int state = 0) {
      nlohmann::json content =
          run_content(system, control, contender, system.reference_of(contender), system.grid_ms());
      // how many there are does not change one of them
      if (state > 0) content["initial_state"] = initial_states_content({state, states_of.seed, states_of.around});
      return content_hash(dump_json(content));
    };
    const int states = system.initial_states.count;
    std::vector<std::string> trained_in;  // runs of that contender, from each state
    for (int state = 0; system.trained_in >= 0 && state < states; ++state) {
      trained_in.push_back(reference_of(campaign.contenders[static_cast<size_t>(system.trained_in)], state));
    }
    nlohmann::json from_states;  // what several initial states add to a cell's content
    if (states > 1) from_states = initial_states_content(system.initial_states);
    // What agreement gives depends on which contenders are compared.
    nlohmann::json compared = nlohmann::json::array();
    if (system.has(Measure::kAgreement)) {
      for (const int c : system.contenders) {
        const CampaignContender& contender = campaign.contenders[static_cast<size_t>(c)];
        if (contender.absent.empty() && !contender.twin)
          compared.push_back({contender.resolved.name, reference_of(contender)});
      }
    }
    for (const int c : system.contenders) {
      const CampaignContender& contender = campaign.contenders[static_cast<size_t>(c)];
      if (!contender.absent.empty()) continue;
      // A twin shares the runs of the contender that it is one with.
      const auto has = [&](Measure measure) {
        return system.has(measure) && (!contender.twin || measure == Measure::kRawSpeed);
      };
      // Timing starts from states of the reference run, too.
      const bool has_reference =
          has(Measure::kConsistency) || system.has(Measure::kRawSpeed) || has(Measure::kAgreement);
      const std::string reference = reference_of(contender);
      const double reference_ms = system.reference_of(contender);
      std::vector<std::string> other_states;
      for (int state = 1; state < states; ++state) other_states.push_back(reference_of(contender, state));

      const auto add = [&](const std::string& measure, double timestep_ms, const std::string& trajectory,
                           long long steps, const nlohmann::json& parameters) {
        nlohmann::json content = {{"run", run_of(contender, timestep_ms)}, {"system", system.name},
                                  {"name", contender.resolved.name},       {"measure", measure},
                                  {"limit_s", campaign.time_limit_s},      {"parameters", parameters}};
        if (!from_states.is_null() && reads_states(measure)) content["initial_states"] = from_states;
        plan.cells.push_back(
            {content_hash(dump_json(content)), static_cast<int>(s), c, timestep_ms, measure, trajectory, steps, 1});
      };
      const double run_ms = system.duration_s * 1000;
      if (has_reference && !contender.twin) {
        const int runs = system.has(Measure::kConsistency) ? states : 1;
        add("reference", reference_ms, reference, runs * steps_of(run_ms, reference_ms), {});
        plan.cells.back().runs = runs;
      }
      if (has(Measure::kConsistency)) {
        for (const double timestep : system.timesteps_ms) {
          // a run with smaller steps than the reference's has none
          if (timestep < reference_ms * (1 - 1e-9)) continue;
          nlohmann::json parameters = {system.pieces, system.piece_ms, reference_ms, campaign.seed};
          if (!system.more_pieces_ms.empty()) parameters.push_back(system.more_pieces_ms);
          add("consistency", timestep, reference, piece_steps(system, timestep), parameters);
          plan.cells.back().other_states = other_states;
        }
      }
      // These measures read one run a timestep: the first of them makes it.
      std::set<double> made;
      for (const Measure measure : system.measures) {
        const bool reads_run = measure == Measure::kTruth || measure == Measure::kGrasp ||
                               measure == Measure::kTransfer || find_run_measure(measure_text(measure)) != nullptr;
        if (!reads_run || contender.twin) continue;
        nlohmann::json parameters;
        const bool compares = measure == Measure::kTransfer && !trained_in.empty();
        // what is stored beside the values of a policy's runs
        constexpr int kTransferVersion = 2;
        if (measure == Measure::kTransfer) parameters = {kTransferVersion, compares ? trained_in.front() : ""};
        if (measure == Measure::kGrasp) parameters = {system.grasp.object, system.grasp.hand, system.grasp.drop_m};
        for (const double timestep : measure == Measure::kViolation ? system.violation_ms : system.timesteps_ms) {
          const bool is_reference = has_reference && same_timestep(timestep, reference_ms);
          const bool from_all = states == 1 || reads_states(std::string(measure_text(measure)));
          const bool first = from_all ? made.insert(timestep).second : !made.contains(timestep);
          // of the states' runs at the reference's timestep only the first exists where there are no pieces
          const long long runs = from_all ? states : 1;
          const long long by_reference = system.has(Measure::kConsistency) ? runs : 1;
          const long long there = is_reference ? by_reference : 0;
          add(std::string(measure_text(measure)), timestep, is_reference ? reference : "",
              first ? (runs - there) * steps_of(run_ms, timestep) : 0, parameters);
          if (compares) plan.cells.back().against = trained_in;
          if (measure == Measure::kTransfer && !has_reference && same_timestep(timestep, system.reference_ms)) {
            const nlohmann::json content = {{"shown", 1},
                                            {"run", run_of(contender, timestep)},
                                            {"from", from_states},
                                            {"state", system.shown_state()}};
            plan.cells.back().keep = content_hash(dump_json(content));
          }
          if (is_reference && from_all && system.has(Measure::kConsistency)) {
            plan.cells.back().other_states = other_states;
          }
        }
      }
      if (has(Measure::kAgreement)) add("agreement", reference_ms, reference, 0, compared);
      if (has(Measure::kScaling)) {
        for (const double timestep : system.timing_ms) {
          add("scaling", timestep, "", steps_of(run_ms, timestep), {});
          if (has_reference && same_timestep(timestep, reference_ms)) continue;  // all its states are kept
          const nlohmann::json content = {{"final_state", 1}, {"run", run_of(contender, timestep)}};
          plan.cells.back().final_state = content_hash(dump_json(content));
        }
      }
      if (system.has(Measure::kRawSpeed)) {
        const TimingOptions& timing = campaign.timing;
        const bool own = system.states_of < 0;
        const CampaignContender& whose = own ? contender : campaign.contenders[static_cast<size_t>(system.states_of)];
        const std::string states_from = reference_of(whose);
        constexpr int kTimingVersion = 2;  // windows start from the run at the timed timestep
        for (const double timestep : system.timing_ms) {
          add("raw_speed", timestep, states_from, 0,
              {kTimingVersion, timing.rounds, timing.batch_ms, timing.windows, timing.warmup, timing.processes,
               system.reference_of(whose), campaign.seed, own ? "" : states_from});
          if (own && !same_timestep(timestep, system.reference_of(contender))) {
            const nlohmann::json content = {{"timed_run", 1}, {"run", run_of(contender, timestep)}};
            plan.cells.back().timed_run = content_hash(dump_json(content));
          }
        }
      }
      if (has(Measure::kBatch)) {
        // an engine that steps one world does so in processes of the machine, whatever the device
        const bool many = batch_engine(contender.resolved.engine) != nullptr;
        const std::string device = many ? campaign.device : "cpu";
        for (const double timestep : system.timing_ms) {
          for (const int worlds : system.worlds) {
            constexpr int kBatchVersion = 1;
            const TimingOptions& timing = campaign.timing;
            add(batch_measure({worlds, device}), timestep, "", 0,
                {kBatchVersion, initial_states_content(states_of), timing.rounds, timing.batch_ms, timing.warmup,
                 campaign.seed});
            plan.cells.back().worlds = worlds;
            plan.cells.back().device = device;
          }
        }
      }
    }
  }
  divide(campaign, plan, shards, cells);
  return plan;
}

namespace {

// How a step's time grows with the size, beyond the sizes whose times are known: the power that fits all of them. Two
// robots of about one size, of which one takes longer, would give any power by themselves.
double power_of_size(const std::map<double, double>& known) {
  constexpr double kMost = 3;  // that of solvers with dense matrices
  double mean_x = 0, mean_y = 0, xx = 0, xy = 0;
  for (const auto& [size, time] : known) {
    mean_x += std::log(size) / static_cast<double>(known.size());
    mean_y += std::log(time) / static_cast<double>(known.size());
  }
  for (const auto& [size, time] : known) {
    const double x = std::log(size) - mean_x;
    xx += x * x;
    xy += x * (std::log(time) - mean_y);
  }
  return std::clamp(xy / xx, 0.0, kMost);
}

}  // namespace

double time_at_size(const std::map<double, double>& known, double size) {
  if (known.empty()) return 0;
  if (known.size() == 1) return known.begin()->second * size / known.begin()->first;
  const auto above = known.lower_bound(size);
  if (above == known.begin() || above == known.end()) {
    const auto& [nearest, time] = above == known.begin() ? *above : *std::prev(above);
    return time * std::pow(size / nearest, power_of_size(known));
  }
  const auto below = std::prev(above);
  const double exponent = std::log(above->second / below->second) / std::log(above->first / below->first);
  return below->second * std::pow(size / below->first, exponent);
}

double estimate_seconds(const Campaign& campaign, const std::vector<PlannedCell>& cells,
                        const std::map<std::pair<int, int>, double>& step_us, int jobs, const StartTimes& starts) {
  constexpr double kNativeStart = 0.05, kNativeInstance = 1e-4;  // benchmarks/balance.py shards
  const auto at_least = [](double least, const auto& times, const auto& key) {
    const auto found = times.find(key);
    return found == times.end() ? least : std::max(least, found->second);
  };
  std::set<std::pair<int, int>> sessions;
  double accuracy = 0, timing = 0, longest = 0;
  for (const PlannedCell& cell : cells) {
    const auto found = step_us.find({cell.system, cell.contender});
    const double step_s = found == step_us.end() ? 0 : 1e-6 * found->second;
    const double start = at_least(kNativeStart, starts.worker_s, cell.contender);
    if (cell.measure == "raw_speed") {
      timing += timing_seconds(campaign, step_s,
                               at_least(kNativeInstance, starts.instance_s, std::pair(cell.system, cell.contender)));
      // processes serve all timesteps of a system
      if (sessions.insert({cell.system, cell.contender}).second) timing += start * campaign.timing.processes;
      continue;
    }
    if (cell.worlds > 0) {
      timing += batch_seconds(campaign, step_s, cell.worlds);
      continue;
    }
    const double seconds = start + step_s * static_cast<double>(cell.steps);
    if (is_timed(cell)) {
      timing += seconds * std::clamp(std::ceil(kScalingEnoughSeconds / seconds), 1.0, 1.0 * kScalingMostRuns);
      continue;
    }
    accuracy += seconds;
    longest = std::max(longest, seconds);
  }
  return std::max(longest, accuracy / std::max(1, jobs)) + timing;
}

}  // namespace assay
