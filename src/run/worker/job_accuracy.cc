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
#include "measures/agreement.h"
#include "measures/clusters.h"
#include "measures/grasp.h"
#include "measures/initial_states.h"
#include "measures/plausible.h"
#include "measures/rebound.h"
#include "measures/reference/smooth.h"
#include "measures/run_measures.h"
#include "measures/statistics.h"
#include "measures/transfer.h"
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

CellResult truth_cell(const Subject& subject, const Run& run, const Trajectory& truth, double steps) {
  if (run.ending.outcome == Outcome::kDiverged) return {"truth", run.ending, {}, {}};
  const ErrorOverTime error = error_over_time(run.trajectory.states, truth.states);
  double extent = 0;
  for (const State& state : truth.states) {
    for (const BodyState& body : state.bodies) extent = std::max(extent, body.p_WBcm.cwiseAbs().maxCoeff());
  }
  const double rounding = rounding_error(subject.capabilities.precision == Precision::kSingle, extent, steps);
  return {"truth",
          run.ending,
          {{"truth_error_max", "m", error.largest, {}, {}},
           {"truth_error_rms", "m", error.rms, {}, {}},
           {"truth_error", "m", error.at_end, {}, {}},
           {"truth_rounding", "m", rounding, {}, {}}},
          {}};
}

CellResult run_cell(const RunMeasure& measure, const Subject& subject, const Run& run, std::uint64_t seed) {
  CellResult cell = {std::string(measure.name), run.ending, {}, {}};
  if (run.ending.outcome == Outcome::kDiverged) return cell;
  for (RunValue& value : measure.values({subject.model, run.trajectory.states, subject.control->is_zero(), seed})) {
    cell.values.push_back({std::move(value.name), std::move(value.unit), value.value, value.low, value.high});
  }
  return cell;
}

void add_contacts(const Run& run, CellResult& cell) {
  if (!run.contacts) return;
  const ContactResiduals& of = *run.contacts;
  cell.values.push_back({"contact_depth", "m", of.depth, {}, {}});
  cell.values.push_back({"signorini_residual", "m/s", of.signorini, {}, {}});
  if (of.cone) cell.values.push_back({"cone_violation", "1", of.cone, {}, {}});
  if (of.dissipation) cell.values.push_back({"dissipation_residual", "m/s", of.dissipation, {}, {}});
}

// A run that diverges did not hold its object, even if the object was still in the hand.
CellResult grasp_cell(const Run& run, const GraspBodies& bodies) {
  const Grasp found = grasp(run.trajectory.states, bodies);
  const bool ended = run.ending.outcome != Outcome::kDiverged;
  CellResult cell = {"grasp", run.ending, {{"grasp_held", "1", ended && found.held() ? 1.0 : 0.0, {}, {}}}, {}};
  if (ended) cell.values.push_back({"grasp_slip", "m", found.slip, {}, {}});
  if (found.dropped_at) {
    cell.values.push_back({"drop_time", "s", *found.dropped_at - run.trajectory.states.front().time, {}, {}});
  }
  return cell;
}

void add_parting(CellResult& cell, double time_s, const FirstParting& first) {
  cell.samples.push_back({kPartingTimes, {time_s}});
  cell.samples.push_back({kPartingBodies, {static_cast<double>(first.body)}});
  cell.samples.push_back({kPartingJoints, {static_cast<double>(first.joint)}});
  cell.samples.push_back({kPartingContacts, {first.contact ? 1.0 : 0.0}});
}

