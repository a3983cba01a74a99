#include "controls/input_file.h"

#include <sstream>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/regular_file.h"

namespace assay {

std::string input_file(const std::string& path, const std::string& what, const std::string& give,
                       std::uintmax_t most_bytes) {
  const RegularFile file(path);
  if (!file.other().empty()) {
    throw InputError(fmt::format("{} '{}' is {} and not a regular file: give {}", what, path, file.other(), give));
  }
  if (file.size() > most_bytes) {
    throw InputError(fmt::format("{} '{}' has {} KiB, and at most {} are read: give {} of less", what, path,
                                 file.size() >> 10, most_bytes >> 10, give));
  }
  std::string bytes;
  if (file.error() != 0 || file.read(bytes, most_bytes) != 0) {
    throw InputError(fmt::format("{} '{}' cannot be read: check the path", what, path));
  }
  return bytes;
}

std::vector<std::string> csv_fields(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream stream(line + ",");
  for (std::string field; std::getline(stream, field, ',');) {
    const size_t first = field.find_first_not_of(" \t\r");
    fields.push_back(first == std::string::npos ? ""
                                                : field.substr(first, field.find_last_not_of(" \t\r") - first + 1));
  }
  return fields;
}

}  // namespace assay
