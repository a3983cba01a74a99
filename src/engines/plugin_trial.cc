#include "engines/plugin_trial.h"

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fcntl.h>
#include <optional>
#include <sstream>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <poll.h>

#include "base/errors.h"
#include "isolate/child.h"
#include "isolate/limits.h"
#include "isolate/processes.h"
#include "isolate/sandbox.h"
#include "isolate/time_limit.h"

namespace assay {
namespace {

// What was refused, a line "PATH\tREASON" each.
constexpr const char* kTried = "ASSAY_PLUGINS_TRIED";
constexpr double kMostSeconds = 10;  // for one plugin
constexpr int kMostTries = 3;        // of one that somebody else ended
constexpr std::uint64_t kMostBytes = std::uint64_t{4} << 30;

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

// How the child tells what it has come to: a byte before each plugin, and one after it with what it told and the end of
// the line. At the end its guard says how it ended.
constexpr char kBegins = 'b', kEnds = 'e', kThrows = 't', kStatus = 's', kTimeIsUp = 'u';

void try_all(const std::vector<std::string>& plugins, size_t first,
             const std::function<std::string(const std::string&)>& use, int to) {
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  write_no_core_file();
  WorkerLimits{.memory_bytes = kMostBytes, .file_bytes = 0}.apply();
  const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(nothing, stream);
  enter_sandbox({.read_everything = true});
  for (size_t i = first; i < plugins.size(); ++i) {
    write_all(to, &kBegins, 1);
    std::string told, thrown;
    try {
      told = use(plugins[i]);
    } catch (const RefusedPlugin& refused) {
      thrown = refused.what();
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
      write_all(to, fmt::format("{}{}\n", kEnds, told));
    } else {
      for (char& c : thrown) {
        if (c == '\n' || c == '\t') c = ' ';
      }
      write_all(to, fmt::format("{}{}\n", kThrows, thrown));
    }
  }
}

// Stands between the process that tries plugins and its parent: passes on what that one says, ends it when a plugin
// takes too long, and everything that plugins have started. No plugin can hold the parent's pipe open.
void guard_trial(const std::vector<std::string>& plugins, size_t first,
                 const std::function<std::string(const std::string&)>& use, int to) {
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  Pipe ends = make_pipe();
  ::fcntl(ends.reading.get(), F_SETFL, O_NONBLOCK);
  const pid_t child = start_child([&] {
    ::close(to);
    ends.reading.close();
    try_all(plugins, first, use, ends.writing.get());
    return 0;
  });
  ends.writing.close();
  int status = 0;
  bool over = false;
  TimeLimit limit(kMostSeconds, child);
  constexpr size_t kMostSaid = size_t{16} << 20;
  size_t count = 0;  // of bytes
  while (true) {
    // first whether it has ended: after that it says no more
    const bool ended = ::waitpid(child, &status, WNOHANG) == child;
    std::string said;
    read_available(ends.reading.get(), said, kMostSaid - count);
    if (!said.empty()) {
      write_all(to, said);
      count += said.size();
      limit = TimeLimit(kMostSeconds, child);
    }
    if (ended) break;
    if (count >= kMostSaid || limit.over()) {
      over = true;
      ::kill(child, SIGKILL);
      status = wait_for(child);
      break;
    }
    constexpr int kPauseMs = 5;
    pollfd polled = {ends.reading.get(), POLLIN, 0};
    ::poll(&polled, 1, kPauseMs);
    if ((polled.revents & POLLIN) == 0) ::poll(nullptr, 0, 1);  // it says no more and is about to end
  }
  end_descendants();
  write_all(to, fmt::format("{}{}\n", over ? kTimeIsUp : kStatus, status));
}

std::string how_it_ended(int status, bool over) {
  if (over) return fmt::format("is not loaded after {:g} s", kMostSeconds);
  if (WIFSIGNALED(status)) {
    return fmt::format("ends the process that loads it (signal {}, {})", WTERMSIG(status),
                       ::strsignal(WTERMSIG(status)));
  }
  return fmt::format("ends the process that loads it ({})", end_text(status));
}

}  // namespace

void trust_plugins() { ::setenv(kTried, "", 1); }

PluginTrial try_plugins(const std::vector<std::string>& all, const std::vector<std::string>& unknown,
                        const std::function<std::string(const std::string&)>& use) {
  PluginTrial trial;
  std::map<std::string, std::string>& refused = trial.refused;
  std::vector<std::string> plugins = all;
  if (auto before = tried_before()) {
    refused = *std::move(before);
    plugins = unknown;
    std::erase_if(plugins, [&](const std::string& plugin) { return refused.contains(plugin); });
  }
  int tries = 0;
  for (size_t next = 0; next < plugins.size();) {
    std::string said;
    int status = 0;
    try {
      Pipe ends = make_pipe();
      const pid_t guard = start_child([&] {
        ends.reading.close();
        try {
          guard_trial(plugins, next, use, ends.writing.get());
        } catch (const SystemError&) {  // no further process: as one that did not begin
          return 1;
        }
        return 0;
      });
      ends.writing.close();
      said = read_to_end(ends.reading.get());
      status = wait_for(guard);
    } catch (const SystemError&) {
      break;  // no process can be started now: loading them will show
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
      const size_t end = said.find('\n', at);
      if (end == std::string::npos) {  // it ended while it told
        within = true;
        break;
      }
      const std::string text = said.substr(at + 1, end - at - 1);
      if (said[at] == kThrows) {
        refused[plugins.at(next)] = text;
      } else if (!text.empty()) {
        trial.told[plugins.at(next)] = text;
      }
      at = end;
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
  return trial;
}

}  // namespace assay
