// Jobs of the accuracy pass: runs from the initial state, reference solutions, pieces, agreement.
#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "controls/work.h"
#include "measures/accuracy.h"
#include "measures/agreement.h"
#include "measures/grasp.h"
#include "measures/plausible.h"
#include "measures/run_measures.h"
#include "measures/statistics.h"
#include "reference/smooth.h"
#include "worker/job_parts.h"

namespace assay::jobs {

namespace {

// ---- runs from the initial state --------------------------------------------------------------------------------------

// How a run that is read from its file ended. It did not diverge, or it would not have been stored.
Ending judge(const Subject& subject, const Trajectory& trajectory) {
  const double duration_s = trajectory.states.back().time - trajectory.states.front().time;
  const Plausibility plausibility(subject.model, trajectory.states.front(), duration_s,
                                  largest_work(subject.model, *subject.control, duration_s));
  for (const State& state : trajectory.states) {
    if (const std::string why = plausibility.impossibility(state); !why.empty()) {
      return {Outcome::kUnstable, fmt::format("at {:.4g} s: {}", state.time, why)};
    }
  }
  return {};
}

CellResult truth_cell(const Subject& subject, const Run& run, const Trajectory& truth, double steps) {
  if (run.ending.outcome == Outcome::kDiverged) return {"truth", run.ending, {}, {}};
  const double error = position_error(run.trajectory.states.back(), truth.states.back());
  double extent = 0;
  for (const State& state : truth.states) {
    for (const BodyState& body : state.bodies) extent = std::max(extent, body.p_WBcm.cwiseAbs().maxCoeff());
  }
  const double rounding = rounding_error(subject.capabilities.precision == Precision::kSingle, extent, steps);
  return {"truth", run.ending, {{"truth_error", "m", error, {}, {}}, {"truth_rounding", "m", rounding, {}, {}}}, {}};
}

CellResult run_cell(const RunMeasure& measure, const Subject& subject, const Run& run, std::uint64_t seed) {
  CellResult cell = {std::string(measure.name), run.ending, {}, {}};
  if (run.ending.outcome == Outcome::kDiverged) return cell;
  for (RunValue& value : measure.values({subject.model, run.trajectory.states, subject.control->is_zero(), seed})) {
    cell.values.push_back({std::move(value.name), std::move(value.unit), value.value, value.low, value.high});
  }
  return cell;
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

}  // namespace

JobDone do_job(const RunJob& job) {
  const Subject subject = subject_of(job.subject);
  const std::string& dir = job.trajectories;
  const long long per_sample = std::llround(job.subject.sample_ms / job.timestep_ms);
  const long long samples = std::llround(1000 * job.subject.duration_s / job.subject.sample_ms);
  std::vector<CellResult> cells;
  Run run;
  try {
    check_supported(subject, 1e-3 * job.timestep_ms);
    if (!job.use.empty()) {
      run.trajectory = load(dir, job.use, subject.model, samples + 1);
      run.ending = judge(subject, run.trajectory);
    } else {
      run = run_sampled(subject, subject.model.initial, job.timestep_ms, samples, per_sample);
    }
  } catch (const UnsupportedError& error) {
    run.ending = {Outcome::kUnsupported, error.what()};
  } catch (const EngineError& error) {
    run.ending = {Outcome::kCrashed, fmt::format("the engine failed to start: {}", error.what())};
  }
  const bool ended = run.ending.outcome == Outcome::kOk || run.ending.outcome == Outcome::kUnstable;
  const bool partial = job.partial && !run.trajectory.states.empty();
  if ((ended || partial) && !job.save.empty()) save(dir, job.save, run.trajectory);
  for (const std::string& measure : job.measures) {
    const bool ran = ended || run.ending.outcome == Outcome::kDiverged;
    if (measure == "reference" || !ran) {
      cells.push_back({measure, run.ending, {}, {}});
    } else if (measure == "truth") {
      cells.push_back(
          truth_cell(subject, run, load(dir, job.truth, subject.model), static_cast<double>(samples * per_sample)));
    } else if (measure == "grasp") {
      cells.push_back(grasp_cell(run, job.grasp));
    } else {
      const RunMeasure* of_run = find_run_measure(measure);
      if (of_run == nullptr) throw InputError(fmt::format("no measure '{}' reads a run", measure));
      cells.push_back(run_cell(*of_run, subject, run, job.seed));
    }
  }
  return job_done(std::move(cells), run.engine_s);
}

JobDone do_job(const TruthJob& job) {
  const Model model = model_of(job.model);
  Trajectory truth;
  truth.states = {model.initial, smooth_solution(model, model.initial, model.initial.time + job.duration_s)};
  save(job.trajectories, job.save, truth);
  return job_done({}, 0);
}

// ---- consistency ----------------------------------------------------------------------------------------------------

JobDone do_job(const PiecesJob& job) {
  const Subject subject = subject_of(job.subject);
  const Trajectory reference = load(job.trajectories, job.reference, subject.model,
                                    std::llround(1000 * job.subject.duration_s / job.subject.sample_ms) + 1);
  const auto total = static_cast<long long>(reference.states.size()) - 1;
  const long long samples = std::llround(job.piece_ms / job.subject.sample_ms);
  const long long per_sample = std::llround(job.subject.sample_ms / job.timestep_ms);
  CellResult cell = {"consistency", {}, {}, {}};
  Ending& ending = cell.ending;
  std::vector<double> errors;
  double engine_s = 0;
  int piece = 0;
  try {
    check_supported(subject, 1e-3 * job.timestep_ms);
    for (const long long start : piece_starts(total, samples, job.pieces)) {
      ++piece;
      const Run run =
          run_sampled(subject, reference.states[static_cast<size_t>(start)], job.timestep_ms, samples, per_sample);
      engine_s += run.engine_s;
      if (run.ending.outcome != Outcome::kOk && ending.outcome != Outcome::kDiverged) {
        ending = {run.ending.outcome, fmt::format("piece {}, {}", piece, run.ending.reason)};
      }
      if (run.ending.outcome == Outcome::kDiverged) break;
      errors.push_back(
          position_error(run.trajectory.states.back(), reference.states[static_cast<size_t>(start + samples)]));
    }
  } catch (const UnsupportedError& error) {
    ending = {Outcome::kUnsupported, error.what()};
  } catch (const EngineError& error) {
    ending = {Outcome::kCrashed, fmt::format("piece {}: the engine failed to start: {}", piece, error.what())};
  }
  if (ending.outcome == Outcome::kOk || ending.outcome == Outcome::kUnstable) {
    const Interval error = bootstrap_mean(errors, job.seed);
    cell.values.push_back({"consistency", "m", error.value, error.low, error.high});
    if (same_timestep(job.timestep_ms, job.reference_ms)) {
      cell.values.push_back({"restart_floor", "m", error.value, error.low, error.high});
    }
    cell.samples = {{"piece_error_m", errors}};
  }
  return job_done({std::move(cell)}, engine_s);
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
