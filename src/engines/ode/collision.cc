#include "collision.h"

#include <algorithm>
#include <utility>

#include "convert.h"
#include "engines/adapter.h"
#include "model/ellipsoid.h"

namespace assay::ode {
namespace {

constexpr int kEllipsoidSubdivisions = 3;

// Softness of the contacts of faces and of bodies with several shapes, whose points share one load, in h / mass:
// without any the rows of four points are so nearly dependent that the exact solver gives up. A resting body sinks by
// this / ERP times g h^2, under 1e-8 m.
constexpr double kFaceSoftness = 1e-4;

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

bool has_faces(ShapeType type) {
  return type != ShapeType::kSphere && type != ShapeType::kCapsule && type != ShapeType::kPlane;
}

// Keeps `wanted` of the contacts at the front: the deepest, then one by one the farthest from those already there. ODE
// itself stops at the number it is asked for, and the first corners of a face may all lie on one side.
int keep_apart(dContactGeom* contacts, int count, int wanted) {
  if (count <= wanted) return count;
  std::swap(contacts[0], *std::max_element(contacts, contacts + count,
                                           [](const auto& a, const auto& b) { return a.depth < b.depth; }));
  for (int kept = 1; kept < wanted; ++kept) {
    int farthest = kept;
    double most = -1;
    for (int i = kept; i < count; ++i) {
      double nearest = dInfinity;
      for (int k = 0; k < kept; ++k) {
        nearest = std::min(nearest, (vec3(contacts[i].pos) - vec3(contacts[k].pos)).squaredNorm());
      }
      if (nearest > most) {
        most = nearest;
        farthest = i;
      }
    }
    std::swap(contacts[kept], contacts[farthest]);
  }
  return wanted;
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
  contact_cfm_ = options.contact_cfm;
  std::vector<int> shapes_of(model.bodies.size(), 0);
  for (const Shape& shape : model.shapes) {
    if (shape.body != kWorld) ++shapes_of[shape.body];
  }
  for (const Shape& shape : model.shapes) {
    has_faces_.push_back(has_faces(shape.type));
    shares_load_.push_back(has_faces(shape.type) || (shape.body != kWorld && shapes_of[shape.body] > 1));
    const double mass = shape.body == kWorld ? dInfinity : model.bodies[shape.body].mass;
    cfm_of_face_.push_back(options.compliance.is_set() ? 0 : kFaceSoftness * options.timestep / mass);
  }
  pair_friction_.assign(count * count, kNoContact);
  for (const ContactPair& pair : model.contacts) {
    const std::uint16_t friction = friction_index({pair.friction, pair.torsional, pair.rolling});
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
    if (options.restitution.coefficient > 0) contact.surface.mode |= dContactBounce;
    contact.surface.bounce = options.restitution.coefficient;
    contact.surface.bounce_vel = options.restitution.threshold;
  }
}

std::uint16_t Collision::friction_index(const Friction& friction) {
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
  Pose X_BS = shape.X_BS;  // of the geom
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
      geom = dCreateBox(space, 2 * shape.half_size.x(), 2 * shape.half_size.y(), 2 * shape.half_size.z());
      break;
    case ShapeType::kCylinder:
      geom = dCreateCylinder(space, shape.radius, 2 * shape.half_length);
      break;
    case ShapeType::kEllipsoid:
      geom = create_polyhedron(ellipsoid_hull(shape.half_size, kEllipsoidSubdivisions), X_BS);
      break;
    case ShapeType::kHull:
      geom = create_polyhedron(model.hulls[shape.data], X_BS);
      break;
    case ShapeType::kHeightField:
      geom = create_height_field(model.height_fields[shape.data], X_BS);
      break;
  }
  dGeomSetData(geom, &tags_[index]);
  if (shape.type == ShapeType::kPlane) return;

