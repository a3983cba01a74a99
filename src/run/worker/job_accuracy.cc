// Jobs of the accuracy pass: runs from the initial state, reference solutions, pieces, agreement.
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "controls/policy_config.h"
#include "controls/work.h"
#include "measures/accuracy.h"
#include "measures/clusters.h"
#include "measures/initial_states.h"
#include "measures/measure.h"
#include "measures/plausible.h"
#include "measures/reference/certified.h"
#include "measures/reference/smooth.h"
#include "measures/statistics.h"
#include "measures/transfer.h"
#include "run/worker/failures.h"
#include "run/worker/job_parts.h"

namespace assay::jobs {

namespace {

// ---- runs from the initial state --------------------------------------------------------------------------------------

// How a run that is read from its file ended. It did not diverge, or it would not have been stored.
Ending judge(const Subject& subject, double timestep_s, const Trajectory& trajectory) {
  const double duration_s = trajectory.states.back().time - trajectory.states.front().time;
  const Plausibility plausibility(subject.model, trajectory.states.front(), duration_s,
                                  largest_work(subject.model, *subject.control, duration_s),
                                  arithmetic_of(subject.capabilities, timestep_s));
  for (const State& state : trajectory.states) {
    if (const std::string why = plausibility.impossibility(state); !why.empty()) {
      return {Outcome::kUnstable, fmt::format("at {:.4g} s: {}", state.time, why)};
    }
  }
  return {};
}

// A run that exists may have more samples than are wanted: every so many of them are kept.
void thin(std::vector<State>& states, long long samples) {
  const long long extra = (std::ssize(states) - 1) % samples;
  if (extra != 0 || std::ssize(states) <= samples) {
    throw SystemError(
        fmt::format("a kept run has {} states, which are no multiple of {} samples: remove the results' "
                    "trajectories and start the same command again",
                    states.size(), samples));
  }
  const auto stride = (states.size() - 1) / static_cast<size_t>(samples);
  if (stride <= 1) return;
  std::vector<State> kept;
  for (size_t i = 0; i < states.size(); i += stride) kept.push_back(std::move(states[i]));
  states = std::move(kept);
}

// Null where none is named.
const CertifiedSolution* certified_named(const std::string& name) {
  if (name.empty()) return nullptr;
  const CertifiedSolution* found = find_certified_solution(name);
  if (found == nullptr) throw InputError(fmt::format("no solution '{}'", name));
  return found;
}

// What the runs from a job's initial states have in common for measures.
struct RunContext {
  const RunJob& job;
  const Subject& subject;
  std::optional<TransferTask> task;  // of a policy
  long long samples = 0, steps = 0;
};

std::optional<TransferTask> task_of(const Subject& subject) {
  if (subject.control->policy() == nullptr) return std::nullopt;
  const PolicyConfig& policy = *subject.control->policy();
  TransferTask task = {policy.base, policy.command, policy.fallen_height, policy.fallen_tilt, {}};
  for (const auto& [joint, range] : policy.joint_range) task.joints.push_back({joint, range.low, range.high});
  return task;
}

// The cell of a measure of the run from initial state number `state` of the job.
CellResult run_cell(const Measure& measure, const RunContext& context, const Run& run, int state) {
  const auto& [job, subject, task, samples, steps] = context;
  CellResult cell = {std::string(measure.name), run.ending, {}, {}};
  const bool ended = run.ending.outcome == Outcome::kOk || run.ending.outcome == Outcome::kUnstable;
  const bool diverged = run.ending.outcome == Outcome::kDiverged;
  if (!ended && !diverged) cell.samples = measure.without_run;
  if (measure.of_run == nullptr || (!ended && (!diverged || !measure.of_failed_runs))) return cell;
  MeasuredRun seen = {subject.model, run.trajectory.states};
  seen.duration_s = job.subject.duration_s;
  seen.diverged = diverged;
  seen.passive = subject.control->is_zero();
  seen.seed = job.seed;
  seen.steps = steps;
  seen.single_precision = subject.capabilities.precision == Precision::kSingle;
  seen.grasp = job.grasp;
  if (run.contacts) seen.contacts = &*run.contacts;
  if (run.watched) seen.watched = &*run.watched;
  if (task) seen.task = &*task;
  seen.work_J = run.account.work;
  seen.policy_s = run.account.policy_s;
  seen.policy_steps = run.account.policy_steps;
  std::vector<State> other;
  if (measure.reads == Reads::kSolution) {
    other = load(job.trajectories, job.truth, subject.model, samples + 1).states;
    seen.other = &other;
  } else if (measure.reads == Reads::kRunPairs && std::cmp_less(state, job.against.size()) &&
             !job.against[static_cast<size_t>(state)].empty()) {
    other = load(job.trajectories, job.against[static_cast<size_t>(state)], subject.model).states;
    thin(other, samples);
    seen.other = &other;
  }
  std::optional<CertifiedMotion> certified;
  const CertifiedSolution* solution = measure.reads == Reads::kSolution ? certified_named(job.solution) : nullptr;
  if (solution != nullptr) {
    std::vector<double> times;
    for (const State& at : run.instants) times.push_back(at.time);
    try {
      seen.certified = &certified.emplace(solution->solve(subject.model, times));
      seen.instants = &run.instants;
    } catch (const InputError& error) {  // at an instant between the samples that were asked for before
      cell.ending = {Outcome::kUnsupported, error.what()};
      return cell;
    }
  }
  Measured measured = measure.of_run(seen);
  cell.values = std::move(measured.values);
  cell.samples = std::move(measured.samples);
  return cell;
}

// ---- several initial states ---------------------------------------------------------------------------------------------

// The worst of the endings, and from how many states it is.
Ending worst_of(const std::vector<CellResult>& cells) {
  Ending worst;
  size_t first = 0, count = 0;
  for (size_t i = 0; i < cells.size(); ++i) {
    const Ending& ending = cells[i].ending;
    if (ending.outcome == Outcome::kOk) continue;
    ++count;
    if (worst.outcome < ending.outcome) worst = ending, first = i;
  }
  if (count > 0 && cells.size() > 1) {
    worst.reason = fmt::format("{} of {} initial states (the first is number {}): {}", count, cells.size(), first + 1,
                               worst.reason);
  }
  return worst;
}

// The numbers that the states' cells have for a value.
std::vector<double> of_states(const std::vector<CellResult>& cells, const std::string& name) {
  std::vector<double> numbers;
  for (const CellResult& cell : cells) {
    for (const Value& value : cell.values) {
      if (value.name == name && value.value) numbers.push_back(*value.value);
    }
  }
  return numbers;
}

Value mean_over_states(const std::vector<double>& numbers, const Value& like, std::uint64_t seed) {
  std::vector<std::vector<double>> groups;
  groups.reserve(numbers.size());
  for (const double number : numbers) groups.push_back({number});
  const Interval mean = bootstrap_mean_of_groups(groups, seed);
  return {like.name, like.unit, mean.value, mean.low, mean.high};
}

OverStates over_states_of(const Measure& measure, const std::string& value) {
  const auto row = std::ranges::find(measure.values, value, &ValueInfo::name);
  return row == measure.values.end() ? OverStates::kMean : row->over_states;
}

// One measure's cells from several initial states as one: each value is what its row says, with an interval, and the
// states' own numbers are its samples.
CellResult over_states(const Measure& measure, std::vector<CellResult> cells, std::uint64_t seed) {
  if (cells.size() == 1) return std::move(cells.front());
  CellResult all = {cells.front().measure, worst_of(cells), {}, {}};
  const bool diverged = all.ending.outcome == Outcome::kDiverged;
  std::vector<std::string> done;
  for (const CellResult& cell : cells) {
    for (const SampleSeries& of_state : cell.samples) {
      auto series = std::ranges::find(all.samples, of_state.name, &SampleSeries::name);
      if (series == all.samples.end()) series = all.samples.insert(series, {of_state.name, {}});
      series->values.insert(series->values.end(), of_state.values.begin(), of_state.values.end());
    }
    for (const Value& value : cell.values) {
      if (std::ranges::find(done, value.name) != done.end()) continue;
      done.push_back(value.name);
      const std::vector<double> numbers = of_states(cells, value.name);
      if (numbers.empty()) continue;
      all.samples.push_back({value.name + " of states", numbers});
      switch (over_states_of(measure, value.name)) {
        case OverStates::kShare: {
          const auto ones = static_cast<int>(std::ranges::count(numbers, 1.0));
          const Interval share = probability(ones, static_cast<int>(cells.size()));
          all.values.push_back({value.name, value.unit, share.value, share.low, share.high});
          break;
        }
        case OverStates::kLeast:
          all.values.push_back({value.name, value.unit, std::ranges::min(numbers)});
          break;
        case OverStates::kMean:
          if (diverged) break;
          [[fallthrough]];
        case OverStates::kMeanOfAll:
          all.values.push_back(mean_over_states(numbers, value, seed));
      }
    }
  }
  return all;
}

// The value of the measure's own experiment with the contender's settings. Empty where the system has none, and where
// the engine cannot make it.
std::optional<Value> experiment_value(const Measure& measure, const Subject& subject, double timestep_ms,
                                      double& engine_s) {
  std::optional<Experiment> made = measure.experiment(subject.model, 1e-3 * timestep_ms);
  if (!made) return std::nullopt;
  Subject own;
  own.model = std::move(made->model);
  own.control = passive_control();
  own.contender = subject.contender;
  own.capabilities = subject.capabilities;
  try {
    check_supported(own, 1e-3 * timestep_ms);
    const Run run = run_sampled(own, own.model.initial, timestep_ms, made->steps, 1);
    engine_s += run.engine_s;
    if (run.ending.outcome == Outcome::kDiverged) return std::nullopt;
    return measure.of_experiment(run.trajectory.states);
  } catch (const EngineError&) {
    return std::nullopt;
  }
}

std::vector<const Measure*> measures_of(const std::vector<std::string>& names) {
  std::vector<const Measure*> found;
  found.reserve(names.size());
  for (const std::string& name : names) {
    const Measure* measure = measure_of(name);
    if (measure == nullptr || (!shares_runs(measure->reads) && measure->reads != Reads::kFineRun)) {
      throw InputError(fmt::format("no measure '{}' reads a run", name));
    }
    found.push_back(measure);
  }
  return found;
}

}  // namespace

JobDone do_job(const RunJob& job) {
  const Subject subject = subject_of(job.subject);
  const std::string& dir = job.trajectories;
  const long long per_sample = std::llround(job.subject.sample_ms / job.timestep_ms);
  const long long samples = std::llround(1000 * job.subject.duration_s / job.subject.sample_ms);
  const std::vector<const Measure*> measures = measures_of(job.measures);
  std::map<const Measure*, std::vector<CellResult>> found;  // of each state
  const RunContext context = {job, subject, task_of(subject), samples, samples * per_sample};
  double engine_s = 0;
  Looks looks = {.seed = job.seed};
  looks.contacts = std::ranges::any_of(measures, &Measure::reads_contacts) && !subject.model.contacts.empty();
  const bool wanted = std::ranges::any_of(measures, &Measure::reads_between);
  looks.instants = !job.solution.empty();  // a kept run has only samples
  for (int i = 0; i < job.states; ++i) {
    const auto of_state = [&](const std::vector<std::string>& addresses) {
      return std::cmp_less(i, addresses.size()) ? addresses[static_cast<size_t>(i)] : "";
    };
    const std::string use = of_state(job.use), watched = of_state(job.watched);
    looks.between.reset();
    if (wanted || !watched.empty()) looks.between = job.grasp;
    Run run;
    try {
      check_supported(subject, 1e-3 * job.timestep_ms);
      // one that was made without what is wanted is made again
      if (!use.empty() && !watched.empty()) run.watched = load_watched(dir, watched);
      if (!use.empty() && (run.watched || !wanted) && !looks.instants) {
        run.trajectory = load(dir, use, subject.model);
        thin(run.trajectory.states, samples);
        run.ending = judge(subject, 1e-3 * job.timestep_ms, run.trajectory);
      } else {
        const Model& of = subject.unchanged ? *subject.unchanged : subject.model;
        const State start = initial_state(of, subject.states, job.state + i);
        run = run_sampled(
            subject, start, job.timestep_ms, samples, per_sample, looks,
            draw_pushes(subject.pushes, job.state + i, job.subject.duration_s, 1e-3 * job.subject.push_sample_ms));
      }
    } catch (const EngineError& error) {
      run.ending = failed_to_start(error);
    }
    engine_s += run.engine_s;
    const bool ended = run.ending.outcome == Outcome::kOk || run.ending.outcome == Outcome::kUnstable;
    const bool partial = job.partial && !run.trajectory.states.empty();
    if ((ended || partial) && !job.save.empty()) {
      const std::string number = job.states > 1 ? fmt::format("-{}", job.state + i) : "";
      save(dir, job.save + number, run.trajectory);
      if (run.watched && !watched.empty()) save_watched(dir, watched, *run.watched);
    }
    // of a replay even what diverges is of use
    if (!job.keep.empty() && job.state + i == job.keep_state && run.trajectory.states.size() > 1) {
      save(dir, job.keep, run.trajectory);
    }
    for (const Measure* measure : measures) {
      // the reference solution is that of the model's own initial state
      if (measure->reads == Reads::kSolution && job.state + i > 0) continue;
      found[measure].push_back(run_cell(*measure, context, run, i));
    }
    if (run.ending.outcome == Outcome::kUnsupported) break;  // from every state
  }
  std::vector<CellResult> cells;
  cells.reserve(measures.size());
  for (const Measure* measure : measures) {
    CellResult& cell = cells.emplace_back(over_states(*measure, std::move(found[measure]), job.seed));
    if (measure->experiment == nullptr || cell.values.empty()) continue;
    if (auto value = experiment_value(*measure, subject, job.timestep_ms, engine_s)) cell.values.push_back(*value);
  }
  return job_done(std::move(cells), engine_s);
}

JobDone do_job(const TruthJob& job) {
  const Model model = model_of(job.model);
  Trajectory truth;
  const std::vector<double> times = sample_times(model.initial.time, job.duration_s, job.sample_ms);
  try {
    const CertifiedSolution* certified = certified_named(job.solution);
    truth.states =
        certified != nullptr ? certified->solve(model, times).states : smooth_solution(model, model.initial, times);
  } catch (const InputError& error) {
    // Of this model, and no reason to end the campaign.
    return job_done({{kTruthJobCell, {Outcome::kUnsupported, error.what()}, {}, {}}}, 0);
  }
  truth.states.insert(truth.states.begin(), model.initial);
  save(job.trajectories, job.save, truth);
  return job_done({}, 0);
}

// ---- consistency ----------------------------------------------------------------------------------------------------

namespace {

// Of which pieces the share is given.
constexpr double kPieceLimit = 1e-3;  // m

struct Piece {
  int state = 0;        // number of the initial state whose reference run it is part of
  long long start = 0;  // sample of that run
};

// Spread evenly over the runs, each next one in the next state's.
std::vector<Piece> spread(long long total, long long length, int pieces, int states) {
  std::vector<Piece> all;
  for (const long long start : piece_starts(total, length, pieces)) {
    all.push_back({static_cast<int>(all.size()) % states, start});
  }
  return all;
}

const Measure& measure_named(const std::string& name) {
  const Measure* measure = measure_of(name);
  if (measure == nullptr) throw InputError(fmt::format("there is no measure '{}'", name));
  return *measure;
}

// Whether `a` is a whole number of `b`, up to the rounding of decimal fractions.
bool is_multiple(double a, double b) {
  const double ratio = a / b;
  return ratio > 0.5 && std::abs(ratio - std::round(ratio)) <= 1e-9 * std::max(1.0, ratio);
}

// The pieces of one length.
struct PieceErrors {
  double length_ms = 0;
  std::vector<double> warm, states;  // errors against the fine-step run; numbers of the initial states
  std::vector<State> ends;
  std::vector<double> cold;  // errors against the pieces at the fine-step run's timestep
};

class Pieces {
 public:
  // Pieces start at samples of the system, at every timestep at the same ones. They end at samples of the reference
  // runs, or of the system where these have more than the timestep can resolve.
  Pieces(const PiecesJob& job, const Subject& subject)
      : job_(job),
        subject_(subject),
        measure_(measure_named(job.measure)),
        sample_ms_(is_multiple(job.grid_ms, job.timestep_ms) ? job.grid_ms : job.subject.sample_ms) {
    const long long samples = std::llround(1000 * job.subject.duration_s / job.grid_ms);
    for (const std::string& address : job.references) {
      references_.push_back(load(job.trajectories, address, subject.model, samples + 1));
    }
    for (const double length : job.piece_ms) {
      if (is_multiple(length, sample_ms_)) lengths_.emplace_back().length_ms = length;
    }
  }

