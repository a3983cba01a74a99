// Verdicts of the conformance suite, kept for later runs: in campaigns those of the suite, in `assay conformance
// --long` those of the long series.
#pragma once

#include <string>
#include <vector>

#include "conformance/conformance.h"

namespace assay {

// The file in `folder` of a contender's verdicts. They depend on the contender with its plugin's build, which `content`
// says (CampaignContender::content), on the suite, which is part of this program, and on the series.
std::string kept_verdicts_file(const std::string& folder, const std::string& content, bool long_series);

// The verdicts in the file, in the order in which the tests ran; empty where there are none, or anything else.
std::vector<ConformanceResult> kept_verdicts(const std::string& path);

// Keeps them, as well as the folder can be written. What was not run is no verdict: leave it out. An engine that fails
// every test did not even start, as where its files are gone: nothing is kept.
void keep_verdicts(const std::string& path, const std::vector<ConformanceResult>& results);

}  // namespace assay
