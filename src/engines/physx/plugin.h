// What differs between the versions of PhysX that this adapter is built for besides the library itself: plugin.cc here,
// and in ../physx56.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engines/adapter.h"
#include "options.h"
#include "shapes.h"

namespace assay::px {

// How the names and the summaries of contenders begin.
extern const char* const kPrefix;
extern const char* const kTitle;

// Values of the setting `friction`; the first is its default.
std::vector<std::string> friction_models();
// Whether contacts can have a damping, and with it a compliance.
extern const bool kContactDamping;

// Default of the setting `link_cfm`.
extern const double kLinkCfm;

// Velocity iterations of contenders with temporal Gauss-Seidel.
extern const long long kTgsVelocityIterations;

// Whether a callback can set the friction of contacts.
extern const bool kContactModification;

// Whether temporal Gauss-Seidel divides the friction of an articulation's contacts between a patch's two anchors twice.
extern const bool kSharesFrictionTwice;
// Where it does: gives the contacts of such patches twice their friction.
void share_friction(physx::PxContactModifyPair& pair);

// Adds to the capabilities what is this version's: friction by pair, contact forces, curved shapes, further deviations.
void describe_plugin(Capabilities& capabilities, const Options& options);

// A cylinder or an ellipsoid as a body of its own kind, with what it points to; nullopt: only as a polyhedron.
struct Curved {
  std::unique_ptr<physx::PxCustomGeometryCallbacks> callbacks;
  physx::PxGeometryHolder holder;
};
std::optional<Curved> make_curved(const Shape& shape);

}  // namespace assay::px
