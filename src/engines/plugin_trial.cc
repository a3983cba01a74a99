#include "engines/plugin_trial.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fcntl.h>
#include <optional>
#include <sstream>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "base/sandbox.h"

namespace assay {
namespace {

// What was refused, a line "PATH\tREASON" each.
constexpr const char* kTried = "ASSAY_PLUGINS_TRIED";
constexpr unsigned kMostSeconds = 10;  // for one plugin
constexpr rlim_t kMostBytes = rlim_t{4} << 30;

std::optional<std::map<std::string, std::string>> tried_before() {
  const char* text = std::getenv(kTried);
  if (text == nullptr) return std::nullopt;
  std::map<std::string, std::string> refused;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const size_t tab = line.find('\t');
    if (tab != std::string::npos) refused[line.substr(0, tab)] = line.substr(tab + 1);
  }
  return refused;
}

// How the child tells what it has come to: a byte before each plugin and one after it.
constexpr char kBegins = 'b', kEnds = 'e', kThrows = 't';

void say(int to, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(to, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;
    text.remove_prefix(static_cast<size_t>(written));
  }
}

[[noreturn]] void try_all(const std::vector<std::string>& plugins, size_t first,
                          const std::function<void(const std::string&)>& use, int to) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const rlimit no_core = {0, 0}, memory = {kMostBytes, kMostBytes};
  ::setrlimit(RLIMIT_CORE, &no_core);
#ifndef __SANITIZE_ADDRESS__  // its shadow memory counts
  ::setrlimit(RLIMIT_DATA, &memory);
#else
  static_cast<void>(memory);
#endif
  const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(nothing, stream);
  ::signal(SIGALRM, SIG_DFL);
  enter_sandbox({.read_everything = true});
  for (size_t i = first; i < plugins.size(); ++i) {
    say(to, {&kBegins, 1});
    ::alarm(kMostSeconds);
    std::string thrown;
    try {
      use(plugins[i]);
    } catch (const std::exception& error) {
      thrown = fmt::format("throws where it must not: {}", error.what());
    } catch (...) {
      thrown = "throws where it must not";
    }
    ::alarm(0);
    if (thrown.empty()) {
      say(to, {&kEnds, 1});
    } else {
      for (char& c : thrown) {
        if (c == '\n' || c == '\t') c = ' ';
      }
      say(to, fmt::format("{}{}\n", kThrows, thrown));
    }
  }
  ::_exit(0);
}

std::string how_it_ended(int status) {
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) {
    return fmt::format("is not loaded after {} s", kMostSeconds);
  }
  if (WIFSIGNALED(status)) {
    return fmt::format("ends the process that loads it (signal {}, {})", WTERMSIG(status),
                       ::strsignal(WTERMSIG(status)));
  }
  return fmt::format("ends the process that loads it (exit status {})", WEXITSTATUS(status));
}

}  // namespace

void trust_plugins() { ::setenv(kTried, "", 1); }

std::map<std::string, std::string> refused_plugins(const std::vector<std::string>& plugins,
                                                   const std::function<void(const std::string&)>& use) {
  if (auto before = tried_before()) return *std::move(before);
  std::map<std::string, std::string> refused;
  for (size_t next = 0; next < plugins.size();) {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) break;
    const pid_t child = ::fork();
    if (child == 0) try_all(plugins, next, use, ends[1]);
    ::close(ends[1]);
    std::string said;
    std::array<char, 4096> buffer{};
    while (child > 0) {
      const ssize_t got = ::read(ends[0], buffer.data(), buffer.size());
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;
      said.append(buffer.data(), static_cast<size_t>(got));
    }
    ::close(ends[0]);
    if (child < 0) break;  // no process can be started now: loading them will show
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    bool within = false;  // a plugin was begun and not ended
    for (size_t at = 0; at < said.size(); ++at) {
      within = said[at] == kBegins;
      if (within) continue;
      if (said[at] == kThrows) {
        const size_t end = std::min(said.find('\n', at), said.size());
        refused[plugins.at(next)] = said.substr(at + 1, end - at - 1);
        at = end;
      }
      ++next;
    }
    if (within) refused[plugins.at(next++)] = how_it_ended(status);
    if (said.empty()) break;  // the process did not even begin
  }
  std::string text;
  for (const auto& [plugin, why] : refused) text += fmt::format("{}\t{}\n", plugin, why);
  ::setenv(kTried, text.c_str(), 1);
  return refused;
}

}  // namespace assay
