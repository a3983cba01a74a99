// One contender fitted to measured logs.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "match/evaluator.h"
#include "match/parameters.h"
#include "match/windows.h"

namespace assay::match {

struct FitOptions {
  std::uint64_t seed = 1;
  int budget = 600;  // candidates of the search, of all starts together; the same for every contender
  int starts = 3;
  bool rough = false;                                   // impacts: CMA-ES and not least squares
  std::string record = {};                              // file of what was evaluated, to go on from; "" for none
  std::function<void(int done, int of)> progress = {};  // candidates
};

// A direction that the data do not determine.
struct Combination {
  std::vector<std::string> members;  // names of parameters, the largest share first
  std::vector<double> weights;
  double interval = 0;    // 95 %, in sizes of the parameters: 1 is a number by itself
  std::string frozen;     // the member that the fit left alone then
  bool as_found = false;  // at the value that was found, because the model's fits worse; else at the model's
};

struct Fit {
  std::vector<double> values;                    // of the parameters
  std::vector<std::optional<double>> low, high;  // 95 %; empty: not determined
  std::vector<Combination> combinations;
  std::vector<std::string> at_bound;
  std::vector<std::vector<double>> starts;  // values at which the starts ended, with the cost behind them, best first
  double cost = 0;
  int evaluations = 0;
};

// Fits to the windows `training` (indices into those of the evaluator's job). Throws SystemError.
Fit fit(Evaluator& evaluator, const Model& model, const Windows& windows, const std::vector<size_t>& training,
        const std::vector<Parameter>& parameters, const FitOptions& options);

nlohmann::ordered_json fit_json(const Fit& fit);
Fit fit_from_json(const nlohmann::ordered_json& json);

}  // namespace assay::match
