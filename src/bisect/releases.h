// Runs of one robot in the releases of an engine, and what is measured of them.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bisect/bisect.h"
#include "explain/question.h"
#include "explain/runs.h"
#include "measures/gap.h"

namespace assay {

// Means over the starts of one release.
struct ReleaseValues {
  double energy = 0;            // J, kinetic and potential, at the end
  double contacts = 0;          // pairs of shapes that touch, mean over the samples
  double penetration = 0;       // m, the deepest of a run
  double joint_error = 0;       // m, between the anchors of a joint, the largest of a run
  double limit = 0;             // rad beyond a limit, the largest of a run
  std::optional<double> falls;  // share of the runs, under a policy that says when the robot has fallen
  std::optional<double> velocity_error, turning_error;  // m/s, rad/s, under a policy with commands (RunSet)
};

struct MeasuredRelease {
  ReleaseResult result;
  std::vector<Track> tracks;  // by start
  ReleaseValues values;
};

// A setting of the newer release that brings its runs back towards those of the older one.
struct Restoring {
  std::string setting;  // "integrator=euler"
  double left = 0;      // of the distance, m
  bool same_bits = false;
};

// How far both are apart in the mean of the starts while the cause decides: mean distance of the bodies, at most
// kFarMetres a sample, m; and the largest distance of one body, m.
struct Apart {
  double mean = 0, largest = 0;
};
Apart apart(const std::vector<Track>& a, const std::vector<Track>& b, size_t samples);

// Runs sides of the question, one process a side and start, and measures them.
class ReleaseRunner {
 public:
  ReleaseRunner(const ExplainQuestion& question, std::function<void(size_t done, size_t of)> progress);

  std::vector<MeasuredRelease> run(const std::vector<Side>& sides, int starts);

  // Time of a step in each side, microseconds: `rounds` looks, each at all sides in turn. A side that fails has none.
  std::vector<std::vector<double>> step_us(const std::vector<Side>& sides, int rounds) const;

 private:
  const ExplainQuestion& question_;
  std::function<void(size_t done, size_t of)> progress_;
};

// Each other value of the settings of `newer` that could have been what changed: switches turned, other choices, ten
// times the iterations, a thousandth of the tolerance; those first that leave least, only those that leave less than
// half.
std::vector<Restoring> restoring(ReleaseRunner& runner, const Side& newer, const MeasuredRelease& older,
                                 double distance, int starts, size_t samples);

}  // namespace assay
