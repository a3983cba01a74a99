// The report's page of `assay match`: the answer, measured and simulated motion, errors by log, fitted parameters.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace assay {

// What the page shows of the match in `dir`, also while it is not complete (web/src/data.ts names the fields). Throws
// InputError for a folder that is none of a match.
nlohmann::json match_report_data(const std::string& dir);

// Writes `dir`/report.html and returns its path. Throws as above, and SystemError.
std::string write_match_report(const std::string& dir);

}  // namespace assay
