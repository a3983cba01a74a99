#include "load/repair.h"

#include <fmt/format.h>

#include "base/errors.h"
#include "load/mjcf_document.h"
#include "load/urdf.h"

namespace assay {

std::string mended_model(const std::string& text, const std::string& path, const std::string& out,
                         std::vector<Mend>& mends, const LoadOptions& options) {
  const std::string root = root_element(text);
  if (root != "robot" && root != "mujoco") {
    throw InputError(fmt::format("--repair mends URDF and MJCF files, and '{}' is neither; name such a file", path));
  }
  return root == "robot" ? mend_urdf(text, path, out, mends, options) : mend_mjcf(text, path, out, mends);
}

}  // namespace assay
