#include "options.h"

#include <string>

#include "engines/adapter.h"

namespace assay::havok_adapter {

std::vector<Setting> declared_settings() {
  std::vector<Setting> settings = {
      {"pd",
       "explicit",
       "",
       "joint springs and dampers: explicit: torques from the state at the step's start; native: Havok's own motor "
       "(spring force) on the hinge's axis",
       {"explicit", "native"},
       {},
       {}},
      {"ideal_step_time",
       0.0,
       "s",
       "timestep that the solver's stiffness is tuned for; 0: none, the same solver at every timestep (Havok's own "
       "default is 1/60)",
       {},
       0.0,
       1.0},
      {"max_speed", 1e6, "m/s", "speed above which bodies are slowed down (Havok's own default is 200)", {}, 1.0, 1e9},
      {"max_angular_speed",
       1e6,
       "rad/s",
       "angular speed above which bodies are slowed down (Havok's own default is 100)",
       {},
       1.0,
       1e9},
      lent_share_setting(),
      {"ground_size",
       100.0,
       "m",
       "least side of the box that replaces a plane, which Havok does not have",
       {},
       1.0,
       1e5},
      {"ground_thickness", 10.0, "m", "thickness of that box", {}, 0.1, 1e4},
  };
  add_restitution(settings, "");
  return settings;
}

Options read_options(const Settings& s) {
  return {.timestep = s.timestep,
          .native_springs = is(s, "pd", "native"),
          .ideal_step_time = s.get<double>("ideal_step_time"),
          .max_speed = s.get<double>("max_speed"),
          .max_angular_speed = s.get<double>("max_angular_speed"),
          .lent_share = s.get<double>("lent_share"),
          .restitution = restitution(s),
          .ground_size = s.get<double>("ground_size"),
          .ground_thickness = s.get<double>("ground_thickness")};
}

}  // namespace assay::havok_adapter
