#include "collision.h"

#include <algorithm>
#include <optional>

#include <BulletCollision/CollisionDispatch/btCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include "convert.h"
#include "engines/adapter.h"

namespace assay::bullet {
namespace {

// The frame of a body's only shape when it lies on principal axes: the shape then needs no transform of its own.
bool shape_frame_is_principal(const Body& body, const Shape& shape, BodyFrame& frame) {
  if ((shape.X_BS.p - body.p_BBcm).norm() > 1e-14 * (1 + body.p_BBcm.norm())) return false;
  const Mat3 R_BS = shape.X_BS.q.toRotationMatrix();
  const Mat3 I_S = R_BS.transpose() * body.I_BBcm_B * R_BS;
  if (std::abs(I_S(0, 1)) + std::abs(I_S(0, 2)) + std::abs(I_S(1, 2)) > 1e-14 * I_S.trace()) return false;
  frame = {{body.p_BBcm, shape.X_BS.q}, I_S.diagonal()};
  return true;
}

// Where a ball, capsule or cylinder touches what lies in the direction `towards`, at the height along its axis of a
// point near there; nothing for other shapes, and for a cylinder's flat ends.
std::optional<btVector3> round_surface(const btCollisionObject& object, int child, const btVector3& near,
                                       const btVector3& towards) {
  const btCollisionShape* shape = object.getCollisionShape();
  btTransform X_WS = object.getWorldTransform();
  if (shape->isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(*shape);
    if (child < 0 || child >= compound.getNumChildShapes()) return std::nullopt;
    X_WS = X_WS * compound.getChildTransform(child);
    shape = compound.getChildShape(child);
  }
  const btVector3 direction = towards * X_WS.getBasis();  // in the shape's axes
  const btScalar height = X_WS.invXform(near).z();
  switch (shape->getShapeType()) {
    case SPHERE_SHAPE_PROXYTYPE:
      return X_WS.getOrigin() + static_cast<const btSphereShape*>(shape)->getRadius() * towards;
    case CAPSULE_SHAPE_PROXYTYPE: {
      const auto& capsule = static_cast<const btCapsuleShape&>(*shape);
      const btScalar half = capsule.getHalfHeight();
      return X_WS * (btVector3(0, 0, std::clamp(height, -half, half)) + capsule.getRadius() * direction);
    }
    case CYLINDER_SHAPE_PROXYTYPE: {
      constexpr btScalar kLying = real(0.1);  // of the direction, along the axis
      if (std::abs(direction.z()) > kLying) return std::nullopt;
      const btVector3 across = btVector3(direction.x(), direction.y(), 0).normalized();
      const btScalar radius = static_cast<const btCylinderShape*>(shape)->getRadius();
      return X_WS * (radius * across + btVector3(0, 0, height));
    }
    default:
      return std::nullopt;
  }
}

bool is_identity(const Pose& X, double length) {
  return X.p.norm() <= 1e-14 * (1 + length) && X.q.vec().norm() <= 1e-14;
}

}  // namespace

Collision::Collision(const Model& model, bool turning_friction, const ContactCompliance& compliance,
                     const Restitution& restitution)
    : turning_friction_(turning_friction), compliance_(compliance), restitution_(restitution) {
  // rows: the shapes that can touch something
  ContactShapes shapes = contact_shapes(model);
  row_of_shape_ = std::move(shapes.row);
  rows_ = shapes.count;
  choose_frames(model);
  make_shapes(model);
  make_tables(model);
}

void Collision::choose_frames(const Model& model) {
  std::vector<int> count(model.bodies.size(), 0);
  std::vector<const Shape*> only(model.bodies.size(), nullptr);
  for (size_t s = 0; s < model.shapes.size(); ++s) {
    const Shape& shape = model.shapes[s];
    if (shape.body == kWorld || row_of_shape_[s] < 0) continue;
    ++count[shape.body];
    only[shape.body] = &shape;
  }
  frames_.resize(model.bodies.size());
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    const Body& body = model.bodies[b];
    if (count[b] == 1 && shape_frame_is_principal(body, *only[b], frames_[b])) continue;
    const PrincipalInertia principal = principal_inertia(body.I_BBcm_B);
    frames_[b] = {{body.p_BBcm, principal.q_BI}, principal.diagonal};
  }
}

btCollisionShape* Collision::add_shape(const Model& model, int shape) {
  MadeShape made = make_shape(model, model.shapes[shape]);
  tags_.push_back(std::make_unique<ShapeTag>(ShapeTag{this, row_of_shape_[shape]}));
  made.shape->setUserPointer(tags_.back().get());
  shapes_.push_back(std::move(made));
  return shapes_.back().shape.get();
}

