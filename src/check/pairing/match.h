// Which body of one model is which of the other. A body stands for itself and the joint to its parent.
#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "check/pairing/pairing.h"
#include "model/model.h"

namespace assay::pairing {

struct BodyMatch {
  int a = -1, b = -1;  // indices into Model::bodies
  How how = How::kName;
};

// "joint 'knee'", "free body 'torso'": what a body is called here.
std::string name_of(const Model& model, int body);         // of its joint, of a free body its own
std::string element_of(const Model& model, int body);      // with its noun
bool is_descendant(const Model& model, int body, int of);  // also of itself; of kWorld always

// Matches that respect both trees: what one body hangs on, its match hangs on. Names of `map` that are no joint and no
// body are left to `actuators`, whose names `others` holds. Throws InputError for a name that is none of these.
std::vector<BodyMatch> match_bodies(const Model& a, const Model& b,
                                    const std::vector<std::pair<std::string, std::string>>& map);

// The model without these bodies: those with a joint are fused into their parents as they lie at 0, free ones with
// `kept` descendants stay where they are, other free ones are left out with all that they carry. `index` gets by old
// body its new index, and that of the body that it was fused into (kWorld), or -2 where it is gone.
struct Locked {
  Model model;
  std::vector<int> index;
  std::vector<bool> absorbed;  // by new body: it has taken in a fused one
};
Locked locked(const Model& model, const std::set<int>& bodies);

}  // namespace assay::pairing
