// What differs between the plugins besides the module.
#pragma once

#include <vector>

#include "engines/engine.h"

namespace assay::havok_adapter {

BuildFacts build_facts();
std::vector<Contender> plugin_contenders();

}  // namespace assay::havok_adapter