void Collision::make_shapes(const Model& model) {
  body_shapes_.assign(model.bodies.size(), nullptr);
  object_of_body_.assign(model.bodies.size(), -1);
  std::vector<std::vector<int>> shapes_of_body(model.bodies.size());
  for (size_t s = 0; s < model.shapes.size(); ++s) {
    if (row_of_shape_[s] >= 0 && model.shapes[s].body != kWorld) {
      shapes_of_body[model.shapes[s].body].push_back(static_cast<int>(s));
    }
  }

  for (size_t b = 0; b < model.bodies.size(); ++b) {
    const std::vector<int>& list = shapes_of_body[b];
    if (list.empty()) continue;
    object_of_body_[b] = static_cast<int>(object_rows_.size());
    object_rows_.emplace_back();
    const Pose X_IB = frames_[b].X_BI.inverse();
    std::unique_ptr<btCompoundShape> compound;
    for (const int s : list) {
      const Shape& shape = model.shapes[s];
      btCollisionShape* primitive = add_shape(model, s);
      const Pose X_IS = X_IB * shape.X_BS;
      object_rows_.back().push_back(row_of_shape_[s]);
      if (list.size() == 1 && is_identity(X_IS, shape.radius)) {
        body_shapes_[b] = primitive;
        break;
      }
      if (!compound) compound = std::make_unique<btCompoundShape>();
      compound->addChildShape(to_bt(X_IS), primitive);
    }
    if (compound) {
      body_shapes_[b] = compound.get();
      shapes_.push_back({std::move(compound), {}, {}});
    }
  }

  for (size_t s = 0; s < model.shapes.size(); ++s) {
    const Shape& shape = model.shapes[s];
    if (row_of_shape_[s] < 0 || shape.body != kWorld) continue;
    auto object = std::make_unique<btCollisionObject>();
    object->setCollisionShape(add_shape(model, static_cast<int>(s)));
    const Pose& X_SB = shapes_.back().X_SB;
    if (shape.type != ShapeType::kPlane) object->setWorldTransform(to_bt(shape.X_BS * X_SB));
    object->setCollisionFlags(btCollisionObject::CF_STATIC_OBJECT);
    object_rows_.push_back({row_of_shape_[s]});
    world_objects_.push_back(std::move(object));
  }
}

void Collision::make_tables(const Model& model) {
  shape_of_row_.assign(rows_, -1);
  for (size_t s = 0; s < row_of_shape_.size(); ++s) {
    if (row_of_shape_[s] >= 0) shape_of_row_[row_of_shape_[s]] = static_cast<int>(s);
  }
  const size_t objects = object_rows_.size();
  touch_.assign(static_cast<size_t>(rows_) * rows_, 0);
  std::vector<int> object_of_row(rows_, -1);
  for (size_t o = 0; o < objects; ++o) {
    for (const int row : object_rows_[o]) object_of_row[row] = static_cast<int>(o);
  }
  object_touch_.assign(objects * objects, 0);
  const auto friction_of = [this](const ContactPair& pair) {
    const PairFriction sliding{real(pair.friction), 0, 0};
    return turning_friction_ ? PairFriction{sliding.slide, real(pair.torsional), real(pair.rolling)} : sliding;
  };
  if (!model.contacts.empty()) uniform_friction_ = friction_of(model.contacts.front());
  const bool uniform = std::ranges::all_of(
      model.contacts, [&](const ContactPair& pair) { return friction_of(pair) == uniform_friction_; });
  if (!uniform) friction_.assign(touch_.size(), {});

  for (const ContactPair& pair : model.contacts) {
    const int a = row_of_shape_[pair.shape_a], b = row_of_shape_[pair.shape_b];
    const int object_a = object_of_row[a], object_b = object_of_row[b];
    touch_[index(a, b)] = touch_[index(b, a)] = 1;
    object_touch_[object_a * objects + object_b] = object_touch_[object_b * objects + object_a] = 1;
    if (!uniform) friction_[index(a, b)] = friction_[index(b, a)] = friction_of(pair);
  }

  by_shape_.assign(objects, 0);
  for (size_t o = 0; o < objects; ++o) by_shape_[o] = !uniform && object_rows_[o].size() > 1;
  const size_t moving = objects - world_objects_.size();
  for (size_t o = 0; o < world_objects_.size(); ++o) mark(*world_objects_[o], static_cast<int>(moving + o));
}

