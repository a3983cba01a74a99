// Errors of positions against a reference, their order of convergence, and floors that do not depend on the timestep.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/model.h"

namespace assay {

// The times of a run's samples, s, but for its start: at `start` + k `sample_ms`, to the run's end.
std::vector<double> sample_times(double start, double duration_s, double sample_ms);

// Mean over bodies of the distance between their centres of mass, m. Both states belong to one model (assert).
double position_error(const State& a, const State& b);

// Position errors of a run's samples against a reference at the same moments, m. The first sample, from which both
// start, does not count. Both have the same number of states, at least 2 (assert).
struct ErrorOverTime {
  double at_end = 0, rms = 0, largest = 0;
};
ErrorOverTime error_over_time(const std::vector<State>& run, const std::vector<State>& reference);

// log(E(h2)/E(h1)) / log(h2/h1). Empty when an error is not positive and finite.
std::optional<double> observed_order(double h1, double error1, double h2, double error2);

// Largest position error that rounding explains: one unit in the last place of the system's extent, of the same sign in
// every step. `extent` is the largest coordinate that the run reaches, m.
double rounding_error(bool single_precision, double extent, double steps);

struct ErrorAt {
  double timestep_ms = 0;
  double error = 0;     // m
  double rounding = 0;  // rounding_error() of that run, m
};

// The error at which a curve stops falling: the largest at the smallest timesteps, when these lie within a factor
// of 1.3 of each other over a factor of at least 4 in the timestep. `curve` ascends in the timestep; points without a
// positive, finite error are ignored. Needs three points.
std::optional<double> plateau(const std::vector<ErrorAt>& curve);

// The part of the error that does not depend on the timestep: the error at the smallest timestep of a plateau that is
// more than 10 times what rounding explains.
std::optional<double> error_floor(const std::vector<ErrorAt>& curve);

// Start times of `pieces` pieces of `length` steps of the sample grid, spread evenly over `total` steps of it.
std::vector<long long> piece_starts(long long total, long long length, int pieces);

}  // namespace assay
