// What tests of policies share: a robot, the texts of configurations, a folder for their files.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "controls/policy_config.h"
#include "model/kinematics.h"
#include "temp_folder.h"

namespace assay {

// A free trunk, whose centre of mass lies 0.1 m in front of its frame, and two hinges in a row.
inline Model walker() {
  Model model;
  model.name = "walker";
  model.bodies.push_back({.name = "trunk", .X_PB = {}, .mass = 5, .p_BBcm = {0.1, 0, 0}});
  model.bodies.push_back({.name = "thigh", .parent = 0, .joint = 0, .X_PB = {}, .mass = 1});
  model.bodies.push_back({.name = "shank", .parent = 1, .joint = 1, .X_PB = {}, .mass = 1});
  model.joints.push_back({.name = "hip", .body = 1});
  model.joints.push_back({.name = "knee", .body = 2});
  for (int joint : {0, 1}) {
    Actuator& motor = model.actuators.emplace_back();
    motor.name = model.joints[static_cast<size_t>(joint)].name + "_motor";
    motor.terms = {{joint, 1}};
    motor.force_limited = true;
    motor.force_lower = -20;
    motor.force_upper = 20;
  }
  model.initial = reference_state(model);
  model.initial.position = {0.5, -1};
  return model;
}

inline constexpr const char* kControl = "[control]\ntimestep_ms = 5\ndecimation = 4\n";
inline constexpr const char* kActions = "[actions]\ntype = \"joint_position\"\nscale = 0.25\n";
inline constexpr const char* kPd = "[pd]\nstiffness = 20\ndamping = 0.5\n";
inline constexpr const char* kTerms = "[[observations.terms]]\nterm = \"joint_pos_rel\"\n";

// The parts of a configuration, `top` first.
inline std::string config_text(const std::string& terms = kTerms, const std::string& top = "",
                               const std::string& actions = kActions, const std::string& pd = kPd,
                               const std::string& observations = "", const std::string& control = kControl,
                               const std::string& more = "") {
  return top + control + actions + pd + "[observations]\n" + observations + terms + more;
}

inline std::string term(const std::string& name, const std::string& more = "") {
  return "[[observations.terms]]\nterm = \"" + name + "\"\n" + more;
}

inline PolicyConfig parsed(const std::string& text) { return parse_policy_config(walker(), text, "policy.toml"); }

class PolicyFile : public TempFolderTest {
 protected:
  std::string write(const std::string& name, const std::string& content) const {
    std::filesystem::create_directories(dir_);
    const std::string path = (dir_ / name).string();
    std::ofstream(path, std::ios::binary) << content;
    return path;
  }
};

}  // namespace assay
