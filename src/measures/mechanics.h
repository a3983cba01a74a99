// Energy and momenta of a state, and how far they drift. Formulas: docs/methodology.md, "Drift".
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/model.h"

namespace assay {

double kinetic_energy(const Model& model, const State& state);    // J
double potential_energy(const Model& model, const State& state);  // J: gravity and joint springs; zero at height 0
Vec3 linear_momentum(const Model& model, const State& state);     // kg m/s
Vec3 angular_momentum(const Model& model, const State& state, const Vec3& p_Wo);  // about o, kg m^2/s

// Which quantities the motion of a model conserves. Contact, joint damping and limits dissipate energy. Contact between
// moving bodies conserves momenta, contact with the world does not. Torques of a control (`driven`) are internal to a
// floating tree: they change its energy but neither of its momenta.
struct Conserved {
  bool energy = false;
  bool linear_momentum = false;
  bool angular_momentum = false;  // all three components about the world's origin
  // The component along the axis of the only hinge to the world, about its anchor.
  struct Axis {
    Vec3 p_Wo = Vec3::Zero();
    Vec3 axis_W = Vec3::UnitZ();
  };
  std::optional<Axis> angular_momentum_axis;

  bool any() const { return energy || linear_momentum || angular_momentum || angular_momentum_axis; }
};
Conserved conserved_quantities(const Model& model, bool driven = false);

// Of each conserved quantity the largest absolute deviation from the first state's value over a run, the same relative
// to the first state's kinetic energy (energy) or to the momentum's scale there: sum m |v| (linear), sum m |x - o| |v|
// + |I w| (angular), which is not zero when momenta of moving bodies cancel, and the deviation over time. Only
// conserved quantities are listed.
struct Drift {
  struct Quantity {
    std::string name;  // "energy", "linear_momentum", "angular_momentum"
    std::string unit;  // of `absolute`
    double absolute = 0;
    std::optional<double> relative;  // empty when nothing moves at the start
    // In each state, with its sign. Of a vector: its component along the direction in which the vector moves over the
    // whole run, so that a drift adds up and an oscillation does not.
    std::vector<double> deviation;
  };
  std::vector<Quantity> quantities;
};
Drift drift(const Model& model, const Conserved& conserved, const std::vector<State>& states);

}  // namespace assay
