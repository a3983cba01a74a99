#include "report/batches.h"

#include <algorithm>
#include <tuple>

#include <nlohmann/json.hpp>

#include "measures/batch.h"

namespace assay {
namespace {

using nlohmann::json;

constexpr const char* kDevice = "device ";  // begins the manifest's entries

json bound(const std::optional<double>& value) { return value ? json(*value) : json(nullptr); }

}  // namespace

json batch_data(const Results& results) {
  json devices = json::object();
  for (const ManifestEntry& entry : results.store().manifest()) {
    if (entry.key == "cpu") devices["cpu"] = entry.value;
    if (entry.key.starts_with(kDevice)) devices[entry.key.substr(std::string(kDevice).size())] = entry.value;
  }
  json all = json::array();
  for (const std::string& system : results.systems()) {
    std::vector<std::pair<BatchOf, const Cell*>> cells;
    for (const Cell& cell : results.batch_cells()) {
      if (const auto batch = batch_of(cell.measure); batch && cell.system == system) cells.emplace_back(*batch, &cell);
    }
    if (cells.empty()) continue;
    const auto order = [&](const std::pair<BatchOf, const Cell*>& each) {
      const auto& [batch, cell] = each;
      const auto contender = std::ranges::find(results.contenders(), cell->contender) - results.contenders().begin();
      return std::tuple(contender, cell->timestep_ms, batch.device, batch.worlds);
    };
    std::ranges::stable_sort(cells, {}, order);
    json rows = json::array();
    for (const auto& [batch, cell] : cells) {
      json values = json::object();
      for (const Value& value : cell->values) {
        values[value.name] = {{"value", bound(value.value)}, {"low", bound(value.low)}, {"high", bound(value.high)}};
      }
      rows.push_back({{"contender", cell->contender},
                      {"timestep_ms", cell->timestep_ms},
                      {"worlds", batch.worlds},
                      {"device", batch.device},
                      {"outcome", outcome_text(cell->outcome)},
                      {"reason", cell->reason},
                      {"values", std::move(values)}});
    }
    all.push_back({{"system", system}, {"devices", devices}, {"rows", std::move(rows)}});
  }
  return all;
}

}  // namespace assay
