// Measures that read the states of one run from the initial state and nothing else. Campaigns name them, the plan gives
// each a cell per timestep. A new one is a file with its function, and a line of run_measures.cc.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "model/model.h"

namespace assay {

struct RunValue {
  std::string name;  // as stored: "energy_drift", with a row in results/values.cc
  std::string unit;  // "m"; "1" for ratios
  std::optional<double> value;
  std::optional<double> low, high;  // 95 % interval, where there is one
};

// A run that came to its end, as a measure sees it.
struct MeasuredRun {
  const Model& model;
  const std::vector<State>& states;  // at equal distances, the initial state first
  bool passive = true;               // no control acts
  std::uint64_t seed = 1;            // of bootstraps
};

struct RunMeasure {
  std::string_view name;  // as campaigns name it: "drift"

  // Why the measure has no values for a model, as the end of a sentence about the system; "" when it has some.
  std::string (*obstacle)(const Model& model, bool passive);

  std::vector<RunValue> (*values)(const MeasuredRun& run);
};

const std::vector<RunMeasure>& run_measures();
const RunMeasure* find_run_measure(std::string_view name);  // null when there is none of this name

}  // namespace assay