// Of one state's run under a policy. A run that diverges has fallen then. `against` is a run of the contender that the
// policy was trained in, from the same state, or empty.
CellResult transfer_cell(const Subject& subject, const Run& run, const std::vector<State>& against, double duration_s) {
  const PolicyConfig& policy = *subject.control->policy();
  TransferTask task = {policy.base, policy.command, policy.fallen_height, policy.fallen_tilt, {}};
  for (const auto& [joint, range] : policy.joint_range) task.joints.push_back({joint, range.low, range.high});
  const std::vector<State>& states = run.trajectory.states;
  const Transfer found = transfer(subject.model, states, task, run.ending.outcome == Outcome::kDiverged);
  CellResult cell = {"transfer", run.ending, {}, {}};
  const auto add = [&](const char* name, const char* unit, const std::optional<double>& value) {
    if (value) cell.values.push_back({name, unit, value, {}, {}});
  };
  add("fall_rate", "1", found.fell_at ? 1.0 : 0.0);
  add("time_up", "s", found.up_s);
  add("velocity_error", "m/s", found.velocity_error);
  add("turning_error", "rad/s", found.turning_error);
  add("foot_slip", "m/s", found.foot_slip);
  const double ran_s = states.back().time - states.front().time;
  if (ran_s > 0) add("joint_power", "W", run.account.work / ran_s);
  if (run.account.policy_steps > 0) {
    add("policy_time", "us", 1e6 * run.account.policy_s / static_cast<double>(run.account.policy_steps));
  }
  if (against.size() > 1) {
    std::vector<double> time;
    const size_t count = std::min(states.size(), against.size());
    time.reserve(count);
    for (size_t i = 0; i < count; ++i) time.push_back(states[i].time - states.front().time);
    const std::vector<State> own(states.begin(), states.begin() + static_cast<std::ptrdiff_t>(count));
    const std::vector<State> other(against.begin(), against.begin() + static_cast<std::ptrdiff_t>(count));
    const auto parted = parting_time(time, distances(own, other));
    // a run that failed has parted then
    add("policy_parting_time", "s", parted.value_or(count < states.size() ? duration_s : time.back()));
    const auto first = first_parting(subject.model, own, other);
    add_parting(cell, first ? first->time_s : kNeverParted, first.value_or(FirstParting{0, -1, -1, false}));
  } else {
    add_parting(cell, kNotCompared, {0, -1, -1, false});
  }
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

// One measure's cells from several initial states as one: each value is the mean over the states with an interval, and
// the states' own numbers are its samples. Of a grasp the share that held is a probability, and a drop the earliest.
CellResult over_states(std::vector<CellResult> cells, std::uint64_t seed) {
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
      if (value.name == "grasp_held" || value.name == "fall_rate") {
        const auto held = static_cast<int>(std::ranges::count(numbers, 1.0));
        const Interval share = probability(held, static_cast<int>(cells.size()));
        all.values.push_back({value.name, value.unit, share.value, share.low, share.high});
      } else if (value.name == "drop_time") {
        all.values.push_back({value.name, value.unit, std::ranges::min(numbers), {}, {}});
      } else if (!diverged || cell.measure == "transfer") {
        all.values.push_back(mean_over_states(numbers, value, seed));
      }
    }
  }
  return all;
}

// The rebound of an impact at the system's scale with the contender's settings, beside how far its contacts give way.
// Empty where the system has no impacts, and where the engine cannot make them.
std::optional<Value> rebound_value(const Subject& subject, double timestep_ms, double& engine_s) {
  std::optional<ImpactProbe> probe = impact_probe(subject.model, 1e-3 * timestep_ms);
  if (!probe) return std::nullopt;
  Subject impacts;
  impacts.model = std::move(probe->model);
  impacts.control = passive_control();
  impacts.contender = subject.contender;
  impacts.capabilities = subject.capabilities;
  try {
    check_supported(impacts, 1e-3 * timestep_ms);
    const Run run = run_sampled(impacts, impacts.model.initial, timestep_ms, probe->steps, 1);
    engine_s += run.engine_s;
    if (run.ending.outcome == Outcome::kDiverged) return std::nullopt;
    return Value{"rebound", "1", rebound(run.trajectory.states), {}, {}};
  } catch (const UnsupportedError&) {
    return std::nullopt;
  } catch (const EngineError&) {
    return std::nullopt;
  }
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

}  // namespace

