#include "collision.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace assay::box3d {
namespace {

// A plane goes on for ever; the box that stands for it is put where the bodies are.
Vec3 middle_of(const State& start) {
  Vec3 sum = Vec3::Zero();
  for (const BodyState& body : start.bodies) sum += body.p_WBcm;
  return start.bodies.empty() ? sum : Vec3(sum / static_cast<double>(start.bodies.size()));
}

Pose box_of_plane(const Pose& plane, const State& start) {
  Vec3 foot = plane.inverse() * middle_of(start);
  foot.z() = 0;
  return {plane * foot, plane.q};
}

// Four times the way from the middle to the farthest body, if that is more than what the settings ask for.
double box_size(const State& start, double least) {
  const Vec3 middle = middle_of(start);
  for (const BodyState& body : start.bodies) least = std::max(least, 4 * (body.p_WBcm - middle).norm());
  return least;
}

}  // namespace

Collision::Collision(const Model& model, const State& start, const Options& options)
    : model_(model),
      start_(start),
      shapes_(contact_shapes(model)),
      friction_(shape_friction(model, FrictionRule::kLarger)),
      by_shape_(friction_.gives_all(model)),
      touch_(static_cast<size_t>(shapes_.count) * shapes_.count, false),
      maker_(box_size(start, options.ground_size), options.ground_thickness),
      restitution_(options.restitution) {
  if (!by_shape_) pair_friction_.resize(touch_.size(), 0);
  for (const ContactPair& pair : model.contacts) {
    const int a = shapes_.row[pair.shape_a], b = shapes_.row[pair.shape_b];
    touch_[at(a, b)] = touch_[at(b, a)] = true;
    if (!by_shape_) pair_friction_[at(a, b)] = pair_friction_[at(b, a)] = real(pair.friction);
  }
  tags_.resize(model.shapes.size());
  for (size_t s = 0; s < tags_.size(); ++s) tags_[s] = {this, static_cast<int>(s), shapes_.row[s]};
}

void Collision::prepare(b3WorldDef& definition) const {
  definition.frictionCallback = by_shape_ ? larger_friction : pair_friction;
}

float Collision::larger_friction(float a, uint64_t /*of_a*/, float b, uint64_t /*of_b*/) { return std::max(a, b); }

float Collision::pair_friction(float /*of_a*/, uint64_t a, float /*of_b*/, uint64_t b) {
  const Tag& first = *std::bit_cast<const Tag*>(a);
  const Tag& second = *std::bit_cast<const Tag*>(b);
  return first.owner->pair_friction_[first.owner->at(first.row, second.row)];
}

bool Collision::may_touch(b3ShapeId a, b3ShapeId b, void* context) {
  const Collision& self = *static_cast<const Collision*>(context);
  return self.touch_[self.at(tag_of(a).row, tag_of(b).row)];
}

bool Collision::can_touch(int body_a, int body_b) const {
  return std::ranges::any_of(model_.contacts, [&](const ContactPair& pair) {
    const int a = model_.shapes[pair.shape_a].body, b = model_.shapes[pair.shape_b].body;
    return (a == body_a && b == body_b) || (a == body_b && b == body_a);
  });
}

// Whether a shape must not touch one that Box3D would let it touch.
bool Collision::is_filtered(size_t shape) const {
  const int body = model_.shapes[shape].body, row = shapes_.row[shape];
  for (size_t other = 0; other < model_.shapes.size(); ++other) {
    if (shapes_.contains(other) && model_.shapes[other].body != body && !touch_[at(row, shapes_.row[other])])
      return true;
  }
  return false;
}

void Collision::create_shapes(b3WorldId world, const std::vector<b3BodyId>& bodies) {
  bool any_filtered = false;
  for (size_t s = 0; s < model_.shapes.size(); ++s) {
    if (!shapes_.contains(s)) continue;
    const Shape& shape = model_.shapes[s];
    b3ShapeDef definition = b3DefaultShapeDef();
    definition.userData = &tags_[s];
    definition.density = 0;
    definition.updateBodyMass = false;
    definition.baseMaterial.friction = real(friction_.of[s]);
    definition.baseMaterial.restitution = real(restitution_.coefficient);  // Box3D takes the larger of two
    definition.baseMaterial.userMaterialId = std::bit_cast<uint64_t>(&tags_[s]);
    definition.enableCustomFiltering = is_filtered(s);
    any_filtered = any_filtered || definition.enableCustomFiltering;
    if (shape.body != kWorld) {
      const Pose X{shape.X_BS.p - model_.bodies[shape.body].p_BBcm, shape.X_BS.q};
      maker_.make(model_, shape, X, bodies[shape.body], definition);
      continue;
    }
    // a body of its own, whose position may be double
    const Pose X = shape.type == ShapeType::kPlane ? box_of_plane(shape.X_BS, start_) : shape.X_BS;
    b3BodyDef fixed = b3DefaultBodyDef();
    fixed.position = b3_position(X.p);
    fixed.rotation = b3_rotation(X.q);
    maker_.make(model_, shape, {}, b3CreateBody(world, &fixed), definition);
  }
  if (any_filtered) b3World_SetCustomFilterCallback(world, may_touch, this);
}

void Collision::read_forces(const std::vector<b3BodyId>& bodies, const std::vector<Vec3>& centres,
                            std::vector<ContactForce>& out) const {
  std::vector<b3ContactData> found;
  for (size_t b = 0; b < bodies.size(); ++b) {
    found.resize(static_cast<size_t>(b3Body_GetContactCapacity(bodies[b])));
    found.resize(static_cast<size_t>(b3Body_GetContactData(bodies[b], found.data(), static_cast<int>(found.size()))));
    for (const b3ContactData& contact : found) {
      const int first = tag_of(contact.shapeIdA).shape, second = tag_of(contact.shapeIdB).shape;
      const int body_a = model_.shapes[first].body, body_b = model_.shapes[second].body;
      // each contact is in the lists of both of its bodies
      if (static_cast<int>(b) != (body_a == kWorld ? body_b : body_a)) continue;
      const double sign = first < second ? 1 : -1;
      for (int m = 0; m < contact.manifoldCount; ++m) {
        const b3Manifold& manifold = contact.manifolds[m];
        const Vec3 normal = vec3(manifold.normal);
        // friction acts at the middle of the points
        const Vec3 friction = vec3(manifold.frictionImpulse) / manifold.pointCount;
        for (int p = 0; p < manifold.pointCount; ++p) {
          const b3ManifoldPoint& point = manifold.points[p];
          const Vec3 p_W = body_a == kWorld ? Vec3(centres[body_b] + vec3(point.anchorB))
                                            : Vec3(centres[body_a] + vec3(point.anchorA));
          out.push_back({.shape_a = std::min(first, second),
                         .shape_b = std::max(first, second),
                         .p_W = p_W,
                         .n_W = sign * normal,
                         .gap = point.separation,
                         .impulse_W = sign * (point.normalImpulse * normal + friction)});
        }
      }
    }
  }
}

}  // namespace assay::box3d
