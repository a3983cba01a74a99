#include "check/overlaps.h"

#include <algorithm>

#include "load/pair_distances.h"
#include "model/shape.h"

namespace assay {

std::vector<Overlap> overlaps(const Model& model, const State& state, double least) {
  std::vector<Pose> X_WS;
  std::vector<Box> boxes;
  for (const Shape& shape : model.shapes) {
    X_WS.push_back(shape_pose(model, state, shape));
    boxes.push_back(is_ground(shape) ? Box() : box_around(model, shape, X_WS.back()));
  }
  std::vector<int> near;  // contact pairs with ground, and those whose boxes meet
  for (size_t i = 0; i < model.contacts.size(); ++i) {
    const int a = model.contacts[i].shape_a, b = model.contacts[i].shape_b;
    const bool ground = is_ground(model.shapes[a]) || is_ground(model.shapes[b]);
    if (ground || boxes[a].intersects(boxes[b])) near.push_back(static_cast<int>(i));
  }
  const PairDistances distances(model, near);
  std::vector<Overlap> found;
  for (const int i : near) {
    const double depth = -distances.distance(i, X_WS);
    if (depth > least) found.push_back({i, depth});
  }
  std::ranges::stable_sort(found, std::ranges::greater(), &Overlap::depth);
  return found;
}

}  // namespace assay
