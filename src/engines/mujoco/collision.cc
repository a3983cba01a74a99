#include "collision.h"

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "convert.h"
#include "engines/adapter.h"

namespace assay::mujoco {
namespace {

std::string shape_label(size_t shape) { return fmt::format("shape{}", shape); }

// A frictionless contact has no friction rows; MuJoCo would raise a zero coefficient to a small one.
int contact_dimension(double friction) { return friction > 0 ? 3 : 1; }

void add_pair(mjSpec* spec, const ContactPair& contact, const Softness& soft) {
  mjsPair* pair = mjs_addPair(spec, nullptr);
  mjs_setString(pair->geomname1, shape_label(contact.shape_a).c_str());
  mjs_setString(pair->geomname2, shape_label(contact.shape_b).c_str());
  pair->condim = contact_dimension(contact.friction);
  pair->friction[0] = pair->friction[1] = contact.friction;
  pair->margin = pair->gap = 0;
  std::ranges::copy(soft.reference, pair->solref);
  std::ranges::copy(soft.impedance, pair->solimp);
}

}  // namespace

// The broad phase can be used when each two bodies collide with all of their shapes or with none, with the friction
// that MuJoCo's rule gives. It scales with the number of bodies, the list with that of pairs.
ContactPlan plan_contacts(const Model& model, bool explicit_pairs) {
  ContactPlan plan;
  plan.shapes = contact_shapes(model);
  if (explicit_pairs || model.contacts.empty()) return plan;

  const int bodies = static_cast<int>(model.bodies.size());
  const auto slot = [](int body) { return static_cast<size_t>(body) + 1; };  // the world first
  std::vector<int> shapes(slot(bodies), 0);
  for (size_t i = 0; i < model.shapes.size(); ++i) {
    if (plan.shapes.contains(i)) ++shapes[slot(model.shapes[i].body)];
  }
  std::map<std::pair<int, int>, int> wanted;  // pairs of shapes for each two bodies
  for (const ContactPair& pair : model.contacts) {
    const Shape& a = model.shapes[pair.shape_a];
    const Shape& b = model.shapes[pair.shape_b];
    if (pair.friction != std::max(a.friction, b.friction)) return plan;
    ++wanted[std::minmax(a.body, b.body)];
  }
  const auto related = [&](int a, int b) { return a != kWorld && model.bodies[b].parent == a; };
  for (const auto& [pair, count] : wanted) {
    const auto [a, b] = pair;
    if (a == b || count != shapes[slot(a)] * shapes[slot(b)]) return plan;
    if (related(a, b)) plan.filter_parents = false;
  }
  for (int a = kWorld; a < bodies; ++a) {
    for (int b = a + 1; b < bodies; ++b) {
      if (shapes[slot(a)] == 0 || shapes[slot(b)] == 0 || wanted.contains({a, b})) continue;
      if (!(plan.filter_parents && related(a, b))) plan.apart.emplace_back(a, b);
    }
  }
  plan.broad_phase = true;
  return plan;
}

std::string body_label(int body) { return body == kWorld ? "world" : fmt::format("body{}", body); }

void add_shape(mjsBody* body, const Shape& shape, size_t index, bool filtered, const Softness& soft) {
  mjsGeom* geom = mjs_addGeom(body, nullptr);
  mjs_setName(geom->element, shape_label(index).c_str());
  Eigen::Map<Vec3>(geom->pos) = shape.X_BS.p;
  copy_quat(shape.X_BS.q, geom->quat);
  switch (shape.type) {
    case ShapeType::kSphere:
      geom->type = mjGEOM_SPHERE;
      geom->size[0] = shape.radius;
      break;
    case ShapeType::kCapsule:
      geom->type = mjGEOM_CAPSULE;
      geom->size[0] = shape.radius;
      geom->size[1] = shape.half_length;
      break;
    case ShapeType::kPlane:
      geom->type = mjGEOM_PLANE;
      geom->size[2] = 1;  // spacing of drawn grid lines; the plane is infinite
      break;
    case ShapeType::kBox:
    case ShapeType::kCylinder:
    case ShapeType::kEllipsoid:
    case ShapeType::kHull:
    case ShapeType::kHeightField:
      throw UnsupportedError("this shape is refused by check()");
  }
  geom->contype = geom->conaffinity = filtered ? 1 : 0;
  geom->condim = contact_dimension(shape.friction);
  geom->friction[0] = shape.friction;
  std::ranges::copy(soft.reference, geom->solref);
  std::ranges::copy(soft.impedance, geom->solimp);
}

void add_pairs(mjSpec* spec, const Model& model, const ContactPlan& plan, const Softness& soft) {
  if (plan.broad_phase) {
    for (const auto& [a, b] : plan.apart) {
      const mjsExclude* exclude = mjs_addExclude(spec);
      mjs_setString(exclude->bodyname1, body_label(a).c_str());
      mjs_setString(exclude->bodyname2, body_label(b).c_str());
    }
  } else {
    for (const ContactPair& pair : model.contacts) add_pair(spec, pair, soft);
  }
}

}  // namespace assay::mujoco
