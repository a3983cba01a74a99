#include "options.h"

#include "engines/adapter.h"

namespace assay::rapier {

std::vector<Setting> declared_settings() {
  SettingList list;
  list.add("joints", "impulse", "",
           "impulse: six coordinates a body, hinges are constraints; multibody: joint coordinates (reduced)",
           {"impulse", "multibody"});
  list.add("precision", "f64", "", "Rapier in float (crate rapier3d) or in double (crate rapier3d-f64)",
           {"f32", "f64"});
  list.add("solver_iterations", 4LL, "",
           "parts that Rapier divides a step into; each applies forces, solves constraints and moves the bodies by "
           "timestep/n",
           {}, 1, 100000);
  list.add("pgs_iterations", 1LL, "", "sweeps of the constraint solver in each part, with position correction", {}, 1,
           100000);
  list.add("stabilization_iterations", 1LL, "",
           "sweeps at the end of each part, without position correction, which take its velocity out again", {}, 0,
           100000);
  list.add("contact_natural_frequency", 200.0, "Hz",
           "stiffness of a contact between moving bodies (Rapier's own default is 30, with which a stack of ten boxes "
           "buckles)",
           {}, 0, 1e9);
  list.add("contact_damping_ratio", 10.0, "1", "damping of a contact between moving bodies", {}, 0, 1e9);
  list.add("static_contact_natural_frequency", 200.0, "Hz",
           "stiffness of a contact with what is fixed (Rapier's own default is 60)", {}, 0, 1e9);
  list.add("static_contact_damping_ratio", 10.0, "1", "damping of a contact with what is fixed", {}, 0, 1e9);
  list.add("joint_natural_frequency", 1e6, "Hz", "stiffness of impulse joints, and of the limits of both kinds", {}, 0,
           1e12);
  list.add("joint_damping_ratio", 1.0, "1", "damping of impulse joints, and of the limits of both kinds", {}, 0, 1e9);
  list.add("max_corrective_speed", 3.0, "m/s, rad/s",
           "cap of the speed that takes out a penetration, or an impulse joint's passed limit", {}, 0, 1e9);
  list.add("prediction_distance", 0.02, "m",
           "distance below which the contact solver gets a pair of shapes; 0: a fiftieth of the shapes' size and a "
           "step's way at the speed of a fall through the model's height",
           {}, 0, 1e9);
  list.add("warmstart", 1.0, "1", "share of the last step's contact impulses that the solver starts from", {}, 0, 1);
  list.add("warmstart_joints", false, "", "start impulse joints, too, from the last step's impulses");
  list.add("contact_recycling", false, "",
           "keep a pair's contact points and normal while it has moved by less than 0.05 m and 0.2 rad (Rapier's own "
           "default is on)");
  list.add("contact_coherence", false, "",
           "keep a pair's contact points while they move by less than 1 mm and 1 degree (Rapier's own default is on, "
           "with which a capsule at rest on a box rolls away)");
  list.add("friction_in_bias_pass", false, "", "let friction act in the sweeps with position correction, too");
  list.add("friction_model", "coulomb", "",
           "coulomb: two friction rows a contact point; simplified: Rapier's own default, two and a torsional one a "
           "manifold",
           {"coulomb", "simplified"});
  list.add(
      "gyroscopic", true, "",
      "gyroscopic torque of bodies without multibody joints (Rapier's own default is off); multibodies always have it");
  list.add(
      "ccd_substeps", 0LL, "",
      "continuous collision detection of fast bodies: at most so many parts of a step; 0: off (Rapier's own default is "
      "1)",
      {}, 0, 1000);
  list.add(
      "pd", "explicit", "",
      "springs and dampers of joints: explicit: a torque from the state at the step's start; native: the motor of an "
      "impulse joint, the implicit spring and damping of a multibody's",
      {"explicit", "native"});
  list.add("link_share", kDefaultLinkShare, "",
           "multibodies: part of a body's mass and inertia that each massless body before it borrows", {}, 1e-6,
           kLargestLentShare);
  std::vector<Setting> settings = list.take();
  settings.push_back(lent_share_setting());
  add_restitution(settings, "");
  give_role(settings, "solver_iterations", SettingRole::kIterations);
  give_role(settings, "contact_natural_frequency", SettingRole::kContactSoftness);
  give_role(settings, "static_contact_natural_frequency", SettingRole::kContactSoftness);
  return settings;
}

Options read_options(const Settings& settings) {
  const auto number = [&settings](const char* name) { return settings.get<double>(name); };
  const auto flag = [&settings](const char* name) { return settings.get<bool>(name) ? 1 : 0; };
  Options options;
  options.double_precision = is(settings, "precision", "f64");
  options.native_springs = is(settings, "pd", "native");
  options.lent_share = number(is(settings, "joints", "multibody") ? "link_share" : "lent_share");
  RapierOptions& world = options.world;
  world.timestep = settings.timestep;
  world.multibody = is(settings, "joints", "multibody") ? 1 : 0;
  world.native_springs = is(settings, "pd", "native") ? 1 : 0;
  world.solver_iterations = integer(settings, "solver_iterations");
  world.pgs_iterations = integer(settings, "pgs_iterations");
  world.stabilization_iterations = integer(settings, "stabilization_iterations");
  world.contact_frequency = number("contact_natural_frequency");
  world.contact_damping_ratio = number("contact_damping_ratio");
  world.static_contact_frequency = number("static_contact_natural_frequency");
  world.static_contact_damping_ratio = number("static_contact_damping_ratio");
  world.joint_frequency = number("joint_natural_frequency");
  world.joint_damping_ratio = number("joint_damping_ratio");
  world.max_corrective_speed = number("max_corrective_speed");
  world.prediction_distance = number("prediction_distance");
  world.restitution = restitution(settings).coefficient;
  world.warmstart = number("warmstart");
  world.warmstart_joints = flag("warmstart_joints");
  world.contact_recycling = flag("contact_recycling");
  world.contact_coherence = flag("contact_coherence");
  world.friction_in_bias_pass = flag("friction_in_bias_pass");
  world.coulomb = is(settings, "friction_model", "coulomb") ? 1 : 0;
  world.gyroscopic = flag("gyroscopic");
  world.ccd_substeps = integer(settings, "ccd_substeps");
  return options;
}

}  // namespace assay::rapier
