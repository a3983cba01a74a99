#include "options.h"

#include <string>

#include "engines/adapter.h"
#include "plugin.h"

namespace assay::px {

std::vector<Setting> declared_settings() {
  SettingList list;
  list.add("joints", "d6", "",
           "d6, revolute: six coordinates a body and PhysX's joint of that name as a constraint; articulation: joint "
           "coordinates",
           {"d6", "revolute", "articulation"});
  list.add(
      "solver", "pgs", "",
      "constraint solver: projected Gauss-Seidel, or temporal Gauss-Seidel, whose position iterations are substeps",
      {"pgs", "tgs"});
  list.add("position_iterations", 50LL, "", "solver iterations that also correct positions (PhysX's own default is 4)",
           {}, 1, 255);
  list.add("velocity_iterations", 1LL, "", "solver iterations after them that only set velocities", {}, 0, 255);
  list.add("friction", "improved_patch", "",
           "improved_patch: up to two anchors a contact patch, which share its normal force; patch: each takes all of "
           "it, up "
           "to twice Coulomb's friction; one_directional, two_directional: at every contact point (pgs only)",
           friction_models());
  list.add("friction_every_iteration", false, "",
           "pgs with patches: friction in every iteration instead of only the last three (tgs always does)");
  list.add(
      "pd", "explicit", "",
      "joint springs and dampers: explicit torque from the state at the step's start, or native: PhysX's joint drive",
      {"explicit", "native"});
  list.add("gyroscopic", true, "",
           "rigid bodies: gyroscopic torque (off in PhysX's defaults; articulations always have it)");
  list.add(
      "contact_offset", 0.02, "1",
      "distance from which a shape makes contacts, over the mean size of the model's shapes (PhysX's own default is "
      "0.02 m); 0: half of a fiftieth of the shapes' size and of a step's way at the speed of a fall through the "
      "model's "
      "height",
      {}, 0, 10);
  list.add("link_cfm", kLinkCfm, "",
           "constraint force mixing of an articulation's contacts and limits (PhysX's own is 0.025)", {}, 0, 1);
  list.add("link_share", 1e-5, "",
           "articulations: part of a body's mass and inertia that each massless body before it borrows, because PhysX "
           "needs mass in every link",
           {}, 1e-6, kLargestLentShare);
  std::vector<Setting> settings = list.take();
  settings.push_back(lent_share_setting());
  settings.back().default_value = kDefaultLentShare;
  if (kContactDamping) add_contact_compliance(settings, "contacts that do not give way", {{"solver", "pgs"}});
  add_restitution(settings, "PhysX's own default is 2");
  give_role(settings, "position_iterations", SettingRole::kIterations);
  give_role(settings, "link_cfm", SettingRole::kContactSoftness, {{"joints", "articulation"}});
  return settings;
}

Options read_options(const Settings& settings) {
  Options options;
  options.timestep = settings.timestep;
  const auto& joints = settings.get<std::string>("joints");
  if (joints == "revolute") options.joints = Joints::kRevolute;
  if (joints == "articulation") options.joints = Joints::kArticulation;
  options.tgs = is(settings, "solver", "tgs");
  options.position_iterations = integer(settings, "position_iterations");
  options.velocity_iterations = integer(settings, "velocity_iterations");
  const auto& friction = settings.get<std::string>("friction");
  if (friction == "patch") options.friction = Friction::kPatch;
  if (friction == "one_directional") options.friction = Friction::kOneDirectional;
  if (friction == "two_directional") options.friction = Friction::kTwoDirectional;
  options.friction_every_iteration = settings.get<bool>("friction_every_iteration");
  options.native_pd = is(settings, "pd", "native");
  options.gyroscopic = settings.get<bool>("gyroscopic");
  options.contact_offset = settings.get<double>("contact_offset");
  options.link_cfm = settings.get<double>("link_cfm");
  if (kContactDamping) options.compliance = contact_compliance(settings);
  options.restitution = restitution(settings);
  options.lent_share = settings.get<double>(options.joints == Joints::kArticulation ? "link_share" : "lent_share");
  return options;
}

}  // namespace assay::px
