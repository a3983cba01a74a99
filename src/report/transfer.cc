#include "report/transfer.h"

#include <nlohmann/json.hpp>

#include "results/transfer_matrix.h"

namespace assay {

nlohmann::json transfer_data(const Results& results) {
  nlohmann::json all = nlohmann::json::array();
  for (const std::string& system : results.systems()) {
    if (const auto matrix = transfer_matrix(results, system)) all.push_back(nlohmann::json(transfer_json(*matrix)));
  }
  return all;
}

}  // namespace assay
