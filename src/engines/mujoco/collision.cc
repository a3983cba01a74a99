#include "collision.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include <fmt/format.h>

#include "convert.h"
#include "engines/adapter.h"
#include "release.h"

namespace assay::mujoco {
namespace {

std::string hull_label(int hull) { return fmt::format("hull{}", hull); }
std::string field_label(int field) { return fmt::format("field{}", field); }

// A frictionless contact has no friction rows; MuJoCo would raise a zero coefficient to a small one.
int contact_dimension(const ContactPair& pair) {
  if (pair.rolling > 0) return 6;
  if (pair.torsional > 0) return 4;
  return pair.friction > 0 ? 3 : 1;
}

// Each shape's smallest of its pairs: if any give every pair its own as the larger of two, these do.
std::vector<ShapeContact> shape_contacts(const Model& model) {
  std::vector<ShapeContact> contacts(model.shapes.size());
  std::vector<bool> known(model.shapes.size(), false);
  for (const ContactPair& pair : model.contacts) {
    for (const int shape : {pair.shape_a, pair.shape_b}) {
      ShapeContact& own = contacts[shape];
      const ShapeContact of_pair = {contact_dimension(pair), pair.torsional, pair.rolling};
      own = known[shape]
                ? ShapeContact{std::min(own.dimension, of_pair.dimension), std::min(own.torsional, of_pair.torsional),
                               std::min(own.rolling, of_pair.rolling)}
                : of_pair;
      known[shape] = true;
    }
  }
  return contacts;
}

bool gives(const ShapeContact& a, const ShapeContact& b, const ContactPair& pair) {
  return std::max(a.dimension, b.dimension) == contact_dimension(pair) &&
         std::max(a.torsional, b.torsional) == pair.torsional && std::max(a.rolling, b.rolling) == pair.rolling;
}

// Heights above the lowest one, which the geom's pose takes out again.
double lowest(const HeightField& field) { return std::ranges::min(field.heights); }

void add_pair(mjSpec* spec, const ContactPair& contact, const Softness& soft) {
  mjsPair* pair = mjs_addPair(spec, nullptr);
  mjs_setString(pair->geomname1, shape_label(contact.shape_a).c_str());
  mjs_setString(pair->geomname2, shape_label(contact.shape_b).c_str());
  pair->condim = contact_dimension(contact);
  pair->friction[0] = pair->friction[1] = contact.friction;
  if (pair->condim > 3) {
    pair->friction[2] = contact.torsional;
    pair->friction[3] = pair->friction[4] = contact.rolling;
  }
  pair->margin = pair->gap = 0;
  std::ranges::copy(soft.reference, pair->solref);
  std::ranges::copy(soft.impedance, pair->solimp);
}

}  // namespace

std::string shape_label(size_t index) { return fmt::format("shape{}", index); }

// The broad phase can be used when each two bodies collide with all of their shapes or with none, with the friction
// that MuJoCo's rules give. It scales with the number of bodies, the list with that of pairs.
ContactPlan plan_contacts(const Model& model, const Tree& tree, bool explicit_pairs) {
  ContactPlan plan;
  plan.shapes = contact_shapes(model);
  plan.contact = shape_contacts(model);
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
    if (!gives(plan.contact[pair.shape_a], plan.contact[pair.shape_b], pair)) return plan;
    ++wanted[std::minmax(a.body, b.body)];
  }
  const auto related = [&](int a, int b) { return a != kWorld && tree.parent[b] == a; };
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

void add_shape_data(mjSpec* spec, const Model& model, const ContactPlan& plan) {
  std::set<std::pair<ShapeType, int>> added;
  for (size_t i = 0; i < model.shapes.size(); ++i) {
    const Shape& shape = model.shapes[i];
    if (shape.data < 0 || !plan.shapes.contains(i) || !added.emplace(shape.type, shape.data).second) continue;
    if (shape.type == ShapeType::kHull) {
      const Hull& hull = model.hulls[shape.data];
      mjsMesh* mesh = mjs_addMesh(spec, nullptr);
      set_name(mesh, hull_label(shape.data));
      mesh->inertia = kInertiaOfHull;
      mesh->maxhullvert = -1;
      for (const Vec3& vertex : hull.vertices) {
        for (const double x : vertex) mesh->uservert->push_back(static_cast<float>(x));
      }
      for (const std::array<int, 3>& face : hull.faces) {
        mesh->userface->insert(mesh->userface->end(), face.begin(), face.end());
      }
    } else if (shape.type == ShapeType::kHeightField) {
      // MuJoCo scales the heights to a range of 0 to 1, and has no flat field
      const HeightField& field = model.height_fields[shape.data];
      const double low = lowest(field), range = std::ranges::max(field.heights) - low;
      mjsHField* out = mjs_addHField(spec);
      set_name(out, field_label(shape.data));
      out->nrow = field.rows;
      out->ncol = field.columns;
      out->size[0] = field.half_x;
      out->size[1] = field.half_y;
      out->size[2] = range > 0 ? range : 1;
      out->size[3] = std::max(field.base + low, 1e-6);
      for (const double height : field.heights) {
        out->userdata->push_back(range > 0 ? static_cast<float>((height - low) / range) : 0.0F);
      }
    }
  }
}

void add_shape(mjsBody* body, const Model& model, size_t index, const ContactPlan& plan, const Softness& soft) {
  const Shape& shape = model.shapes[index];
  mjsGeom* geom = mjs_addGeom(body, nullptr);
  set_name(geom, shape_label(index));
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
      geom->type = mjGEOM_BOX;
      Eigen::Map<Vec3>(geom->size) = shape.half_size;
      break;
    case ShapeType::kCylinder:
      geom->type = mjGEOM_CYLINDER;
      geom->size[0] = shape.radius;
      geom->size[1] = shape.half_length;
      break;
    case ShapeType::kEllipsoid:
      geom->type = mjGEOM_ELLIPSOID;
      Eigen::Map<Vec3>(geom->size) = shape.half_size;
      break;
    case ShapeType::kHull:  // MuJoCo moves a mesh to its principal axes and the geom the other way
      geom->type = mjGEOM_MESH;
      mjs_setString(geom->meshname, hull_label(shape.data).c_str());
      break;
    case ShapeType::kHeightField:
      geom->type = mjGEOM_HFIELD;
      mjs_setString(geom->hfieldname, field_label(shape.data).c_str());
      Eigen::Map<Vec3>(geom->pos) = shape.X_BS * Vec3(0, 0, lowest(model.height_fields[shape.data]));
      break;
  }
  const ShapeContact& contact = plan.contact[index];
  geom->contype = geom->conaffinity = plan.broad_phase ? 1 : 0;
  geom->condim = contact.dimension;
  geom->friction[0] = shape.friction;
  if (contact.dimension > 3) {
    geom->friction[1] = contact.torsional;
    geom->friction[2] = contact.rolling;
  }
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
