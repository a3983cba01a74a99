// Which of a model's shapes MuJoCo gets, and how it finds the pairs that may touch.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <mujoco/mujoco.h>

#include "engines/adapter.h"
#include "options.h"

namespace assay::mujoco {

// How MuJoCo finds exactly the model's contact pairs.
struct ContactPlan {
  ContactShapes shapes;                    // others do not exist for MuJoCo
  bool broad_phase = false;                // by MuJoCo's filter; else from an explicit list
  bool filter_parents = true;              // MuJoCo's own exclusion of parent and child is on
  std::vector<std::pair<int, int>> apart;  // pairs of bodies that the filter leaves out
};

ContactPlan plan_contacts(const Model& model, bool explicit_pairs);

// The name under which body `body` of the model, or the world, is in the spec.
std::string body_label(int body);

// Shape `index` of the model; `filtered`: found by the broad phase.
void add_shape(mjsBody* body, const Shape& shape, size_t index, bool filtered, const Softness& soft);

// What the broad phase leaves out, or the list of pairs in its place.
void add_pairs(mjSpec* spec, const Model& model, const ContactPlan& plan, const Softness& soft);

}  // namespace assay::mujoco
