#include "load/repair.h"

#include <fmt/format.h>

#include "base/errors.h"
#include "isolate/activity.h"
#include "load/mjcf.h"
#include "load/mjcf_document.h"
#include "load/outside_files.h"
#include "load/problems.h"
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

std::string mended_file(const std::string& path, const std::string& out, std::vector<Mend>& mends,
                        const LoadOptions& options) {
  const Activity reading(fmt::format("reading '{}'", path));
  const std::string text = model_text(path);
  // what it includes may become part of the mended text
  if (root_element(text) == "mujoco") {
    const std::vector<Problem> refusals = document_refusals(text, path, options);
    if (!refusals.empty()) throw InputError(fmt::format("{}: {}", path, problem_text(refusals.front())));
  }
  return mended_model(text, path, out, mends, options);
}

}  // namespace assay
