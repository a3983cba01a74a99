#include "model/file_facts.h"

namespace assay {

int FileFacts::line_of(const std::string& element) const {
  const size_t opens = element.find(" '");
  const size_t closes = opens == std::string::npos ? opens : element.find('\'', opens + 2);
  if (closes == std::string::npos) return 0;
  const auto found = lines.find(element.substr(0, closes + 1));
  return found == lines.end() ? 0 : found->second;
}

}  // namespace assay
