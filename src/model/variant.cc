#include "model/variant.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "model/couplings.h"
#include "model/joint.h"
#include "model/shape.h"

namespace assay {
namespace {

bool stands_free(const Model& model, int body) {
  while (body != kWorld && !model.bodies[static_cast<size_t>(body)].is_free()) {
    body = model.bodies[static_cast<size_t>(body)].parent;
  }
  return body != kWorld;
}

struct Ground {
  double height = std::numeric_limits<double>::infinity();  // of the lowest shape above its plane
  Vec3 normal_W = Vec3::UnitZ();                            // that plane's
};

// Of shapes that a free body carries with `free`, else of all.
Ground ground_of(const Model& model, bool free) {
  Ground lowest;
  for (const ContactPair& pair : model.contacts) {
    for (const auto& [a, b] : {std::pair(pair.shape_a, pair.shape_b), std::pair(pair.shape_b, pair.shape_a)}) {
      const Shape& plane = model.shapes[static_cast<size_t>(a)];
      const Shape& shape = model.shapes[static_cast<size_t>(b)];
      if (!is_plane(plane) || shape.body == kWorld) continue;
      if (free && !stands_free(model, shape.body)) continue;
      const Pose X_WS = shape_pose(model, model.initial, shape);
      const Vec3 normal_W = plane.X_BS.q * Vec3::UnitZ();
      const double height = (X_WS.p - plane.X_BS.p).dot(normal_W) - reach(model, shape, X_WS.q.conjugate() * -normal_W);
      if (height < lowest.height) lowest = {height, normal_W};
    }
  }
  return lowest;
}

void raise(Model& model, double height) {
  const Ground ground = ground_of(model, true);
  if (!std::isfinite(ground.height)) return;
  const Vec3 shift = (height - ground.height) * ground.normal_W;
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    if (stands_free(model, static_cast<int>(b))) model.initial.bodies[b].p_WBcm += shift;
  }
}

void set_rates(Model& model, double largest) {
  // The same every time and everywhere, unlike the standard's distributions.
  std::mt19937_64 random(1);  // NOLINT(bugprone-random-generator-seed)
  const auto uniform = [&] { return largest * (2 * static_cast<double>(random() >> 11U) * 0x1p-53 - 1); };
  State& state = model.initial;
  for (double& rate : state.velocity) rate = uniform();
  velocities_follow_leaders(model, state.velocity);
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    if (model.bodies[b].ball < 0) continue;
    for (int axis = 0; axis < 3; ++axis) state.bodies[b].w_WB[axis] = uniform();
  }
  bodies_from_joints(model, state);
}

int body_named(const Model& model, const std::string& name) {
  if (name == "world") return kWorld;
  const auto found = std::ranges::find(model.bodies, name, &Body::name);
  if (found != model.bodies.end()) return static_cast<int>(found - model.bodies.begin());
  std::vector<std::string> names = {"world"};
  for (const Body& body : model.bodies) names.push_back(body.name);
  throw InputError(fmt::format("'exclude' names '{}', and the model '{}' has no such body{}", name, model.name,
                               did_you_mean(name, names)));
}

void exclude(Model& model, const BodyPair& pair) {
  const int first = body_named(model, pair.a), second = body_named(model, pair.b);
  const std::pair<int, int> bodies = std::minmax(first, second);
  std::erase_if(model.contacts, [&](const ContactPair& contact) {
    const int a = model.shapes[static_cast<size_t>(contact.shape_a)].body;
    const int b = model.shapes[static_cast<size_t>(contact.shape_b)].body;
    return bodies == std::pair<int, int>(std::minmax(a, b));
  });
}

}  // namespace

double height_above_ground(const Model& model) { return ground_of(model, false).height; }

Model variant_of(Model model, const ModelVariant& variant) {
  if (variant == ModelVariant()) return model;
  for (const BodyPair& pair : variant.exclude) exclude(model, pair);
  if (variant.above_ground_m >= 0) raise(model, variant.above_ground_m);
  if (!variant.contacts || variant.smooth) model.contacts.clear();
  if (!variant.gravity) model.gravity.setZero();
  if (variant.smooth) {
    each_joint(model, [](auto& joint) { joint.limited = false, joint.dry_friction = 0; });
    for (Tendon& tendon : model.tendons) tendon.limited = false, tendon.dry_friction = 0;
  }
  if (variant.start_rates > 0) set_rates(model, variant.start_rates);
  model.hash = model_hash(model);
  return model;
}

}  // namespace assay
