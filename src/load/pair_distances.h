// Signed distances of the shapes of contact pairs, wherever the shapes are. Spheres, capsules and planes have closed
// forms (measures/violation.h); all other pairs are measured here: by MuJoCo's narrow phase, or below the ground.
#pragma once

#include <memory>
#include <vector>

#include "model/model.h"

namespace assay {

class PairDistances {
 public:
  // For these of the model's contact pairs. Throws InputError with MuJoCo's message for hulls that it does not take.
  PairDistances(const Model& model, const std::vector<int>& pairs);
  ~PairDistances();
  PairDistances(const PairDistances&) = delete;
  PairDistances& operator=(const PairDistances&) = delete;

  // m, negative where the shapes overlap: how far they have to move apart. Of a plane and of a height field it is the
  // height of the other shape's lowest point above the surface, in a height field exact where the field is level around
  // it. Exact up to 1 mm; shapes farther apart have some larger distance. X_WS by Model::shapes.
  double distance(int pair, const std::vector<Pose>& X_WS) const;

 private:
  class Scene;
  const Model& model_;
  std::unique_ptr<Scene> scene_;  // null where no pair needs it
};

}  // namespace assay
