#include "campaign/plan.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <tuple>
#include <variant>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/hash.h"
#include "base/json.h"
#include "base/text.h"
#include "campaign/shards.h"
#include "engines/batch.h"
#include "measures/batch.h"
#include "measures/measure.h"

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

// Makes the cells of one system's contenders.
class SystemPlanner {
 public:
  SystemPlanner(const Campaign& campaign, int index, std::vector<PlannedCell>& cells)
      : campaign_(campaign),
        index_(index),
        system_(campaign.systems[static_cast<size_t>(index)]),
        control_(make_control(system_.model, system_.control)->description()),
        states_(system_.initial_states.count),
        // timings start from states of it, too
        has_fine_run_(system_.has(Reads::kPieces) || system_.has(Reads::kSteps) || system_.has(Reads::kFineRuns)),
        measures_(system_.measures),
        cells_(cells) {
    const auto order = [](const Measure* measure) {
      return shares_runs(measure->reads) ? Reads::kRun : measure->reads;
    };
    std::ranges::stable_sort(measures_, {}, order);
    for (int state = 0; system_.trained_in >= 0 && state < states_; ++state) {
      trained_in_.push_back(fine_run(of(system_.trained_in), state));
    }
    if (states_ > 1) from_states_ = initial_states_content(system_.initial_states);
    if (!system_.has(Reads::kFineRuns)) return;
    for (const int c : system_.contenders) {
      if (of(c).absent.empty() && !of(c).twin) compared_.push_back({of(c).resolved.name, fine_run(of(c))});
    }
  }

  void plan() {
    for (const int c : system_.contenders) {
      if (of(c).absent.empty()) plan_contender(c);
    }
  }

 private:
  const CampaignContender& of(int contender) const { return campaign_.contenders[static_cast<size_t>(contender)]; }

  void plan_contender(int index) {
    contender_index_ = index;
    contender_ = &of(index);
    fine_run_ = fine_run(*contender_);
    fine_ms_ = system_.reference_of(*contender_);
    other_states_.clear();
    for (int state = 1; state < states_; ++state) other_states_.push_back(fine_run(*contender_, state));
    made_.clear();
    if (has_fine_run_ && !contender_->twin) plan_fine_run(*find_measure(kFineRunCell));
    for (const Measure* measure : measures_) {
      // a twin shares the runs of the contender that it is one with
      if (!contender_->twin || measure->reads == Reads::kSteps) plan_measure(*measure);
    }
  }

  void plan_measure(const Measure& measure) {
    switch (measure.reads) {
      case Reads::kFineRun:
        break;  // which is no measure of a system
      case Reads::kPieces:
        return plan_pieces(measure);
      case Reads::kSolution:
      case Reads::kRun:
      case Reads::kRunPairs:
        return plan_runs(measure);
      case Reads::kFineRuns:
        return plan_fine_runs(measure);
      case Reads::kWholeRuns:
        return plan_whole_runs(measure);
      case Reads::kSteps:
        return plan_steps(measure);
      case Reads::kWorlds:
        return plan_worlds(measure);
    }
  }

  // ---- content: what decides the result of a cell or a run ----

  nlohmann::json run(double timestep_ms) const {
    return run_content(system_, control_, *contender_, timestep_ms, system_.sample_ms);
  }

  // The address of a fine-step run.
  std::string fine_run(const CampaignContender& contender, int state = 0) const {
    nlohmann::json content =
        run_content(system_, control_, contender, system_.reference_of(contender), system_.grid_ms());
    const InitialStates& states = system_.initial_states;
    // how many there are does not change one of them
    if (state > 0) content["initial_state"] = initial_states_content({state, states.seed, states.around});
    return content_hash(dump_json(content));
  }

