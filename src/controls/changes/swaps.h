// What may make two contenders part on one robot: for each convention the changes of one of them, or of both, with
// which they would agree if it were the cause.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "controls/changes/change.h"
#include "engines/registry.h"

namespace assay {

// One of the two contenders, with what its user has changed of it.
struct Side {
  std::string name;                                   // "A" or "B"
  std::string contender;                              // as the registry knows it
  std::map<std::string, std::string> overrides = {};  // of its settings
  std::vector<RunChange> changes = {};                // of any kind

  // The same with more changes behind its own.
  Side with(const std::vector<RunChange>& more) const;
};

// What a side runs as, its changes of the contender worked in.
struct Recipe {
  ResolvedContender contender;
  std::map<std::string, std::string> overrides;  // of contender.base
  std::vector<RunChange> changes;                // of the model and its control
  double timestep_factor = 1;
};
// Throws InputError for a contender or a setting that there is not.
Recipe recipe_of(const Side& side);

struct Pairing {
  const Model* model = nullptr;
  ControlSpec spec = {};
  const Control* control = nullptr;  // of the unchanged model
  Side a, b;
  double timestep_ms = 0;
};

struct Swap {
  std::string cause;   // the convention: "armature"; swaps of one cause are its alternatives
  std::string words;   // what is swapped: "A without armature"
  std::string advice;  // what to change if this closes the gap; "" for a swap that only shows where the gap arises
  std::vector<RunChange> a, b;
  bool many = false;  // one of a number that grows with the robot: tried from a few starts first

  bool is_advice() const { return !advice.empty(); }
};

// A convention that cannot be swapped.
struct NoSwap {
  std::string cause, why;
};

struct Swaps {
  std::vector<Swap> swaps;
  std::vector<NoSwap> not_possible;
};

// What a parity certificate has found in one side, relative to the model (check/parity/parity.h: Cause).
struct SeenParameter {
  bool in_b = false;
  std::string parameter;                // "armature"
  std::string element;                  // name of the joint or body
  double change = 0;                    // relative to the model's number, or absolute where that is 0
  std::vector<std::string> alike = {};  // other parameters that would act the same, in words
};

// A departure from the model that one side's adapter declares for this model and timestep, and causes of swaps that it
// concerns.
struct KnownDeviation {
  bool in_b = false;
  std::string of;      // the conformance test that shows it, or what of the model is approximated
  std::string reason;  // in words
  std::vector<std::string> causes;
};
// Throws InputError as recipe_of() does.
std::vector<KnownDeviation> known_deviations(const Pairing& pairing);

// The cause of swaps that change the timestep.
inline constexpr const char* kTimestepCause = "timestep";

// Every swap that both sides have a way for, parameters that parity has seen first. Throws InputError as recipe_of()
// does.
Swaps swaps_for(const Pairing& pairing, const std::vector<SeenParameter>& seen);

}  // namespace assay
