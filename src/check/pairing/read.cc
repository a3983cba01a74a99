#include "check/pairing/read.h"

#include <algorithm>
#include <utility>

#include "base/errors.h"
#include "load/mjcf.h"
#include "load/usd.h"

namespace assay::pairing {
namespace {

Side read_side(const std::string& file, const LoadOptions& options) {
  FileFacts facts;
  LoadReport report = inspect_model(file, options, &facts);
  // a refused file is loaded again for what loading throws
  Side side{.file = file, .model = report.model ? std::move(*report.model) : load_model(file, options)};
  if (facts.is_urdf) {
    side.format = {.name = "URDF", .drives = false, .contact_friction = false, .velocity_limits = true};
  } else if (facts.is_sdf) {
    side.format = {.name = "SDF", .drives = false, .contact_friction = true, .velocity_limits = true};
  }
  side.velocity_limits = std::move(facts.velocity_limits);
  if (is_usd(file)) side.format.name = "USD";
  return side;
}

// Whether a root that carries joints is free, and whether one hangs on the world.
struct Bases {
  bool free = false, fixed = false;
};
Bases bases_of(const Model& model) {
  Bases bases;
  for (const Body& body : model.bodies) {
    if (body.parent == kWorld && !body.is_free()) bases.fixed = true;
    if (body.parent != kWorld && model.bodies[static_cast<size_t>(body.parent)].is_free()) bases.free = true;
  }
  return bases;
}

}  // namespace

std::pair<Side, Side> read_pair(const std::string& file_a, const std::string& file_b, const LoadOptions& options) {
  Side a = read_side(file_a, options), b = read_side(file_b, options);
  const Bases of_a = bases_of(a.model), of_b = bases_of(b.model);
  const auto free_base = [&](Side& side) {
    LoadOptions floating = options;
    floating.root_joint = RootJoint::kFloating;
    try {
      Side read = read_side(side.file, floating);
      read.base_changed = true;
      side = std::move(read);
    } catch (const InputError&) {
      // its base has no mass: the other one is held instead
    }
  };
  if (options.root_joint == RootJoint::kAsInFile) {
    if (of_a.free && !of_b.free && of_b.fixed) free_base(b);
    if (of_b.free && !of_a.free && of_a.fixed) free_base(a);
  }
  return {std::move(a), std::move(b)};
}

}  // namespace assay::pairing
