// Files of users that controls read: torques, actions, networks, configurations.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace assay {

// The content of a regular file of at most `most_bytes`. `what` names it in messages: "the file of torques"; `give`
// ends them: "a CSV file". Throws InputError.
std::string input_file(const std::string& path, const std::string& what, const std::string& give,
                       std::uintmax_t most_bytes);

// The fields of one line of CSV without quotes, blanks around each taken off.
std::vector<std::string> csv_fields(const std::string& line);

}  // namespace assay
