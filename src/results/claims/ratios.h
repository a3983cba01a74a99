// Values of two contenders compared, with the interval of their ratio.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "results/results.h"

namespace assay {

// One for all, so that all contenders' pieces are drawn alike.
inline constexpr std::uint64_t kBootstrapSeed = 1;

// The second contender's value over the first's.
struct Ratio {
  enum class State { kMissing, kFirstFailed, kSecondFailed, kThere };
  State state = State::kMissing;
  std::string why;
  Interval value;
  double least = 0, most = 0;   // of the speeds at which they were compared
  int points = 0;               // so many speeds; 0: at one timestep
  bool by_speed = false;        // at equal speed; else at equal timesteps
  std::vector<Figure> figures;  // the two values, where the ratio is of two values alone

  // No mean stands for ratios that span more than a decade: their range does, and is the interval too.
  bool is_range() const { return most > 10 * least; }
};

class Ratios {
 public:
  // The results have to outlive it.
  explicit Ratios(const Results& results) : results_(&results) {}

  Ratio at_timestep(const std::string& system, const std::string& first, const std::string& second,
                    const std::string& value, double timestep_ms) const;

  // The geometric mean over the second's points, or their range (Ratio::is_range), each compared with the first at its
  // realtime factor: interpolated between the first's points, logarithmically in both. A contender that is faster even
  // at its smallest timestep keeps that timestep's value, because it can always idle. Where a system's speed was not
  // measured, at equal timesteps. Points near the floor of a fine-step run, whose error is only bounded, are not
  // compared. Where both are means over the same pieces of the motion, the interval is a bootstrap of the pieces, drawn
  // alike for both; with pieces from several initial states, of these states with all their pieces
  // (measures/clusters.h).
  Ratio at_equal_speed(const std::string& system, const std::string& first, const std::string& second,
                       const std::string& value) const;

 private:
  struct Point {
    Interval speed, error;
    std::vector<double> resampled;  // logarithms of the mean error in the resamples; empty: no pieces
    bool is_bound = false;          // the error is an upper bound
  };
  struct Curve {
    Found found = Found::kMissing;
    std::string why;
    bool by_speed = false;
    std::vector<Point> points;   // the slowest first
    std::vector<size_t> pieces;  // of each point by initial state; empty: none, or not of all alike
  };
  const Curve& curve(const std::string& system, const std::string& contender, const std::string& value) const;
  std::vector<std::vector<double>> pieces_of(const Figure& figure, const std::string& value) const;

  const Results* results_;
  // Curves are kept: each is compared with many.
  mutable std::map<std::tuple<std::string, std::string, std::string>, Curve> curves_;
};

}  // namespace assay
