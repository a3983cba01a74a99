// The fine-step run of a contender as a cell: what others read and campaigns do not name.
#include "measures/measure.h"

namespace assay {

Measure fine_run_measure() { return {.name = kFineRunCell, .reads = Reads::kFineRun}; }

}  // namespace assay
