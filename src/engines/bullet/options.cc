#include "options.h"

#include <string>

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include "convert.h"
#include "engines/adapter.h"

namespace assay::bullet {

std::vector<Setting> declared_settings() {
  SettingList list;
  list.add(
      "model", "rigid", "",
      "rigid: six coordinates a body and hinge constraints; multibody: joint coordinates, Featherstone's algorithm",
      {"rigid", "multibody"});
  list.add("solver", "si", "", "constraint solver: sequential impulse, or Dantzig's method on the whole LCP",
           {"si", "dantzig"});
  list.add("rk4", false, "", "multibody: Runge-Kutta 4 for what moves without constraints (Bullet's own flag)");
  list.add("iterations", 50LL, "",
           "sequential impulse: sweeps over all constraints a step (Bullet's own default is 10)", {}, 1, 100000);
  list.add("residual_threshold", 0.0, "m^2/s^2",
           "sequential impulse: sweeps end once the largest squared change is below", {}, 0);
  list.add("erp", 0.2, "1/step", "share of a joint's position error that one step corrects", {}, 0, 1);
  list.add("contact_erp", 0.2, "1/step", "share of a penetration that one step corrects", {}, 0, 1);
  list.add("cfm", 0.0, "s/kg", "constraint force mixing of joints and contacts", {}, 0);
  list.add(
      "split_impulse", true, "",
      "correct penetrations deeper than split_impulse_depth by moving bodies, not by velocity (rigid only: it takes "
      "a multibody's limits their correction and does nothing for its contacts)");
  list.add("split_impulse_depth", 0.0, "m",
           "penetration from which split_impulse acts (Bullet's own default is 0.04; shallower ones bounce by ERP)", {},
           0);
  list.add("linear_slop", 0.0, "m", "penetration that is left uncorrected", {}, 0);
  list.add("warmstarting", 0.85, "1",
           "share of the last step's contact impulses that the solver starts from (rigid only)", {}, 0, 1);
  list.add("gyroscopic", "implicit_body", "",
           "rigid: gyroscopic torque, one Newton step of implicit Euler in body or world axes, explicit, or none",
           {"off", "explicit", "implicit_world", "implicit_body"});
  list.add(
      "friction_directions", 2LL, "",
      "tangents a contact's friction acts along, the first along the slip (Bullet's own default is 1 for rigid bodies)",
      {}, 1, 2);
  list.add("friction_cone", true, "", "multibody: couple both tangents in a circular cone; off: a box");
  list.add(
      "pd", "explicit", "",
      "springs and dampers of joints: a torque from the state at the step's start; Bullet has none of its own that "
      "is a spring of a given stiffness",
      {"explicit"});
  list.add("frame_offset", true, "",
           "rigid: hinge rows with levers weighted by the bodies' masses (Bullet's own default)");
  list.add("randomize_order", false, "",
           "sequential impulse: another order of constraints every sweep, from a fixed seed");
  list.add("solver_batch", 128LL, "", "islands are solved together until a batch has this many constraints", {}, 1,
           1000000);
  std::vector<Setting> settings = list.take();
  settings.push_back(lent_share_setting());
  add_contact_compliance(settings, "contact_erp, cfm and split_impulse", {{"solver", "si"}});
  add_restitution(settings, "Bullet's own default is 0.2");
  give_role(settings, "iterations", SettingRole::kIterations, {{"solver", "si"}});
  give_role(settings, "residual_threshold", SettingRole::kTolerance, {{"solver", "si"}});
  give_role(settings, "contact_erp", SettingRole::kContactSoftness);
  return settings;
}

Options read_options(const Settings& settings) {
  const auto number = [&settings](const char* name) { return real(settings.get<double>(name)); };
  Options options;
  options.timestep = settings.timestep;
  options.multibody = is(settings, "model", "multibody");
  options.rk4 = settings.get<bool>("rk4");
  options.solver = is(settings, "solver", "dantzig") ? Solver::kDantzig : Solver::kSequentialImpulse;
  options.iterations = integer(settings, "iterations");
  options.residual = number("residual_threshold");
  options.erp = number("erp");
  options.contact_erp = number("contact_erp");
  options.cfm = number("cfm");
  options.split_impulse = settings.get<bool>("split_impulse") && !options.multibody;
  options.split_impulse_depth = number("split_impulse_depth");
  options.linear_slop = number("linear_slop");
  options.warmstarting = number("warmstarting");
  const auto& gyroscopic = settings.get<std::string>("gyroscopic");
  if (gyroscopic == "explicit") options.gyroscopic = BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT;
  if (gyroscopic == "implicit_world") options.gyroscopic = BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD;
  if (gyroscopic == "implicit_body") options.gyroscopic = BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY;
  options.friction_directions = integer(settings, "friction_directions");
  options.friction_cone = settings.get<bool>("friction_cone");
  options.frame_offset = settings.get<bool>("frame_offset");
  options.randomize_order = settings.get<bool>("randomize_order");
  options.solver_batch = integer(settings, "solver_batch");
  options.lent_share = settings.get<double>("lent_share");
  options.restitution = restitution(settings);
  options.compliance = contact_compliance(settings);
  if (options.compliance.is_set()) options.split_impulse = false;
  return options;
}

}  // namespace assay::bullet