  // The measure's version, then what it reads depends on, then its own parameters.
  nlohmann::json parameters(const Measure& measure, const nlohmann::json& of_what_it_reads = nullptr) const {
    nlohmann::json all;
    if (measure.version > 0) all.push_back(measure.version);
    for (const nlohmann::json& each : of_what_it_reads) all.push_back(each);
    if (measure.parameters == nullptr) return all;
    const MeasuredSystem asked = {.model = system_.model,
                                  .grasp = system_.grasp,
                                  .solution = system_.solution,
                                  .has_solution_file = !system_.solution_hash.empty()};
    for (const Parameter& each : measure.parameters(asked)) {
      std::visit([&](const auto& number) { all.push_back(number); }, each);
    }
    return all;
  }

  PlannedCell& add(const Measure& measure, const std::string& stored, double timestep_ms, const std::string& trajectory,
                   long long steps, const nlohmann::json& of_what_it_reads = nullptr) {
    nlohmann::json content = {
        {"run", run(timestep_ms)},           {"system", system_.name},
        {"name", contender_->resolved.name}, {"measure", stored},
        {"limit_s", campaign_.time_limit_s}, {"parameters", parameters(measure, of_what_it_reads)}};
    if (!from_states_.is_null() && takes_all_states(measure.reads)) content["initial_states"] = from_states_;
    cells_.push_back({.key = content_hash(dump_json(content)),
                      .system = index_,
                      .contender = contender_index_,
                      .timestep_ms = timestep_ms,
                      .measure = stored,
                      .reads = measure.reads,
                      .trajectory = trajectory,
                      .steps = steps});
    return cells_.back();
  }
  PlannedCell& add(const Measure& measure, double timestep_ms, const std::string& trajectory, long long steps,
                   const nlohmann::json& of_what_it_reads = nullptr) {
    return add(measure, std::string(measure.name), timestep_ms, trajectory, steps, of_what_it_reads);
  }

  // The address under which a cell keeps something of its runs.
  static std::string kept_as(const nlohmann::json& content) { return content_hash(dump_json(content)); }

  long long run_steps(double timestep_ms) const { return steps_of(system_.duration_s * 1000, timestep_ms); }

  // ---- cells, by what they read ----

  void plan_fine_run(const Measure& measure) {
    const int runs = system_.has(Reads::kPieces) ? states_ : 1;
    add(measure, fine_ms_, fine_run_, runs * run_steps(fine_ms_)).runs = runs;
  }

  void plan_pieces(const Measure& measure) {
    for (const double timestep : system_.timesteps_of(measure)) {
      // a run with smaller steps than the fine-step run's has none
      if (timestep < fine_ms_ * (1 - 1e-9)) continue;
      nlohmann::json pieces = {system_.pieces, system_.piece_ms, fine_ms_, campaign_.seed};
      if (!system_.more_pieces_ms.empty()) pieces.push_back(system_.more_pieces_ms);
      PlannedCell& cell = add(measure, timestep, fine_run_, piece_steps(system_, timestep), pieces);
      cell.other_states = other_states_;
      cell.cold = kept_as({{"cold", measure.version},
                           {"runs", fine_run_},
                           {"other_states", other_states_},
                           {"sample_ms", system_.sample_ms},
                           {"pieces", system_.pieces},
                           {"piece_ms", system_.piece_ms},
                           {"more_pieces_ms", system_.more_pieces_ms}});
    }
  }

  // Measures of one run a timestep: the first of them makes it.
  void plan_runs(const Measure& measure) {
    const bool compares = measure.reads == Reads::kRunPairs && !trained_in_.empty();
    nlohmann::json pair;
    if (measure.reads == Reads::kRunPairs) pair.push_back(compares ? trained_in_.front() : "");
    const bool has_pieces = system_.has(Reads::kPieces);
    for (const double timestep : system_.timesteps_of(measure)) {
      const bool is_fine_run = has_fine_run_ && same_timestep(timestep, fine_ms_);
      const bool from_all = states_ == 1 || takes_all_states(measure.reads);
      const bool first = from_all ? made_.insert(timestep).second : !made_.contains(timestep);
      // of the states' runs at the fine timestep only the first exists where there are no pieces
      const long long runs = from_all ? states_ : 1;
      const long long by_fine_run = has_pieces ? runs : 1;
      const long long there = is_fine_run ? by_fine_run : 0;
      PlannedCell& cell =
          add(measure, timestep, is_fine_run ? fine_run_ : "", first ? (runs - there) * run_steps(timestep) : 0, pair);
      if (compares) cell.against = trained_in_;
      if (measure.reads == Reads::kRunPairs && !has_fine_run_ && same_timestep(timestep, system_.reference_ms)) {
        cell.keep =
            kept_as({{"shown", 1}, {"run", run(timestep)}, {"from", from_states_}, {"state", system_.shown_state()}});
      }
      if (is_fine_run && from_all && has_pieces) cell.other_states = other_states_;
    }
  }

