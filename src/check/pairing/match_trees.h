// Two files' models with one tree: what only one of them has is locked or left out. Internal to src/check/pairing.
#pragma once

#include <vector>

#include "check/pairing/align.h"
#include "check/pairing/match.h"

namespace assay::pairing {

struct Trees {
  Model whole_a, whole_b;          // from_zero() (load/model_urdf.h)
  std::vector<BodyMatch> matches;  // of their bodies
  Locked a, b;
  Placement placement;  // of the locked ones
};

// Writes matches, counts and findings of bodies to `out`. Throws as compare().
Trees match_trees(const Side& a, const Side& b, const Options& options, Comparison& out);

}  // namespace assay::pairing
