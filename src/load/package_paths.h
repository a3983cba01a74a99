// Where the files lie that a URDF file names.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace assay {

struct FoundFile {
  std::string path;                 // empty when there is none
  bool in_package = false;          // in a package that the URI names: one that the user has named, or is one by its
                                    // package.xml or because the model lies in it
  std::vector<std::string> looked;  // paths that were tried, in order, when there is none
  std::string taken_for = {};       // "which differs in upper and lower case": why it is not the file of that name
};

// Where MuJoCo's reader of URDF looks for a mesh: <mujoco><compiler meshdir strippath>.
struct MeshFolder {
  std::string folder = {};  // from the model's
  bool strip_path = true;   // of the name the last part counts
};

// The file that `uri` means in the model file `from`: package://NAME/..., model://NAME/..., file://..., or a path that
// counts from the model's folder. The package NAME is looked for in `packages`, upward from the model (a folder of that
// name, or one whose package.xml gives it), in the folders of ROS_PACKAGE_PATH, GZ_SIM_RESOURCE_PATH and
// GAZEBO_MODEL_PATH, and in share/ of those of AMENT_PREFIX_PATH. Where there is no such file, it is one whose name
// differs in upper and lower case, backslashes are slashes, and last it is looked for as MuJoCo does.
FoundFile find_resource(const std::string& uri, const std::string& from,
                        const std::map<std::string, std::string>& packages, const MeshFolder& as_mujoco = {});

}  // namespace assay
