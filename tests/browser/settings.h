// Made-up results of a sweep: contenders in many settings.
#pragma once

#include "results/store/store.h"

namespace assay {

// Systems, contenders and cells of a sweep over iterations and softness: the more iterations, the slower and the more
// accurate; the softer, the more accurate and the deeper.
void put_settings(Store& store);

}  // namespace assay