JobDone do_job(const RunJob& job) {
  const Subject subject = subject_of(job.subject);
  const std::string& dir = job.trajectories;
  const long long per_sample = std::llround(job.subject.sample_ms / job.timestep_ms);
  const long long samples = std::llround(1000 * job.subject.duration_s / job.subject.sample_ms);
  std::map<std::string, std::vector<CellResult>> found;  // by measure, of each state
  double engine_s = 0;
  const bool with_contacts =
      std::ranges::find(job.measures, "violation") != job.measures.end() && !subject.model.contacts.empty();
  for (int i = 0; i < job.states; ++i) {
    const std::string use = std::cmp_less(i, job.use.size()) ? job.use[static_cast<size_t>(i)] : "";
    Run run;
    try {
      check_supported(subject, 1e-3 * job.timestep_ms);
      if (!use.empty()) {
        run.trajectory = load(dir, use, subject.model);
        thin(run.trajectory.states, samples);
        run.ending = judge(subject, 1e-3 * job.timestep_ms, run.trajectory);
      } else {
        const Model& of = subject.unchanged ? *subject.unchanged : subject.model;
        const State start = initial_state(of, subject.states, job.state + i);
        run = run_sampled(
            subject, start, job.timestep_ms, samples, per_sample, with_contacts,
            draw_pushes(subject.pushes, job.state + i, job.subject.duration_s, 1e-3 * job.subject.push_sample_ms));
      }
    } catch (const UnsupportedError& error) {
      run.ending = {Outcome::kUnsupported, error.what()};
    } catch (const EngineError& error) {
      run.ending = {Outcome::kCrashed, fmt::format("the engine failed to start: {}", error.what())};
    }
    engine_s += run.engine_s;
    const bool ended = run.ending.outcome == Outcome::kOk || run.ending.outcome == Outcome::kUnstable;
    const bool partial = job.partial && !run.trajectory.states.empty();
    if ((ended || partial) && !job.save.empty()) {
      const std::string number = job.states > 1 ? fmt::format("-{}", job.state + i) : "";
      save(dir, job.save + number, run.trajectory);
    }
    // of a replay even what diverges is of use
    if (!job.keep.empty() && job.state + i == job.keep_state && run.trajectory.states.size() > 1) {
      save(dir, job.keep, run.trajectory);
    }
    for (const std::string& measure : job.measures) {
      std::vector<CellResult>& cells = found[measure];
      // the reference solution is that of the model's own initial state
      if (measure == "truth" && job.state + i > 0) continue;
      const bool ran = ended || run.ending.outcome == Outcome::kDiverged;
      if (measure == "reference" || !ran) {
        cells.push_back({measure, run.ending, {}, {}});
        if (measure == "transfer") add_parting(cells.back(), kNotCompared, {0, -1, -1, false});
      } else if (measure == "truth") {
        cells.push_back(truth_cell(subject, run, load(dir, job.truth, subject.model, samples + 1),
                                   static_cast<double>(samples * per_sample)));
      } else if (measure == "grasp") {
        cells.push_back(grasp_cell(run, job.grasp));
      } else if (measure == "transfer") {
        std::vector<State> against;
        if (std::cmp_less(i, job.against.size()) && !job.against[static_cast<size_t>(i)].empty()) {
          against = load(dir, job.against[static_cast<size_t>(i)], subject.model).states;
          thin(against, samples);
        }
        cells.push_back(transfer_cell(subject, run, against, job.subject.duration_s));
      } else {
        const RunMeasure* of_run = find_run_measure(measure);
        if (of_run == nullptr) throw InputError(fmt::format("no measure '{}' reads a run", measure));
        cells.push_back(run_cell(*of_run, subject, run, job.seed));
        if (measure == "violation" && ended) add_contacts(run, cells.back());
      }
    }
    if (run.ending.outcome == Outcome::kUnsupported) break;  // from every state
  }
  std::vector<CellResult> cells;
  cells.reserve(job.measures.size());
  for (const std::string& measure : job.measures) {
    CellResult& cell = cells.emplace_back(over_states(std::move(found[measure]), job.seed));
    if (measure != "violation" || cell.values.empty()) continue;
    if (auto value = rebound_value(subject, job.timestep_ms, engine_s)) cell.values.push_back(std::move(*value));
  }
  return job_done(std::move(cells), engine_s);
}

