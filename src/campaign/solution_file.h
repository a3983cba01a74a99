// A motion that a system is compared with, as a file: states of a solution that its author has by other means.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"

namespace assay {

// CSV as `assay simulate` writes it: a header "time,body,x,y,z,..." and a line for each time (s) and body with the
// position of its centre of mass (m, world), and if they are there orientation (qw, qx, qy, qz), velocity (vx, vy, vz,
// m/s) and angular velocity (wx, wy, wz, rad/s). Columns in any order, others are skipped; times in any order. States
// of all bodies of the model at `times` (s); what a column does not give is that of the initial state. Throws
// InputError with the file's line for numbers that are none and unknown bodies, and for a body or time that is missing.
// `path` names the file in messages.
std::vector<State> solution_from_text(const Model& model, const std::string& text, const std::string& path,
                                      const std::vector<double>& times);

// The file's text. Throws InputError for what is no file, and above 256 MiB.
std::string solution_text(const std::string& path);

}  // namespace assay