  // The main length's pieces serve all shorter ones too: these end on the way. A longer one has as many pieces as take
  // about the same simulated time. Throws as Engine::create.
  void run() {
    const double main = job_.piece_ms.front();
    run_pieces(main);
    for (const PieceErrors& each : lengths_) {
      if (each.length_ms <= main || ending_.outcome == Outcome::kDiverged) continue;
      run_pieces(each.length_ms);
    }
  }

  bool is_reference() const { return same_timestep(job_.timestep_ms, job_.reference_ms); }

  // Keeps where the pieces ended, or compares with what was kept: of each length in the job's order, one after the
  // other.
  void keep_or_compare() {
    if (ending_.outcome == Outcome::kDiverged || job_.cold.empty()) return;
    if (is_reference()) {
      Trajectory all;
      for (const PieceErrors& each : lengths_) {
        all.states.insert(all.states.end(), each.ends.begin(), each.ends.end());
      }
      // one after the other in time, as states of a trajectory are
      for (size_t i = 0; i < all.states.size(); ++i) all.states[i].time = static_cast<double>(i);
      save(job_.trajectories, job_.cold, all);
      return;
    }
    const Trajectory kept = load(job_.trajectories, job_.cold, subject_.model);
    size_t next = 0;
    for (const double length : job_.piece_ms) {
      const size_t count = static_cast<size_t>(count_of(length));
      const auto own = std::ranges::find(lengths_, length, &PieceErrors::length_ms);
      for (size_t i = 0; own != lengths_.end() && i < own->ends.size(); ++i) {
        own->cold.push_back(measure_.of_piece(own->ends[i], kept.states.at(next + i)));
      }
      next += count;
    }
    if (next != kept.states.size()) throw SystemError("the pieces at the reference's timestep are of other lengths");
  }

