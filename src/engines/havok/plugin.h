// What differs between the plugins besides the module.
#pragma once

#include <string>
#include <vector>

#include "engines/engine.h"

namespace assay::havok_adapter {

BuildFacts build_facts();
std::vector<Contender> plugin_contenders();
std::string plugin_note();  // for Capabilities::other; "" for nothing

}  // namespace assay::havok_adapter
