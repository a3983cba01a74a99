#include "load/file_facts.h"

namespace assay {

namespace {

// "joint 'knee'" of "joint 'knee' armature"; empty where nothing is named.
std::string label_of(const std::string& element) {
  const size_t opens = element.find(" '");
  const size_t closes = opens == std::string::npos ? opens : element.find('\'', opens + 2);
  return closes == std::string::npos ? "" : element.substr(0, closes + 1);
}

}  // namespace

int FileFacts::line_of(const std::string& element) const {
  const auto found = lines.find(label_of(element));
  return found == lines.end() ? 0 : found->second;
}

std::string FileFacts::file_of(const std::string& element) const {
  const auto found = files.find(label_of(element));
  return found == files.end() ? "" : found->second;
}

}  // namespace assay
