#include "controls/csv_line.h"

#include <sstream>

namespace assay {

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
