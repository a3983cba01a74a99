// Shared by the tests: a contender that can be run, the rule of convergence, and the verdict.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "conformance/conformance.h"
#include "engines/registry.h"
#include "model/model.h"

namespace assay::conformance {

// The worst of what a test found at one timestep; it passes when figure <= tolerance.
struct TimestepVerdict {
  double timestep = 0;  // s
  double figure = 0;
  double tolerance = 0;
  std::string note;
};

// The result of a test; it passes when figure <= tolerance.
struct Verdict {
  double figure = 0;
  double tolerance = 0;
  std::string unit;
  std::string note;
  // Of tests that run at several timesteps, the coarsest first: a deviation may be declared for some of them only.
  std::vector<TimestepVerdict> timesteps = {};
};

// Keeps the check with the largest figure relative to its tolerance, of all and of each timestep. All checks of a test
// share one unit, so that the bound of a declared deviation has a meaning.
class Checks {
 public:
  explicit Checks(std::string unit) { worst_.unit = std::move(unit); }
  void add(double figure, double tolerance, const std::string& what);
  // The same of a run with this timestep, s.
  void add_at(double timestep, double figure, double tolerance, const std::string& what);
  const Verdict& worst() const { return worst_; }

 private:
  Verdict worst_;
};

class Subject {
 public:
  // `long_series`: tests that have a longer version run that.
  explicit Subject(const ResolvedContender& contender, bool long_series = false)
      : contender_(contender), long_(long_series) {}

  bool is_long() const { return long_; }

  // Whether the contender's contacts were given a stiffness.
  bool is_compliant() const;
  // The contender with this compliance of its contacts (N/m, N s/m); nothing where it cannot have one.
  std::optional<ResolvedContender> with_compliance(double stiffness, double damping) const;
  // The contender with this coefficient of restitution; nothing where it has none.
  std::optional<ResolvedContender> with_restitution(double coefficient) const;

  Capabilities capabilities() const { return contender_.engine->capabilities(contender_.settings); }

  // Whether the contender declares a feature as exact, or at all.
  bool is_exact(Feature feature) const;
  bool accepts(Feature feature) const;

  // Whether the contender refuses something of this model by name.
  bool refuses(const Model& model) const;

  // Distance from 1 to the next number of the declared precision.
  double epsilon() const;

  // The rounding error allowed for `steps` steps: a few relevant operations per step, each with an error of one unit in
  // the last place of the largest quantity.
  double rounding(double steps, double scale) const { return 4 * epsilon() * steps * scale; }

  // The largest of the three timesteps of a convergence test, s: small enough for the method's leading error to rule,
  // and large enough to keep that error above rounding.
  double coarse_timestep() const;

  std::unique_ptr<Simulation> create(const Model& model, const State& state, double timestep) const;

  // A state on the way: throws EngineError for one of another size, with values that cannot be, or of a time before
  // `not_before_s`.
  static void read(const Simulation& simulation, const Model& model, double not_before_s, State& out);

  // The state after `duration` (a whole number of timesteps), with constant torques or none. Reads the state every
  // 10 ms, so that angles unwrap.
  State run(const Model& model, const State& start, double timestep, double duration,
            std::span<const double> torques = {}) const;

  // The same with every state on the way, the first included.
  std::vector<State> record(const Model& model, const State& start, double timestep, double duration,
                            std::span<const double> torques = {}) const;

 private:
  const ResolvedContender& contender_;
  bool long_ = false;
};

// Result of a run with a given timestep: the compared quantities, all of one unit.
using Measurement = std::function<std::vector<double>(double timestep)>;

struct ConvergenceOptions {
  double duration = 1;  // s, for the allowed rounding error
  std::string unit;
  int order = 0;          // 0: the declared order
  double scale = 0;       // of the quantities; 0: the largest of the reference solution
  double floor = 0;       // added to the tolerance: legitimate errors that do not shrink with the timestep
  double time_scale = 1;  // of the timesteps: for a motion that is faster or slower by its size
};

// Does the contender converge to `truth` at its declared order p, or a higher one? Three runs with h, h/2 and h/4 give
// two Richardson extrapolations to h = 0. The figure is the distance of the finer one from `truth`. It has to be
// below
// - a quarter of the error at h/4 (or of its estimate from h or h/2): the extrapolation removes the leading term only
// if the order is right;
// - twice the distance between the two extrapolations, which estimates the remaining error of the finer one;
// whichever is smaller, plus rounding. A set-up error of the adapter does not depend on h and stays fully in the
// figure.
Verdict converges(const Subject& subject, const Measurement& measure, const std::vector<double>& truth,
                  const ConvergenceOptions& options);

// Centre-of-mass positions of all bodies, one after the other.
std::vector<double> positions(const State& state);

// Every number of a state in a fixed order, for comparisons bit by bit.
std::vector<double> all_numbers(const State& state);

// How many numbers differ in any bit.
int differing_bits(const State& a, const State& b);

// The angle between two orientations, rad.
double angle_between(const Quat& a, const Quat& b);

}  // namespace assay::conformance
