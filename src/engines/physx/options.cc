#include "options.h"

#include <string>

namespace assay::px {

std::vector<Setting> declared_settings() {
  std::vector<Setting> list;
  const auto add = [&list](const char* name, SettingValue value, const char* unit, const char* meaning,
                           std::vector<std::string> choices = {}, std::optional<double> minimum = {},
                           std::optional<double> maximum = {}) {
    list.push_back({name, std::move(value), unit, meaning, std::move(choices), minimum, maximum});
  };
  add("joints", std::string("d6"), "",
      "d6, revolute: six coordinates a body and PhysX's joint of that name as a constraint; articulation: joint "
      "coordinates",
      {"d6", "revolute", "articulation"});
  add("solver", std::string("pgs"), "",
      "constraint solver: projected Gauss-Seidel, or temporal Gauss-Seidel, whose position iterations are substeps",
      {"pgs", "tgs"});
  add("position_iterations", 50LL, "", "solver iterations that also correct positions (PhysX's own default is 4)", {},
      1, 255);
  add("velocity_iterations", 1LL, "", "solver iterations after them that only set velocities", {}, 0, 255);
  add("friction", std::string("improved_patch"), "",
      "improved_patch: up to two anchors a contact patch, which share its normal force; patch: each takes all of it, "
      "up "
      "to twice Coulomb's friction; one_directional, two_directional: at every contact point (pgs only)",
      {"improved_patch", "patch", "one_directional", "two_directional"});
  add("friction_every_iteration", false, "",
      "pgs with patches: friction in every iteration, not in the last three alone (tgs always does)");
  add("pd", std::string("explicit"), "",
      "joint springs and dampers: explicit torque from the state at the step's start, or native: PhysX's joint drive",
      {"explicit", "native"});
  add("gyroscopic", true, "",
      "rigid bodies: gyroscopic torque (off in PhysX's defaults; articulations always have it)");
  add("contact_offset", 0.02, "1",
      "distance from which a shape makes contacts, over the mean size of the model's shapes (PhysX's own default is "
      "0.02 "
      "m)",
      {}, 1e-6, 10);
  add("link_cfm", 0.0, "1/kg",
      "constraint force mixing of an articulation's contacts and limits (PhysX's own is 0.025)", {}, 0, 1);
  return list;
}

Options read_options(const Settings& settings) {
  const auto integer = [&settings](const char* name) { return static_cast<int>(settings.get<long long>(name)); };
  Options options;
  options.timestep = settings.timestep;
  const auto& joints = settings.get<std::string>("joints");
  if (joints == "revolute") options.joints = Joints::kRevolute;
  if (joints == "articulation") options.joints = Joints::kArticulation;
  options.tgs = settings.get<std::string>("solver") == "tgs";
  options.position_iterations = integer("position_iterations");
  options.velocity_iterations = integer("velocity_iterations");
  const auto& friction = settings.get<std::string>("friction");
  if (friction == "patch") options.friction = Friction::kPatch;
  if (friction == "one_directional") options.friction = Friction::kOneDirectional;
  if (friction == "two_directional") options.friction = Friction::kTwoDirectional;
  options.friction_every_iteration = settings.get<bool>("friction_every_iteration");
  options.native_pd = settings.get<std::string>("pd") == "native";
  options.gyroscopic = settings.get<bool>("gyroscopic");
  options.contact_offset = settings.get<double>("contact_offset");
  options.link_cfm = settings.get<double>("link_cfm");
  return options;
}

}  // namespace assay::px
