// Lines of CSV without quotes: torques, actions, lists of joints.
#pragma once

#include <string>
#include <vector>

namespace assay {

// The fields of one line, blanks around each taken off.
std::vector<std::string> csv_fields(const std::string& line);

}  // namespace assay
