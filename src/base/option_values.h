// Values of options as users write them. What throws InputError names the option, the value and how to mend it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/quantity.h"  // parse_positive(), parse_quantity()

namespace assay {

// A positive number with or without a fraction bar, in `unit`.
double parse_positive(const std::string& option, const std::string& text, const std::string& unit);

// A whole number from `minimum` to `maximum`.
int parse_count(const std::string& option, const std::string& text, int minimum, int maximum);

// "on" or "off".
bool parse_switch(const std::string& option, const std::string& text);

// "5%", "5 %" or "0.05". A plain number from 1 on is refused: 5 for "5%" would mean 500 %, which nothing ever exceeds.
double parse_share(const std::string& option, const std::string& text);

// Texts "key=value" of --set; a key twice is an error.
std::map<std::string, std::string> parse_settings(const std::vector<std::string>& texts);

}  // namespace assay