  const Ending& ending() const { return ending_; }
  double engine_s() const { return engine_s_; }
  const std::vector<PieceErrors>& lengths() const { return lengths_; }
  std::string where() const {
    if (references_.size() == 1) return fmt::format("piece {}", piece_);
    return fmt::format("piece {} (from initial state {})", piece_, state_ + 1);
  }

 private:
  int count_of(double length_ms) const {
    const double main = job_.piece_ms.front();
    if (length_ms <= main) return job_.pieces;
    return std::clamp(static_cast<int>(std::llround(job_.pieces * main / length_ms)), 1, job_.pieces);
  }

  void run_pieces(double length_ms) {
    const bool main = length_ms == job_.piece_ms.front();
    const double start_ms = job_.subject.sample_ms;
    const long long samples = std::llround(length_ms / sample_ms_);
    const long long stride = std::llround(sample_ms_ / job_.grid_ms);
    const long long per_start = std::llround(start_ms / job_.grid_ms);
    const long long per_sample = std::llround(sample_ms_ / job_.timestep_ms);
    const auto total = (static_cast<long long>(references_.front().states.size()) - 1) / per_start;
    piece_ = 0;
    for (const Piece& piece :
         spread(total, std::llround(length_ms / start_ms), count_of(length_ms), static_cast<int>(references_.size()))) {
      ++piece_;
      state_ = piece.state;
      const std::vector<State>& reference = references_[static_cast<size_t>(piece.state)].states;
      const auto at = [&](long long sample) -> const State& {
        return reference[static_cast<size_t>(per_start * piece.start + stride * sample)];
      };
      const Run run = run_sampled(subject_, at(0), job_.timestep_ms, samples, per_sample);
      engine_s_ += run.engine_s;
      if (run.ending.outcome != Outcome::kOk && ending_.outcome != Outcome::kDiverged) {
        ending_ = {run.ending.outcome,
                   fmt::format("{}{}, {}", where(), main ? "" : fmt::format(" of {} ms", shortest(length_ms)),
                               run.ending.reason)};
      }
      if (run.ending.outcome == Outcome::kDiverged) return;
      for (PieceErrors& each : lengths_) {
        if (main ? each.length_ms > length_ms : each.length_ms != length_ms) continue;
        const long long end = std::llround(each.length_ms / sample_ms_);
        each.ends.push_back(run.trajectory.states[static_cast<size_t>(end)]);
        each.warm.push_back(measure_.of_piece(each.ends.back(), at(end)));
        each.states.push_back(piece.state);
      }
    }
  }

