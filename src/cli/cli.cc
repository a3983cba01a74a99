#include "cli/cli.h"

#include <csignal>
#include <cstdint>
#include <ctime>
#include <new>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "cli/help.h"

namespace assay::cli {
namespace {

volatile std::sig_atomic_t interruption = 0;
volatile bool second_ends = false;
volatile std::int64_t interrupted_at_ms = 0;

// A signal to a whole process group comes twice: to this process, and from the parent that passes its own on.
constexpr std::int64_t kTwinMs = 200;

void note_interruption(int signal) {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const std::int64_t now_ms = 1000 * static_cast<std::int64_t>(now.tv_sec) + now.tv_nsec / 1'000'000;
  if (interruption != 0 && second_ends && now_ms - interrupted_at_ms > kTwinMs) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
    return;
  }
  if (interruption == 0) interrupted_at_ms = now_ms;
  interruption = 1;
}

}  // namespace

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
    message("an engine threw an exception that is not a std::exception");
    return kFailed;
  }
}

void watch_for_interruption(bool once) {
  struct sigaction action = {};
  action.sa_handler = note_interruption;
  sigemptyset(&action.sa_mask);
  second_ends = once;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() { return interruption != 0; }

}  // namespace assay::cli
