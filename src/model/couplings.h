// Joints that couplings move together: which of them lead, and where the others follow.
#pragma once

#include <vector>

#include "model/model.h"

namespace assay {

// By joint: it leads others. From positions of these, `follow` finds those of all joints in couplings, as far as the
// couplings allow. Of a group that joints move together, one leads that no coupling is solved for, where there is one.
std::vector<bool> leaders(const Model& model);

// Sets what couplings make of the joints that are `settled`, chains in whatever order they stand, and settles it. A
// coupling of which two joints are not settled leaves both; one of which all are is not looked at. `positions` in rad
// or m.
void follow(const Model& model, std::vector<bool>& settled, std::vector<double>& positions);

// All joints that couplings move follow the leaders. `velocities` in rad/s or m/s.
void follow_leaders(const Model& model, std::vector<double>& positions);
void velocities_follow_leaders(const Model& model, std::vector<double>& velocities);

}  // namespace assay
