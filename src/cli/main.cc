// `assay`: one program with subcommands. Reads the command line, runs the subcommand and turns what it throws into one
// sentence and a status.
#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <fcntl.h>
#include <iterator>
#include <memory>
#include <new>
#include <optional>
#include <unistd.h>

#include <fmt/format.h>

#include "base/build_info.h"
#include "base/errors.h"
#include "base/output_file.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/completion.h"
#include "cli/help.h"
#include "engines/engine_files.h"
#include "isolate/contained.h"
#include "isolate/limits.h"
#include "run/worker/worker.h"

namespace assay::cli {
namespace {

constexpr const char* kDescription =
    "Puts one robot model into many physics engines and measures, side by side, how fast, how accurate and how stable "
    "each contender is. A contender is an engine with settings.";

const Examples kExamples = {{"assay check my_robot.xml", "what each engine does with a model of your own"},
                            {"assay paper --quick --out results", "measure the paper's systems in a few minutes"},
                            {"assay recommend results humanoid --error 1mm", "the fastest contender within an error"}};

// The subcommand that was called, or the program itself.
const CLI::App* called(const CLI::App& app) {
  const auto commands = app.get_subcommands();
  return commands.empty() ? &app : commands.front();
}

std::string full_name(const CLI::App& app, const CLI::App& command) {
  return &app == &command ? app.get_name() : app.get_name() + " " + command.get_name();
}

// The first argument that nothing of `command` takes, as a complaint; empty when there is none.
std::string unexpected_argument(const CLI::App& app, const CLI::App& command) {
  std::vector<std::string> options;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) options.push_back("--" + name);
  }
  const std::vector<std::string> rest = command.remaining();
  const auto is_option = [](const std::string& text) { return text.size() > 1 && text.front() == '-'; };
  const auto unknown = std::ranges::find_if(rest, is_option);
  if (unknown != rest.end()) {
    const std::string name = unknown->substr(0, unknown->find('='));
    const auto nearest = nearest_name(name, options);
    return fmt::format("'{}' has no option '{}'{}", full_name(app, command), name,
                       nearest ? fmt::format(" (did you mean '{}'?)", *nearest) : "");
  }
  if (!rest.empty())
    return fmt::format("'{}' takes no further argument, but '{}' was given", full_name(app, command), rest.front());
  return "";
}

// A model that its own run replaces would be gone. Options whose value is no file are left out: a file may be called 1.
void check_outputs(const CLI::App& command) {
  std::vector<std::string> given;
  for (const CLI::Option* option : command.get_options()) {
    const std::string kind = option->get_type_name();
    const bool is_output =
        std::ranges::any_of(kOutputOptions, [option](const char* name) { return option->check_name(name); });
    const bool names_file = (kind.starts_with("FILE") || kind == "CONTROL") && !is_output;
    if (!names_file && !option->get_positional()) continue;
    for (const std::string& value : option->results()) given.push_back(value);
  }
  for (const char* name : kOutputOptions) {
    const CLI::Option* option = command.get_option_no_throw(name);
    if (option != nullptr && option->count() > 0) refuse_to_overwrite(name, option->as<std::string>(), given);
  }
}

// The writable memory, in bytes, of a command that needs some. Nothing for other commands.
std::optional<std::uint64_t> memory_bytes(Memory memory) {
  if (memory == Memory::kAny) return std::nullopt;
  return (memory == Memory::kShare ? WorkerLimits::of_share(1) : WorkerLimits::of_machine()).memory_bytes;
}

// The limit holds for what it starts, too.
Action within_memory(Action action, const std::string& command, std::uint64_t bytes) {
  return [action = std::move(action), command, bytes] {
    WorkerLimits limits;
    limits.memory_bytes = bytes;
    limits.file_bytes = limits.tasks = 0;  // not limited
    limits.apply();
    try {
      return action();
    } catch (const std::bad_alloc&) {
      constexpr double kGiB = 1 << 30;
      throw SystemError(
          fmt::format("out of memory: '{}' may take {:.2g} GiB here, and what it was given needs more: give smaller "
                      "results or a smaller model",
                      command, static_cast<double>(bytes) / kGiB));
    }
  };
}

// A wrong command line in one sentence that ends in where to look.
std::string complaint(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = *called(app);
  std::string text = unexpected_argument(app, command);
  if (text.empty() && dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
    text = error.what();
    // the only two ways to get there: an option without its value, a flag with one
    const bool flag = text.find("flag override") != std::string::npos;
    text = text.substr(0, text.find_first_of(": ")) + (flag ? " takes no value" : " needs a value");
    if (!text.starts_with('-')) text.insert(0, "--");
  } else if (text.empty()) {
    text = error.what();
    text.erase(std::min(text.find('\n'), text.size()));
    if (!text.empty() && text.back() == '.') text.pop_back();
  }
  return fmt::format("{}: see '{} --help'", text, full_name(app, command));
}

// A word that is no subcommand's name gets the nearest one, which CLI11 cannot know.
void check_command(const std::string& word) {
  std::vector<std::string> names;
  for (const Command& command : commands()) {
    if (command.name == word) return;
    if (*command.group != '\0') names.emplace_back(command.name);
  }
  throw InputError(fmt::format("unknown command '{}'{}", word, did_you_mean(word, names)));
}

