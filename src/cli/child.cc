#include "cli/child.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "base/errors.h"
#include "cli/cli.h"

namespace assay::cli {
namespace {

SystemError failure(const char* what) {
  const std::string text = fmt::format("{} failed: {}", what, std::strerror(errno));
  return SystemError{text};
}

void write_all(int fd, const std::string& text) {
  for (size_t done = 0; done < text.size();) {
    const ssize_t count = write(fd, text.data() + done, text.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) throw failure("writing to the parent process");
    done += static_cast<size_t>(count);
  }
}

[[noreturn]] void be_child(const std::function<int(const Send&)>& work, int fd) {
  int status = kFailed;
  try {
    status = guarded([&] { return work([fd](const std::string& line) { write_all(fd, line + "\n"); }); });
  } catch (...) {  // NOLINT(bugprone-empty-catch): nothing of this process may run the parent's clean-up
  }
  std::fflush(stderr);
  _exit(status);
}

}  // namespace

ChildEnd run_in_child(const std::function<int(const Send&)>& work, const Send& on_line) {
  std::array<int, 2> ends{};
  flush_output();
  if (pipe(ends.data()) != 0) throw failure("making a pipe");
  watch_for_interruption();
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) throw failure("starting a process");
  if (child == 0) {
    close(ends[0]);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    // a terminal interrupts both, and the parent passes it on: twice is once
    watch_for_interruption(/*once=*/false);
    if (getppid() != parent) _exit(kFailed);
    be_child(work, ends[1]);
  }
  close(ends[1]);

  bool passed_on = false;
  const auto pass_on = [&] {
    if (!interrupted() || passed_on) return;
    kill(child, SIGINT);
    passed_on = true;
  };
  std::string pending;
  std::array<char, 65536> buffer{};
  while (true) {
    const ssize_t count = read(ends[0], buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) {
      pass_on();
      continue;
    }
    if (count <= 0) break;
    pending.append(buffer.data(), static_cast<size_t>(count));
    for (size_t end = pending.find('\n'); end != std::string::npos; end = pending.find('\n')) {
      if (on_line) on_line(pending.substr(0, end));
      pending.erase(0, end + 1);
    }
  }
  close(ends[0]);

  int result = 0;
  while (waitpid(child, &result, 0) < 0) {
    if (errno != EINTR) throw failure("waiting for a process");
    pass_on();
  }
  if (!WIFSIGNALED(result)) return {WEXITSTATUS(result), 0};
  if (WTERMSIG(result) == SIGPIPE) raise(SIGPIPE);
  return {kFailed, WTERMSIG(result)};
}

std::string ChildEnd::signal_text() const { return fmt::format("SIG{} ({})", sigabbrev_np(signal), strsignal(signal)); }

}  // namespace assay::cli
