#include "cli/cli.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"

namespace assay::cli {
namespace {

volatile std::sig_atomic_t interruption = 0;

void note_interruption(int) { interruption = 1; }

// Columns that a terminal shows for UTF-8 text without wide or combining characters.
size_t width(const std::string& text) {
  return static_cast<size_t>(
      std::ranges::count_if(text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

}  // namespace

CLI::App* add_command(CLI::App& app, const std::string& name, const std::string& summary,
                      const std::vector<std::pair<std::string, std::string>>& examples) {
  CLI::App* command = app.add_subcommand(name, summary);
  std::string footer = "Examples:";
  for (const auto& [line, meaning] : examples) footer += fmt::format("\n  {}\n      {}", line, meaning);
  command->footer(footer + "\n");
  return command;
}

double parse_positive(const std::string& option, const std::string& text, const std::string& unit) {
  const auto value = parse_fraction(text);
  if (!value)
    throw InputError(fmt::format("{} is '{}', which is no number: give {}, as in 0.5 or 1/64", option, text, unit));
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

namespace {

[[noreturn]] void fail_output(int error) {
  throw SystemError(fmt::format("standard output cannot be written ({}): free some space or redirect it elsewhere",
                                std::strerror(error != 0 ? error : EIO)));
}

}  // namespace

void print(const std::string& text) {
  errno = 0;
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) fail_output(errno);
}

void print_json(const Json& json) { print(json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"); }

void flush_output() {
  errno = 0;
  if (std::fflush(stdout) != 0) fail_output(errno);
}

void message(const std::string& text) {
  const std::string line = fmt::format("assay: {}\n", text);
  std::fflush(stdout);
  std::fwrite(line.data(), 1, line.size(), stderr);
}

int guarded(const std::function<int()>& work) {
  try {
    return work();
  } catch (const InputError& error) {
    message(error.what());
    return kWrongInput;
  } catch (const std::bad_alloc&) {
    message("out of memory: use a smaller model or fewer jobs");
    return kFailed;
  } catch (const std::exception& error) {
    message(error.what());
    return kFailed;
  } catch (...) {
    message("an exception of a type that is no std::exception, which an engine must have thrown");
    return kFailed;
  }
}

std::string counted(size_t count, const std::string& singular, const std::string& plural) {
  return fmt::format("{} {}", count, count == 1 ? singular : plural);
}

std::string table(const std::vector<std::string>& headings, const std::vector<std::vector<std::string>>& rows,
                  const std::vector<size_t>& right) {
  std::vector<size_t> widths;
  widths.reserve(headings.size());
  for (size_t column = 0; column < headings.size(); ++column) {
    widths.push_back(width(headings[column]));
    for (const auto& row : rows) widths[column] = std::max(widths[column], width(row[column]));
  }
  std::string text;
  const auto add_line = [&](const std::vector<std::string>& cells) {
    std::string line;
    for (size_t column = 0; column < cells.size(); ++column) {
      if (column > 0) line += "  ";
      const std::string padding(widths[column] - width(cells[column]), ' ');
      const bool flush_right = std::ranges::find(right, column) != right.end();
      line += flush_right ? padding + cells[column] : cells[column] + padding;
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  };
  add_line(headings);
  for (const auto& row : rows) add_line(row);
  return text;
}

void watch_for_interruption(bool once) {
  struct sigaction action = {};
  action.sa_handler = note_interruption;
  sigemptyset(&action.sa_mask);
  action.sa_flags = once ? static_cast<int>(SA_RESETHAND) : 0;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() { return interruption != 0; }

}  // namespace assay::cli
