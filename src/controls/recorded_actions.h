// Actions that a CSV file gives: those of a run that somebody recorded.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "controls/policy.h"

namespace assay {

// The header has the names of the joints that get actions, in any order; each line after it is a control step. Empty
// lines are skipped.
struct RecordedActions {
  std::vector<double> actions;  // of each step one for each joint of PolicyConfig::joints
  size_t steps = 0;
};

// `text` is the content of the file `path`. Throws InputError with the file's line.
RecordedActions parse_recorded_actions(const std::string& text, const std::string& path, const PolicyConfig& config,
                                       const Model& model);

// Gives them in order, and the last ones again after them.
std::unique_ptr<ActionSource> recorded_actions(const RecordedActions& recorded);

}  // namespace assay