void Collision::mark(btCollisionObject& object, int number) const {
  object.setUserPointer(const_cast<Collision*>(this));
  object.setUserIndex(number);
  object.setRestitution(real(restitution_.of_material()));  // Bullet multiplies the two
  // of contacts at a distance Bullet first closes the gap, and gives back of the speed that is left then
  if (restitution_.coefficient > 0) object.setContactProcessingThreshold(0);
  // Bullet puts the springs of two objects in a row, and their dampers side by side
  if (compliance_.is_set()) {
    object.setContactStiffnessAndDamping(real(2 * compliance_.stiffness), real(compliance_.damping / 2));
  }
  if (by_shape_[number]) {
    object.setCollisionFlags(object.getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
  }
}

bool Collision::needBroadphaseCollision(btBroadphaseProxy* proxy_a, btBroadphaseProxy* proxy_b) const {
  const int a = static_cast<const btCollisionObject*>(proxy_a->m_clientObject)->getUserIndex();
  const int b = static_cast<const btCollisionObject*>(proxy_b->m_clientObject)->getUserIndex();
  return a >= 0 && b >= 0 && object_touch_[a * object_rows_.size() + b] != 0;
}

int Collision::shape_row(const btCollisionObject& object, int child) const {
  // of an object of one shape, `child` is a triangle of it, if anything
  const std::vector<int>& rows = object_rows_[object.getUserIndex()];
  return rows.size() == 1 ? rows[0] : rows[child < 0 ? 0 : child];
}

const Collision::PairFriction& Collision::friction_of_objects(const btCollisionObject* a, const btCollisionObject* b) {
  const auto* owner = static_cast<const Collision*>(a->getUserPointer());
  if (owner->friction_.empty()) return owner->uniform_friction_;
  return owner->friction_[owner->index(owner->shape_row(*a, -1), owner->shape_row(*b, -1))];
}

btScalar Collision::sliding_friction(const btCollisionObject* a, const btCollisionObject* b) {
  return friction_of_objects(a, b).slide;
}

btScalar Collision::spinning_friction(const btCollisionObject* a, const btCollisionObject* b) {
  return friction_of_objects(a, b).spin;
}

btScalar Collision::rolling_friction(const btCollisionObject* a, const btCollisionObject* b) {
  return friction_of_objects(a, b).roll;
}

bool Collision::shape_friction(btManifoldPoint& point, const btCollisionObjectWrapper* a, int /*part_a*/, int child_a,
                               const btCollisionObjectWrapper* b, int /*part_b*/, int child_b) {
  const btCollisionObject& object_a = *a->getCollisionObject();
  const btCollisionObject& object_b = *b->getCollisionObject();
  const auto* owner = static_cast<const Collision*>(object_a.getUserPointer());
  const PairFriction& friction =
      owner->friction_[owner->index(owner->shape_row(object_a, child_a), owner->shape_row(object_b, child_b))];
  point.m_combinedFriction = friction.slide;
  point.m_combinedSpinningFriction = friction.spin;
  point.m_combinedRollingFriction = friction.roll;
  return true;
}

bool Collision::children_touch(const btCollisionShape* a, const btCollisionShape* b) {
  const auto* tag_a = static_cast<const ShapeTag*>(a->getUserPointer());
  const auto* tag_b = static_cast<const ShapeTag*>(b->getUserPointer());
  // a compound as a whole has no tag: its children are asked one by one
  if (tag_a == nullptr || tag_b == nullptr) return true;
  return tag_a->owner->shapes_touch(tag_a->shape, tag_b->shape);
}

// Bullet keeps contact points from step to step, on each body where they were found. On a round body such a point turns
// away from where the body touches, and pushes it from beside: a capsule at rest on a box rolls away
// (findings/bullet/kept_contacts.cc). So the point of a round body on a flat one is put back to where it touches.
bool Collision::renew_point(btManifoldPoint& point, void* a, void* b) {
  const auto& object_a = *static_cast<const btCollisionObject*>(a);
  const auto& object_b = *static_cast<const btCollisionObject*>(b);
  const btVector3 normal = point.m_normalWorldOnB;
  const auto on_a = round_surface(object_a, point.m_index0, point.m_positionWorldOnA, -normal);
  const auto on_b = round_surface(object_b, point.m_index1, point.m_positionWorldOnB, normal);
  if (on_a.has_value() == on_b.has_value()) return true;  // of two round bodies the normal turns, too
  // the other body's point is the nearest one of the plane that it had
  if (on_a) {
    point.m_distance1 = (*on_a - point.m_positionWorldOnB).dot(normal);
    point.m_positionWorldOnA = *on_a;
    point.m_positionWorldOnB = *on_a - point.m_distance1 * normal;
  } else {
    point.m_distance1 = (point.m_positionWorldOnA - *on_b).dot(normal);
    point.m_positionWorldOnB = *on_b;
    point.m_positionWorldOnA = *on_b + point.m_distance1 * normal;
  }
  point.m_localPointA = object_a.getWorldTransform().invXform(point.m_positionWorldOnA);
  point.m_localPointB = object_b.getWorldTransform().invXform(point.m_positionWorldOnB);
  return true;
}

void Collision::install_hooks() {
  gCalculateCombinedFrictionCallback = &Collision::sliding_friction;
  gCalculateCombinedSpinningFrictionCallback = &Collision::spinning_friction;
  gCalculateCombinedRollingFrictionCallback = &Collision::rolling_friction;
  gContactAddedCallback = &Collision::shape_friction;
  gContactProcessedCallback = &Collision::renew_point;
  gCompoundChildShapePairCallback = &Collision::children_touch;
  gCompoundCompoundChildShapePairCallback = &Collision::children_touch;
}

}  // namespace assay::bullet
