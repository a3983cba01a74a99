// How Rapier is told which of a model's shapes may touch and with what friction.
//
// Rapier filters by bits of groups and combines two shapes' coefficients by a rule. Both are enough for most models,
// and cost nothing. Where they are not, the pairs are looked up by hooks, which Rapier calls at every step and which
// keep it from recycling the contacts.
#pragma once

#include <vector>

#include "model/model.h"

namespace assay::rapier {

struct ShapePlan {
  int shape = 0;  // index into Model::shapes
  unsigned groups = ~0U, collides_with = ~0U;
  bool filter_pairs = false;      // the groups cannot say it: ask the table
  double friction = 0;            // of the shape; the larger of two acts
  bool look_up_friction = false;  // the rule cannot say it: ask the table
};

struct CollisionPlan {
  std::vector<ShapePlan> shapes;  // those that may touch something
  std::vector<double> pairs;      // shapes x shapes: friction, -1 where they may not touch; empty when nobody asks
};

CollisionPlan plan_collision(const Model& model);

}  // namespace assay::rapier
