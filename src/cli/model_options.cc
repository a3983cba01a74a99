#include "cli/model_options.h"

#include <filesystem>
#include <string_view>

#include <fmt/format.h>

#include "base/console.h"
#include "base/errors.h"
#include "base/external_files.h"
#include "base/paths.h"
#include "load/mjcf.h"

namespace assay::cli {
namespace {

namespace fs = std::filesystem;

void refuse_both(bool a, bool b, std::string_view first, std::string_view second) {
  if (a && b) throw InputError(fmt::format("{} and {} contradict each other: give one of them", first, second));
}

}  // namespace

void add_load_options(CLI::App& command, ModelOptions& options, Repair repair) {
  const auto flag = [&](const char* name, bool& value, const char* meaning) {
    command.add_flag(name, value, meaning)->disable_flag_override()->group(kModelGroup);
  };
  flag("--drop-unsupported", options.drop_unsupported,
       "Leaves out elements that no engine can be given instead of refusing the model, and names them");
  command
      .add_option("--package", options.packages,
                  "Folder of package://NAME/... in a URDF file; may be repeated (also found: upward from the file, in "
                  "ROS_PACKAGE_PATH and AMENT_PREFIX_PATH)")
      ->group(kModelGroup)
      ->type_name("NAME=DIR")
      ->allow_extra_args(false);
  flag("--floating-base", options.floating_base, "Gives the robot's root a free joint");
  flag("--fixed-base", options.fixed_base, "Fixes the robot's root to the world");
  flag("--ground", options.ground, "Adds a ground plane at the lowest point of the robot's shapes at its start");
  flag("--no-ground", options.no_ground, "Leaves out the file's planes");
  flag("--decompose", options.decompose,
       "Takes concave meshes for several convex hulls instead of one; seconds a mesh, kept for the next time");
  flag("--allow-external-files", options.allow_external_files,
       "Takes includes, meshes and other assets from anywhere and not only from below the model's folder");
  flag("--within-limits", options.within_limits, "Puts joints that start beyond their limits at the limit");
  if (repair == Repair::kFlag) {
    flag("--repair", options.repair,
         "Mends in memory what has one obvious way out (inertias that no body has, swapped limits, joints that move no "
         "mass), and says what");
  }
  command
      .add_option("--keyframe", options.keyframe, "Keyframe to start from, by name or number from 0 (default: first)")
      ->group(kModelGroup)
      ->type_name("NAME|NUMBER");
  command
      .add_option("--qpos", options.qpos,
                  "File with the configuration to start from, at rest: all numbers of MuJoCo's qpos, or lines "
                  "JOINT=VALUE")
      ->group(kModelGroup)
      ->type_name("FILE");
}

void add_model_options(CLI::App& command, ModelOptions& options, Repair repair) {
  command.add_option("MODEL", options.model, "MJCF or URDF file, or a system's name")->required()->type_name("");
  add_load_options(command, options, repair);
}

LoadOptions load_options(const ModelOptions& options) {
  refuse_both(options.floating_base, options.fixed_base, "--floating-base", "--fixed-base");
  refuse_both(options.ground, options.no_ground, "--ground", "--no-ground");
  refuse_both(options.keyframe.has_value(), options.qpos.has_value(), "--keyframe", "--qpos");
  LoadOptions load;
  load.drop_unsupported = options.drop_unsupported;
  load.keyframe = options.keyframe.value_or("");
  load.qpos = options.qpos.value_or("");
  load.decompose = options.decompose;
  load.allow_external_files = options.allow_external_files;
  if (options.allow_external_files) agree_to_external_files();
  load.within_limits = options.within_limits;
  load.repair = options.repair;
  if (options.floating_base) load.root_joint = RootJoint::kFloating;
  if (options.fixed_base) load.root_joint = RootJoint::kFixed;
  if (options.ground) load.ground = Ground::kPlane;
  if (options.no_ground) load.ground = Ground::kNone;
  for (const std::string& text : options.packages) {
    const size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
      throw InputError(
          fmt::format("--package is '{}': write it as NAME=DIR, as in --package my_robot=~/my_robot", text));
    }
    const std::string name = text.substr(0, equals), folder = text.substr(equals + 1);
    if (std::error_code error; !fs::is_directory(folder, error)) {
      throw InputError(fmt::format("--package {}: there is no folder '{}'; check the path", name, folder));
    }
    if (!load.packages.emplace(name, folder).second) {
      throw InputError(fmt::format("--package names '{}' twice: keep one of them", name));
    }
  }
  return load;
}

Model load(const ModelOptions& options) {
  const LoadOptions how = load_options(options);
  return load_model(find_model(options.model), how);
}

}  // namespace assay::cli
