// Made-up results of the paper's whole programme, for the tests of the page.
#pragma once

#include "results/store/store.h"

namespace assay {

// Fills an empty store: 26 contenders, all main systems with the scenes of the models themselves, every measure, two
// families of sizes. Figures have the shape of real ones: orders, floors, failures, holes. Always the same.
void put_programme(Store& store);

}  // namespace assay
