// Findings as SARIF 2.1.0, which forges and editors show at their lines.
#pragma once

#include "check/dataset/dataset.h"

namespace assay::dataset {

// A rule for each kind, a result for each finding: "error" for refused files, "warning" for what is to mend, "note" for
// the rest. URIs count from the folder ("%SRCROOT%"). Where there is a baseline, results say whether it has them.
// Fingerprints are of file, kind and subject, as in a baseline.
Json sarif_json(const Report& report);

// `path` as a relative URI: bytes that may not be in one as %XX.
std::string uri_of(const std::string& path);

}  // namespace assay::dataset
