// Jobs of the accuracy pass: runs from the initial state, the truth, pieces, agreement.
#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
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

using nlohmann::json;

namespace {

// ---- runs from the initial state --------------------------------------------------------------------------------------

// The verdict on a run that is read from its file: it was stored because it came to its end.
Verdict judge(const Subject& subject, const Trajectory& trajectory) {
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

json truth_cell(const Subject& subject, const Run& run, const Trajectory& truth, double steps) {
  if (run.verdict.outcome == Outcome::kDiverged) return cell_json("truth", run.verdict);
  const double error = position_error(run.trajectory.states.back(), truth.states.back());
  double extent = 0;
  for (const State& state : truth.states) {
    for (const BodyState& body : state.bodies) extent = std::max(extent, body.p_WBcm.cwiseAbs().maxCoeff());
  }
  const double rounding = rounding_error(subject.capabilities.precision == Precision::kSingle, extent, steps);
  return cell_json("truth", run.verdict,
                   {value_json("truth_error", "m", error), value_json("truth_rounding", "m", rounding)});
}

json run_cell(const RunMeasure& measure, const Subject& subject, const Run& run, std::uint64_t seed) {
  const std::string name(measure.name);
  if (run.verdict.outcome == Outcome::kDiverged) return cell_json(name, run.verdict);
  json values = json::array();
  for (const RunValue& value :
       measure.values({subject.model, run.trajectory.states, subject.control->is_zero(), seed})) {
    values.push_back(value_json(value.name, value.unit, value.value, value.low, value.high));
  }
  return cell_json(name, run.verdict, std::move(values));
}

// A run that diverges has not held, whether or not the object had left the hand before.
json grasp_cell(const Run& run, const json& bodies) {
  const Grasp found =
      grasp(run.trajectory.states, bodies.at("object"), bodies.at("hand"), bodies.at("drop_m").get<double>());
  const bool ended = run.verdict.outcome != Outcome::kDiverged;
  json values = {value_json("grasp_held", "1", ended && found.held() ? 1 : 0)};
  if (ended) values.push_back(value_json("grasp_slip", "m", found.slip));
  if (found.dropped_at) {
    values.push_back(value_json("drop_time", "s", *found.dropped_at - run.trajectory.states.front().time));
  }
  return cell_json("grasp", run.verdict, std::move(values));
}

}  // namespace

// {"timestep_ms", "measures", "save": address or "", "use": address or "", "truth": address or "", "trajectories",
// "seed", "grasp": {"object", "hand", "drop_m"}, "partial": save what diverges too, as far as it went}
json do_run(const json& job) {
  const Subject subject = subject_of(job);
  const std::vector<std::string> measures = job.at("measures");
  const double timestep_ms = job.at("timestep_ms"), sample_ms = job.at("sample_ms"), duration_s = job.at("duration_s");
  const std::string dir = job.at("trajectories"), saved = job.at("save"), used = job.at("use");
  const long long per_sample = std::llround(sample_ms / timestep_ms);
  const long long samples = std::llround(1000 * duration_s / sample_ms);
  json cells = json::array();
  Run run;
  try {
    check_supported(subject, 1e-3 * timestep_ms);
    if (!used.empty()) {
      run.trajectory = load(dir, used);
      run.verdict = judge(subject, run.trajectory);
    } else {
      run = run_sampled(subject, subject.model.initial, timestep_ms, samples, per_sample);
    }
  } catch (const UnsupportedError& error) {
    run.verdict = {Outcome::kUnsupported, error.what()};
  } catch (const EngineError& error) {
    run.verdict = {Outcome::kCrashed, fmt::format("the engine failed to start: {}", error.what())};
  }
  const bool ended = run.verdict.outcome == Outcome::kOk || run.verdict.outcome == Outcome::kUnstable;
  const bool partial = job.value("partial", false) && !run.trajectory.states.empty();
  if ((ended || partial) && !saved.empty()) save(dir, saved, run.trajectory);
  for (const std::string& measure : measures) {
    const bool ran = ended || run.verdict.outcome == Outcome::kDiverged;
    if (measure == "reference" || !ran) {
      cells.push_back(cell_json(measure, run.verdict));
    } else if (measure == "truth") {
      cells.push_back(truth_cell(subject, run, load(dir, job.at("truth")), static_cast<double>(samples * per_sample)));
    } else if (measure == "grasp") {
      cells.push_back(grasp_cell(run, job.at("grasp")));
    } else {
      const RunMeasure* of_run = find_run_measure(measure);
      if (of_run == nullptr) throw InputError(fmt::format("no measure '{}' reads a run", measure));
      cells.push_back(run_cell(*of_run, subject, run, job.at("seed").get<std::uint64_t>()));
    }
  }
  return answer_json(std::move(cells), run.engine_s);
}

// The truth itself: no engine takes part.
json do_truth(const json& job) {
  const Model model = model_of(job);
  const std::string dir = job.at("trajectories"), address = job.at("save");
  Trajectory truth;
  truth.states = {model.initial,
                  smooth_solution(model, model.initial, model.initial.time + job.at("duration_s").get<double>())};
  save(dir, address, truth);
  return answer_json(json::array(), 0);
}

// ---- consistency ----------------------------------------------------------------------------------------------------

// {"timestep_ms", "reference", "pieces", "piece_ms", "reference_ms", "seed", "trajectories"}
json do_pieces(const json& job) {
  const Subject subject = subject_of(job);
  const double timestep_ms = job.at("timestep_ms"), sample_ms = job.at("sample_ms"), piece_ms = job.at("piece_ms");
  const Trajectory reference = load(job.at("trajectories"), job.at("reference"));
  const auto total = static_cast<long long>(reference.states.size()) - 1;
  const long long samples = std::llround(piece_ms / sample_ms);
  const long long per_sample = std::llround(sample_ms / timestep_ms);
  Verdict verdict;
  std::vector<double> errors;
  double engine_s = 0;
  int piece = 0;
  try {
    check_supported(subject, 1e-3 * timestep_ms);
    for (const long long start : piece_starts(total, samples, job.at("pieces"))) {
      ++piece;
      const Run run =
          run_sampled(subject, reference.states[static_cast<size_t>(start)], timestep_ms, samples, per_sample);
      engine_s += run.engine_s;
      if (run.verdict.outcome != Outcome::kOk && verdict.outcome != Outcome::kDiverged) {
        verdict = {run.verdict.outcome, fmt::format("piece {}, {}", piece, run.verdict.reason)};
      }
      if (run.verdict.outcome == Outcome::kDiverged) break;
      errors.push_back(
          position_error(run.trajectory.states.back(), reference.states[static_cast<size_t>(start + samples)]));
    }
  } catch (const UnsupportedError& error) {
    verdict = {Outcome::kUnsupported, error.what()};
  } catch (const EngineError& error) {
    verdict = {Outcome::kCrashed, fmt::format("piece {}: the engine failed to start: {}", piece, error.what())};
  }
  json values = json::array();
  json series = json::object();
  if (verdict.outcome == Outcome::kOk || verdict.outcome == Outcome::kUnstable) {
    const Interval error = bootstrap_mean(errors, job.at("seed").get<std::uint64_t>());
    values.push_back(value_json("consistency", "m", error.value, error.low, error.high));
    if (std::abs(timestep_ms - job.at("reference_ms").get<double>()) <= 1e-9 * timestep_ms) {
      values.push_back(value_json("restart_floor", "m", error.value, error.low, error.high));
    }
    series["piece_error_m"] = errors;
  }
  return answer_json({cell_json("consistency", verdict, std::move(values), std::move(series))}, engine_s);
}

// ---- agreement --------------------------------------------------------------------------------------------------------

// {"own": address, "others": [{"name", "address"}], "trajectories"}
json do_agreement(const json& job) {
  const std::string dir = job.at("trajectories");
  const Trajectory own = load(dir, job.at("own"));
  std::vector<double> time;
  time.reserve(own.states.size());
  for (const State& state : own.states) time.push_back(state.time);
  const double duration_s = time.back() - time.front();
  // enough for a plot
  constexpr size_t kMostSamples = 64;
  const size_t stride = (time.size() + kMostSamples - 1) / kMostSamples;
  const auto thinned = [&](const std::vector<double>& series) {
    std::vector<double> kept;
    kept.reserve(kMostSamples);
    for (size_t i = 0; i < series.size(); i += stride) kept.push_back(series[i]);
    return kept;
  };
  json series = json::object();
  std::vector<double> at_end, parted;
  for (const json& other : job.at("others")) {
    const std::vector<double> apart = distances(own.states, load(dir, other.at("address")).states);
    const std::string name = other.at("name");
    at_end.push_back(apart.back());
    parted.push_back(parting_time(time, apart).value_or(duration_s));
    series["distance_m " + name] = thinned(apart);
    series["parting_time_s " + name] = {parted.back()};
  }
  json values = json::array();
  if (!at_end.empty()) {
    series["time_s"] = thinned(time);
    values.push_back(value_json("agreement", "m", median(at_end)));
    values.push_back(value_json("parting_time", "s", median(parted)));
  }
  return answer_json({cell_json("agreement", {}, std::move(values), std::move(series))}, 0);
}

}  // namespace assay::jobs
