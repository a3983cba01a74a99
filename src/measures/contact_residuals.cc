#include "measures/contact_residuals.h"

#include <algorithm>
#include <cmath>

namespace assay {
namespace {

Vec3 velocity_at(const Model& model, int shape, const Vec3& p_W, const State& before, const State& after) {
  const int body = model.shapes[static_cast<size_t>(shape)].body;
  if (body == kWorld) return Vec3::Zero();
  const auto b = static_cast<size_t>(body);
  return after.bodies[b].v_WBcm + after.bodies[b].w_WB.cross(p_W - before.bodies[b].p_WBcm);
}

std::uint64_t key_of(int shape_a, int shape_b) {
  const auto [low, high] = std::minmax(shape_a, shape_b);
  return (static_cast<std::uint64_t>(low) << 32U) | static_cast<std::uint64_t>(high);
}

}  // namespace

ContactSums::ContactSums(const Model& model, double timestep, bool with_friction)
    : model_(model), timestep_(timestep), with_friction_(with_friction) {
  for (const ContactPair& pair : model.contacts) friction_[key_of(pair.shape_a, pair.shape_b)] = pair.friction;
}

void ContactSums::add(const State& before, const State& after, const std::vector<ContactPoint>& contacts) {
  for (const ContactPoint& contact : contacts) {
    const auto pair = friction_.find(key_of(contact.shape_a, contact.shape_b));
    if (pair == friction_.end()) continue;
    const double friction = pair->second;
    const Vec3 speed = velocity_at(model_, contact.shape_b, contact.p_W, before, after) -
                       velocity_at(model_, contact.shape_a, contact.p_W, before, after);
    const double normal = contact.n_W.dot(contact.impulse_W), away = contact.n_W.dot(speed);
    const double press = std::abs(normal);
    pressed_ += press;
    depth_ += press * std::max(0.0, -contact.gap);
    // what is still apart may close its gap within the step
    signorini_ += press * std::abs(away + std::max(0.0, contact.gap) / timestep_);
    const Vec3 tangential = contact.impulse_W - normal * contact.n_W, slip = speed - away * contact.n_W;
    cone_ += std::max(0.0, tangential.norm() - friction * normal);  // a pull, too, is outside
    held_ += friction * press;
    dissipation_ += std::max(0.0, friction * press * slip.norm() + tangential.dot(slip));
  }
}

std::optional<ContactResiduals> ContactSums::residuals() const {
  if (!(pressed_ > 0)) return std::nullopt;
  ContactResiduals result{
      .depth = depth_ / pressed_, .signorini = signorini_ / pressed_, .cone = {}, .dissipation = {}};
  if (with_friction_) {
    result.cone = cone_ / pressed_;
    result.dissipation = held_ > 0 ? dissipation_ / held_ : 0;
  }
  return result;
}

}  // namespace assay
