#include "controls/input_file.h"

#include <filesystem>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include "base/errors.h"

namespace assay {

std::string input_file(const std::string& path, const std::string& what, const std::string& give,
                       std::uintmax_t most_bytes) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::exists(path, error) && !fs::is_regular_file(path, error)) {
    throw InputError(fmt::format("{} '{}' is not a regular file: give {}", what, path, give));
  }
  if (const auto size = fs::file_size(path, error); !error && size > most_bytes) {
    throw InputError(fmt::format("{} '{}' has {} KiB, and at most {} are read: give {} of less", what, path, size >> 10,
                                 most_bytes >> 10, give));
  }
  std::ifstream file(path, std::ios::binary);
  std::ostringstream all;
  if (file && file.peek() != std::ifstream::traits_type::eof()) all << file.rdbuf();
  if (!file.is_open() || !all) throw InputError(fmt::format("{} '{}' cannot be read: check the path", what, path));
  return all.str();
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
