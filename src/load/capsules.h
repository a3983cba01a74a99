// The family of systems capsules-N: N free capsules in random orientations fall from a grid onto a plane. No N needs a
// file of its own (capsules_named of base/paths.h).
#pragma once

#include <string>

#include "base/paths.h"

namespace assay {

// The MJCF text of the system. Equal names give equal bytes everywhere: the random numbers are those of the Mersenne
// Twister. models/capsules-27.xml is capsules_mjcf({27}). Without layers the grid is a cube, so that the pile of more
// capsules is higher; with layers it grows in width alone.
std::string capsules_mjcf(const CapsulesName& name);

}  // namespace assay
