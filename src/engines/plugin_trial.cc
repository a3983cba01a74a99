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
#include <poll.h>

#include "isolate/processes.h"
#include "isolate/sandbox.h"
#include "isolate/time_limit.h"

namespace assay {
namespace {

// What was refused, a line "PATH\tREASON" each.
constexpr const char* kTried = "ASSAY_PLUGINS_TRIED";
constexpr double kMostSeconds = 10;  // for one plugin
constexpr int kMostTries = 3;        // of one that somebody else ended
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

// How the child tells what it has come to: a byte before each plugin and one after it. At the end its guard says how it
// ended.
constexpr char kBegins = 'b', kEnds = 'e', kThrows = 't', kStatus = 's', kTimeIsUp = 'u';

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
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  const rlimit no_core = {0, 0}, memory = {kMostBytes, kMostBytes};
  ::setrlimit(RLIMIT_CORE, &no_core);
#ifndef __SANITIZE_ADDRESS__  // its shadow memory counts
  ::setrlimit(RLIMIT_DATA, &memory);
#else
  static_cast<void>(memory);
#endif
  const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(nothing, stream);
  enter_sandbox({.read_everything = true});
  for (size_t i = first; i < plugins.size(); ++i) {
    say(to, {&kBegins, 1});
    std::string thrown;
    try {
      use(plugins[i]);
    } catch (const std::exception& error) {
      thrown = fmt::format("throws where it must not: {}", error.what());
    } catch (...) {
      thrown = "throws where it must not";
    }
    // Whoever loads it for its work would have that process, too, with all that it holds open.
    while (::waitpid(-1, nullptr, WNOHANG) > 0) {
    }
    if (!children_of(::getpid()).empty()) {
      end_descendants();
      thrown = "leaves a process behind when it is loaded: let it start that in create()";
    }
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

// Stands between the process that tries plugins and its parent: passes on what that one says, ends it when a plugin
// takes too long, and everything that plugins have started. No plugin can hold the parent's pipe open.
[[noreturn]] void guard_trial(const std::vector<std::string>& plugins, size_t first,
                              const std::function<void(const std::string&)>& use, int to, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  std::array<int, 2> ends{};
  if (::getppid() != parent || ::pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK) != 0) ::_exit(1);
  ::fcntl(ends[1], F_SETFL, 0);
  const pid_t guard = ::getpid(), child = ::fork();
  if (child < 0) ::_exit(1);
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != guard) ::_exit(1);
    ::close(to);
    ::close(ends[0]);
    try_all(plugins, first, use, ends[1]);
  }
  ::close(ends[1]);
  int status = 0;
  bool over = false;
  TimeLimit limit(kMostSeconds, child);
  constexpr size_t kMostSaid = size_t{1} << 20;
  size_t count = 0;  // of bytes
  std::array<char, 4096> buffer{};
  while (true) {
    // first whether it has ended: after that it says no more
    const bool ended = ::waitpid(child, &status, WNOHANG) == child;
    for (ssize_t got = 0; count < kMostSaid && (got = ::read(ends[0], buffer.data(), buffer.size())) > 0;) {
      say(to, {buffer.data(), static_cast<size_t>(got)});
      count += static_cast<size_t>(got);
      limit = TimeLimit(kMostSeconds, child);
    }
    if (ended) break;
    if (count >= kMostSaid || limit.over()) {
      over = true;
      ::kill(child, SIGKILL);
      while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
      }
      break;
    }
    constexpr int kPauseMs = 5;
    pollfd polled = {ends[0], POLLIN, 0};
    ::poll(&polled, 1, kPauseMs);
    if ((polled.revents & POLLIN) == 0) ::poll(nullptr, 0, 1);  // it says no more and is about to end
  }
  end_descendants();
  say(to, fmt::format("{}{}\n", over ? kTimeIsUp : kStatus, status));
  ::_exit(0);
}

std::string how_it_ended(int status, bool over) {
  if (over) return fmt::format("is not loaded after {:g} s", kMostSeconds);
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
  int tries = 0;
  for (size_t next = 0; next < plugins.size();) {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) break;
    const pid_t parent = ::getpid(), guard = ::fork();
    if (guard == 0) {
      ::close(ends[0]);
      guard_trial(plugins, next, use, ends[1], parent);
    }
    ::close(ends[1]);
    std::string said;
    std::array<char, 4096> buffer{};
    while (guard > 0) {
      const ssize_t got = ::read(ends[0], buffer.data(), buffer.size());
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;
      said.append(buffer.data(), static_cast<size_t>(got));
    }
    ::close(ends[0]);
    if (guard < 0) break;  // no process can be started now: loading them will show
    int status = 0;
    while (::waitpid(guard, &status, 0) < 0 && errno == EINTR) {
    }
    const size_t first = next;
    bool within = false;  // a plugin was begun and not ended
    bool over = false;
    for (size_t at = 0; at < said.size() && next < plugins.size(); ++at) {
      if (said[at] == kStatus || said[at] == kTimeIsUp) {
        over = said[at] == kTimeIsUp;
        status = static_cast<int>(std::strtol(said.c_str() + at + 1, nullptr, 10));
        break;
      }
      within = said[at] == kBegins;
      if (within) continue;
      if (said[at] == kThrows) {
        const size_t end = std::min(said.find('\n', at), said.size());
        refused[plugins.at(next)] = said.substr(at + 1, end - at - 1);
        at = end;
      }
      ++next;
    }
    if (next < plugins.size() && !over && ended_from_outside(status)) {
      // of the same plugin
      tries = next == first ? tries + 1 : 1;
      if (tries == kMostTries) {
        throw EndedFromOutside(fmt::format("loading '{}' to try it", plugins.at(next)), WTERMSIG(status));
      }
      continue;
    }
    if (within && next < plugins.size()) refused[plugins.at(next++)] = how_it_ended(status, over);
    if (next == first) break;  // the process did not even begin
  }
  std::string text;
  for (const auto& [plugin, why] : refused) text += fmt::format("{}\t{}\n", plugin, why);
  ::setenv(kTried, text.c_str(), 1);
  return refused;
}

}  // namespace assay
