// What differs between the releases of MuJoCo that the adapter is compiled for: 3.2.7 and newer (releases.txt). All of
// it is here; the other files are the same for every release.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include <mujoco/mujoco.h>

#include "engines/engine.h"

// The release as MAJOR * 1000000 + MINOR * 1000 + PATCH: until 3.4.0 mjVERSION_HEADER had one digit for each.
#if mjVERSION_HEADER < 1000
#define ASSAY_MUJOCO (mjVERSION_HEADER / 100 * 1000000 + mjVERSION_HEADER / 10 % 10 * 1000 + mjVERSION_HEADER % 10)
#else
#define ASSAY_MUJOCO mjVERSION_HEADER
#endif

namespace assay::mujoco {

// Integrators by the adapter's names.
inline constexpr std::array kIntegrators = {
    std::pair{"euler", mjINT_EULER},       std::pair{"rk4", mjINT_RK4}, std::pair{"implicitfast", mjINT_IMPLICITFAST},
    std::pair{"implicit", mjINT_IMPLICIT},
#if ASSAY_MUJOCO >= 3013000
    std::pair{"discrete", mjINT_DISCRETE},
#endif
};

// Groups of bodies are solved apart unless switched off since 3.3.6, and only when switched on before.
#if ASSAY_MUJOCO >= 3003006
inline constexpr bool kIslandsByDefault = true;
inline void set_islands(bool on, mjOption& option) {
  if (!on) option.disableflags |= mjDSBL_ISLAND;
}
#else
inline constexpr bool kIslandsByDefault = false;
inline void set_islands(bool on, mjOption& option) {
  if (on) option.enableflags |= mjENBL_ISLAND;
}
#endif

#if ASSAY_MUJOCO >= 3003000
inline constexpr auto kInertiaOfHull = mjMESH_INERTIA_CONVEX;
#else
inline constexpr auto kInertiaOfHull = mjINERTIA_CONVEX;
#endif

// An element's name is a member of its own before 3.3.4.
template <typename Element>
void set_name(Element* out, const std::string& name) {
#if ASSAY_MUJOCO >= 3003004
  mjs_setName(out->element, name.c_str());
#else
  mjs_setString(out->name, name.c_str());
#endif
}

// Stiffness and damping are polynomials since 3.7.0: their linear term.
inline double& linear(double& coefficient) { return coefficient; }
inline double& linear(double* coefficients) { return *coefficients; }

// Actuators have one control each before 3.11.0.
inline int control_of(const mjModel& model, int actuator) {
#if ASSAY_MUJOCO >= 3011000
  return model.actuator_ctrladr[actuator];
#else
  static_cast<void>(model);
  return actuator;
#endif
}

// Islands of a model with couplings end in an error of the engine ("edge array too small") from 3.3.6 to 3.4.0.
inline constexpr bool kIslandsTakeCouplings = !kIslandsByDefault || ASSAY_MUJOCO >= 3005000;

// What the newest release no longer does. Bounds: about 1.15 times what the tests measure.
inline std::vector<Deviation> former_deviations([[maybe_unused]] const Settings& settings) {
  std::vector<Deviation> former;
#if ASSAY_MUJOCO < 3007000
  const char* open =
      "before 3.7.0 connects and welds of moving bodies part with the square of their speed, because "
      "the constraint's own acceleration is not in its reference";
  former.insert(former.end(),
                {{"weld", 3.6e-3, open}, {"weld-distances", 0.031, open}, {"connect-distances", 0.037, open}});
#endif
#if ASSAY_MUJOCO < 3008000
  former.push_back({"resting-shapes", settings.get<std::string>("solver") == "pgs" ? 9.5e-3 : 5.5e-3,
                    "before 3.8.0 a lying cylinder sinks deeper into a box than into the ground"});
#elif ASSAY_MUJOCO < 3015000
  former.push_back({"bodies-at-rest", 1.2e-3, "from 3.8.0 to 3.14.0 a capsule that lies on a hull creeps by 1 mm"});
#endif
#if ASSAY_MUJOCO >= 3008000 && ASSAY_MUJOCO < 3013000
  former.push_back(
      {"cylinders-at-rest", 1.05e-3, "from 3.8.0 to 3.12.0 a cylinder that lies on a hull creeps by 0.9 mm"});
#endif
#if ASSAY_MUJOCO < 3013000
  if (settings.get<std::string>("cone") == "elliptic") {
    former.push_back({"hull-slides", 0.041, "before 3.13.0 a hull that slides turns by up to 0.04 rad"});
  }
#endif
#if ASSAY_MUJOCO < 4000000
  if (settings.get<std::string>("integrator") == "rk4") {
    const char* second = "before 4.0.0 the Runge-Kutta method turns free bodies and ball joints with second order";
    former.insert(former.end(), {{"torque-free-top", 1.4e-6, second},
                                 {"oblique-trees", 4.2e-8, second},
                                 {"torque-reaction", 2.5e-8, second},
                                 {"massless-joints", 4.3e-8, second},
                                 {"ball-armature", 1.2e-7, second},
                                 {"random-trees", 1.4e-7, second},
                                 {"random-massless-trees", 4.5e-7, second},
                                 {"spinning-bodies", 4e-6, second}});
  }
#endif
  return former;
}

// Calls `on_error` with the message of each of MuJoCo's errors, and nothing for its warnings, which mjData counts.
template <void (*on_error)(const char* message)>
void handle_errors() {
#if ASSAY_MUJOCO >= 3010000
  mju_setLogHandler([](const mjLogMessage* message) {
    if (message->level == mjLOG_ERROR) on_error(message->subject);
  });
#else
  mju_user_error = on_error;
  mju_user_warning = [](const char* /*message*/) {};
#endif
}

}  // namespace assay::mujoco
