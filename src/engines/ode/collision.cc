#include "collision.h"

#include <algorithm>

#include "convert.h"
#include "engines/adapter.h"

namespace assay::ode {
namespace {

void set_slip_direction(dContact& contact, dxBody* a, dxBody* b) {
  const dReal* p = contact.geom.pos;
  dVector3 v_a = {}, v_b = {};
  if (a != nullptr) dBodyGetPointVel(a, p[0], p[1], p[2], v_a);
  if (b != nullptr) dBodyGetPointVel(b, p[0], p[1], p[2], v_b);
  const Vec3 normal = vec3(contact.geom.normal);
  Vec3 slip = vec3(v_a) - vec3(v_b);
  slip -= slip.dot(normal) * normal;
  // without slip any direction serves
  const Vec3 direction = slip.norm() > 1e-12 ? slip.normalized() : normal.unitOrthogonal();
  for (int k = 0; k < 3; ++k) contact.fdir1[k] = direction[k];
}

}  // namespace

// Only shapes that are in a contact pair get a geom.
void Collision::create_shapes(const Model& model, const std::vector<dxBody*>& bodies, const Options& options) {
  if (options.broadphase == "simple") {
    space_.reset(dSimpleSpaceCreate(nullptr));
  } else if (options.broadphase == "hash") {
    space_.reset(dHashSpaceCreate(nullptr));
  } else {
    space_.reset(dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ));
  }
  contacts_.reset(dJointGroupCreate(0));
  max_contacts_ = options.max_contacts;
  along_slip_ = options.along_slip;

  const size_t count = model.shapes.size();
  tags_.resize(count);
  pair_friction_.assign(count * count, kNoContact);
  for (const ContactPair& pair : model.contacts) {
    const std::uint16_t friction = friction_index(pair.friction);
    pair_friction_[(pair.shape_a * count) + pair.shape_b] = friction;
    pair_friction_[(pair.shape_b * count) + pair.shape_a] = friction;
  }
  const ContactShapes touching = contact_shapes(model);
  for (size_t s = 0; s < count; ++s) {
    if (touching.contains(s)) create_shape(model, s, bodies);
  }

  for (dContact& contact : points_) {
    contact = {};
    contact.surface.mode = dContactApprox1 | dContactSoftERP | dContactSoftCFM;
    if (along_slip_) contact.surface.mode |= dContactFDir1;
    contact.surface.soft_erp = options.contact_erp;
    contact.surface.soft_cfm = options.contact_cfm;
  }
}

std::uint16_t Collision::friction_index(double friction) {
  const auto found = std::ranges::find(frictions_, friction);
  if (found != frictions_.end()) return static_cast<std::uint16_t>(found - frictions_.begin());
  if (frictions_.size() == kNoContact) throw EngineError("more than 65535 different friction coefficients");
  frictions_.push_back(friction);
  return static_cast<std::uint16_t>(frictions_.size() - 1);
}

void Collision::create_shape(const Model& model, size_t index, const std::vector<dxBody*>& bodies) {
  const Shape& shape = model.shapes[index];
  dxSpace* space = space_.get();
  dxGeom* geom = nullptr;
  switch (shape.type) {
    case ShapeType::kSphere:
      geom = dCreateSphere(space, shape.radius);
      break;
    case ShapeType::kCapsule:
      geom = dCreateCapsule(space, shape.radius, 2 * shape.half_length);
      break;
    case ShapeType::kPlane: {
      const Vec3 normal = shape.X_BS.q * Vec3::UnitZ();
      geom = dCreatePlane(space, normal.x(), normal.y(), normal.z(), normal.dot(shape.X_BS.p));
      break;
    }
    case ShapeType::kBox:
    case ShapeType::kCylinder:
    case ShapeType::kEllipsoid:
    case ShapeType::kHull:
    case ShapeType::kHeightField:
      throw UnsupportedError("this shape is refused by check()");
  }
  dGeomSetData(geom, &tags_[index]);
  if (shape.type == ShapeType::kPlane) return;

  const std::array<dReal, 4> q = ode_quaternion(shape.X_BS.q);
  if (shape.body == kWorld) {
    dGeomSetPosition(geom, shape.X_BS.p.x(), shape.X_BS.p.y(), shape.X_BS.p.z());
    dGeomSetQuaternion(geom, q.data());
    return;
  }
  const Vec3 p_BcmS = shape.X_BS.p - model.bodies[shape.body].p_BBcm;
  dGeomSetBody(geom, bodies[shape.body]);
  // an offset costs at every step, so only shapes that have one get it
  if (p_BcmS.isZero(0) && shape.X_BS.q.isApprox(Quat::Identity(), 0)) return;
  dGeomSetOffsetPosition(geom, p_BcmS.x(), p_BcmS.y(), p_BcmS.z());
  dGeomSetOffsetQuaternion(geom, q.data());
}

void Collision::collide(dxGeom* a, dxGeom* b) {
  const std::uint16_t friction = pair_friction_[(shape_index(a) * tags_.size()) + shape_index(b)];
  if (friction == kNoContact) return;
  const int count = dCollide(a, b, max_contacts_, &points_[0].geom, sizeof(dContact));
  if (count == 0) return;
  dxBody* body_a = dGeomGetBody(a);
  dxBody* body_b = dGeomGetBody(b);
  for (int i = 0; i < count; ++i) {
    points_[i].surface.mu = frictions_[friction];
    if (along_slip_) set_slip_direction(points_[i], body_a, body_b);
    dJointAttach(dJointCreateContact(world_, contacts_.get(), &points_[i]), body_a, body_b);
  }
}

}  // namespace assay::ode
