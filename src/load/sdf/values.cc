#include "load/sdf/values.h"

#include <algorithm>
#include <cctype>
#include <limits>
#include <sstream>

#include "base/text.h"

namespace assay::sdf {
namespace {

std::string small_letters(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace

namespace xml = tinyxml2;

std::string attribute(const xml::XMLElement* element, const char* name) {
  const char* value = element == nullptr ? nullptr : element->Attribute(name);
  return value == nullptr ? "" : value;
}

std::string text_of(const xml::XMLElement* element) {
  const char* value = element == nullptr ? nullptr : element->GetText();
  const std::string text = value == nullptr ? "" : value;
  const size_t begin = text.find_first_not_of(" \t\r\n");
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(" \t\r\n") + 1 - begin);
}

const xml::XMLElement* child(const xml::XMLElement* element, const char* name) {
  return element == nullptr ? nullptr : element->FirstChildElement(name);
}

std::optional<double> number(std::string word) {
  if (word.starts_with('+')) word.erase(0, 1);
  const std::string small = small_letters(word);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (small == "inf" || small == "infinity") return kInfinity;
  if (small == "-inf" || small == "-infinity") return -kInfinity;
  return parse_number(word);
}

std::optional<std::vector<double>> numbers(const std::string& text) {
  std::istringstream words(text);
  std::vector<double> values;
  for (std::string word; words >> word;) {
    const std::optional<double> value = number(word);
    if (!value) return std::nullopt;
    values.push_back(*value);
  }
  return values;
}

std::optional<bool> truth(std::string text) {
  text = small_letters(std::move(text));
  if (text == "true" || text == "1") return true;
  if (text == "false" || text == "0") return false;
  return std::nullopt;
}

}  // namespace assay::sdf
