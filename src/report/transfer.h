// Who transfers, for the report's page.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace assay {

class Results;

// An array with transfer_json() (results/transfer_matrix.h) of each system that was run under a policy.
nlohmann::json transfer_data(const Results& results);

}  // namespace assay
