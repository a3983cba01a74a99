// cases.json: cells of two systems, and questions with the answers that the command and the report's page give in
// words.
#pragma once

#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "results/store/store.h"

namespace assay {

inline nlohmann::json answer_cases() { return nlohmann::json::parse(std::ifstream(ASSAY_ANSWER_CASES)); }

// Of what names no system: its cells are of results before assay stored the penetration beyond the start's overlap.
constexpr const char* kCasesSystem = "pile";

inline void put_answer_cases(Store& store, const nlohmann::json& cases) {
  store.set_systems({{kCasesSystem, "{}"}, {"hand", "{}"}});
  std::vector<ContenderRow> contenders;
  for (const nlohmann::json& each : cases.at("contenders")) {
    const std::string name = each.at("name");
    nlohmann::json described = {{"changes", each.value("changes", nlohmann::json::array())}};
    if (each.contains("varies")) described["varies"] = each["varies"];
    contenders.push_back({name, name, "1", name, "", described.dump(), "{}"});
  }
  store.set_contenders(contenders);
  for (const nlohmann::json& each : cases.at("cells")) {
    Cell cell;
    cell.system = each.value("system", kCasesSystem);
    cell.contender = each.at("contender");
    cell.timestep_ms = each.at("timestep_ms");
    cell.measure = each.at("measure");
    cell.key = cell.system + cell.contender + cell.measure + std::to_string(cell.timestep_ms);
    cell.outcome = parse_outcome(each.value("outcome", "ok")).value();
    cell.reason = each.value("reason", "");
    for (const nlohmann::json& value : each.at("values")) {
      Value& made = cell.values.emplace_back(Value{value.at(0), value.at(1), value.at(2).get<double>(), {}, {}});
      if (value.size() < 5) continue;
      made.low = value[3].get<double>();
      made.high = value[4].get<double>();
    }
    store.put_cell(cell);
  }
}

}  // namespace assay
