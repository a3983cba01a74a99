#include "options.h"

#include "engines/adapter.h"

namespace assay::jolt {
namespace {

// Jolt tests a plane only within its bounding box. This box is larger than the way of any run, and a static box costs
// nothing.
constexpr double kPlaneHalfExtent = 1e5;  // m

}  // namespace

std::vector<Setting> declared_settings() {
  std::vector<Setting> settings = {
      {"velocity_steps",
       50LL,
       "",
       "iterations of the velocity solver, joints and contacts together (Jolt's own default is 10)",
       {},
       2.0,  // friction uses the iteration before
       255.0},
      {"position_steps", 2LL, "", "iterations that correct positions", {}, 0.0, 255.0},
      {"collision_steps",
       1LL,
       "",
       "substeps: a step detects collisions and integrates so many times, with the same torques",
       {},
       1.0,
       1024.0},
      {"pd",
       "explicit",
       "",
       "joint springs and dampers: explicit: torque from the state at the step's start; native: the hinge's motor, an "
       "implicit spring",
       {"explicit", "native"}},
      {"baumgarte",
       0.2,
       "",
       "part of a position error that one iteration of the position solver corrects",
       {},
       0.0,
       1.0},
      {"penetration_slop",
       1e-4,
       "m",
       "depth to which bodies may sink into each other (Jolt's own default is 0.02)",
       {},
       0.0,
       1.0},
      {"speculative_distance",
       0.02,
       "m",
       "distance at which a contact is made, which acts only if it would be closed within the step; 0: a fiftieth of "
       "the "
       "shapes' size and a step's way at the speed of a fall through the model's height",
       {},
       0.0,
       1.0},
      {"max_correction", 0.2, "m", "most that one iteration of the position solver moves a body", {}, 1e-6, 1e6},
      {"warm_start", true, "", "start from the impulses of the step before"},
      {"pair_cache", false, "",
       "keep the contact points of two bodies whose relative pose changed by less than 1 mm and 2 degrees, as Jolt "
       "does "
       "by default: a round body at rest then rolls away"},
      {"slow_turns", true, "",
       "keep turns of at most 1e-6 rad a step, which Jolt drops: bodies get them once they add up to more"},
      {"inner_edges", false, "",
       "let bodies feel the edges between the triangles of a flat height field, as Jolt does by default: a capsule at "
       "rest rolls away"},
      lent_share_setting(),
      {"gyroscopic", true, "", "gyroscopic torque (Jolt's own default is off); off is wrong for asymmetric bodies"},
  };
  add_restitution(settings, "Jolt's own default is 1");
  give_role(settings, "velocity_steps", SettingRole::kIterations);
  give_role(settings, "baumgarte", SettingRole::kContactSoftness);
  return settings;
}

Options read_options(const Settings& settings) {
  const auto flag = [&](const char* name) { return static_cast<int32_t>(settings.get<bool>(name)); };
  Options options;
  options.world.timestep = settings.timestep;
  options.world.velocity_steps = integer(settings, "velocity_steps");
  options.world.position_steps = integer(settings, "position_steps");
  options.world.collision_steps = integer(settings, "collision_steps");
  options.world.baumgarte = settings.get<double>("baumgarte");
  options.world.penetration_slop = settings.get<double>("penetration_slop");
  options.world.speculative_distance = settings.get<double>("speculative_distance");
  options.world.max_correction = settings.get<double>("max_correction");
  options.world.plane_half_extent = kPlaneHalfExtent;
  options.world.restitution = restitution(settings).coefficient;
  options.world.restitution_speed = restitution(settings).threshold;
  options.world.warm_start = flag("warm_start");
  options.world.pair_cache = flag("pair_cache");
  options.world.gyroscopic = flag("gyroscopic");
  options.world.slow_turns = flag("slow_turns");
  options.world.inner_edges = flag("inner_edges");
  options.lent_share = settings.get<double>("lent_share");
  options.native_springs = is(settings, "pd", "native");
  return options;
}

}  // namespace assay::jolt
