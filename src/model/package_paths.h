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
};

// The file that `uri` means in the model file `from`: package://NAME/..., model://NAME/..., file://..., or a path that
// counts from the model's folder. The package NAME is looked for in `packages`, upward from the model (a folder of that
// name, or one whose package.xml gives it), in the folders of ROS_PACKAGE_PATH, and in share/ of those of
// AMENT_PREFIX_PATH.
FoundFile find_resource(const std::string& uri, const std::string& from,
                        const std::map<std::string, std::string>& packages);

}  // namespace assay
