// The family of systems capsules-N: N free capsules in random orientations fall from a grid onto a plane. No N needs a
// file of its own (capsules_count of base/paths.h).
#pragma once

#include <string>

namespace assay {

// The MJCF text of capsules-N, N positive. Equal N give equal bytes everywhere: the random numbers are those of the
// Mersenne Twister with a fixed seed. models/capsules-27.xml is capsules_mjcf(27).
std::string capsules_mjcf(int count);

}  // namespace assay
