#include "settings.h"

#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cells.h"

namespace assay {
namespace {

using nlohmann::json;

struct Made {
  std::string name, engine, iterations, softness;  // settings' names; "" for none
  bool joint = false;
  double kilohertz = 0, error = 0, depth = 0;  // at 1 ms, with 50 iterations
};

const std::vector<Made>& made() {
  static const std::vector<Made> kMade = {
      {"mujoco-euler", "mujoco", "iterations", "contact_timeconst", true, 14, 8e-4, 3.4e-2},
      {"mujoco-euler-cg", "mujoco", "iterations", "contact_timeconst", true, 18, 1e-3, 3.4e-2},
      {"bullet-si-f64", "bullet-f64", "iterations", "contact_erp", false, 12, 9e-3, 5.5e-4},
      {"bullet-mb", "bullet-f64", "iterations", "contact_erp", true, 9, 8e-3, 6e-4},
      {"ode-quick", "ode", "iterations", "contact_erp", false, 15, 1.3e-2, 1.4e-3},
      {"physx-d6-pgs", "physx", "position_iterations", "", false, 30, 7e-3, 1.4e-4},
      {"jolt-f32", "jolt", "velocity_steps", "baumgarte", false, 26, 6e-3, 3e-4},
      {"rapier-impulse-f64", "rapier", "solver_iterations", "contact_natural_frequency", false, 22, 5e-3, 2e-3},
      {"havok", "havok", "", "", false, 29, 7e-3, 1e-3},
      {"dart", "dart", "", "contact_erp", true, 2, 6e-3, 1e-3}};
  return kMade;
}

struct Setting {
  int iterations = 50;
  double softness = 1;
};

std::vector<Setting> settings_of(const Made& contender) {
  std::vector<Setting> all;
  for (const int iterations : {50, 4, 10, 200}) {
    for (const double softness : {1.0, 0.25, 4.0}) {
      if (iterations != 50 && contender.iterations.empty()) continue;
      if (softness != 1 && contender.softness.empty()) continue;
      all.push_back({iterations, softness});
    }
  }
  return all;
}

std::string name_of(const Made& contender, const Setting& setting) {
  std::string name = contender.name;
  if (setting.iterations != 50) name += fmt::format(" it={}", setting.iterations);
  if (setting.softness != 1) name += fmt::format(" {}={:g}", contender.softness, 0.2 * setting.softness);
  return name;
}

ContenderRow row_of(const Made& contender, const Setting& setting) {
  json changes = json::array();
  const auto add = [&](const std::string& name, const std::string& value, const char* otherwise, const char* meaning) {
    changes.push_back(
        {{"setting", name}, {"value", value}, {"default", otherwise}, {"unit", ""}, {"meaning", meaning}});
  };
  if (setting.iterations != 50) {
    add(contender.iterations, std::to_string(setting.iterations), "50", "sweeps of the constraint solver in a step");
  }
  if (setting.softness != 1) {
    add(contender.softness, fmt::format("{:g}", 0.2 * setting.softness), "0.2", "how contacts give way");
  }
  json capabilities = {{"coordinates", contender.joint ? "joint" : "maximal"},
                       {"integrator", "semi-implicit Euler"},
                       {"contact", true},
                       {"deviations", json::array()},
                       {"changes", changes}};
  if (!changes.empty()) capabilities["varies"] = contender.name;
  return {name_of(contender, setting),
          contender.engine,
          "1.2.3",
          contender.name,
          "",
          capabilities.dump(),
          json{{"version", "1.2.3"}, {"source", "fixture"}}.dump()};
}

}  // namespace

void put_settings(Store& store) {
  std::vector<ContenderRow> rows;
  for (const Made& contender : made()) {
    for (const Setting& setting : settings_of(contender)) rows.push_back(row_of(contender, setting));
  }
  store.set_contenders(rows);
  const std::vector<std::string> systems = {"capsules-27", "grasp"};
  store.set_systems({{systems[0], R"({"dof": 162, "bodies": 27, "contact_pairs": 378, "duration_s": 3.2})"},
                     {systems[1], R"({"dof": 22, "bodies": 17, "contact_pairs": 99, "duration_s": 5})"}});
  store.set_manifest({{"campaign", "settings"}, {"campaign_title", "A sweep, made up"}, {"cpu", "Example CPU"}});
  for (const Made& contender : made()) {
    store.set_conformance(contender.name, {{contender.name, "free-fall", "pass", 1e-7, 1e-3, "m", ""}});
    for (const std::string& system : systems) {
      for (const Setting& setting : settings_of(contender)) {
        const std::string name = name_of(contender, setting);
        for (const double step : {1.0 / 8, 1.0 / 2, 1.0, 2.0, 4.0, 8.0, 16.0}) {
          const double work = 0.4 + 0.6 * setting.iterations / 50;
          const double kilohertz = contender.kilohertz / work / (system == "grasp" ? 2 : 1);
          put_speed(store, cell(system, name, step, "raw_speed"), kilohertz, 0.01, {1e3 / kilohertz});
          Cell pieces = cell(system, name, step, "consistency");
          if (setting.iterations < 10 && step > 4 && !contender.joint) {
            fail(store, pieces, Outcome::kDiverged, "by 0.1 s: a body is 1e6 m away");
            continue;
          }
          const double error =
              contender.error * step / std::sqrt(setting.softness) * std::pow(50.0 / setting.iterations, 0.7);
          pieces.values = {{"consistency", "m", error, 0.8 * error, 1.3 * error}};
          store.put_cell(pieces);
          Cell violation = cell(system, name, step, "violation");
          violation.values = {{"penetration_max", "m", contender.depth * setting.softness * (1 + step), {}, {}}};
          store.put_cell(violation);
        }
      }
    }
  }
}

}  // namespace assay
