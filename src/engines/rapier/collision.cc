#include "collision.h"

#include <algorithm>

#include "engines/adapter.h"

namespace assay::rapier {
namespace {

constexpr int kGroups = 32;  // bits

// Rows and columns are those of CollisionPlan::shapes.
class Relation {
 public:
  Relation(const Model& model, const std::vector<ShapePlan>& shapes, const std::vector<double>& pairs)
      : size_(shapes.size()), pairs_(pairs) {
    for (const ShapePlan& plan : shapes) body_.push_back(model.shapes[plan.shape].body);
  }

  size_t size() const { return size_; }
  // Rapier itself never lets two shapes of one body touch, nor two fixed ones.
  bool matters(size_t a, size_t b) const { return body_[a] != body_[b]; }
  bool touch(size_t a, size_t b) const { return pairs_[(a * size_) + b] >= 0; }

  // Do both touch the same others?
  bool alike(size_t a, size_t b) const {
    for (size_t other = 0; other < size_; ++other) {
      if (other == a || other == b || !matters(a, other) || !matters(b, other)) continue;
      if (touch(a, other) != touch(b, other)) return false;
    }
    return true;
  }

 private:
  size_t size_;
  const std::vector<double>& pairs_;
  std::vector<int> body_;
};

// Puts shapes that touch the same others into one group; false when that takes too many groups or cannot be said.
bool assign_groups(const Relation& relation, std::vector<ShapePlan>& shapes) {
  std::vector<std::vector<size_t>> groups;
  std::vector<size_t> group_of(relation.size());
  for (size_t s = 0; s < relation.size(); ++s) {
    size_t g = 0;
    while (g < groups.size() && !std::ranges::all_of(groups[g], [&](size_t m) { return relation.alike(s, m); })) ++g;
    if (g == groups.size()) groups.emplace_back();
    groups[g].push_back(s);
    group_of[s] = g;
  }
  if (groups.size() > kGroups) return false;

  std::vector<unsigned> collides(groups.size(), 0), apart(groups.size(), 0);
  for (size_t a = 0; a < relation.size(); ++a) {
    for (size_t b = 0; b < relation.size(); ++b) {
      if (!relation.matters(a, b)) continue;
      (relation.touch(a, b) ? collides : apart)[group_of[a]] |= 1U << group_of[b];
    }
  }
  for (size_t g = 0; g < groups.size(); ++g) {
    if ((collides[g] & apart[g]) != 0) return false;
  }
  for (size_t s = 0; s < shapes.size(); ++s) {
    shapes[s].groups = 1U << group_of[s];
    shapes[s].collides_with = collides[group_of[s]];
  }
  return true;
}

}  // namespace

CollisionPlan plan_collision(const Model& model) {
  CollisionPlan plan;
  const ContactShapes touching = contact_shapes(model);
  const std::vector<int>& row = touching.row;
  const ShapeFriction friction = shape_friction(model, FrictionRule::kLarger);
  for (size_t s = 0; s < model.shapes.size(); ++s) {
    if (touching.contains(s)) plan.shapes.push_back({.shape = static_cast<int>(s), .friction = friction.of[s]});
  }

  const size_t size = plan.shapes.size();
  plan.pairs.assign(size * size, -1.0);
  for (const ContactPair& pair : model.contacts) {
    const size_t a = row[pair.shape_a], b = row[pair.shape_b];
    plan.pairs[(a * size) + b] = plan.pairs[(b * size) + a] = pair.friction;
  }

  bool ask = false;
  for (const ContactPair& pair : model.contacts) {
    if (!friction.gives(pair)) plan.shapes[row[pair.shape_a]].look_up_friction = ask = true;
  }
  if (!assign_groups(Relation(model, plan.shapes, plan.pairs), plan.shapes)) {
    ask = true;
    for (ShapePlan& shape : plan.shapes) shape.filter_pairs = true;
  }
  if (!ask) plan.pairs.clear();
  return plan;
}

}  // namespace assay::rapier
