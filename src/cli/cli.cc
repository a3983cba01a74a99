#include "cli/cli.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "cli/help.h"

namespace assay::cli {
namespace {

// As a shell takes it for one word.
std::string shell_word(const std::string& text) {
  constexpr const char* kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_./:=,+%@-~";
  return text.find_first_not_of(kPlain) == std::string::npos ? text : fmt::format("'{}'", text);
}

}  // namespace

CLI::App* add_command(CLI::App& app, const std::string& name, const std::string& summary, const Examples& examples) {
  CLI::App* command = app.add_subcommand(name, summary);
  command->footer(examples_text(examples));
  return command;
}

std::optional<std::vector<std::string>> written_folders(const CLI::App& command) {
  namespace fs = std::filesystem;
  std::vector<std::string> folders;
  for (const char* name : kOutputOptions) {
    const CLI::Option* option = command.get_option_no_throw(name);
    if (option == nullptr || option->count() == 0) continue;
    const auto file = option->as<std::string>();
    std::error_code error;
    if (file.empty() || file == "-") continue;
    fs::path folder = fs::absolute(file);
    while (!fs::is_directory(folder, error) && folder.has_relative_path()) folder = folder.parent_path();
    if (folder.has_relative_path()) folders.push_back(folder);
  }
  return folders;
}

std::vector<std::string> given_words(const CLI::App& command, const std::string& group,
                                     const std::vector<std::string>& but) {
  std::vector<std::string> words;
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0 || option->get_positional() || option->get_lnames().empty()) continue;
    const std::string name = "--" + option->get_lnames().front();
    if (std::ranges::find(but, name) != but.end() || (!group.empty() && option->get_group() != group)) continue;
    if (option->get_items_expected_max() == 0) {
      words.push_back(name);
    } else if (option->get_delimiter() != '\0') {
      words.insert(words.end(), {name, shell_word(join(option->results(), std::string(1, option->get_delimiter())))});
    } else {
      for (const std::string& value : option->results()) words.insert(words.end(), {name, shell_word(value)});
    }
  }
  return words;
}

}  // namespace assay::cli
