// Which shapes DART gets, with which friction, and which pairs of them may touch.
#pragma once

#include <memory>
#include <unordered_map>
#include <vector>

#include <dart/collision/CollisionFilter.hpp>
#include <dart/dynamics/BodyNode.hpp>

#include "engines/adapter.h"
#include "model/model.h"

namespace assay::dartsim {

// Lets exactly the model's contact pairs touch.
class PairFilter final : public dart::collision::CollisionFilter {
 public:
  // `allowed` is a square table of numbers of shapes.
  // `shapes` has the index into Model::shapes of each number.
  PairFilter(std::unordered_map<const dart::dynamics::ShapeFrame*, int> number, std::vector<char> allowed,
             std::vector<int> shapes)
      : number_(std::move(number)), allowed_(std::move(allowed)), shapes_(std::move(shapes)) {}

  // The index into Model::shapes of an object of DART's collision detection.
  int shape_of(const dart::collision::CollisionObject* object) const;

  bool ignoresCollision(const dart::collision::CollisionObject* a,
                        const dart::collision::CollisionObject* b) const override;

 private:
  std::unordered_map<const dart::dynamics::ShapeFrame*, int> number_;
  std::vector<char> allowed_;
  std::vector<int> shapes_;
};

// Gives the shapes that are in a contact pair to their bodies (`world` for static ones) and returns the filter.
std::shared_ptr<PairFilter> add_shapes(const Model& model, const std::vector<dart::dynamics::BodyNode*>& bodies,
                                       dart::dynamics::BodyNode* world, const Restitution& restitution);

}  // namespace assay::dartsim
