#include "cli/help.h"

#include <algorithm>

#include <fmt/format.h>

namespace assay::cli {
namespace {

constexpr size_t kDefaultColumns = 80;
constexpr size_t kWidest = 100;  // longer lines are hard to read
constexpr size_t kIndent = 2;

size_t help_columns() { return std::min(terminal_columns(stdout).value_or(kDefaultColumns), kWidest); }

std::string lines_text(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

std::string flowing(const std::string& text, size_t indent = 0) {
  return lines_text(wrapped(std::string(indent, ' ') + text, help_columns(), indent));
}

// Names and their meanings in two columns, or one below the other where there is no room for two.
std::string entries(const std::string& title, const std::vector<std::pair<std::string, std::string>>& rows) {
  constexpr size_t kWidestNames = 28, kLeastForMeaning = 36;
  size_t names = 0;
  for (const auto& [name, meaning] : rows) names = std::max(names, 2 * kIndent + name.size());
  names = std::min(names, kWidestNames);
  const bool beside = help_columns() >= names + kLeastForMeaning;
  const size_t begins = beside ? names : 3 * kIndent;
  std::string text = fmt::format("\n{}:\n", heading(title));
  for (const auto& [name, meaning] : rows) {
    std::string line = std::string(kIndent, ' ') + name;
    const std::string lines = lines_text(wrapped(std::string(begins, ' ') + meaning, help_columns(), begins));
    const bool fits = beside && line.size() + kIndent <= begins;
    line.resize(fits ? begins : line.size(), ' ');
    text += fmt::format("{}{}", line, fits ? lines.substr(begins) : "\n" + lines);
  }
  return text;
}

// The parts between which a command line may be broken: what stands between quotes is one, an option and its value too.
std::vector<std::string> arguments_of(const std::string& command) {
  std::vector<std::string> words;
  char quote = 0;
  for (size_t start = 0, at = 0; at <= command.size(); ++at) {
    const char c = at < command.size() ? command[at] : ' ';
    if (quote == 0 && (c == '\'' || c == '"')) {
      quote = c;
    } else if (c == quote) {
      quote = 0;
    } else if (c == ' ' && quote == 0) {
      const std::string word = command.substr(start, at - start);
      const bool is_value =
          !words.empty() && words.back().starts_with("--") && words.back().find(' ') == std::string::npos;
      if (is_value && !word.starts_with('-')) {
        words.back() += " " + word;
      } else {
        words.push_back(word);
      }
      start = at + 1;
    }
  }
  return words;
}

std::string command_lines(const std::string& command) {
  constexpr size_t kContinued = 2;  // " \" at the end of a line
  std::string text, line(kIndent, ' ');
  bool fresh = true;
  for (const std::string& word : arguments_of(command)) {
    if (!fresh && line.size() + 1 + word.size() + kContinued > help_columns()) {
      text += line + " \\\n";
      line.assign(2 * kIndent, ' ');
      fresh = true;
    }
    line += (fresh ? "" : " ") + word;
    fresh = false;
  }
  return text + line + "\n";
}

}  // namespace

std::string HelpFormatter::make_description(const CLI::App* app) const { return flowing(app->get_description()); }

std::string HelpFormatter::make_usage(const CLI::App* app, std::string name) const {
  std::string text = CLI::Formatter::make_usage(app, std::move(name));
  text.erase(text.find_last_not_of('\n') + 1);
  return "\n" + flowing(text);
}

std::string HelpFormatter::make_group(std::string group, bool is_positional,
                                      std::vector<const CLI::Option*> options) const {
  std::vector<std::pair<std::string, std::string>> rows;
  for (const CLI::Option* option : options) {
    const std::string value = option->get_type_size() != 0 ? option->get_type_name() : "";
    std::string name = make_option_name(option, is_positional);
    if (!value.empty()) name += " " + value;
    rows.emplace_back(name, option->get_description() + (option->get_required() ? " (required)" : ""));
  }
  return entries(group, rows);
}

std::string HelpFormatter::make_subcommands(const CLI::App* app, CLI::AppFormatMode /*mode*/) const {
  std::string text;
  std::vector<std::pair<std::string, std::string>> rows;
  const std::vector<const CLI::App*> commands = app->get_subcommands({});
  for (size_t i = 0; i < commands.size(); ++i) {
    const std::string group = commands[i]->get_group();
    if (group.empty()) continue;
    rows.emplace_back(commands[i]->get_name(), commands[i]->get_description());
    if (i + 1 < commands.size() && commands[i + 1]->get_group() == group) continue;
    text += entries(group, rows);
    rows.clear();
  }
  return text;
}

std::string HelpFormatter::make_footer(const CLI::App* app) const { return app->get_footer(); }

std::string examples_text(const Examples& examples, const std::string& note) {
  std::string text = heading("Examples") + ":\n";
  for (const auto& [line, meaning] : examples) text += command_lines(line) + flowing(meaning, 3 * kIndent);
  if (!note.empty()) text += "\n" + flowing(note);
  return text;
}

}  // namespace assay::cli
