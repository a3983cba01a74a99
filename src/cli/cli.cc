#include "cli/cli.h"

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "cli/help.h"

namespace assay::cli {
CLI::App* add_command(CLI::App& app, const std::string& name, const std::string& summary, const Examples& examples) {
  CLI::App* command = app.add_subcommand(name, summary);
  command->footer(examples_text(examples));
  return command;
}

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

}  // namespace assay::cli
