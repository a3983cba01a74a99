// The course of a result over the releases of an engine: which of them end in the same bits, and between which it
// changed by more than the noise of one release. docs/releases.md has the definitions.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace assay {

// What one release makes of the runs that are compared.
struct ReleaseResult {
  std::string release;
  std::string failure;  // why it has none; "" where it has
  std::string bits;     // equal for runs whose states are equal in every bit

  bool usable() const { return failure.empty(); }
};

// Neighbours that end in the same bits: indices into what was asked for, first and last.
struct ReleaseGroup {
  size_t first = 0, last = 0;
  bool inferred = false;  // not every release between the two was run
};

// Between the last release of a group and the first one of the next.
struct ReleaseChange {
  size_t before = 0, after = 0;  // usable ones; those between them could not be used
  double size = 0;               // how far the runs of the two are apart, in the unit of `distance`
  bool beyond_noise = false;
};

struct ReleaseCourse {
  std::vector<ReleaseResult> results;  // by release; those that were not run have no bits and no failure
  std::vector<ReleaseGroup> groups;
  std::vector<ReleaseChange> changes;
};

// Runs releases by their indices; results in the same order.
using RunReleases = std::function<std::vector<ReleaseResult>(const std::vector<size_t>& which)>;
// How far the runs of two releases are apart.
using ReleaseDistance = std::function<double(size_t a, size_t b)>;

// `count` releases from old to new. With `quick` not all of them are run: where two end in the same bits, those between
// are taken to do so, too. `noise` is how far repetitions of one release are apart: changes up to it are none. Where it
// is 0 other bits alone make a group.
ReleaseCourse find_course(size_t count, bool quick, double noise, const RunReleases& run, const ReleaseDistance& distance);

}  // namespace assay
