// Values in SDF elements: text between tags. A null element is one that is not there.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <tinyxml2.h>

namespace assay::sdf {

// The text of an attribute, "" where there is none.
std::string attribute(const tinyxml2::XMLElement* element, const char* name);

// The text of an element without blanks at its ends.
std::string text_of(const tinyxml2::XMLElement* element);

const tinyxml2::XMLElement* child(const tinyxml2::XMLElement* element, const char* name);

// A number as C++ and SDF write it: "1", "+1e-3", "inf". Empty for anything else, NaN included.
std::optional<double> number(std::string word);

// All numbers of a text that is separated by blanks; empty where a word is no number.
std::optional<std::vector<double>> numbers(const std::string& text);

// "true", "1", "false", "0", in small or large letters.
std::optional<bool> truth(std::string text);

}  // namespace assay::sdf
