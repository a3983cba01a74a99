// What the subcommands share: how each is registered, what it needs, and its options as words. What they print goes
// through base/console.h.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "base/console.h"
#include "base/exit_status.h"
#include "base/option_values.h"
#include "isolate/interruption.h"

namespace assay::cli {

using exits::kDone, exits::kFailed, exits::kWrongInput;

// What the chosen subcommand does; its result is the program's status. InputError, SystemError and EngineError may
// leave it.
using Action = std::function<int()>;

// ---- commands
// -------------------------------------------------------------------------------------------------------

enum class Memory {
  kAny,
  kShare,    // it reads results: they may be a stranger's, and what they take to be read is for him to choose
  kMachine,  // the same, and large pictures take more
};

// What a command needs of the process that runs it.
struct Needs {
  Memory memory = Memory::kAny;  // writable memory, of what it starts, too
  // It reads models and loads plugins, and writes no results: it does that in a process of its own
  // (isolate/contained.h). The others rehearse that part.
  bool contained = false;
  // Folders that it may write then, of the parsed command; empty where it starts processes that are confined on their
  // own.
  std::optional<std::vector<std::string>> (*writable)(const CLI::App& command) = nullptr;  // default: written_folders()
};

struct Command {
  const char* name;
  const char* group;  // of the help; "": it is not shown there
  // In the file of its name: adds the subcommand, which sets `action` when it is called.
  void (*add)(CLI::App& app, Action& action);
  Needs needs = {};
};

// All of them, in the order of the help.
const std::vector<Command>& commands();

// Options that name a file or a folder which the command writes.
inline constexpr std::array kOutputOptions = {"--out", "--repair", "--write", "--sarif", "--junit", "--write-baseline"};

// Folders of the files that a command is to write.
std::optional<std::vector<std::string>> written_folders(const CLI::App& command);
// The same with the folder of kept verdicts, for `assay conformance --long`.
std::optional<std::vector<std::string>> verdict_folders(const CLI::App& command);
// The same for a picture; empty for a movie, for which an encoder and workers are started.
std::optional<std::vector<std::string>> drawing_folders(const CLI::App& command);

// ---- options --------------------------------------------------------------------------------------------------------

inline constexpr int kMostJobs = 1024;  // of --jobs

// A subcommand with its examples ("command line", "what it does") below the help.
using Examples = std::vector<std::pair<std::string, std::string>>;
CLI::App* add_command(CLI::App& app, const std::string& name, const std::string& summary, const Examples& examples);

// The options that were given, as words of a command line in the order of the help: "--ground", "--keyframe", "home".
// Without arguments and without those of `but`; with `group`, those of that group of the help alone.
std::vector<std::string> given_words(const CLI::App& command, const std::string& group = "",
                                     const std::vector<std::string>& but = {});

}  // namespace assay::cli
