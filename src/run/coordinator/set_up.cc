#include "run/coordinator/set_up.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>
#include <unistd.h>

#include <fmt/format.h>

#include "base/console.h"
#include "base/text.h"
#include "engines/builds.h"
#include "engines/releases.h"

namespace assay {
namespace {

// "PID:PATH" of the launcher, which has become this program by exec: children inherit the variable and are others.
constexpr const char* kLauncher = "ASSAY_LAUNCHER";
// The engines that the launcher is to set up before it starts the program again.
constexpr const char* kWanted = "ASSAY_SET_UP";
// Set by the launcher once it has tried.
constexpr const char* kTried = "ASSAY_SET_UP_TRIED";

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

std::string launcher() {
  const std::string text = variable(kLauncher), own = fmt::format("{}:", ::getpid());
  return text.starts_with(own) ? text.substr(own.size()) : "";
}

// The words that this process was started with.
std::vector<std::string> command_line() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  std::vector<std::string> words;
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find('\0', begin), text.size());
    words.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return words;
}

std::vector<std::string> names_of(const std::vector<AbsentEngine>& engines) {
  std::vector<std::string> names;
  for (const AbsentEngine& engine : engines) {
    if (std::ranges::find(names, engine.set_up) == names.end()) names.push_back(engine.set_up);
  }
  return names;
}

// As the launcher, which sets these up first. Returns where that is gone: the run says what it leaves out.
void start_again(const std::vector<std::string>& names) {
  flush_output();
  const std::string path = launcher();
  std::vector<std::string> words = command_line();
  ::setenv(kWanted, join(names, " ").c_str(), 1);
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  ::execv(path.c_str(), arguments.data());
  ::unsetenv(kWanted);
}

}  // namespace

std::vector<AbsentEngine> obtainable(const std::vector<AbsentEngine>& absent) {
  std::vector<AbsentEngine> found;
  if (launcher().empty()) return found;
  std::ranges::copy_if(absent, std::back_inserter(found),
                       [](const AbsentEngine& each) { return !each.set_up.empty(); });
  return found;
}

std::string obtainable_text(const std::vector<AbsentEngine>& engines) {
  std::vector<std::string> texts;
  for (const std::string& name : names_of(engines)) {
    const auto engine = std::ranges::find(engines, name, &AbsentEngine::set_up);
    texts.push_back(engine->takes.empty() ? name : fmt::format("{} ({})", name, engine->takes));
  }
  return join(texts, ", ");
}

std::string set_up_command(const std::vector<AbsentEngine>& engines) {
  return "./assay setup " + join(names_of(engines), " ");
}

void obtain_engines(const Campaign& campaign, const std::vector<std::string>* contenders) {
  std::vector<AbsentEngine> needed;
  for (const CampaignContender& contender : campaign.contenders) {
    if (!contender.needs) continue;
    const bool counts =
        contenders == nullptr || std::ranges::find(*contenders, contender.resolved.base) != contenders->end();
    if (counts) needed.push_back(*contender.needs);
  }
  needed = obtainable(needed);
  if (needed.empty() || !variable(kTried).empty()) return;
  message(
      fmt::format("the campaign '{}' has contenders of engines that are not set up: {}; they are set up first "
                  "(--no-set-up goes on without them)",
                  campaign.name, obtainable_text(needed)));
  start_again(names_of(needed));
}

void obtain_releases(const std::vector<std::string>& contenders) {
  const Registry& registry = Registry::instance();
  std::set<std::string> lacking;
  bool environments = false;
  for (const std::string& name : contenders) {
    const std::string plain = without_build(name), release = build_of(name);
    if (!is_release(release) || !registry.has(plain)) continue;
    const std::string engine = registry.resolve(plain).engine->name();
    const std::vector<std::string> known = releases_of(engine);
    const bool there = !release_plugin(engine, release).empty();
    if (there || std::ranges::find(known, release) == known.end()) continue;
    lacking.insert(in_build(engine, release));
    environments = environments || registry.runs_python(engine);
  }
  if (lacking.empty() || launcher().empty() || !variable(kTried).empty()) return;
  message(fmt::format("{} not set up: {} first, some {} each (--no-set-up goes on without)",
                      counted(lacking.size(), "release is", "releases are"),
                      lacking.size() == 1 ? "it is made" : "they are made", environments ? "200 to 400 MB" : "10 s"));
  start_again({lacking.begin(), lacking.end()});
}

}  // namespace assay
