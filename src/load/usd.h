// USD in front of MuJoCo's parser: a Python process of its own (usd/*.py, OpenUSD's library usd-core) reads the stage
// and writes the robot as MJCF, which is then loaded like every other one. It may read the model's folder
// (model_root(), outside_files.h) and nothing else, writes nothing, has no network, and is held to the limits of the
// Activity.
//
// Carried over of UsdPhysics, and of the schemas of PhysX, Newton and MuJoCo where they say it:
// - units: metersPerUnit, kilogramsPerUnit, the up axis, degrees (angular stiffness and damping are per degree in
//   UsdPhysics and Newton's schema, per radian in MuJoCo's)
// - bodies with UsdPhysics' rules of mass, density, centre and principal axes; disabled bodies are fixed, kinematic
//   ones stand still
// - fixed, revolute, prismatic, spherical and generic joints as trees; those that close loops as connects and welds
// - limits, drives (position, velocity or torque actuators), armature, damping, dry friction, springs, mimics
// - cubes, spheres, capsules, cylinders, cones, planes and meshes; physics materials with their combine modes
// - who touches whom: joints, articulations' self-collision, filtered pairs, collision groups
// - where joints start, from the poses of their bodies or their state; velocities of free bodies
// - actuators and keyframes of MuJoCo's schema
// Everything else that the file says of physics is named in a note, or refused.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "load/load_options.h"
#include "load/problems.h"

namespace assay {

struct UsdDocument {
  std::string text;  // MJCF with angles in rad and its meshes in it; empty where the file is refused
  std::vector<std::string> notes;
  std::vector<Problem> problems;             // elements are prims: "</robot/knee>"
  std::map<std::string, std::string> prims;  // of the elements of `text`, by their labels: "joint 'knee'"

  bool refused() const;

  // Of a text about `text`: "joint 'knee'" becomes "joint 'knee' </robot/knee>", and lines of `text`, which nobody has
  // seen, are left out.
  void place(Problem& problem) const;
  static std::string without_lines(const std::string& message);
};

// By its ending: .usd, .usda, .usdc, .usdz.
bool is_usd(const std::string& path);

// Throws InputError where the library is not set up, and for a file that makes it hang or crash; SystemError where no
// process can be started.
UsdDocument read_usd(const std::string& path, const LoadOptions& options);

}  // namespace assay
