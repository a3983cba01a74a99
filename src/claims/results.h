// What a test asks of measured results: figures of a contender, and ratios of two.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "measures/statistics.h"
#include "store/store.h"

namespace assay {

// One for all, so that all contenders' pieces are drawn alike.
inline constexpr std::uint64_t kBootstrapSeed = 1;

// Without a stored interval: one of no width.
Interval interval_of(const Value& value);

// Whether there is a figure.
enum class Found {
  kMissing,  // not measured: `why`
  kFailed,   // the run ended unstable or diverged: `why`
  kThere,
};

struct Figure {
  Found found = Found::kMissing;
  std::string why;
  Interval value;
  bool has_interval = false;
  std::string unit;
  double timestep_ms = 0;
  std::int64_t cell = 0;  // the store's id of where it is from; 0: from no single cell
};

// The second contender's value over the first's.
struct Ratio {
  enum class State { kMissing, kFirstFailed, kSecondFailed, kThere };
  State state = State::kMissing;
  std::string why;
  Interval value;
  double least = 0, most = 0;   // of the speeds at which they were compared
  bool by_speed = false;        // at equal speed; else at equal timesteps
  std::vector<Figure> figures;  // the two values, where the ratio is of two values alone
};

class Results {
 public:
  // The store has to outlive it.
  explicit Results(const Store& store);

  // In the order of the results, without the engine that does nothing.
  const std::vector<std::string>& contenders() const { return contenders_; }

  // Systems of a family, as listed.
  std::vector<std::string> family(const std::string& name) const;

  // Without a timestep: the smallest that was measured.
  Figure figure(const std::string& system, const std::string& contender, const std::string& value,
                std::optional<double> timestep_ms) const;

  // One figure for each timestep, ascending; those of a reference's own timestep are left out with `no_references`.
  std::vector<Figure> figures(const std::string& system, const std::string& contender, const std::string& value,
                              bool no_references = false) const;

  // The same of a measure's cells, whose values do not matter.
  std::vector<Figure> outcomes(const std::string& system, const std::string& contender,
                               const std::string& measure) const;

  Ratio at_timestep(const std::string& system, const std::string& first, const std::string& second,
                    const std::string& value, double timestep_ms) const;

  // The geometric mean over the second's points, each compared with the first at its realtime factor: interpolated
  // between the first's points, logarithmically in both; a contender that is faster even at its smallest timestep may
  // wait and keeps that timestep's value. Where a system's speed was not measured, at equal timesteps. Where both are
  // means over the same pieces of the motion, the interval is a bootstrap of the pieces, drawn alike for both.
  Ratio at_equal_speed(const std::string& system, const std::string& first, const std::string& second,
                       const std::string& value) const;

  // Why there is no value.
  std::string why_missing(const std::string& system, const std::string& contender, const std::string& value) const;

 private:
  struct Point {
    Interval speed, error;
    std::vector<double> resampled;  // logarithms of the mean error in resamples of the pieces; empty: no pieces
  };
  struct Curve {
    Found found = Found::kMissing;
    std::string why;
    bool by_speed = false;
    std::vector<Point> points;  // the slowest first
    size_t pieces = 0;          // of each point; 0: none, or not of all alike
  };
  const Curve& curve(const std::string& system, const std::string& contender, const std::string& value) const;
  std::vector<double> pieces_of(const Figure& figure, const std::string& value) const;

  std::set<std::string> systems_;
  std::vector<std::pair<std::string, std::string>> families_;  // system, family
  std::vector<std::string> contenders_;
  std::set<std::string> absent_;                           // contenders whose engine is
  std::map<std::string, std::set<std::string>> measures_;  // that a value was found in
  std::map<std::pair<std::string, std::string>, std::vector<Cell>> cells_;
  std::set<std::string> timed_;  // systems
  // Raw samples are read when they are asked for. Curves are kept: each is compared with many.
  const Store* store_;
  mutable std::map<std::tuple<std::string, std::string, std::string>, Curve> curves_;
};

}  // namespace assay
