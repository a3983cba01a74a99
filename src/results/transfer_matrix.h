// Who transfers: contenders and timesteps under one policy, from the cells of the measure 'transfer'.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "results/results.h"

namespace assay {

// Where runs part from those of the contender that the policy was trained in, from the same initial states.
struct TransferParting {
  size_t starts = 0, parted = 0;  // runs that were compared, and those of them that part
  // Of the runs that part: the body that does so first and the joint that moves it apart, where most of them have it.
  std::string body, joint;                  // names; no joint: the free base itself
  size_t same_body = 0, same_joint = 0;     // how many of the runs have these
  size_t contact = 0;                       // runs in which a contact with the ground began or ended in one run only
  std::optional<double> first_s, median_s;  // s from the start, of the first body
  std::optional<double> shown_s;            // of the run that is kept for replays
};

struct TransferRow {
  std::string contender;
  double timestep_ms = 0;
  Outcome outcome = Outcome::kOk;
  std::string reason;                   // "" for ok
  size_t runs = 0;                      // that were made, one from each initial state; 0 where the engine refused
  bool trained = false;                 // the contender and timestep of training
  std::map<std::string, Value> values;  // by name, as in the catalogue
  TransferParting parting;

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
  double trained_ms = 0;   // its timestep; 0 where the configuration does not say
  double duration_s = 0;
  std::string pushes;             // "pushes of 0.5 m/s every 3 s"; "" for none
  std::vector<TransferRow> rows;  // the lowest fall rate first, then by contender and timestep; those without one last
};

// Empty for a system without the measure.
std::optional<TransferMatrix> transfer_matrix(const Results& results, const std::string& system);

// The answer in sentences: which contenders keep the robot up at every timestep, then where others do not.
std::vector<std::string> transfer_answer(const TransferMatrix& matrix);

// {"system", "policy", "trained_in", "trained_ms", "duration_s", "pushes", "answer": as above, "rows": [{"contender",
// "timestep_ms", "outcome", "reason", "runs", "trained", "verdict", "values": {NAME: {"value", "unit", "low", "high"}},
// "parting": {"starts", "parted", "body", "same_body", "joint", "same_joint", "contact", "first_s", "median_s",
// "shown_s"}}]}; what is missing is null.
nlohmann::ordered_json transfer_json(const TransferMatrix& matrix);

}  // namespace assay
