// The JSON of the report's section 'template': how many cells each contender has.
//
// It is this file as src/report/template.cc, in the list of src/report/CMakeLists.txt, declared and called in
// src/report/report.cc.
#include <map>

#include <nlohmann/json.hpp>

#include "results/store/store.h"

namespace assay {

nlohmann::json template_data(const Store& store) {
  std::map<std::string, int> counts;
  for (const Cell& cell : store.cells()) ++counts[cell.contender];
  return counts;
}

}  // namespace assay
