// How far the contact forces of an engine are from the laws of rigid contact with Coulomb friction: Signorini's
// condition, the friction cone, the principle of maximum dissipation. Which laws, and that engines relax them
// differently: Le Lidec, Jallet, Montaut, Laptev, Schmid, Carpentier, "Contact Models in Robotics: a Comparative
// Analysis", IEEE Transactions on Robotics, 2024. Formulas: docs/methodology.md, "Contact forces".
#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "model/model.h"

namespace assay {

// A contact point of one step. World frame, SI.
struct ContactPoint {
  int shape_a = 0, shape_b = 0;   // indices into Model::shapes
  Vec3 p_W = Vec3::Zero();        // where it acts
  Vec3 n_W = Vec3::UnitZ();       // from shape a to shape b
  double gap = 0;                 // m, when the step began
  Vec3 impulse_W = Vec3::Zero();  // N s, on shape b's body
};

// Means over contact points and steps, weighted by the normal impulses.
struct ContactResiduals {
  double depth = 0;      // m, overlap of what is pressed together
  double signorini = 0;  // m/s, speed along the normal of what is pressed together
  // Empty where the engine gives no friction.
  std::optional<double> cone;         // 1, friction beyond the coefficient times the normal impulse, over the latter
  std::optional<double> dissipation;  // m/s, speed of slip times the part of the largest friction that misses
};

class ContactSums {
 public:
  // The model has to outlive it. `timestep` in s; `with_friction`: impulses have a part across the normal.
  ContactSums(const Model& model, double timestep, bool with_friction);

  // The contacts of a step from `before` to `after`. Points are where the bodies were before, speeds those after: what
  // a solver's conditions are about.
  void add(const State& before, const State& after, const std::vector<ContactPoint>& contacts);

  // Empty when nothing pressed.
  std::optional<ContactResiduals> residuals() const;

 private:
  const Model& model_;
  double timestep_;
  bool with_friction_;
  std::unordered_map<std::uint64_t, double> friction_;  // by the shapes of a pair
  double pressed_ = 0, depth_ = 0, signorini_ = 0, cone_ = 0, dissipation_ = 0, held_ = 0;
};

}  // namespace assay
