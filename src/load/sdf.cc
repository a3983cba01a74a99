#include "load/sdf.h"

#include <utility>

#include "load/sdf/robot.h"

namespace assay {

SdfDocument read_sdf(const std::string& text, const std::string& path, const LoadOptions& options) {
  sdf::Robot robot(path, options);
  if (sdf::read_models(robot, text) && sdf::resolve_frames(robot)) {
    sdf::read_shapes(robot);
    sdf::read_masses(robot);
    sdf::read_joints(robot);
    if (!robot.result.parts.refused()) sdf::build_tree(robot);
    sdf::note_unread_parts(robot);
  }
  return std::move(robot.result);
}

}  // namespace assay
