// Which of a model's shapes MuJoCo gets, and how it finds the pairs that may touch.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <mujoco/mujoco.h>

#include "engines/adapter.h"
#include "options.h"
#include "tree.h"

namespace assay::mujoco {

// What a shape's contacts resist beside penetration: MuJoCo combines each of two shapes' by the larger.
struct ShapeContact {
  int dimension = 1;  // MuJoCo's condim
  double torsional = 0, rolling = 0;
};

// How MuJoCo finds exactly the model's contact pairs.
struct ContactPlan {
  ContactShapes shapes;                    // others do not exist for MuJoCo
  bool broad_phase = false;                // by MuJoCo's filter; else from an explicit list
  bool filter_parents = true;              // MuJoCo's own exclusion of parent and child is on
  std::vector<std::pair<int, int>> apart;  // pairs of bodies that the filter leaves out
  std::vector<ShapeContact> contact;       // by Model::shapes
};

ContactPlan plan_contacts(const Model& model, const Tree& tree, bool explicit_pairs);

// The name under which body `body` of the model, or the world, is in the spec.
std::string body_label(int body);

// The same of shape `index` of the model.
std::string shape_label(size_t index);

// The hulls and height fields of the shapes.
void add_shape_data(mjSpec* spec, const Model& model, const ContactPlan& plan);

// Shape `index` of the model.
void add_shape(mjsBody* body, const Model& model, size_t index, const ContactPlan& plan, const Softness& soft);

// What the broad phase leaves out, or the list of pairs in its place.
void add_pairs(mjSpec* spec, const Model& model, const ContactPlan& plan, const Softness& soft);

}  // namespace assay::mujoco