  const std::array<dReal, 4> q = ode_quaternion(X_BS.q);
  if (shape.body == kWorld) {
    dGeomSetPosition(geom, X_BS.p.x(), X_BS.p.y(), X_BS.p.z());
    dGeomSetQuaternion(geom, q.data());
    return;
  }
  const Vec3 p_BcmS = X_BS.p - model.bodies[shape.body].p_BBcm;
  dGeomSetBody(geom, bodies[shape.body]);
  // an offset costs at every step, so only shapes that have one get it
  if (p_BcmS.isZero(0) && X_BS.q.isApprox(Quat::Identity(), 0)) return;
  dGeomSetOffsetPosition(geom, p_BcmS.x(), p_BcmS.y(), p_BcmS.z());
  dGeomSetOffsetQuaternion(geom, q.data());
}

dxGeom* Collision::create_polyhedron(const Hull& hull, Pose& X_BS) {
  Polyhedron& polyhedron = *polyhedra_.emplace_back(std::make_unique<Polyhedron>());
  for (const Vec3& vertex : hull.vertices) polyhedron.centre += vertex / static_cast<double>(hull.vertices.size());
  for (const Vec3& vertex : hull.vertices) {
    const Vec3 p = vertex - polyhedron.centre;
    polyhedron.points.insert(polyhedron.points.end(), {p.x(), p.y(), p.z()});
  }
  for (const auto& [a, b, c] : hull.faces) {
    const Vec3& p = hull.vertices[a];
    const Vec3 n = (hull.vertices[b] - p).cross(hull.vertices[c] - p).normalized();
    polyhedron.planes.insert(polyhedron.planes.end(), {n.x(), n.y(), n.z(), n.dot(p - polyhedron.centre)});
    for (const int entry : {3, a, b, c}) polyhedron.faces.push_back(static_cast<unsigned>(entry));
  }
  X_BS.p = X_BS * polyhedron.centre;
  return dCreateConvex(space_.get(), polyhedron.planes.data(), static_cast<unsigned>(hull.faces.size()),
                       polyhedron.points.data(), static_cast<unsigned>(hull.vertices.size()), polyhedron.faces.data());
}

// ODE's heights point along y; its x becomes the field's y and its z the field's x, so that its rows are ours, turned
// over, and its triangles' diagonals are ours.
dxGeom* Collision::create_height_field(const HeightField& field, Pose& X_BS) {
  std::vector<double>& heights = heights_.emplace_back();
  for (int column = 0; column < field.columns; ++column) {
    for (int row = 0; row < field.rows; ++row) heights.push_back(field.heights[(row * field.columns) + column]);
  }
  dxHeightfieldData* data =
      height_data_.emplace_back(dGeomHeightfieldDataCreate(), Destroy{space_.get_deleter().failed}).get();
  dGeomHeightfieldDataBuildDouble(data, heights.data(), 0, 2 * field.half_y, 2 * field.half_x, field.rows,
                                  field.columns, 1, 0, field.base, 0);
  Mat3 axes;
  axes.col(0) = Vec3::UnitY();
  axes.col(1) = Vec3::UnitZ();
  axes.col(2) = Vec3::UnitX();
  X_BS.q = X_BS.q * Quat(axes);
  return dCreateHeightfield(space_.get(), data, 1);
}

void Collision::set_friction(dSurfaceParameters& surface, const Friction& friction) {
  surface.mu = friction.sliding;
  if (friction.torsional == 0 && friction.rolling == 0) {
    surface.mode &= ~(dContactRolling | dContactAxisDep);
    return;
  }
  surface.mode |= dContactRolling | dContactAxisDep;  // the limits are lengths times the normal force: dContactApprox1
  surface.mu2 = friction.sliding;
  surface.rho = surface.rho2 = friction.rolling;
  surface.rhoN = friction.torsional;
}

void Collision::collide(dxGeom* a, dxGeom* b) {
  const std::uint16_t friction = pair_friction_[(shape_index(a) * tags_.size()) + shape_index(b)];
  if (friction == kNoContact) return;
  int count = 0;
  const size_t shape_a = shape_index(a), shape_b = shape_index(b);
  double cfm = contact_cfm_;
  if (shares_load_[shape_a] || shares_load_[shape_b]) {
    cfm = std::max({cfm, cfm_of_face_[shape_a], cfm_of_face_[shape_b]});
  }
  if (has_faces_[shape_a] || has_faces_[shape_b]) {
    count =
        keep_apart(found_.data(), dCollide(a, b, kFoundContacts, found_.data(), sizeof(dContactGeom)), max_contacts_);
    for (int i = 0; i < count; ++i) points_[i].geom = found_[i];
  } else {
    count = dCollide(a, b, max_contacts_, &points_[0].geom, sizeof(dContact));
  }
  if (count == 0) return;
  dxBody* body_a = dGeomGetBody(a);
  dxBody* body_b = dGeomGetBody(b);
  for (int i = 0; i < count; ++i) {
    points_[i].surface.soft_cfm = cfm;
    set_friction(points_[i].surface, frictions_[friction]);
    if (along_slip_) set_slip_direction(points_[i], body_a, body_b);
    dxJoint* joint = dJointCreateContact(world_, contacts_.get(), &points_[i]);
    dJointAttach(joint, body_a, body_b);
    if (!keeps_forces_) continue;
    Kept& kept = kept_.emplace_back();
    const bool in_order = shape_a < shape_b;
    // ODE's normal points to the first shape; its first body is the second shape's where the first has none
    kept.contact = {.shape_a = static_cast<int>(std::min(shape_a, shape_b)),
                    .shape_b = static_cast<int>(std::max(shape_a, shape_b)),
                    .p_W = vec3(points_[i].geom.pos),
                    .n_W = (in_order ? -1 : 1) * vec3(points_[i].geom.normal),
                    .gap = -points_[i].geom.depth};
    // dJointGetBody() would give the bodies as they were attached
    kept.on_b = (body_a != nullptr ? body_a : body_b) == (in_order ? body_b : body_a);
    dJointSetFeedback(joint, &kept.feedback);
  }
}

void Collision::read_forces(double timestep, std::vector<ContactForce>& out) const {
  out.clear();
  for (const Kept& kept : kept_) {
    out.push_back(kept.contact);
    out.back().impulse_W = (kept.on_b ? timestep : -timestep) * vec3(kept.feedback.f1);
  }
}

}  // namespace assay::ode
