#include "base/option_values.h"

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"

namespace assay {

double parse_positive(const std::string& option, const std::string& text, const std::string& unit) {
  const auto value = parse_fraction(text);
  if (!value)
    throw InputError(fmt::format("{} is '{}', which is not a number: give {}, as in 0.5 or 1/64", option, text, unit));
  if (*value <= 0) throw InputError(fmt::format("{} is {}: give a positive number of {}", option, text, unit));
  return *value;
}

int parse_count(const std::string& option, const std::string& text, int minimum, int maximum) {
  const auto value = parse_integer(text);
  if (!value || *value < minimum || *value > maximum) {
    throw InputError(fmt::format("{} is '{}': give a whole number from {} to {}", option, text, minimum, maximum));
  }
  return static_cast<int>(*value);
}

bool parse_switch(const std::string& option, const std::string& text) {
  if (text != "on" && text != "off") throw InputError(fmt::format("{} is '{}': use on or off", option, text));
  return text == "on";
}

double parse_share(const std::string& option, const std::string& text) {
  std::string number = text;
  const bool percent = number.ends_with('%');
  if (percent) number.pop_back();
  while (number.ends_with(' ')) number.pop_back();
  const auto value = parse_number(number);
  if (!value || *value < 0) {
    throw InputError(fmt::format("{} is '{}': give a share that is not negative, such as 5%", option, text));
  }
  if (!percent && *value >= 1) {
    throw InputError(fmt::format("{0} is '{1}', which is {2} %: add %, as in {1}%, or give a number below 1", option,
                                 text, shortest(100 * *value)));
  }
  return percent ? *value / 100 : *value;
}

std::map<std::string, std::string> parse_settings(const std::vector<std::string>& texts) {
  std::map<std::string, std::string> settings;
  for (const std::string& text : texts) {
    const size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw InputError(fmt::format("--set is '{}': write it as key=value, as in --set iterations=20", text));
    }
    if (!settings.emplace(text.substr(0, equals), text.substr(equals + 1)).second) {
      throw InputError(fmt::format("--set names '{}' twice: keep one of them", text.substr(0, equals)));
    }
  }
  return settings;
}

}  // namespace assay
