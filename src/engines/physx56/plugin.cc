// PhysX 5.6.1, by the bindings of its JavaScript package.
#include "engines/physx/plugin.h"

#include <optional>
#include <string>
#include <vector>

namespace assay::px {

const char* const kPrefix = "physx56";
const char* const kTitle = "PhysX 5.6";

// The package's bindings have neither.
const bool kContactDamping = false;
const bool kContactModification = false;

// PhysX's own: with 0, two links that move in one plane and are connected, so that nothing can move along one of the
// connect's three directions, come apart (pgs) or end in no number (tgs).
const double kLinkCfm = 0.025;

// PhysX's own is 1: with it a cylinder that slides standing over a height field changes its velocity by 4.7 % in 1 s.
const long long kTgsVelocityIterations = 0;

const bool kSharesFrictionTwice = false;
void share_friction(physx::PxContactModifyPair& /*pair*/) {}

// 5.6 has no other.
std::vector<std::string> friction_models() { return {"improved_patch"}; }

void describe_plugin(Capabilities& c, const Options& /*options*/) {
  c.friction_combine =
      "the pair's coefficient: as the larger of two materials', or where that is another by copies of both shapes that "
      "touch nothing else";
  c.contact_forces_note = "PxContactPairPoint::impulse of contact reports; the package's bindings give no friction";
  add_approximated(
      c, Feature::kCylinder,
      "a prism of 64 sides, its radius within 0.1 %: it rolls down a slope 9 % slower, and from rest it may "
      "roll off boxes and height fields within seconds");
  c.features.push_back(
      {Feature::kEllipsoid, Fidelity::kRefused,
       "the package's bindings have no geometry of a program's own, and on a polyhedron it would not rock: "
       "replace it by a capsule or a mesh"});
  c.deviations.push_back({"cylinder-rolls", 0.15,
                          "a cylinder is a prism, and PhysX's prisms lose more speed at their edges than rigid ones "
                          "(findings/physx/prism_rolls_slowly.cc)"});
}

std::optional<Curved> make_curved(const Shape& /*shape*/) { return std::nullopt; }

}  // namespace assay::px