int run(int argc, char** argv) {
  // started by a campaign, never by hand: no help shows it and its arguments are its own
  if (argc > 1 && std::string_view(argv[1]) == "worker") return worker_main(argc - 1, argv + 1);

  CLI::App app(kDescription, "assay");
  Action action;
  app.set_version_flag("--version", fmt::format("assay {} ({})", kVersion, kGitCommit), "Print version and commit");
  app.formatter(std::make_shared<HelpFormatter>());
  app.get_formatter()->label("Positionals", "Arguments");
  app.get_formatter()->label("SUBCOMMAND", "COMMAND");
  app.option_defaults()->always_capture_default(false);
  app.require_subcommand(0, 1);
  for (const Command& command : commands()) {
    command.add(app, action);
    app.get_subcommands({}).back()->group(command.group);
  }
  app.footer(examples_text(kExamples,
                           "'assay COMMAND --help' shows a command's options and examples. NO_COLOR=1 switches colours "
                           "off."));

  if (argc > 1 && std::string_view(argv[1]) == "completion") return completion(app, {argv + 2, argv + argc});
  std::vector<const char*> words(argv, argv + argc);
  if (argc > 1 && std::string_view(argv[1]) == "help") {  // 'assay help COMMAND', as with other programs
    words.erase(words.begin() + 1);
    words.push_back("--help");
  }
  if (words.size() > 1 && words[1][0] != '-') check_command(words[1]);
  try {
    app.parse(static_cast<int>(words.size()), words.data());
  } catch (const CLI::CallForVersion& version) {
    print(std::string(version.what()) + "\n");
    return kDone;
  } catch (const CLI::CallForHelp&) {
    print(app.help());
    return kDone;
  } catch (const CLI::ParseError& error) {
    message(complaint(app, error));
    return kWrongInput;
  }
  if (!action) {
    const std::string help = terminal_text(app.help(), stderr);
    std::fwrite(help.data(), 1, help.size(), stderr);
    return kWrongInput;
  }
  const CLI::App& command = *called(app);
  const Needs& needs = std::ranges::find(commands(), command.get_name(), &Command::name)->needs;
  check_outputs(command);
  if (const auto bytes = memory_bytes(needs.memory)) {
    action = within_memory(std::move(action), full_name(app, command), *bytes);
  }
  if (!needs.contained) return action();
  auto writable = needs.writable != nullptr ? needs.writable(command) : written_folders(command);
  if (writable) std::ranges::move(model_caches(), std::back_inserter(*writable));
  return contained(action, writable);
}

// Numbers 0 to 2 that the starter has closed would go to the next files that are opened: what is printed would go into
// them. Standard output and error are opened for reading only, so that writing there fails as on a full disk: nothing
// that was to be shown is lost in silence. False without /dev/null.
bool have_standard_streams() {
  constexpr std::array kStreams = {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO};
  return std::ranges::all_of(kStreams, [](int number) {
    if (::fcntl(number, F_GETFD) >= 0 || errno != EBADF) return true;  // NOLINT(*-vararg)
    return ::open("/dev/null", O_RDONLY) == number;                    // NOLINT(*-vararg): the lowest free number
  });
}

}  // namespace

const std::vector<Command>& commands() {
  constexpr const char *kModels = "Engines and models", *kRuns = "Measurements", *kResults = "Results";
  constexpr Needs kReads = {.memory = Memory::kShare};
  constexpr Needs kContained = {.contained = true};
  constexpr Needs kDraws = {.memory = Memory::kMachine, .contained = true, .writable = drawing_folders};
  static const std::vector<Command> all = {
      {"list", kModels, add_list, kContained},
      {"check", kModels, add_check, kContained},
      {"parity", kModels, add_parity, kContained},
      {"conformance", kModels, add_conformance, {.contained = true, .writable = verdict_folders}},
      {"convert", kModels, add_convert, kContained},
      {"import", kModels, add_import, kContained},
      {"simulate", kRuns, add_simulate},
      {"run", kRuns, add_run},
      {"match", kRuns, add_match},
      {"paper", kRuns, add_paper},
      {"submit", kRuns, add_submit},
      {"status", kRuns, add_status, kReads},
      {"merge", kRuns, add_merge, kReads},
      {"recommend", kResults, add_recommend, kReads},
      {"explain", kResults, add_explain},
      {"bisect", kResults, add_bisect},
      {"report", kResults, add_report, kReads},
      {"compare", kResults, add_compare, kReads},
      {"history", kResults, add_history, kReads},
      {"export", kResults, add_export, kReads},
      {"draw", kResults, add_draw, kDraws},
      // names until 1.0
      {"engines", "", add_engines, kContained},
      {"systems", "", add_systems, kContained},
      {"snapshot", "", add_snapshot, kDraws},
      {"movie", "", add_movie, kDraws},
      {"transfer", "", add_transfer},
      {"claims", "", add_claims, kReads}};
  return all;
}

}  // namespace assay::cli

int main(int argc, char** argv) {
  if (!assay::cli::have_standard_streams()) return assay::cli::kFailed;
  // whoever started us may have switched it off: `assay list engines | head -1` ends quietly
  std::signal(SIGPIPE, SIG_DFL);
  // a limit of file sizes is a full disk to us: an error of the write, not the end
  std::signal(SIGXFSZ, SIG_IGN);
  return assay::guarded([&] {
    const int status = assay::cli::run(argc, argv);
    assay::flush_output();
    return status;
  });
}
