// The measure 'truth': the error of a run against the reference solution.
#include <algorithm>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "measures/accuracy.h"
#include "measures/contact_truth.h"
#include "measures/measure.h"
#include "measures/reference/certified.h"
#include "measures/reference/smooth.h"

namespace assay {
namespace {

// Whether the named solution is one of this model: it says so itself.
std::string solution_obstacle(const MeasuredSystem& system) {
  const CertifiedSolution* solution = find_certified_solution(system.solution);
  if (solution == nullptr) {
    std::vector<std::string> names;
    for (const CertifiedSolution& each : certified_solutions()) names.emplace_back(each.name);
    return fmt::format("names the solution '{}', which does not exist{}: there are {}", system.solution,
                       did_you_mean(system.solution, names), join(names, ", "));
  }
  if (!system.passive) {
    return fmt::format("has the solution '{}', which is of a passive motion: leave its control out", system.solution);
  }
  try {
    constexpr double kMoments = 128;  // of the run, at which it says whether it holds
    solution->solve(system.model,
                    sample_times(system.model.initial.time, system.duration_s, 1000 * system.duration_s / kMoments));
  } catch (const InputError& error) {
    return fmt::format("cannot be measured against its solution: {}; '{}' is of {}", error.what(), solution->name,
                       solution->about);
  }
  return "";
}

std::string truth_obstacle(const MeasuredSystem& system) {
  if (system.has_solution_file) return "";
  if (!system.solution.empty()) return solution_obstacle(system);
  const std::string obstacle = smooth_obstacle(system.model);
  if (obstacle.empty() && system.passive) return "";
  return fmt::format(
      "cannot be measured against the truth, which needs a smooth, passive motion: {}; leave 'truth' out of its "
      "measures, or name a certified 'solution' of it",
      obstacle.empty() ? "its control is not passive" : obstacle);
}

// Events and impulses came with version 1 of certified solutions.
std::vector<Parameter> truth_parameters(const MeasuredSystem& system) {
  if (system.solution.empty() || system.has_solution_file) return {};
  return {1};
}

void add_contact_values(const MeasuredRun& run, std::vector<Value>& values) {
  const CertifiedMotion& certified = *run.certified;
  if (!certified.events.empty()) {
    const EventErrors events = event_errors(certified.events, *run.instants);
    if (events.found > 0) {
      values.push_back({"event_time_error", "ms", events.largest});
      values.push_back({"event_lag", "ms", events.mean});
    }
    values.push_back({"missed_events", "1", events.missed});
  }
  const ImpulseErrors impulses = impulse_errors(certified.impulses, certified.states, *run.instants);
  if (impulses.normal) values.push_back({"normal_impulse_error", "1", impulses.normal});
  if (impulses.tangential) values.push_back({"tangential_impulse_error", "1", impulses.tangential});
}

Measured truth_values(const MeasuredRun& run) {
  const ErrorOverTime error = error_over_time(run.states, *run.other);
  double extent = 0;
  for (const State& state : *run.other) {
    for (const BodyState& body : state.bodies) extent = std::max(extent, body.p_WBcm.cwiseAbs().maxCoeff());
  }
  const double rounding = rounding_error(run.single_precision, extent, static_cast<double>(run.steps));
  Measured measured = {{{"truth_error_max", "m", error.largest},
                        {"truth_error_rms", "m", error.rms},
                        {"truth_error", "m", error.at_end},
                        {"truth_rounding", "m", rounding}}};
  if (run.certified != nullptr) add_contact_values(run, measured.values);
  return measured;
}

}  // namespace

Measure truth_measure() {
  using namespace rows;
  return {
      .name = "truth",
      .reads = Reads::kSolution,
      .values =
          {{"truth_error_max", "m", "Error against the reference solution", "error", kLow, kPlot, kLimit,
            "mean distance of the bodies from an independent solution, certified or error-controlled, the "
            "largest of the run's samples",
            0},
           {"truth_error_rms", "m", "Error against the reference solution, RMS", "error (RMS)", kLow, kPlot, kLimit,
            "mean distance of the bodies from an independent solution, certified or error-controlled, root mean "
            "square over the run",
            0},
           {"truth_error", "m", "Error against the reference solution, at the end", "error at the end", kLow, kPlot,
            kLimit,
            "mean distance of the bodies from an independent solution, certified or error-controlled, at the end "
            "of the run",
            0},
           {"truth_floor", "m", "Error floor", "error floor", kNone, kNo, kNo,
            "error that stays however small the timestep, far above rounding: not an integration error", 12},
           {"truth_rounding", "m", "Rounding part of the error", "rounding", kNone, kNo, kNo,
            "estimate of the part of the error against the reference solution that rounding explains", 12},
           {"truth_order", "1", "Observed order", "observed order", kNone, kNo, kNo,
            "slope of the error against the reference solution between this timestep and the next smaller one", 15},
           {"event_time_error", "ms", "Error of event times", "error of event times", kLow, kPlot, kLimit,
            "difference between the moments at which an event of a certified solution happens in the run and in "
            "the solution, the largest of those that happen",
            1},
           {"event_lag", "ms", "Lag of events", "lag of events", kNone, kNo, kNo,
            "how much later than in the certified solution events happen, in the mean; negative: earlier", 1},
           {"missed_events", "1", "Events that never happen", "missed events", kLow, kNo, kLimit,
            "events of a certified solution that do not happen until the end of the run", 1},
           {"normal_impulse_error", "1", "Error of normal impulses", "error of normal impulses", kLow, kPlot, kLimit,
            "normal impulses of contacts and limits over parts of the run, by the balance of momentum: distance "
            "from those of a certified solution over their size",
            1},
           {"tangential_impulse_error", "1", "Error of tangential impulses", "error of tangential impulses", kLow,
            kPlot, kLimit,
            "tangential impulses of contacts and dry friction over parts of the run, by the balance of momentum: "
            "distance from those of a certified solution over their size",
            1},
           {"event_time_order", "1", "Observed order of event times", "order of event times", kNone, kNo, kNo,
            "slope of the error of event times between this timestep and the next smaller one", 15},
           {"event_time_floor", "ms", "Floor of event times", "floor of event times", kNone, kNo, kNo,
            "error of event times that stays however small the timestep", 12},
           {"normal_impulse_order", "1", "Observed order of normal impulses", "order of normal impulses", kNone, kNo,
            kNo, "slope of the error of normal impulses between this timestep and the next smaller one", 15},
           {"normal_impulse_floor", "1", "Floor of normal impulses", "floor of normal impulses", kNone, kNo, kNo,
            "error of normal impulses that stays however small the timestep", 12},
           {"tangential_impulse_order", "1", "Observed order of tangential impulses", "order of tangential impulses",
            kNone, kNo, kNo, "slope of the error of tangential impulses between this timestep and the next smaller one",
            15},
           {"tangential_impulse_floor", "1", "Floor of tangential impulses", "floor of tangential impulses", kNone, kNo,
            kNo, "error of tangential impulses that stays however small the timestep", 12}},
      .obstacle = truth_obstacle,
      .parameters = truth_parameters,
      .of_run = truth_values};
}

}  // namespace assay