JobDone do_job(const TruthJob& job) {
  const Model model = model_of(job.model);
  Trajectory truth;
  const long long samples = std::llround(1000 * job.duration_s / job.sample_ms);
  std::vector<double> times;
  times.reserve(static_cast<size_t>(samples));
  for (long long i = 1; i <= samples; ++i) {
    times.push_back(model.initial.time + job.duration_s * static_cast<double>(i) / static_cast<double>(samples));
  }
  try {
    truth.states = smooth_solution(model, model.initial, times);
  } catch (const InputError& error) {
    // Of this model, and no reason to end the campaign.
    return job_done({{"truth", {Outcome::kUnsupported, error.what()}, {}, {}}}, 0);
  }
  truth.states.insert(truth.states.begin(), model.initial);
  save(job.trajectories, job.save, truth);
  return job_done({}, 0);
}

// ---- consistency ----------------------------------------------------------------------------------------------------

namespace {

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

// Whether `a` is a whole number of `b`, up to the rounding of decimal fractions.
bool is_multiple(double a, double b) {
  const double ratio = a / b;
  return ratio > 0.5 && std::abs(ratio - std::round(ratio)) <= 1e-9 * std::max(1.0, ratio);
}

// Errors of the pieces of one length.
struct PieceErrors {
  double length_ms = 0;
  std::vector<double> errors, states;
};

class Pieces {
 public:
  // Timesteps that the samples of the reference runs cannot resolve are compared at the system's own.
  Pieces(const PiecesJob& job, const Subject& subject)
      : job_(job),
        subject_(subject),
        sample_ms_(is_multiple(job.grid_ms, job.timestep_ms) ? job.grid_ms : job.subject.sample_ms) {
    const long long samples = std::llround(1000 * job.subject.duration_s / job.grid_ms);
    for (const std::string& address : job.references) {
      references_.push_back(load(job.trajectories, address, subject.model, samples + 1));
    }
    for (const double length : job.piece_ms) {
      if (is_multiple(length, sample_ms_)) lengths_.push_back({length, {}, {}});
    }
  }

  // The main length's pieces serve all shorter ones too: these end on the way. A longer one has as many pieces as take
  // about the same simulated time. Throws as Engine::create.
  void run() {
    const double main = job_.piece_ms.front();
    run_pieces(main, job_.pieces);
    for (const PieceErrors& each : lengths_) {
      if (each.length_ms <= main || ending_.outcome == Outcome::kDiverged) continue;
      run_pieces(each.length_ms,
                 std::clamp(static_cast<int>(std::llround(job_.pieces * main / each.length_ms)), 1, job_.pieces));
    }
  }

  const Ending& ending() const { return ending_; }
  double engine_s() const { return engine_s_; }
  const std::vector<PieceErrors>& lengths() const { return lengths_; }
  std::string where() const {
    if (references_.size() == 1) return fmt::format("piece {}", piece_);
    return fmt::format("piece {} (from initial state {})", piece_, state_ + 1);
  }

 private:
  void run_pieces(double length_ms, int count) {
    const bool main = length_ms == job_.piece_ms.front();
    const long long samples = std::llround(length_ms / sample_ms_);
    const long long stride = std::llround(sample_ms_ / job_.grid_ms);
    const long long per_sample = std::llround(sample_ms_ / job_.timestep_ms);
    const auto total = (static_cast<long long>(references_.front().states.size()) - 1) / stride;
    piece_ = 0;
    for (const Piece& piece : spread(total, samples, count, static_cast<int>(references_.size()))) {
      ++piece_;
      state_ = piece.state;
      const std::vector<State>& reference = references_[static_cast<size_t>(piece.state)].states;
      const auto at = [&](long long sample) -> const State& { return reference[static_cast<size_t>(stride * sample)]; };
      const Run run = run_sampled(subject_, at(piece.start), job_.timestep_ms, samples, per_sample);
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
        each.errors.push_back(position_error(run.trajectory.states[static_cast<size_t>(end)], at(piece.start + end)));
        each.states.push_back(piece.state);
      }
    }
  }

