#include "measures/run_measures.h"

#include <algorithm>

namespace assay {

// Each is defined in the file of its name. A new one is declared here and takes part below.
RunMeasure drift_measure();
RunMeasure violation_measure();

const std::vector<RunMeasure>& run_measures() {
  static const std::vector<RunMeasure> kRows = {drift_measure(), violation_measure()};
  return kRows;
}

const RunMeasure* find_run_measure(std::string_view name) {
  const auto found = std::ranges::find(run_measures(), name, &RunMeasure::name);
  return found == run_measures().end() ? nullptr : &*found;
}

}  // namespace assay
