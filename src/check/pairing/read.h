// Two files as the sides of a comparison.
#pragma once

#include <string>
#include <utility>

#include "check/pairing/pairing.h"
#include "load/load_options.h"

namespace assay::pairing {

// Reads both alike. Where one has a free base and the other is fixed to the world, the fixed one is read with a free
// base, too, if it can be (Side::base_changed); `options` may decide otherwise. Throws what load_model() throws.
std::pair<Side, Side> read_pair(const std::string& file_a, const std::string& file_b, const LoadOptions& options);

}  // namespace assay::pairing
