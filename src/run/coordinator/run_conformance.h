// The conformance suite of a campaign's contenders, before anything is measured.
#pragma once

#include <string>

#include "run/coordinator/run_work.h"

namespace assay {

// Runs the suites whose verdicts neither the results nor RunOptions::suites have. Of `work` the contenders that failed
// become Work::unscored, which takes back what was measured of them before they had to pass; what needs a contender
// whose workers somebody else ended is taken out. Returns what the machine lacked for a test, as in RunSummary.
std::string score_contenders(RunShared& run, Work& work);

}  // namespace assay
