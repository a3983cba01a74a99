#include "results/line_up.h"

#include <algorithm>
#include <array>

namespace assay {
namespace {

constexpr const char* kDense = "MuJoCo dense";
// Of the paper's text, and not of its figures of all systems.
constexpr std::array kInTextOnly = {"MuJoCo sparse", "ODE exact", "the fastest gaming engine"};

bool holds(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

}  // namespace

const std::vector<StandIns>& paper_line_up() {
  static const std::vector<StandIns> kLineUp = {
      {"MuJoCo Euler", {"mujoco-euler"}},
      {"MuJoCo RK4", {"mujoco-rk4"}},
      // The paper does not give the precision of its one build.
      {"Bullet", {"bullet-si-f64", "bullet-si-f32"}},
      {"BulletMB", {"bullet-mb"}},
      {"ODE", {"ode-quick"}},
      {"PhysX", {"physx-d6-pgs"}},
      {"Havok", {"havok"}},
      // With its own drives as springs, as in the paper; they differ in the grasp only.
      {"PhysX with drives", {"physx-d6-pgs-native-pd"}},
      // Its sparse solver works without the Hessian, as conjugate gradients do and today's default, Newton, does not.
      {"MuJoCo sparse", {"mujoco-euler-cg", "mujoco-euler"}},
      {kDense, {"mujoco-euler-dense"}},
      {"ODE exact", {"ode-step"}},
      {"the fastest gaming engine", {"physx-d6-pgs", "havok", "bullet-si-f64", "bullet-si-f32", "ode-quick"}}};
  return kLineUp;
}

std::vector<std::string> papers_among(const std::vector<std::string>& present, bool solvers) {
  std::vector<std::string> chosen;
  for (const auto& [engine, names] : paper_line_up()) {
    if ((engine == kDense && !solvers) || std::ranges::find(kInTextOnly, engine) != kInTextOnly.end()) continue;
    const auto found = std::ranges::find_if(names, [&](const std::string& name) { return holds(present, name); });
    if (found != names.end() && !holds(chosen, *found)) chosen.push_back(*found);
  }
  return chosen;
}

std::vector<std::string> line_up(const std::vector<std::string>& present, size_t most) {
  constexpr std::array kOthers = {"physx-art-pgs",      "dart",          "rapier-multibody-f64",
                                  "jolt-f64",           "simbody-euler", "simbody-rkm",
                                  "rapier-impulse-f64", "jolt-f32",      "ode-step"};
  std::vector<std::string> chosen;
  const auto add = [&](const std::string& name) {
    if (chosen.size() < most && holds(present, name) && !holds(chosen, name)) chosen.push_back(name);
  };
  for (const std::string& name : papers_among(present)) add(name);
  for (const char* name : kOthers) add(name);
  for (const std::string& name : present) add(name);
  return chosen;
}

std::vector<std::string> shown_first(const std::vector<std::string>& present) {
  constexpr size_t kMany = 16, kFew = 3;
  const std::vector<std::string> papers = papers_among(present, /*solvers=*/true);
  return present.size() <= kMany || papers.size() < kFew ? present : papers;
}

}  // namespace assay
