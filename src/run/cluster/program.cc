#include "run/cluster/program.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <string_view>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>

#include "base/errors.h"
#include "isolate/child.h"

extern char** environ;  // NOLINT(readability-redundant-declaration): POSIX leaves it to the program

namespace assay {
namespace {

constexpr size_t kMostOutput = 1 << 20;  // what is longer is cut

void read_both(const Pipe& out, const Pipe& error, ProgramEnd& end) {
  std::array<pollfd, 2> waiting = {{{out.reading.get(), POLLIN, 0}, {error.reading.get(), POLLIN, 0}}};
  std::array<std::string*, 2> texts = {&end.out, &end.error};
  std::array<char, 4096> buffer{};
  while (waiting[0].fd >= 0 || waiting[1].fd >= 0) {
    if (::poll(waiting.data(), waiting.size(), -1) < 0 && errno != EINTR) return;
    for (size_t i = 0; i < waiting.size(); ++i) {
      if (waiting[i].fd < 0 || waiting[i].revents == 0) continue;
      const ssize_t got = ::read(waiting[i].fd, buffer.data(), buffer.size());
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) {
        waiting[i].fd = -1;
      } else if (texts[i]->size() < kMostOutput) {
        texts[i]->append(buffer.data(), static_cast<size_t>(got));
      }
    }
  }
}

}  // namespace

std::optional<ProgramEnd> run_program(const std::vector<std::string>& words) {
  Pipe out = make_pipe(), error = make_pipe();
  posix_spawn_file_actions_t actions{};
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, out.writing.get(), STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, error.writing.get(), STDERR_FILENO);
  std::vector<std::string> copies = words;
  std::vector<char*> arguments;
  arguments.reserve(copies.size() + 1);
  for (std::string& word : copies) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int why = ::posix_spawnp(&child, arguments.front(), &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (why == ENOENT || why == EACCES) return std::nullopt;
  if (why != 0) throw SystemError(fmt::format("cannot start '{}': {}", words.front(), std::strerror(why)));
  out.writing.close();
  error.writing.close();
  ProgramEnd end;
  read_both(out, error, end);
  const int result = wait_for(child);
  constexpr int kSignalled = 128;
  end.status = WIFEXITED(result) ? WEXITSTATUS(result) : kSignalled + WTERMSIG(result);
  return end;
}

std::string shell_word(const std::string& text) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=:,+@%";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

}  // namespace assay