  const PiecesJob& job_;
  const Subject& subject_;
  const Measure& measure_;
  std::vector<Trajectory> references_;
  double sample_ms_ = 0;
  std::vector<PieceErrors> lengths_;
  Ending ending_;
  double engine_s_ = 0;
  int piece_ = 0, state_ = 0;
};

}  // namespace

JobDone do_job(const PiecesJob& job) {
  const Subject subject = subject_of(job.subject);
  Pieces pieces(job, subject);
  CellResult cell = {job.measure, {}, {}, {}};
  try {
    check_supported(subject, 1e-3 * job.timestep_ms);
    pieces.run();
    pieces.keep_or_compare();
    cell.ending = pieces.ending();
  } catch (const EngineError& error) {
    cell.ending = failed_to_start(error, pieces.where());
  }
  if (cell.ending.outcome == Outcome::kOk || cell.ending.outcome == Outcome::kUnstable) {
    for (const PieceErrors& each : pieces.lengths()) {
      const bool main = each.length_ms == job.piece_ms.front();
      // pieces of one motion depend on each other: where there are several motions, these are drawn
      const auto groups = [&](const std::vector<double>& errors) {
        return job.references.size() == 1 ? std::vector<std::vector<double>>{errors} : grouped(errors, each.states);
      };
      const auto put = [&](const std::string& name, const std::string& unit, const Interval& of) {
        cell.values.push_back(
            {main ? name : fmt::format("{}_{}ms", name, shortest(each.length_ms)), unit, of.value, of.low, of.high});
      };
      const auto keep = [&](const std::string& name, const std::vector<double>& numbers) {
        cell.samples.push_back({main ? name : fmt::format("{} {} ms", name, shortest(each.length_ms)), numbers});
      };
      if (!each.cold.empty()) {
        put(job.measure + "_cold", "m", bootstrap_mean_of_groups(groups(each.cold), job.seed));
        put(job.measure + "_cold_median", "m", bootstrap_median_of_groups(groups(each.cold), job.seed));
        put(job.measure + "_cold_share", "1", share_within_of_groups(groups(each.cold), kPieceLimit, job.seed));
        keep("piece_cold_error_m", each.cold);
      }
      const Interval warm = bootstrap_mean_of_groups(groups(each.warm), job.seed);
      put(job.measure, "m", warm);
      if (main && pieces.is_reference()) {
        cell.values.push_back({"restart_floor", "m", warm.value, warm.low, warm.high});
      }
      keep("piece_error_m", each.warm);
      if (job.references.size() > 1) keep("piece_state", each.states);
    }
  }
  return job_done({std::move(cell)}, pieces.engine_s());
}

// ---- fine-step runs of all contenders --------------------------------------------------------------------------------------------------------

JobDone do_job(const AgreementJob& job) {
  const std::vector<State> own = load(job.trajectories, job.own).states;
  const State& like = own.front();
  std::vector<ComparedRuns::Other> others;
  others.reserve(job.others.size());
  for (const auto& [contender, address] : job.others) {
    others.push_back({contender, load(job.trajectories, address, like.bodies.size(), like.position.size()).states});
  }
  Measured measured = measure_named(job.measure).of_fine_runs({own, others});
  return job_done({{job.measure, {}, std::move(measured.values), std::move(measured.samples)}}, 0);
}

}  // namespace assay::jobs