  const PiecesJob& job_;
  const Subject& subject_;
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
  CellResult cell = {"consistency", {}, {}, {}};
  try {
    check_supported(subject, 1e-3 * job.timestep_ms);
    pieces.run();
    cell.ending = pieces.ending();
  } catch (const UnsupportedError& error) {
    cell.ending = {Outcome::kUnsupported, error.what()};
  } catch (const EngineError& error) {
    cell.ending = {Outcome::kCrashed, fmt::format("{}: the engine failed to start: {}", pieces.where(), error.what())};
  }
  if (cell.ending.outcome == Outcome::kOk || cell.ending.outcome == Outcome::kUnstable) {
    for (const PieceErrors& each : pieces.lengths()) {
      const bool main = each.length_ms == job.piece_ms.front();
      // pieces of one motion depend on each other: where there are several motions, these are drawn
      const Interval error = job.references.size() == 1
                                 ? bootstrap_mean(each.errors, job.seed)
                                 : bootstrap_mean_of_groups(grouped(each.errors, each.states), job.seed);
      cell.values.push_back({main ? "consistency" : fmt::format("consistency_{}ms", shortest(each.length_ms)), "m",
                             error.value, error.low, error.high});
      if (main && same_timestep(job.timestep_ms, job.reference_ms)) {
        cell.values.push_back({"restart_floor", "m", error.value, error.low, error.high});
      }
      cell.samples.push_back(
          {main ? "piece_error_m" : fmt::format("piece_error_m {} ms", shortest(each.length_ms)), each.errors});
      if (job.references.size() > 1) {
        cell.samples.push_back(
            {main ? "piece_state" : fmt::format("piece_state {} ms", shortest(each.length_ms)), each.states});
      }
    }
  }
  return job_done({std::move(cell)}, pieces.engine_s());
}

// ---- agreement --------------------------------------------------------------------------------------------------------

JobDone do_job(const AgreementJob& job) {
  const Trajectory own = load(job.trajectories, job.own);
  std::vector<double> time;
  time.reserve(own.states.size());
  for (const State& state : own.states) time.push_back(state.time);
  const double duration_s = time.back() - time.front();
  // Enough for a plot.
  constexpr size_t kMostSamples = 64;
  const size_t stride = (time.size() + kMostSamples - 1) / kMostSamples;
  const auto thinned = [&](const std::vector<double>& series) {
    std::vector<double> kept;
    kept.reserve(kMostSamples);
    for (size_t i = 0; i < series.size(); i += stride) kept.push_back(series[i]);
    return kept;
  };
  CellResult cell = {"agreement", {}, {}, {}};
  std::vector<double> at_end, parted;
  for (const AgreementJob::Other& other : job.others) {
    const State& like = own.states.front();
    const std::vector<double> apart =
        distances(own.states, load(job.trajectories, other.address, like.bodies.size(), like.position.size()).states);
    at_end.push_back(apart.back());
    parted.push_back(parting_time(time, apart).value_or(duration_s));
    cell.samples.push_back({"distance_m " + other.name, thinned(apart)});
    cell.samples.push_back({"parting_time_s " + other.name, {parted.back()}});
  }
  if (!at_end.empty()) {
    cell.samples.push_back({"time_s", thinned(time)});
    cell.values = {{"agreement", "m", median(at_end), {}, {}}, {"parting_time", "s", median(parted), {}, {}}};
  }
  return job_done({std::move(cell)}, 0);
}

}  // namespace assay::jobs
