// What differs between the plugins besides the module.
#pragma once

#include "engines/engine.h"

namespace assay::havok_adapter {

BuildFacts build_facts();
const char* summary();  // one line, for the list of contenders

}  // namespace assay::havok_adapter
