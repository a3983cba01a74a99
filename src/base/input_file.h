// Files that a user names: read as far as a bound, and only where they are files.
#pragma once

#include <cstdint>
#include <string>

namespace assay {

// Of a robot's files, each.
inline constexpr std::uintmax_t kMostModelFileBytes = std::uintmax_t{256} << 20;

// The content of a regular file of at most `most_bytes`; no more is taken into memory, whatever the file becomes while
// it is read. `what` names it in messages: "the file of torques"; `give` ends them: "a CSV file". Throws InputError,
// and SystemError where the machine is to blame, as for too many open files.
std::string input_file(const std::string& path, const std::string& what, const std::string& give,
                       std::uintmax_t most_bytes);

// The same of a text: one with a NUL is refused, behind which the system's functions would read nothing.
std::string input_text(const std::string& path, const std::string& what, const std::string& give,
                       std::uintmax_t most_bytes);

}  // namespace assay
