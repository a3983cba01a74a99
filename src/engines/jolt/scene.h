// A model in the arrays of jolt_world.h.
#pragma once

#include <memory>
#include <vector>

#include "model/model.h"
#include "options.h"

namespace assay::jolt {

struct FreeWorld {
  void operator()(jolt_world* world) const { jolt_free(world); }
};
using World = std::unique_ptr<jolt_world, FreeWorld>;

// The position at which Jolt's own is zero. Jolt knows an angle within a turn only, and wants zero within limits, so a
// limited joint counts from the middle of its range, and one with a native spring from the spring's rest.
double zero_angle(const Joint& hinge, bool native_springs);

// Jolt's body frame in the MJCF body frame, one for each body. Its origin is the centre of mass. Jolt's capsules lie
// along y, so a body whose only colliding shape is centred takes that shape's axes: the shape then needs no transform.
std::vector<Pose> body_frames(const Model& model);

// Throws EngineError when Jolt refuses it.
World make_world(const Model& model, const State& state, const std::vector<Pose>& frames, const Options& options);

}  // namespace assay::jolt
