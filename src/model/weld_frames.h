// Where a weld holds its bodies. A rigid weld has no place. An engine's weld gives way a little, and turns about the
// point that it holds: a load at a distance from that point turns it, and the bodies part by the turn times the
// distance.
#pragma once

#include "model/model.h"

namespace assay {

// One frame that both bodies carry, with the axes of body b.
struct WeldFrames {
  Pose X_AS, X_BS;
};

// At the centre of mass of the lighter body, where its weight and inertia do not turn the weld; never at the origin of
// the world, which may be far away.
inline WeldFrames weld_frames(const Model& model, const Weld& weld) {
  const auto mass = [&](int body) { return body == kWorld ? 0.0 : model.bodies[body].mass; };
  const double mass_a = mass(weld.body_a), mass_b = mass(weld.body_b);
  const bool at_a = mass_a > 0 ? mass_b <= 0 || mass_a < mass_b : weld.body_b == kWorld;
  WeldFrames frames;
  frames.X_BS.p = at_a ? weld.X_AB.inverse() * model.bodies[weld.body_a].p_BBcm
                       : (weld.body_b == kWorld ? Vec3(Vec3::Zero()) : model.bodies[weld.body_b].p_BBcm);
  frames.X_AS = weld.X_AB * frames.X_BS;
  return frames;
}

}  // namespace assay
