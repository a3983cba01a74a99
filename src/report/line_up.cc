#include "report/line_up.h"

#include <algorithm>
#include <array>

namespace assay {

std::vector<std::string> line_up(const std::vector<std::string>& present, size_t most) {
  constexpr std::array kFirst = {"mujoco-euler", "mujoco-rk4",           "bullet-si-f64", "bullet-mb",
                                 "ode-quick",    "physx-d6-pgs",         "havok",         "physx-art-pgs",
                                 "dart",         "rapier-multibody-f64", "jolt-f64",      "simbody-euler",
                                 "simbody-rkm",  "rapier-impulse-f64",   "jolt-f32",      "ode-step"};
  std::vector<std::string> chosen;
  const auto add = [&](const std::string& name) {
    if (chosen.size() < most && std::ranges::find(chosen, name) == chosen.end()) chosen.push_back(name);
  };
  for (const char* name : kFirst) {
    if (std::ranges::find(present, name) != present.end()) add(name);
  }
  for (const std::string& name : present) add(name);
  return chosen;
}

}  // namespace assay
