// The accuracy pass: every cell of a campaign's run that is not a timing, on all cores.
#pragma once

#include <vector>

#include "run/coordinator/run_answers.h"
#include "run/coordinator/run_describe.h"

namespace assay {

// Makes the runs that cells and other parts read, and measures the cells. Runs that fail or whose workers somebody else
// ends are noted in `work`, those for others in `description`. Returns the systems without a reference solution, as in
// RunSummary.
std::vector<Missing> measure_accuracy(RunShared& run, Work& work, TimeLeft& time_left, Answers& answers,
                                      RunDescription& description);

}  // namespace assay
