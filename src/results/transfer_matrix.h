// Who transfers: contenders and timesteps under one policy, from the cells of the measure 'transfer'.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "results/results.h"

namespace assay {

struct TransferRow {
  std::string contender;
  double timestep_ms = 0;
  Outcome outcome = Outcome::kOk;
  std::string reason;                   // "" for ok
  size_t runs = 0;                      // that were made, one from each initial state; 0 where the engine refused
  bool trained = false;                 // the contender and timestep of training
  std::map<std::string, Value> values;  // by name, as in the catalogue

  const Value* value(const std::string& name) const;
  // What the fall rate says of this many runs: "stays up" where its interval ends at or below kUp, "falls" where it
  // begins at or above kDown, else "not settled".
  std::string_view verdict() const;
  static constexpr double kUp = 0.2, kDown = 0.5;
};

struct TransferMatrix {
  std::string system;
  std::string policy;      // the control, as the results describe it
  std::string trained_in;  // "" where the policy's configuration does not say
  double duration_s = 0;
  std::vector<TransferRow> rows;  // the lowest fall rate first, then by contender and timestep; those without one last
};

// Empty for a system without the measure.
std::optional<TransferMatrix> transfer_matrix(const Results& results, const std::string& system);

// {"system", "policy", "trained_in", "duration_s", "rows": [{"contender", "timestep_ms", "outcome", "reason", "runs",
// "trained", "verdict", "values": {NAME: {"value", "unit", "low", "high"}}}]}; what is missing is null.
nlohmann::ordered_json transfer_json(const TransferMatrix& matrix);

}  // namespace assay
