// How a model file is read: what the command line, campaigns and the Python package let a user choose.
#pragma once

#include <array>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>

#include "base/fields.h"

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

using Folders = std::map<std::string, std::string>;  // by name

struct LoadOptions {
  bool drop_unsupported = false;  // Model::notes lists each element and what leaving it out changes
  std::string keyframe = {};      // empty: the first, where there is one
  std::string qpos = {};          // start.h has the file's format; empty: none
  std::string sdf_model = {};     // of several that move in an SDF file; "*": all of them
  Folders packages = {};          // come before those that the environment names
  RootJoint root_joint = RootJoint::kAsInFile;
  Ground ground = Ground::kAsInFile;
  bool decompose = false;             // decomposition.h
  bool allow_external_files = false;  // outside_files.h
  bool repair = false;                // repair.h
  bool within_limits = false;         // start.h

  bool operator==(const LoadOptions&) const = default;
};

// ---- the one list of the options ------------------------------------------------------------------------------------
// The keys of [[system]] in campaigns, the options of the command line, the messages to workers, the manifest's "load"
// and the arguments of the Python package's load() follow from it. Defaults are false, empty and as in the file.

// A value of an enumeration other than 0, which is as in the file. In campaigns and on the command line it is a flag.
struct LoadChoice {
  const char* key;
  const char* name;  // in Python
  const char* meaning;
};

struct LoadField {
  const char* key;
  std::variant<bool LoadOptions::*, std::string LoadOptions::*, Folders LoadOptions::*, RootJoint LoadOptions::*,
               Ground LoadOptions::*>
      member;
  const char* meaning = "";
  const char* value = "";                  // how a text or a folder is written; "FILE": a path
  std::array<LoadChoice, 2> choices = {};  // of an enumeration, values 1 and 2
  const char* option = nullptr;            // on the command line, where it is not `key`
  const char* argument = nullptr;          // in Python, where it is not `key`
  bool kept_at_default = false;            // results of before have it wherever any option is set

  constexpr bool is_path() const { return value == std::string_view("FILE"); }
};

// In the order of the help.
inline constexpr auto kLoadFields = std::to_array<LoadField>({
    {.key = "drop_unsupported",
     .member = &LoadOptions::drop_unsupported,
     .meaning = "Leaves out elements that no engine can be given instead of refusing the model, and names them",
     .kept_at_default = true},
    {.key = "packages",
     .member = &LoadOptions::packages,
     .meaning = "Folder of package://NAME/... in a URDF file, or model://NAME in an SDF file; may be repeated (also "
                "found: upward from the file, in "
                "ROS_PACKAGE_PATH and AMENT_PREFIX_PATH)",
     .value = "NAME=DIR",
     .option = "package",
     .kept_at_default = true},
    {.key = "allow_external_files",
     .member = &LoadOptions::allow_external_files,
     .meaning = "Takes includes, meshes and other assets from anywhere and not only from below the model's folder",
     .kept_at_default = true},
    {.key = "root_joint",
     .member = &LoadOptions::root_joint,
     .choices = {{{"floating_base", "floating", "Gives the robot's root a free joint"},
                  {"fixed_base", "fixed", "Fixes the robot's root to the world"}}},
     .argument = "base",
     .kept_at_default = true},
    {.key = "ground",
     .member = &LoadOptions::ground,
     .choices = {{{"ground", "plane", "Adds a ground plane at the lowest point of the robot's shapes at its start"},
                  {"no_ground", "none", "Leaves out the file's planes"}}},
     .kept_at_default = true},
    {.key = "within_limits",
     .member = &LoadOptions::within_limits,
     .meaning = "Puts joints that start beyond their limits at the limit"},
    {.key = "repair",
     .member = &LoadOptions::repair,
     .meaning = "Mends in memory what has one obvious way out (inertias that no body has, swapped limits, joints that "
                "move no mass), and says what"},
    {.key = "decompose",
     .member = &LoadOptions::decompose,
     .meaning = "Takes concave meshes for several convex hulls instead of one; seconds a mesh, kept for the next time",
     .kept_at_default = true},
    {.key = "keyframe",
     .member = &LoadOptions::keyframe,
     .meaning = "Keyframe to start from, by name or number from 0 (default: first)",
     .value = "NAME|NUMBER",
     .kept_at_default = true},
    {.key = "qpos",
     .member = &LoadOptions::qpos,
     .meaning = "File with the configuration to start from, at rest: all numbers of MuJoCo's qpos, or lines "
                "JOINT=VALUE",
     .value = "FILE",
     .kept_at_default = true},
    {.key = "sdf_model",
     .member = &LoadOptions::sdf_model,
     .meaning = "Model of an SDF file that has several which move; '*' takes all",
     .value = "NAME"},
});
static_assert(kLoadFields.size() == member_count<LoadOptions>(), "each member of LoadOptions has a row");

// Calls visit(row, member) for each row. Members are bool, std::string, Folders or an enumeration.
template <typename Options, typename Visit>
void visit_load_fields(Options& options, const Visit& visit) {
  for (const LoadField& field : kLoadFields) {
    std::visit([&](auto member) { visit(field, options.*member); }, field.member);
  }
}

template <typename T>
bool is_load_default(const T& value) {
  return value == T{};
}

}  // namespace assay
