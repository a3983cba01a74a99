#include "coordinator/process.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <poll.h>

#include "base/errors.h"

namespace assay {
namespace {

constexpr size_t kKeptOutput = 4096;

[[noreturn]] void fail(const char* what) {
  throw SystemError(fmt::format("cannot start a worker ({}): {}", what, std::strerror(errno)));
}

// Between fork and exec: only system calls. When exec fails, its error is written to `failure`.
[[noreturn]] void become_worker(const char* program, int socket, int output, int failure, pid_t parent) {
  constexpr int kCannotExec = 127;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(kCannotExec);  // it died before prctl
  ::setpgid(0, 0);                                  // Ctrl-C reaches only the parent
  const int nothing = ::open("/dev/null", O_RDONLY);
  if (nothing >= 0) ::dup2(nothing, STDIN_FILENO);
  ::dup2(output, STDOUT_FILENO);
  ::dup2(output, STDERR_FILENO);
  if (socket == kWorkerSocket) {
    ::fcntl(socket, F_SETFD, 0);
  } else {
    ::dup2(socket, kWorkerSocket);
  }
  std::array<char, 7> worker = {'w', 'o', 'r', 'k', 'e', 'r', '\0'};
  std::array<char*, 3> arguments = {const_cast<char*>(program), worker.data(), nullptr};
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::signal(SIGPIPE, SIG_DFL);
  ::execv(program, arguments.data());
  const int error = errno;
  (void)!::write(failure, &error, sizeof error);
  ::_exit(kCannotExec);
}

// 0 once the worker's program runs (its end of the pipe closes then), else exec's error.
int exec_error(int failure) {
  int error = 0;
  ssize_t got = 0;
  do {
    got = ::read(failure, &error, sizeof error);
  } while (got < 0 && errno == EINTR);
  return got == sizeof error ? error : 0;
}

void close_all(const std::array<int, 6>& descriptors) {
  for (const int descriptor : descriptors) {
    if (descriptor >= 0) ::close(descriptor);
  }
}

}  // namespace

WorkerProcess::WorkerProcess(const std::string& program) {
  std::array<int, 2> sockets = {-1, -1}, pipes = {-1, -1}, failures = {-1, -1};
  const auto give_up = [&](const char* what) {
    const int error = errno;
    close_all({sockets[0], sockets[1], pipes[0], pipes[1], failures[0], failures[1]});
    errno = error;
    fail(what);
  };
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets.data()) != 0) give_up("socket");
  if (::pipe2(pipes.data(), O_CLOEXEC | O_NONBLOCK) != 0) give_up("pipe");
  if (::pipe2(failures.data(), O_CLOEXEC) != 0) give_up("pipe");
  // The worker blocks when it prints too much; the reading end does not block.
  ::fcntl(pipes[1], F_SETFL, 0);
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ < 0) give_up("fork");
  if (pid_ == 0) become_worker(program.c_str(), sockets[1], pipes[1], failures[1], parent);
  ::close(sockets[1]);
  ::close(pipes[1]);
  ::close(failures[1]);
  sockets[1] = pipes[1] = failures[1] = -1;
  // The machine's fault, not an engine's.
  if (const int error = exec_error(failures[0])) {
    ::waitpid(pid_, nullptr, 0);
    errno = error;
    give_up(program.c_str());
  }
  ::close(failures[0]);
  socket_ = sockets[0];
  output_ = pipes[0];
}

WorkerProcess::~WorkerProcess() { end(); }

void WorkerProcess::send(const Request& message) const {
  const std::string line = to_line(message);
  std::string_view left = line;
  while (!left.empty() && socket_ >= 0) {
    const ssize_t sent = ::send(socket_, left.data(), left.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) return;
    left.remove_prefix(static_cast<size_t>(sent));
  }
}

void WorkerProcess::read_socket() {
  std::array<char, 1 << 16> buffer;
  while (socket_ >= 0) {
    const ssize_t got = ::recv(socket_, buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (got > 0) {
      received_.append(buffer.data(), static_cast<size_t>(got));
    } else if (got < 0 && errno == EINTR) {
      continue;
    } else if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
      return;
    } else {
      ::close(socket_);
      socket_ = -1;
    }
  }
}

void WorkerProcess::read_output() {
  std::array<char, kKeptOutput> buffer;
  while (output_ >= 0) {
    const ssize_t got = ::read(output_, buffer.data(), buffer.size());
    if (got > 0) {
      printed_.append(buffer.data(), static_cast<size_t>(got));
      if (printed_.size() > kKeptOutput) printed_.erase(0, printed_.size() - kKeptOutput);
    } else if (got < 0 && errno == EINTR) {
      continue;
    } else if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
      return;
    } else {
      ::close(output_);
      output_ = -1;
    }
  }
}

void WorkerProcess::read_available() {
  read_output();
  read_socket();
}

std::optional<Reply> WorkerProcess::take_reply() {
  const size_t end = received_.find('\n');
  if (end == std::string::npos) return std::nullopt;
  const std::string line = received_.substr(0, end);
  received_.erase(0, end + 1);
  try {
    return parse_reply(line);
  } catch (const MessageError& error) {
    return JobCrash{fmt::format("the worker's answer is damaged: {}", error.what())};
  }
}

std::optional<Reply> WorkerProcess::wait_reply(double seconds, int interrupt) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::chrono::duration<double>(seconds);
  while (true) {
    if (auto reply = take_reply()) return reply;
    if (gone()) return std::nullopt;
    const double left = std::chrono::duration<double>(deadline - Clock::now()).count();
    if (left <= 0) return std::nullopt;
    std::array<pollfd, 3> polled = {pollfd{socket_, POLLIN, 0}, pollfd{output_, POLLIN, 0},
                                    pollfd{interrupt, POLLIN, 0}};
    const int milliseconds = static_cast<int>(std::min(left * 1000 + 1, 1e9));
    if (::poll(polled.data(), polled.size(), milliseconds) < 0 && errno != EINTR) fail("poll");
    if (polled[2].revents != 0) return std::nullopt;
    read_available();
  }
}

std::string WorkerProcess::last_line() const {
  size_t end = printed_.size();
  while (end > 0 && (printed_[end - 1] == '\n' || printed_[end - 1] == '\r')) --end;
  const size_t start = printed_.rfind('\n', end == 0 ? 0 : end - 1);
  const size_t from = start == std::string::npos || start >= end ? 0 : start + 1;
  return printed_.substr(from, std::min<size_t>(end - from, 300));
}

std::string WorkerProcess::end() {
  if (pid_ < 0) return "";
  int status = 0;
  // It may be about to end by itself: its socket is closed before its exit status is there.
  pid_t ended = 0;
  for (int i = 0; i < 200 && gone() && ended == 0; ++i) {
    ended = ::waitpid(pid_, &status, WNOHANG);
    if (ended == 0) ::usleep(5000);
  }
  if (ended == 0) {
    ::kill(pid_, SIGKILL);
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
  }
  pid_ = -1;
  read_output();
  if (socket_ >= 0) ::close(socket_);
  if (output_ >= 0) ::close(output_);
  socket_ = output_ = -1;
  std::string how = "no exit status";
  if (WIFSIGNALED(status)) how = fmt::format("signal {} ({})", WTERMSIG(status), ::strsignal(WTERMSIG(status)));
  if (WIFEXITED(status)) how = fmt::format("exit status {}", WEXITSTATUS(status));
  const std::string printed = last_line();
  return printed.empty() ? how : fmt::format("{}, last line printed: {}", how, printed);
}

}  // namespace assay
