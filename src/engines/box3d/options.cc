#include "options.h"

#include "engines/adapter.h"

namespace assay::box3d {

std::vector<Setting> declared_settings() {
  SettingList list;
  list.add("sub_steps", 4LL, "",
           "parts that Box3D divides a step into after it has found contacts: each applies forces, solves constraints "
           "once with and once without position correction, and moves the bodies by timestep/n",
           {}, 1, 100000);
  list.add("contact_hertz", 200.0, "Hz",
           "stiffness of contacts, twice that with what is fixed; lowered to an eighth of the rate of sub-steps "
           "(Box3D's own "
           "default is 30, with which a heavy body sinks into light ones)",
           {}, 0, 1e9);
  list.add("contact_damping_ratio", 10.0, "1", "damping of contacts, half of that with what is fixed", {}, 0, 1e9);
  list.add("contact_speed", 3.0, "m/s", "cap of the speed that takes out a penetration", {}, 0, 1e9);
  list.add(
      "joint_hertz", 1e6, "Hz",
      "stiffness of joints and their limits; at most a quarter of the rate of sub-steps (Box3D's own default is 60, "
      "with which hinges lose energy at every timestep)",
      {}, 0, 1e9);
  list.add("joint_damping_ratio", 2.0, "1", "damping of joints and their limits", {}, 0, 1e9);
  list.add(
      "pd", "explicit", "",
      "springs and dampers of joints: explicit: torque from the state at the step's start; native: the joint's own "
      "implicit spring",
      {"explicit", "native"});
  list.add("warm_start", true, "", "start from the impulses of the step before");
  list.add(
      "contact_recycling", false, "",
      "keep the contact points of two bodies while they move by less than 5 cm and 10 degrees (Box3D's own default "
      "is on)");
  list.add(
      "continuous", false, "",
      "stop bodies that move by more than half of their size in a step where they would meet what is fixed (Box3D's "
      "own default is on)");
  list.add("ground_size", 100.0, "m", "edge of the box that stands for a plane, below where the bodies start", {}, 1e-3,
           1e5);
  list.add("ground_thickness", 10.0, "m", "height of that box", {}, 1e-3, 1e5);
  std::vector<Setting> settings = list.take();
  settings.push_back(lent_share_setting());
  add_restitution(settings, "Box3D's own default is 1");
  give_role(settings, "sub_steps", SettingRole::kIterations);
  give_role(settings, "contact_hertz", SettingRole::kContactSoftness);
  return settings;
}

Options read_options(const Settings& settings) {
  const auto number = [&settings](const char* name) { return settings.get<double>(name); };
  Options options;
  options.timestep = settings.timestep;
  options.sub_steps = integer(settings, "sub_steps");
  options.contact_hertz = number("contact_hertz");
  options.contact_damping_ratio = number("contact_damping_ratio");
  options.contact_speed = number("contact_speed");
  options.joint_hertz = number("joint_hertz");
  options.joint_damping_ratio = number("joint_damping_ratio");
  options.native_springs = is(settings, "pd", "native");
  options.warm_start = settings.get<bool>("warm_start");
  options.contact_recycling = settings.get<bool>("contact_recycling");
  options.continuous = settings.get<bool>("continuous");
  options.ground_size = number("ground_size");
  options.ground_thickness = number("ground_thickness");
  options.lent_share = number("lent_share");
  options.restitution = restitution(settings);
  return options;
}

}  // namespace assay::box3d
