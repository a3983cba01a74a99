// How a model file is read: what the command line (cli/model_options.h) and campaigns let a user choose.
#pragma once

#include <map>
#include <string>

namespace assay {

// The joint between the world and the robot's root.
enum class RootJoint {
  kAsInFile,  // URDF: none, the root link is fixed to the world; MJCF: as written
  kFloating,  // a free joint on every root that is fixed to the world and carries moving bodies
  kFixed,     // free joints of roots are left out
};

enum class Ground {
  kAsInFile,
  kPlane,  // a horizontal plane at the lowest point of the robot's collision shapes in the initial state
  kNone,   // planes are left out
};

struct LoadOptions {
  // Leave out what the Model cannot hold instead of refusing the file; Model::notes lists each element and what leaving
  // it out changes.
  bool drop_unsupported = false;
  // The keyframe that gives the initial state: its name, or its number from 0. Empty: the first, where there is one.
  std::string keyframe = {};
  // A file that gives the initial configuration, at rest (start.h has its format). Empty: none.
  std::string qpos = {};
  // Folders of package://NAME/..., by name, before those that the environment names.
  std::map<std::string, std::string> packages = {};
  RootJoint root_joint = RootJoint::kAsInFile;
  Ground ground = Ground::kAsInFile;
  bool decompose = false;  // concave meshes become several hulls (decomposition.h) instead of one
  // Included files, meshes and other assets may lie anywhere and not only below the model's folder
  // (load/outside_files.h).
  bool allow_external_files = false;
  // Faults of the file that have one obvious way out are mended in memory (repair.h), with a note each.
  bool repair = false;
  // Joints that start beyond their limits start at the limit (start.h), whatever gives the initial state.
  bool within_limits = false;

  bool operator==(const LoadOptions&) const = default;
};

}  // namespace assay
