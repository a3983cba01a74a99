#include "collision.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engines/adapter.h"

namespace assay::havok_adapter {
namespace {

constexpr size_t kMaxGroups = 32;

enum class Wish : char { kAny, kMeet, kPass };

bool agree(Wish a, Wish b) { return a == Wish::kAny || b == Wish::kAny || a == b; }

Wish merged(Wish a, Wish b) { return a == Wish::kAny ? b : a; }

// What each pair of shapes has to do: meet, pass, or either, where the two cannot meet anyway.
class Wishes {
 public:
  explicit Wishes(const Model& model) : count_(model.shapes.size()), wishes_(count_ * count_, Wish::kPass) {
    std::vector<bool> touches_parent(model.bodies.size(), false);
    for (const ContactPair& pair : model.contacts) {
      const int a = model.shapes[pair.shape_a].body, b = model.shapes[pair.shape_b].body;
      if (are_hinged(model, a, b)) touches_parent[model.bodies[a].parent == b ? a : b] = true;
    }
    std::vector<std::vector<size_t>> shapes_of(model.bodies.size() + 1);  // the world's first
    for (size_t s = 0; s < count_; ++s) shapes_of[static_cast<size_t>(model.shapes[s].body + 1)].push_back(s);
    const auto either = [&](int body_a, int body_b) {
      for (const size_t a : shapes_of[static_cast<size_t>(body_a + 1)]) {
        for (const size_t b : shapes_of[static_cast<size_t>(body_b + 1)]) at(a, b) = at(b, a) = Wish::kAny;
      }
    };
    either(kWorld, kWorld);
    for (size_t body = 0; body < model.bodies.size(); ++body) {
      const int own = static_cast<int>(body), parent = model.bodies[body].parent;
      either(own, own);
      if (are_hinged(model, own, parent) && !touches_parent[body]) either(own, parent);
    }
    for (const ContactPair& pair : model.contacts) {
      at(pair.shape_a, pair.shape_b) = at(pair.shape_b, pair.shape_a) = Wish::kMeet;
    }
  }

  Wish operator()(size_t a, size_t b) const { return wishes_[a * count_ + b]; }

  void merge(const std::vector<size_t>& others, size_t into, size_t from) {
    at(into, into) = merged(merged((*this)(into, into), (*this)(from, from)), (*this)(into, from));
    for (const size_t c : others) {
      if (c != into && c != from) at(into, c) = at(c, into) = merged((*this)(into, c), (*this)(from, c));
    }
  }

 private:
  Wish& at(size_t a, size_t b) { return wishes_[a * count_ + b]; }

  size_t count_;
  std::vector<Wish> wishes_;
};

// Whether b can be merged into a: they want nothing different of any shape, nor of each other and themselves.
bool can_merge(const Wishes& wishes, const std::vector<size_t>& shapes, size_t a, size_t b) {
  const Wish own = merged(wishes(a, a), wishes(b, b));
  return agree(wishes(a, a), wishes(b, b)) && agree(own, wishes(a, b)) &&
         std::ranges::all_of(shapes, [&](size_t c) { return c == a || c == b || agree(wishes(a, c), wishes(b, c)); });
}

// Products: a shape of each connected part is free, the others follow. Found for every tree of pairs without zeros.
std::optional<Friction> by_product(const Model& model) {
  Friction friction{havok::kMultiply, std::vector<double>(model.shapes.size(), 0)};
  std::vector<bool> settled(model.shapes.size(), false);
  for (const ContactPair& first : model.contacts) {
    if (settled[first.shape_a]) continue;
    friction.of[first.shape_a] = std::sqrt(first.friction);
    settled[first.shape_a] = true;
    for (bool again = true; again;) {
      again = false;
      for (const ContactPair& pair : model.contacts) {
        if (pair.friction == 0) return std::nullopt;
        for (const auto& [from, to] : {std::pair(pair.shape_a, pair.shape_b), std::pair(pair.shape_b, pair.shape_a)}) {
          if (!settled[from] || settled[to]) continue;
          friction.of[to] = pair.friction / friction.of[from];
          settled[to] = again = true;
        }
      }
    }
  }
  const bool exact = std::ranges::all_of(model.contacts, [&](const ContactPair& pair) {
    const double product = friction.of[pair.shape_a] * friction.of[pair.shape_b];
    return std::abs(product - pair.friction) <= 1e-6 * pair.friction;
  });
  if (!exact) return std::nullopt;
  return friction;
}

}  // namespace

bool are_hinged(const Model& model, int body_a, int body_b) {
  const auto is_child_of = [&model](int child, int parent) {
    return child != kWorld && parent != kWorld && !model.bodies[child].is_free() &&
           model.bodies[child].parent == parent;
  };
  return is_child_of(body_a, body_b) || is_child_of(body_b, body_a);
}

bool joint_has_contact(const Model& model, int body) {
  return std::ranges::any_of(model.contacts, [&](const ContactPair& pair) {
    const int a = model.shapes[pair.shape_a].body, b = model.shapes[pair.shape_b].body;
    const int parent = model.bodies[body].parent;
    return (a == body && b == parent) || (a == parent && b == body);
  });
}

Filters find_filters(const Model& model) {
  Wishes wishes(model);
  const ContactShapes touching = contact_shapes(model);

  // A merged shape wants what either of the two wanted, of all others, so that no later merge can contradict it.
  std::vector<size_t> shapes;
  for (size_t s = 0; s < model.shapes.size(); ++s) {
    if (touching.contains(s)) shapes.push_back(s);
  }
  std::vector<size_t> leaders;
  std::vector<size_t> leader_of(model.shapes.size(), 0);
  for (size_t i = 0; i < shapes.size(); ++i) {
    const size_t shape = shapes[i];
    // what is not merged away: the leaders and the shapes to come
    std::vector<size_t> others = leaders;
    others.insert(others.end(), shapes.begin() + static_cast<std::ptrdiff_t>(i), shapes.end());
    const auto leader =
        std::ranges::find_if(leaders, [&](size_t candidate) { return can_merge(wishes, others, candidate, shape); });
    if (leader == leaders.end()) {
      leaders.push_back(shape);
      if (leaders.size() > kMaxGroups) return {};
      leader_of[shape] = leaders.size() - 1;
    } else {
      wishes.merge(others, *leader, shape);
      leader_of[shape] = static_cast<size_t>(leader - leaders.begin());
    }
  }

  Filters filters;
  filters.of.resize(model.shapes.size());
  for (const size_t shape : shapes) {
    const size_t group = leader_of[shape];
    std::uint32_t collision = 0;
    for (size_t other = 0; other < leaders.size(); ++other) {
      if (wishes(leaders[group], leaders[other]) == Wish::kMeet) collision |= 1U << other;
    }
    filters.of[shape] = {1U << group, collision};
  }
  return filters;
}

std::optional<Friction> find_friction(const Model& model) {
  for (const FrictionRule rule : {FrictionRule::kLarger, FrictionRule::kSmaller}) {
    ShapeFriction own = shape_friction(model, rule);
    if (!own.gives_all(model)) continue;
    for (double& friction : own.of) friction = std::max(friction, 0.0);
    return Friction{rule == FrictionRule::kLarger ? havok::kMaximum : havok::kMinimum, std::move(own.of)};
  }
  return by_product(model);
}

}  // namespace assay::havok_adapter
