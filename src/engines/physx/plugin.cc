// PhysX 5.1.3, built from its sources.
#include "plugin.h"

#include <optional>
#include <string>
#include <vector>

#include <extensions/PxCustomGeometryExt.h>

#include "convert.h"

namespace assay::px {

using namespace physx;

namespace {

// Given by the point that is farthest in a direction, as PhysX's own cylinder. Such bodies meet each other only where
// their type is one of PhysX's own, so this is one.
class Ellipsoid final : public PxCustomGeometryExt::CylinderCallbacks {
 public:
  explicit Ellipsoid(const PxVec3& semi_axes)
      : CylinderCallbacks(2 * semi_axes.z, semi_axes.x, /*axis=*/2), semi_axes_(semi_axes) {}

  PxVec3 supportLocal(const PxVec3& direction) const override {
    const PxVec3 scaled = direction.multiply(semi_axes_);
    const float length = scaled.magnitude();
    return length > 0 ? scaled.multiply(semi_axes_) / length : PxVec3(0, 0, semi_axes_.z);
  }

 protected:
  // A smooth body touches in one point: there is no face or edge to put in its place.
  bool useSubstituteGeometry(PxGeometryHolder& /*geometry*/, PxTransform& /*pose*/, const PxContactPoint& /*contact*/,
                             const PxTransform& /*own*/, const PxVec3& /*other*/) const override {
    return false;
  }

 private:
  PxVec3 semi_axes_;
};

}  // namespace

const char* const kPrefix = "physx";
const char* const kTitle = "PhysX";

const bool kContactDamping = true;
const bool kContactModification = true;

// findings/physx/tgs_links_halve_friction.cc; right from 5.3 on
const double kLinkCfm = 0;
const long long kTgsVelocityIterations = 1;

const bool kSharesFrictionTwice = true;

void share_friction(PxContactModifyPair& pair) {
  // PhysX's own: normals of one patch, and the distance in m^2 from which two of its points are two anchors
  constexpr float kSameNormal = 0.999F, kApart = 1e-8F;
  const float reach = pair.actor[0]->getScene()->getFrictionOffsetThreshold();  // m, of points that can be anchors
  PxContactSet& contacts = pair.contacts;
  const auto are_anchors = [&](PxU32 i, PxU32 k) {
    return contacts.getSeparation(i) < reach && contacts.getSeparation(k) < reach &&
           contacts.getNormal(i).dot(contacts.getNormal(k)) >= kSameNormal &&
           (contacts.getPoint(i) - contacts.getPoint(k)).magnitudeSquared() > kApart;
  };
  // all points of a patch have one friction, also those that are no anchors
  for (PxU32 i = 0; i < contacts.size(); ++i) {
    bool two = false;
    for (PxU32 j = 0; j < contacts.size() && !two; ++j) {
      if (contacts.getNormal(i).dot(contacts.getNormal(j)) < kSameNormal) continue;
      for (PxU32 k = 0; k < j && !two; ++k) two = are_anchors(j, k);
    }
    if (!two) continue;
    contacts.setStaticFriction(i, 2 * contacts.getStaticFriction(i));
    contacts.setDynamicFriction(i, 2 * contacts.getDynamicFriction(i));
  }
}

std::vector<std::string> friction_models() { return {"improved_patch", "patch", "one_directional", "two_directional"}; }

void describe_plugin(Capabilities& c, const Options& options) {
  c.friction_combine =
      "the pair's coefficient: as the larger of two materials', or by a callback where that is another";
  c.contact_forces_note = "PxContactPairPoint::impulse of contact reports; PhysX 5.1 gives no friction";
  if (options.tgs) {
    // findings/physx/tgs_spin_gain.cc
    c.other = "what turns freely gains 6e-7 of its spin a step" + (c.other.empty() ? "" : "; " + c.other);
  } else {
    c.deviations.push_back({"restitution", 0.25,
                            "where a contact is found before its gap is closed, the body first slows down to close it "
                            "and gets back a part of what is left (findings/physx/pgs_restitution.cc)"});
  }
  add_approximated(
      c, Feature::kCylinder,
      "exact on planes; one contact point a step against curved bodies and boxes, on which one at rest rolls by up to "
      "metres in a minute; on height fields a prism of 64 sides, its radius within 0.1 %, which rolls away within "
      "seconds");
  add_approximated(c, Feature::kEllipsoid,
                   "exact on planes; against boxes a rocking ellipsoid's rate is 7 % off; on height fields a "
                   "polyhedron of 80 faces, its radius within 3.4 %");
}

std::optional<Curved> make_curved(const Shape& shape) {
  Curved curved;
  if (shape.type == ShapeType::kCylinder) {
    curved.callbacks = std::make_unique<PxCustomGeometryExt::CylinderCallbacks>(real(2 * shape.half_length),
                                                                                real(shape.radius), /*axis=*/2);
  } else {
    curved.callbacks = std::make_unique<Ellipsoid>(to_px(shape.half_size));
  }
  curved.holder = PxGeometryHolder(PxCustomGeometry(*curved.callbacks));
  return curved;
}

}  // namespace assay::px
