#include "load/urdf/values.h"

#include <cmath>
#include <sstream>

#include "base/text.h"

namespace assay::urdf {

namespace xml = tinyxml2;

std::string text_of(const xml::XMLElement* element, const char* attribute) {
  const char* value = element == nullptr ? nullptr : element->Attribute(attribute);
  return value == nullptr ? "" : value;
}

std::vector<double> numbers_of(const xml::XMLElement* element, const char* attribute) {
  std::istringstream words(text_of(element, attribute));
  std::vector<double> numbers;
  for (std::string word; words >> word;) {
    if (word.starts_with('+')) word.erase(0, 1);  // "+1" is a number to every reader of URDF
    numbers.push_back(parse_number(word).value_or(std::nan("")));
  }
  return numbers;
}

double number_of(const xml::XMLElement* element, const char* attribute, double otherwise) {
  const std::vector<double> numbers = numbers_of(element, attribute);
  return numbers.empty() ? otherwise : numbers.front();
}

Vec3 vector_of(const xml::XMLElement* element, const char* attribute, const Vec3& otherwise) {
  const std::vector<double> v = numbers_of(element, attribute);
  return v.size() == 3 ? Vec3(v[0], v[1], v[2]) : otherwise;
}

Pose origin_of(const xml::XMLElement& element) {
  const xml::XMLElement* origin = element.FirstChildElement("origin");
  const Vec3 rpy = vector_of(origin, "rpy", Vec3::Zero());
  const Quat q = Eigen::AngleAxisd(rpy.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vec3::UnitY()) *
                 Eigen::AngleAxisd(rpy.x(), Vec3::UnitX());
  return {vector_of(origin, "xyz", Vec3::Zero()), q};
}

}  // namespace assay::urdf
