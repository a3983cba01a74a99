// What a robot on a free base would stand on or fly with: URDF cannot say that a base is free, but its parts do.
#pragma once

#include <string>

#include "model/model.h"

namespace assay {

// Why the base of a model is likely to be free, as the rest of "because it ...": "stands on 4 of its limbs". Empty
// where its base is likely to be fixed. The model's base is free, and all of its shapes may collide with a ground.
//
// A robot rolls when two bodies that turn without limits about a horizontal axis reach the ground and are as high above
// their axis as below. It flies when three or more light bodies on its base turn without limits about the vertical. It
// stands on limbs when its trunk is clear of the ground and limbs of the trunk reach it that are named as legs; limbs
// without such a name count as legs when they are no grippers, come in pairs, have two joints each (a pair alone
// three), no slides, and 15 % of the mass. Fingers that hang from a bolted platform are light, or three.
std::string support_of(const Model& model);

}  // namespace assay
