// The model's contact pairs in Havok's terms: each shape has two 32-bit masks that say which shapes meet, and a
// material from which a pair's friction is combined. Both are found exactly, or not at all.
#pragma once

#include <optional>
#include <vector>

#include "model/model.h"
#include "types.h"

namespace assay::havok_adapter {

// Shapes of one group meet the same others, so a group needs one bit: 32 groups at most.
struct Filters {
  std::vector<havok::FilterInfo> of;  // per shape, zero for shapes without a pair; empty where more groups are needed
};
Filters find_filters(const Model& model);

// One rule of combination and one coefficient a shape that give every pair its coefficient.
struct Friction {
  havok::Combine rule = havok::kMaximum;
  std::vector<double> of;  // per shape
};
std::optional<Friction> find_friction(const Model& model);

// Parent and child of a joint: Havok has a switch of its own for contact between them.
bool are_hinged(const Model& model, int body_a, int body_b);

// Whether any pair is between a body and its parent.
bool joint_has_contact(const Model& model, int body);

}  // namespace assay::havok_adapter
