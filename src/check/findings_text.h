// What a model itself gives reason to mend or to know: the first half of `assay check`.
#pragma once

#include <string>
#include <vector>

#include "base/console.h"
#include "check/model_check.h"
#include "check/step_bounds.h"
#include "load/problems.h"

namespace assay {

Json line_json(int line);  // null for 0, which is no line
Json findings_json(const std::vector<Finding>& findings);
Json bounds_json(const StepBounds& bounds, const FileFacts& facts);

// What was left out of the file, what to mend, what to know.
std::string findings_text(const std::vector<Finding>& findings, const std::vector<Problem>& left_out);
// The largest timestep of explicit springs and dampers; nothing for a model without any.
std::string bounds_text(const StepBounds& bounds, const FileFacts& facts);
// Model::notes that findings_text() did not print.
std::string notes_text(const Model& model, const std::vector<Problem>& left_out);

}  // namespace assay
