// Values in the attributes of URDF elements. A null element is one that is not there.
#pragma once

#include <string>
#include <vector>

#include <tinyxml2.h>

#include "model/geometry.h"

namespace assay::urdf {

// "" where the element or the attribute is missing.
std::string text_of(const tinyxml2::XMLElement* element, const char* attribute);

// The numbers of a list, NaN for a word that is none; empty where the element or the attribute is missing.
std::vector<double> numbers_of(const tinyxml2::XMLElement* element, const char* attribute);

// The first number, or `otherwise` where there is none.
double number_of(const tinyxml2::XMLElement* element, const char* attribute, double otherwise);

// Three numbers, or `otherwise` where there are more or fewer.
Vec3 vector_of(const tinyxml2::XMLElement* element, const char* attribute, const Vec3& otherwise);

// The pose in <origin xyz rpy>, the identity where there is none; roll, pitch and yaw turn about fixed axes, in rad.
Pose origin_of(const tinyxml2::XMLElement& element);

}  // namespace assay::urdf