  // What it gives depends on which contenders are compared.
  void plan_fine_runs(const Measure& measure) { add(measure, fine_ms_, fine_run_, 0, compared_); }

  void plan_whole_runs(const Measure& measure) {
    for (const double timestep : system_.timesteps_of(measure)) {
      PlannedCell& cell = add(measure, timestep, "", run_steps(timestep));
      if (has_fine_run_ && same_timestep(timestep, fine_ms_)) continue;  // all its states are kept
      cell.final_state = kept_as({{"final_state", 1}, {"run", run(timestep)}});
    }
  }

  void plan_steps(const Measure& measure) {
    const TimingOptions& timing = campaign_.timing;
    const bool own = system_.states_of < 0;
    const CampaignContender& owner = own ? *contender_ : of(system_.states_of);
    const std::string states_from = fine_run(owner);
    for (const double timestep : system_.timesteps_of(measure)) {
      PlannedCell& cell = add(measure, timestep, states_from, 0,
                              {timing.rounds, timing.batch_ms, timing.windows, timing.warmup, timing.processes,
                               system_.reference_of(owner), campaign_.seed, own ? "" : states_from});
      if (!own || same_timestep(timestep, fine_ms_)) continue;
      cell.timed_run = kept_as({{"timed_run", 1}, {"run", run(timestep)}});
    }
  }

  void plan_worlds(const Measure& measure) {
    const TimingOptions& timing = campaign_.timing;
    // an engine that steps one world does so in processes of the machine, whatever the device
    const bool many = batch_engine(contender_->resolved.engine) != nullptr;
    const std::string device = many ? campaign_.device : "cpu";
    for (const double timestep : system_.timesteps_of(measure)) {
      for (const int worlds : system_.worlds) {
        PlannedCell& cell = add(measure, batch_name({worlds, device}), timestep, "", 0,
                                {initial_states_content(system_.initial_states), timing.rounds, timing.batch_ms,
                                 timing.warmup, campaign_.seed});
        cell.worlds = worlds;
        cell.device = device;
      }
    }
  }

  const Campaign& campaign_;
  int index_;
  const CampaignSystem& system_;
  std::string control_;
  int states_;
  bool has_fine_run_;
  std::vector<const Measure*> measures_;  // in the order of their cells
  std::vector<std::string> trained_in_;   // fine-step runs of that contender, from each state
  nlohmann::json from_states_;            // what several initial states add to a cell's content
  nlohmann::json compared_ = nlohmann::json::array();
  std::vector<PlannedCell>& cells_;

  // Of the contender under way.
  int contender_index_ = 0;
  const CampaignContender* contender_ = nullptr;
  std::string fine_run_;  // its address
  double fine_ms_ = 0;
  std::vector<std::string> other_states_;  // fine-step runs from the other initial states
  std::set<double> made_;                  // timesteps whose runs from all states a cell makes
};

}  // namespace

Plan make_plan(const Campaign& campaign, int shards, ShardCells cells) {
  Plan plan;
  for (size_t s = 0; s < campaign.systems.size(); ++s) {
    SystemPlanner(campaign, static_cast<int>(s), plan.cells).plan();
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
    if (cell.reads == Reads::kSteps) {
      timing += timing_seconds(campaign, step_s,
                               at_least(kNativeInstance, starts.instance_s, std::pair(cell.system, cell.contender)));
      // processes serve all timesteps of a system
      if (sessions.insert({cell.system, cell.contender}).second) timing += start * campaign.timing.processes;
      continue;
    }
    if (cell.reads == Reads::kWorlds) {
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
