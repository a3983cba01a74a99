#include "cli/completion.h"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/paths.h"
#include "base/text.h"
#include "conformance/conformance.h"
#include "controls/control.h"
#include "engines/engine_files.h"
#include "engines/registry.h"
#include "isolate/contained.h"

namespace assay::cli {
namespace {

constexpr const char* kBashScript =
#include "completion_script.inc"
    ;

struct Candidates {
  std::vector<std::string> words;
  bool files = false;
};

// By what the help shows for a value: "csv|json", "CONTENDER", "FILE".
Candidates values_of(const std::string& kind) {
  Candidates found;
  const auto mentions = [&](const char* word) { return kind.find(word) != std::string::npos; };
  const auto add = [&](const std::vector<std::string>& words) {
    found.words.insert(found.words.end(), words.begin(), words.end());
  };
  const bool choices =
      mentions("|") && std::ranges::none_of(kind, [](unsigned char c) { return std::isupper(c) != 0; });
  if (choices) {
    for (size_t begin = 0; begin <= kind.size();) {
      const size_t end = std::min(kind.find('|', begin), kind.size());
      found.words.push_back(kind.substr(begin, end - begin));
      begin = end + 1;
    }
  }
  if (kind == "CONTENDER" || kind == "A" || kind == "B") add(Registry::instance().contender_names());
  if (mentions("MODEL") || mentions("ROBOT")) add(system_names());
  if (mentions("CAMPAIGN")) add(campaign_names());
  if (kind == "CONTROL") add(control_kinds());
  if (kind == "TEST") {
    for (const ConformanceTest& test : conformance_tests()) found.words.push_back(test.name);
  }
  for (const char* file : {"FILE", "DIR", "PATH", "MODEL", "CAMPAIGN", "CONTROL", "OUT", "ENV"}) {
    found.files = found.files || mentions(file);
  }
  return found;
}

// An argument has its kind in its name, where its type says no more.
std::string kind_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  return type.empty() && option.get_positional() ? option.get_name(true) : type;
}

// For the last of `words`, which follow the program's name.
Candidates candidates(const CLI::App& app, const std::vector<std::string>& words) {
  Candidates found;
  if (words.size() < 2) {
    for (const Command& command : commands()) {
      if (*command.group != '\0') found.words.emplace_back(command.name);
    }
    found.words.insert(found.words.end(), {"--help", "--version"});
    return found;
  }
  const auto all = commands();
  if (std::ranges::none_of(all, [&](const Command& command) { return command.name == words.front(); })) return found;
  const CLI::App& command = *app.get_subcommand(words.front());
  const std::string& before = words[words.size() - 2];
  if (before.starts_with("--")) {
    const CLI::Option* option = command.get_option_no_throw(before);
    if (option != nullptr && option->get_items_expected_max() > 0) return values_of(kind_of(*option));
  }
  for (const CLI::Option* option : command.get_options()) {
    if (words.back().starts_with('-')) {
      if (option->get_group().empty()) continue;
      for (const std::string& name : option->get_lnames()) found.words.push_back("--" + name);
    } else if (option->get_positional()) {
      const Candidates more = values_of(kind_of(*option));
      found.words.insert(found.words.end(), more.words.begin(), more.words.end());
      found.files = found.files || more.files;
    }
  }
  return found;
}

}  // namespace

int completion(const CLI::App& app, const std::vector<std::string>& arguments) {
  const std::string what = arguments.empty() ? "" : arguments.front();
  if (what == "bash") {
    print(kBashScript);
    return kDone;
  }
  if (what != "words") throw InputError("give 'assay completion bash': it prints the script for that shell");
  const std::vector<std::string> words(arguments.begin() + 1, arguments.end());
  const auto show = [&] {
    const Candidates found = candidates(app, words);
    std::string text = found.files ? "files\n" : "words\n";
    for (const std::string& word : found.words) {
      if (words.empty() || word.starts_with(words.back())) text += word + "\n";
    }
    print(text);
    return kDone;
  };
  return contained(show, model_caches());  // plugins are loaded for their names
}

}  // namespace assay::cli
