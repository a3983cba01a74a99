#include "options.h"

#include <array>
#include <string>

#include "engines/adapter.h"

namespace assay::simbody {
namespace {

constexpr std::array<MethodFacts, 6> kMethods = {
    {{"euler", Method::kSemiExplicitEuler, 1, "semi-implicit Euler"},
     {"verlet", Method::kVerlet, 2, "velocity Verlet, trapezoidal in the velocities"},
     {"rk2", Method::kRungeKutta2, 2, "Runge-Kutta 2"},
     {"rk3", Method::kRungeKutta3, 3, "Runge-Kutta 3"},
     {"rkm", Method::kRungeKuttaMerson, 4, "Runge-Kutta-Merson"},
     {"rkf", Method::kRungeKuttaFehlberg, 4, "Runge-Kutta-Fehlberg"}}};

}  // namespace

std::vector<Setting> declared_settings() {
  return {{"integrator",
           "euler",
           "",
           "one step of it is one of assay's, whatever its own error estimate says: euler (semi-explicit), verlet, "
           "rk2, rk3, rkm (Merson), rkf (Fehlberg)",
           {"euler", "verlet", "rk2", "rk3", "rkm", "rkf"}},
          {"pd",
           "native",
           "",
           "joint springs and dampers: native: Simbody's own, evaluated in every stage of a step; explicit: torque "
           "from the state at the step's start",
           {"native", "explicit"}},
          {"limit_frequency",
           0.2,
           "rad",
           "a joint limit is a spring: how far it swings in a step; the stiffness follows from the joint's inertia",
           {},
           1e-3,
           1.0},
          {"limit_dissipation", 0.5, "s/rad", "Hunt-Crossley dissipation of joint limits", {}, 0.0, 1e3}};
}

Options read_options(const Settings& settings) {
  return {settings.timestep, method_facts(settings).method, is(settings, "pd", "native"),
          settings.get<double>("limit_frequency"), settings.get<double>("limit_dissipation")};
}

const MethodFacts& method_facts(const Settings& settings) {
  const auto& name = settings.get<std::string>("integrator");
  for (const MethodFacts& facts : kMethods) {
    if (name == facts.name) return facts;
  }
  throw EngineError("Simbody has no integrator '" + name + "'");
}

}  // namespace assay::simbody
