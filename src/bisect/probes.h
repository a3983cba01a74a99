// Small scenes of one mechanism each that a release's own program runs (src/engines/NAME/probes.cc), compared between
// two releases: what of the engine changed, whatever the robot.
#pragma once

#include <string>
#include <vector>

namespace assay {

struct ProbeValue {
  std::string probe, condition, quantity, unit;  // "contact pairs", "box and mesh", "contacts", "1"
  double value = 0;
};

struct ProbeRun {
  std::vector<ProbeValue> values;
  std::string failure;  // in words; "" where there is none
};

// Runs the probes of the release whose plugin is given, in a process of its own, for at most `limit_s`.
ProbeRun run_probes(const std::string& plugin, double limit_s);

struct ProbeChange {
  ProbeValue before;
  double after = 0;
};

// Values that differ by more than rounding: 1e-9 of the larger one, or 1e-12 where both are small.
std::vector<ProbeChange> probe_changes(const std::vector<ProbeValue>& before, const std::vector<ProbeValue>& after);

// "contact pairs (box and mesh): contacts 4 to 5", "free flight (implicitfast): ... 0.485 to 2e-13".
std::string probe_change_text(const ProbeChange& change);

}  // namespace assay
