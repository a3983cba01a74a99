// What differs between the releases of MuJoCo that the adapter is compiled for: 3.2.7 and newer (releases.txt). All of
// it is here; the other files are the same for every release.
#pragma once

#include <array>
#include <string>
#include <utility>

#include <mujoco/mujoco.h>

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
