// What only draws.
#pragma once

#include <utility>
#include <vector>

#include <tinyxml2.h>

#include "load/urdf/masses.h"
#include "load/urdf/robot.h"

namespace assay::urdf {

class Pictures {
 public:
  explicit Pictures(Robot& robot) : robot_(robot) {}

  // What only draws never refuses a robot: MuJoCo's reader, which takes fewer colours and files than drawing.cc, gets
  // no <visual> but a colour for the shapes that collide.
  void leave_out();
  // UrdfDocument::drawn_reach.
  void measure(const Masses& masses);

 private:
  // The corners of a shape that is drawn.
  void add(const Link& link, const Pose& X_LV, const tinyxml2::XMLElement& shape);

  Robot& robot_;
  std::vector<std::pair<int, Vec3>> pictures_;  // links, and points of what is drawn of them, in the links' frames
};

}  // namespace assay::urdf
