// Torques that a CSV file gives over time.
#pragma once

#include <memory>
#include <string>

#include "controls/control.h"

namespace assay {

// The first line is the header: "time" and names of hinges or slides; joints that it does not name get no torque. Each
// line after it has a time (s, ascending) and a torque (Nm; N for slides) for each name. Between two lines torques are
// interpolated linearly; before the first and after the last line they are those of that line. Empty lines are skipped.
// Throws InputError with the file's line for an unknown or repeated name, a wrong number of columns, a field that is no
// finite number, and times that do not ascend.
std::unique_ptr<Control> file_control(const Model& model, const std::string& path);

}  // namespace assay
