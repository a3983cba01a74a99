// SDFormat (Gazebo's SDF), versions 1.4 to 1.12, in front of MuJoCo's compiler. Read here with the rules of libsdformat
// and not by it: Debian 12 has the library for versions to 1.9 alone, newer ones would be a compile of four libraries
// on each machine, and it keeps no lines for messages.
//
// Read, exactly: models, nested and included ones (a:: scopes, merge), poses and frames (relative_to, attached_to,
// __model__, placement_frame, canonical_link; degrees, quat_xyzw), links with mass and inertia (also computed from
// collisions, inertial auto="true"), revolute, continuous, prismatic, ball, universal, revolute2, screw, gearbox and
// fixed joints with limits, springs, damping, dry friction, effort and <mimic>, loops of joints, collisions of boxes,
// spheres, cylinders, capsules, ellipsoids, planes and meshes, friction, collide_bitmask, self_collide, static,
// gravity. Approximated with a note: a cone is a pyramid of 64 sides, a polyline its convex hull, a friction that
// differs in two directions the smaller one. Refused: height maps, images, and what a link or joint has besides that
// changes motion. All else that stands in the file and is not read has a note with its line; what is only drawn or
// sensed has none.
//
// What differs from MJCF and URDF, because SDF says so:
// - A link without <inertial> has 1 kg and 1 kg m^2 about each axis. What no joint joins to the world is free.
// - Links of one model touch each other only where self_collide says so, and never where a joint joins them.
// - Two shapes rub with the smaller of their coefficients, as in Gazebo; 1 is a shape's default.
// - The gravity of a <world> is 9.8 m/s^2 where it gives none; a file of a model has MuJoCo's 9.81.
// - Joints with equal limits are fixed there, as in URDF, and each joint that moves and mimics no other has a motor
//   within its effort limit (none where that is 0).
#pragma once

#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "load/inertia.h"
#include "load/load_options.h"
#include "load/mjcf_document.h"
#include "load/mujoco_messages.h"
#include "load/urdf.h"

namespace assay {

struct SdfJoint {
  enum class Type { kHinge, kSlide, kBall, kFree };
  Type type = Type::kHinge;
  std::string name = {};
  Vec3 p_BJ = Vec3::Zero();     // in the body that it moves
  Vec3 axis_B = Vec3::UnitZ();  // unit length
  bool limited = false;
  double lower = 0, upper = 0;  // rad, m
  double stiffness = 0, spring_reference = 0, damping = 0, dry_friction = 0;
  double effort = std::numeric_limits<double>::infinity();  // Nm, N
  int line = 0;                                             // 0 in an included file, as of all below
};

struct SdfShape {
  std::string name = {}, type = {}, mesh = {};  // type: SDF's element; mesh: a key of UrdfDocument::meshes
  Vec3 size = Vec3::Zero();                     // box: edges; ellipsoid: semi-axes; else radius and length
  Pose X_BS = {};
  double friction = 1;
  int bits = 0xffff;  // collide_bitmask
  int line = 0;
};

struct SdfBody {
  std::string name = {};
  int parent = -1;  // index of a body before it; -1 for the world
  Pose X_PB;
  std::vector<SdfJoint> joints;  // from the parent on; none: fixed to it
  std::vector<SdfShape> shapes;
  int line = 0;
};

// position of `follower` = multiplier * position of `leader` + offset
struct SdfCoupling {
  std::string name = {}, follower = {}, leader = {};
  double multiplier = 1, offset = 0;
  int line = 0;
};

// Two bodies, indices or -1 for the world, held together at a frame of each.
struct SdfLoop {
  std::string name = {};
  bool weld = false;             // else a point alone
  int body_a = -1, body_b = -1;  // body_a is not the world
  Pose X_AJ, X_BJ;
  int line = 0;
};

struct SdfDocument {
  UrdfDocument parts;  // meshes, massless, inertia (of all bodies with mass), locked, driven, velocity limits, notes,
                       // lines (none) and problems as of URDF
  std::string name = {};
  std::vector<SdfBody> bodies;  // parents first
  std::vector<SdfCoupling> couplings;
  std::vector<SdfLoop> loops;
  std::vector<std::pair<std::string, std::string>> apart;  // bodies that do not touch each other
  Vec3 gravity = Vec3(0, 0, -9.81);                        // m/s^2
  std::map<std::string, IncludedPlace> included;           // DocumentPlaces::included
};

// `path` is where the text comes from, for relative names. Every problem is found, not only the first.
SdfDocument read_sdf(const std::string& text, const std::string& path, const LoadOptions& options);

// The document as MuJoCo's spec, with lines; its masses are placeholders, and UrdfDocument::inertia has the true ones.
// Needs a MessageGuard.
SpecPtr sdf_spec(const SdfDocument& document);

}  // namespace assay
