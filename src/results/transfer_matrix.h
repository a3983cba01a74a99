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

// A value that is many times that of the run of training.
struct TransferExcess {
  std::string value;  // "foot_slip"
  double times = 0;   // the one's mean over the other's
};

struct TransferRow {
  std::string contender;
  double timestep_ms = 0;
  Outcome outcome = Outcome::kOk;
  std::string reason;                   // "" for ok
  std::vector<double> falls;            // of each run 1 or 0, one from each initial state; none where there was no run
  bool trained = false;                 // the contender and timestep of training
  std::map<std::string, Value> values;  // by name, as in the catalogue
  TransferParting parting;
  // Against the run of training, where that takes part and this is another one.
  std::vector<TransferExcess> excesses;  // the largest first
  std::optional<double> falls_p;         // that it falls as often: of the rank test, corrected for the number of rows

  size_t runs() const { return falls.size(); }
  const Value* value(const std::string& name) const;
  // What the fall rate says of this many runs: "stays up" where its interval ends at or below kUp, "falls" where it
  // begins at or above kDown, else "not settled". "stays up, but worse" is one that stays up with an excess.
  std::string_view verdict() const;
  static constexpr double kUp = 0.2, kDown = 0.5;
};

// The values of `row` that even by the near ends of both intervals are at least kManyTimes those of `trained`.
inline constexpr double kManyTimes = 2;
std::vector<TransferExcess> excesses(const TransferRow& row, const TransferRow& trained);

// "slips 9.7 times as much and takes 3 times as much power"; "" without any.
std::string excess_text(const std::vector<TransferExcess>& excesses);

// Whether the share of falls is told apart from that of training: falls_p is at most kToldApart.
inline constexpr double kToldApart = 0.05;

struct TransferMatrix {
  std::string system;
  std::string policy;      // the control, as the results describe it
  std::string trained_in;  // "" where the policy's configuration does not say
  double trained_ms = 0;   // its timestep; 0 where the configuration does not say
  double duration_s = 0;
  std::string pushes;             // "pushes of 0.5 m/s every 3 s"; "" for none
  std::vector<TransferRow> rows;  // the lowest fall rate first, then by contender and timestep; those without one last

  const TransferRow* trained() const;  // the run of training; null where it takes no part
  // "falls more often", "falls less often", "not told apart"; "" where the row is not compared.
  std::string_view against_training(const TransferRow& row) const;
};

// Empty for a system without the measure.
std::optional<TransferMatrix> transfer_matrix(const Results& results, const std::string& system);

// The answer in sentences: which contenders keep the robot up at all timesteps tried, then where others do not, which
// rows are told apart from training, and how much worse those are that stay up.
std::vector<std::string> transfer_answer(const TransferMatrix& matrix);

// {"system", "policy", "trained_in", "trained_ms", "duration_s", "pushes", "many_times", "told_apart", "answer": as
// above, "rows": [{"contender", "timestep_ms", "outcome", "reason", "runs", "trained", "verdict", "against_training":
// "falls more often" or as above, "falls_p", "excesses": [{"value", "times"}], "excess": as a sentence, "values":
// {NAME: {"value", "unit", "low", "high"}}, "parting": {"starts", "parted", "body", "same_body", "joint", "same_joint",
// "contact", "first_s", "median_s", "shown_s"}}]}; what is missing is null.
nlohmann::ordered_json transfer_json(const TransferMatrix& matrix);

}  // namespace assay
