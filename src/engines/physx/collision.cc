#include "collision.h"

#include <algorithm>
#include <utility>

#include "convert.h"
#include "engines/adapter.h"
#include "plugin.h"

namespace assay::px {

using namespace physx;

std::vector<bool> bodies_in_trees(const Model& model) {
  std::vector<size_t> root(model.bodies.size());
  std::vector<bool> jointed(model.bodies.size(), false);  // of roots
  for (size_t b = 0; b < root.size(); ++b) {
    const Body& body = model.bodies[b];
    root[b] = body.parent == kWorld ? b : root[body.parent];
    if (!body.is_free()) jointed[root[b]] = true;
  }
  std::vector<bool> found(root.size());
  for (size_t b = 0; b < root.size(); ++b) found[b] = jointed[root[b]];
  return found;
}

Collision::Collision(const Model& model, const Options& options)
    : shapes_(model.shapes),
      size_(mean_extent(model)),
      contact_offset_(real(options.contact_offset > 0 ? options.contact_offset * size_
                                                      : contact_margin(model, options.timestep) / 2)) {
  frames_.reserve(model.bodies.size());
  for (const Body& body : model.bodies) {
    const PrincipalInertia principal = principal_inertia(body.I_BBcm_B);
    frames_.push_back({{body.p_BBcm, principal.q_BI}, principal.diagonal});
  }

  row_of_shape_ = contact_shapes(model).row;
  std::vector<bool> on_field(shapes_.size(), false);
  for (const ContactPair& pair : model.contacts) {
    if (shapes_[pair.shape_a].type == ShapeType::kHeightField) on_field[pair.shape_b] = true;
    if (shapes_[pair.shape_b].type == ShapeType::kHeightField) on_field[pair.shape_a] = true;
  }
  for (size_t s = 0; s < shapes_.size(); ++s) {
    if (row_of_shape_[s] < 0) continue;
    geometry_of_row_.push_back(geometries_.make(model, shapes_[s], on_field[s]));
    shape_of_row_.push_back(static_cast<int>(s));
  }
  make_tables(model, options);
  make_materials(model, options);
}

void Collision::make_tables(const Model& model, const Options& options) {
  const ShapeFriction own = shape_friction(model, FrictionRule::kLarger);
  for (const int shape : shape_of_row_) material_of_row_.push_back(own.of[shape]);
  std::vector<std::pair<int, int>> rows_of_pair;
  for (const ContactPair& pair : model.contacts) {
    std::pair rows(row_of_shape_[pair.shape_a], row_of_shape_[pair.shape_b]);
    if (!own.gives(pair) && !kContactModification) rows = {copy(rows.first, pair), copy(rows.second, pair)};
    rows_of_pair.push_back(rows);
  }
  rows_ = shape_of_row_.size();
  table_.assign(rows_ * rows_, kNever);
  std::vector<float> friction(rows_ * rows_, 0);
  const bool shares = kSharesFrictionTwice && options.tgs && options.joints == Joints::kArticulation &&
                      options.friction == Friction::kImprovedPatch;
  const std::vector<bool> is_link = bodies_in_trees(model);
  const auto on_link = [&](int shape) { return shapes_[shape].body != kWorld && is_link[shapes_[shape].body]; };
  for (size_t i = 0; i < model.contacts.size(); ++i) {
    const ContactPair& pair = model.contacts[i];
    const size_t a = rows_of_pair[i].first, b = rows_of_pair[i].second;
    const bool by_materials = own.gives(pair) || !kContactModification;
    std::uint8_t touch = by_materials ? kMaterials : kModified;
    if (shares && (on_link(pair.shape_a) || on_link(pair.shape_b))) touch |= kShared;
    table_[index(a, b)] = table_[index(b, a)] = touch;
    friction[index(a, b)] = friction[index(b, a)] = real(pair.friction);
    modifies_ = modifies_ || (touch & (kModified | kShared)) != 0;
  }
  if (modifies_) friction_ = std::move(friction);
}

// Another row with the same shape, whose material is that of `pair`.
int Collision::copy(int row, const ContactPair& pair) {
  geometry_of_row_.push_back(geometry_of_row_[row]);
  shape_of_row_.push_back(shape_of_row_[row]);
  material_of_row_.push_back(pair.friction);
  return static_cast<int>(shape_of_row_.size()) - 1;
}

void Collision::make_materials(const Model& model, const Options& options) {
  for (size_t row = 0; row < rows_ && !model.contacts.empty(); ++row) {
    const float mu = real(material_of_row_[row]);
    PxMaterial* material = sdk().createMaterial(mu, mu, real(options.restitution.coefficient));
    if (material == nullptr) throw EngineError("PhysX made no material: " + take_complaint());
    material->setFrictionCombineMode(PxCombineMode::eMAX);
#if PX_PHYSICS_VERSION_MAJOR == 5 && PX_PHYSICS_VERSION_MINOR < 6  // later ones always have improved patches
    material->setFlag(PxMaterialFlag::eIMPROVED_PATCH_FRICTION, options.friction == Friction::kImprovedPatch);
    if (options.compliance.is_set()) {  // of two materials alike PhysX takes the mean
      material->setFlag(PxMaterialFlag::eCOMPLIANT_CONTACT, true);
      material->setRestitution(real(-options.compliance.stiffness));
      material->setDamping(real(options.compliance.damping));
    }
#endif
    materials_.emplace_back(material);
  }
}

bool Collision::attach(PxRigidActor& actor, int body) const {
  const Pose X_IB = body == kWorld ? Pose{} : frames_[body].X_BI.inverse();
  bool any = false;
  for (size_t row = 0; row < rows_; ++row) {
    const Shape& shape = shapes_[shape_of_row_[row]];
    if (shape.body != body) continue;
    const PxMaterial& material = *materials_[row];
    // not for scene queries: their trees would be kept up to date for nobody
    const PxShapeFlags flags = PxShapeFlag::eSIMULATION_SHAPE;
    const Geometry& geometry = geometry_of_row_[row];
    PxShape* made = PxRigidActorExt::createExclusiveShape(actor, geometry.holder.any(), material, flags);
    if (made == nullptr) throw EngineError("PhysX made no shape: " + take_complaint());
    made->setLocalPose(to_px(X_IB * shape.X_BS * geometry.X_SG));
    made->setContactOffset(contact_offset_);
    made->setRestOffset(0);
    made->setSimulationFilterData(PxFilterData(static_cast<PxU32>(row), static_cast<PxU32>(rows_), 0, 0));
    any = true;
  }
  return any;
}

// NOLINTBEGIN(performance-unnecessary-value-param): PhysX's own signature
PxFilterFlags Collision::filter(PxFilterObjectAttributes /*attributes_a*/, PxFilterData a,
                                PxFilterObjectAttributes /*attributes_b*/, PxFilterData b, PxPairFlags& flags,
                                const void* table, PxU32 /*size*/) {
  const auto touch = static_cast<const std::uint8_t*>(table)[static_cast<size_t>(a.word0) * a.word1 + b.word0];
  if (touch == kNever) return PxFilterFlag::eKILL;
  flags = PxPairFlag::eCONTACT_DEFAULT;
  if ((touch & (kModified | kShared)) != 0) flags |= PxPairFlag::eMODIFY_CONTACTS;
  if ((touch & kReported) != 0) {
    flags |= PxPairFlag::eNOTIFY_TOUCH_FOUND | PxPairFlag::eNOTIFY_TOUCH_PERSISTS | PxPairFlag::eNOTIFY_CONTACT_POINTS;
  }
  return PxFilterFlag::eDEFAULT;
}
// NOLINTEND(performance-unnecessary-value-param)

void Collision::onContactModify(PxContactModifyPair* pairs, PxU32 count) {
  for (PxU32 i = 0; i < count; ++i) {
    const size_t a = pairs[i].shape[0]->getSimulationFilterData().word0;
    const size_t b = pairs[i].shape[1]->getSimulationFilterData().word0;
    const std::uint8_t touch = table_[index(a, b)];
    for (PxU32 k = 0; (touch & kModified) != 0 && k < pairs[i].contacts.size(); ++k) {
      pairs[i].contacts.setStaticFriction(k, friction_[index(a, b)]);
      pairs[i].contacts.setDynamicFriction(k, friction_[index(a, b)]);
    }
    if ((touch & kShared) != 0) share_friction(pairs[i]);
  }
}

void Collision::report_contacts(PxScene& scene) {
  if (table_.empty()) return;
  for (std::uint8_t& touch : table_) {
    if (touch != kNever) touch |= kReported;
  }
  scene.setFilterShaderData(table_.data(), static_cast<PxU32>(table_.size()));
  scene.setSimulationEventCallback(this);
}

void Collision::onContact(const PxContactPairHeader& /*header*/, const PxContactPair* pairs, PxU32 count) {
  std::vector<PxContactPairPoint> points;
  for (PxU32 i = 0; i < count; ++i) {
    points.resize(pairs[i].contactCount);
    const PxU32 found = pairs[i].extractContacts(points.data(), static_cast<PxU32>(points.size()));
    const int first = shape_of_row_[pairs[i].shapes[0]->getSimulationFilterData().word0];
    const int second = shape_of_row_[pairs[i].shapes[1]->getSimulationFilterData().word0];
    const double sign = first > second ? 1 : -1;  // normal and impulse are those of the first shape
    for (PxU32 k = 0; k < found; ++k) {
      contacts_.push_back({.shape_a = std::min(first, second),
                           .shape_b = std::max(first, second),
                           .p_W = from_px(points[k].position),
                           .n_W = sign * from_px(points[k].normal),
                           .gap = points[k].separation,
                           .impulse_W = sign * from_px(points[k].impulse)});
    }
  }
}

}  // namespace assay::px
