// One simulated second of both files in one engine.
#pragma once

#include <string>

#include "check/pairing/pairing.h"
#include "engines/registry.h"

namespace assay::pairing {

// Both as they are, from A's first state, with their own actuators where both files have drives; without the shapes of
// the world where only one has a ground. The engine steps in a process of its own, at 1 ms. What cannot be run says why
// in Motion::failure. Throws what compare() throws, EndedFromOutside, and SystemError where it is interrupted.
Motion one_second(const Side& a, const Side& b, const Options& options, const ResolvedContender& contender);

}  // namespace assay::pairing
