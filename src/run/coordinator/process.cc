#include "run/coordinator/process.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <sys/prctl.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <poll.h>

#include "base/errors.h"
#include "isolate/guard.h"
#include "isolate/processes.h"

namespace assay {
namespace {

constexpr size_t kKeptOutput = 4096;

[[noreturn]] void fail(const char* what) {
  throw SystemError(fmt::format("cannot start a worker ({}): {}", what, std::strerror(errno)));
}

struct Ends {
  int socket = -1, output = -1, status = -1, failure = -1;
};

// Between fork and exec: only system calls. When one fails, its error is written to `failure`.
[[noreturn]] void become_worker(const char* program, char* const* environment, Ends ends, const WorkerLimits& limits,
                                pid_t parent) {
  constexpr int kCannotExec = 127;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(kCannotExec);  // it died before prctl
  ::setpgid(0, 0);                                  // Ctrl-C reaches only the parent
  const int nothing = ::open("/dev/null", O_RDONLY);
  if (nothing >= 0) ::dup2(nothing, STDIN_FILENO);
  ::dup2(ends.output, STDOUT_FILENO);
  ::dup2(ends.output, STDERR_FILENO);
  const auto give_up = [&] {
    const int error = errno;
    (void)!::write(ends.failure, &error, sizeof error);
    ::_exit(kCannotExec);
  };
  // away from the numbers that they are to have
  constexpr int kAbove = 10;
  for (int* end : {&ends.failure, &ends.socket, &ends.status}) {
    const int there = ::fcntl(*end, F_DUPFD_CLOEXEC, kAbove);
    if (there < 0) {
      if (errno == EINVAL) errno = EMFILE;  // such numbers are beyond the limit
      give_up();
    }
    *end = there;
  }
  ::dup2(ends.socket, kWorkerSocket);
  ::dup2(ends.status, kWorkerStatus);
  limits.apply();
  std::array<char, 7> worker = {'w', 'o', 'r', 'k', 'e', 'r', '\0'};
  std::array<char*, 3> arguments = {const_cast<char*>(program), worker.data(), nullptr};
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::signal(SIGPIPE, SIG_DFL);
  ::execve(program, arguments.data(), environment);
  give_up();
  ::_exit(kCannotExec);
}

// 0 once the worker's program runs (its end of the pipe closes then), else exec's error.
int exec_error(int failure) {
  int error = 0;
  return read_all(failure, &error, sizeof error) ? error : 0;
}

void close_all(const std::vector<int>& descriptors) {
  for (const int descriptor : descriptors) {
    if (descriptor >= 0) ::close(descriptor);
  }
}

std::string random_secret() {
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) fail("random numbers");
  std::string text;
  for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

// Whether `descriptor` becomes readable within `seconds`.
bool readable_within(int descriptor, double seconds) {
  pollfd polled = {descriptor, POLLIN, 0};
  return ::poll(&polled, 1, static_cast<int>(1000 * seconds)) > 0;
}

// A name that nobody has, for the worker's guard to make.
std::string scratch_name(const std::string& secret) {
  constexpr size_t kEnough = 12;  // of its digits; engines have sockets there, whose paths may have 107 characters
  std::error_code error;
  std::filesystem::path folder = std::filesystem::absolute(std::filesystem::temp_directory_path(error), error);
  if (error) folder = "/nonexistent";
  return (folder / (kScratchPrefix + secret.substr(0, kEnough))).string();
}

std::string scratch_entry(const std::string& scratch) { return fmt::format("{}={}", kScratchVariable, scratch); }

// Of this process, with the worker's folder.
std::vector<std::string> environment_with(const std::string& scratch) {
  std::vector<std::string> entries = {scratch_entry(scratch)};
  const std::string begin = scratch_entry("");
  for (char* const* entry = environ; *entry != nullptr; ++entry) {
    if (!std::string_view(*entry).starts_with(begin)) entries.emplace_back(*entry);
  }
  return entries;
}

// Whether the process was started with this entry in its environment, or is forked from one that was.
bool has_in_environment(pid_t process, const std::string& entry) {
  std::ifstream file(fmt::format("/proc/{}/environ", process), std::ios::binary);
  for (std::string line; std::getline(file, line, '\0');) {
    if (line == entry) return true;
  }
  return false;
}

// Ends what was below a guard that has ended itself: that has become this process's, beside children that are not
// touched. The worker is in the guard's group; what its engine has started may have left that.
void end_orphans(pid_t guard, const std::string& scratch) {
  const std::string entry = scratch_entry(scratch);
  end_children([&](pid_t child) { return ::getpgid(child) == guard || has_in_environment(child, entry); });
}

}  // namespace

WorkerProcess::WorkerProcess(const std::string& program, const WorkerLimits& limits)
    : secret_(random_secret()), scratch_(scratch_name(random_secret())) {
  std::array<int, 2> sockets = {-1, -1}, pipes = {-1, -1}, failures = {-1, -1}, statuses = {-1, -1};
  const auto give_up = [&](const char* what) {
    const int error = errno;
    close_all({sockets[0], sockets[1], pipes[0], pipes[1], failures[0], failures[1], statuses[0], statuses[1]});
    errno = error;
    fail(what);
  };
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets.data()) != 0) give_up("socket");
  if (::pipe2(pipes.data(), O_CLOEXEC | O_NONBLOCK) != 0) give_up("pipe");
  if (::pipe2(failures.data(), O_CLOEXEC) != 0) give_up("pipe");
  if (::pipe2(statuses.data(), O_CLOEXEC) != 0) give_up("pipe");
  // The worker blocks when it prints too much; the reading end does not block.
  ::fcntl(pipes[1], F_SETFL, 0);
  std::vector<std::string> environment = environment_with(scratch_);
  std::vector<char*> entries;
  entries.reserve(environment.size() + 1);
  for (std::string& entry : environment) entries.push_back(entry.data());
  entries.push_back(nullptr);
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  const pid_t parent = ::getpid();
  guard_ = ::fork();
  if (guard_ < 0) give_up("fork");
  if (guard_ == 0) {
    become_worker(program.c_str(), entries.data(), {sockets[1], pipes[1], statuses[1], failures[1]}, limits, parent);
  }
  close_all({sockets[1], pipes[1], statuses[1], failures[1]});
  sockets[1] = pipes[1] = statuses[1] = failures[1] = -1;
  // The machine's fault, not an engine's.
  if (const int error = exec_error(failures[0])) {
    ::waitpid(guard_, nullptr, 0);
    errno = error;
    give_up(program.c_str());
  }
  ::close(failures[0]);
  socket_ = sockets[0];
  output_ = pipes[0];
  status_ = statuses[0];
  send_line(secret_ + "\n");
}

WorkerProcess::~WorkerProcess() { finish(); }

void WorkerProcess::send(const Request& message) const { send_line(to_line(message)); }

void WorkerProcess::send_line(const std::string& line) const {
  if (socket_ >= 0) write_all(socket_, line);
}

void WorkerProcess::read_socket() {
  std::array<char, 1 << 16> buffer;
  while (socket_ >= 0) {
    const ssize_t got = ::recv(socket_, buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (got > 0) {
      received_.append(buffer.data(), static_cast<size_t>(got));
      if (const std::string taken = fmt::format("{} {}\n", secret_, kJobTaken);
          !taken_ && received_.starts_with(taken)) {
        taken_ = true;
        received_.erase(0, taken.size());
      }
      // no reply is as long: nothing more is taken
      too_long_ = received_.size() > kMostReplyBytes && received_.find('\n') == std::string::npos;
      if (too_long_ || received_.size() > 2 * kMostReplyBytes) {
        too_long_ = true;
        received_ = {};
        ::close(socket_);
        socket_ = -1;
      }
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
  // A worker that prints without end must not hold its parent.
  constexpr size_t kMostBytes = size_t{4} << 20;
  if (output_ >= 0 && !assay::read_available(output_, printed_, kMostBytes)) ::close(std::exchange(output_, -1));
  if (printed_.size() > kKeptOutput) printed_.erase(0, printed_.size() - kKeptOutput);
}

void WorkerProcess::read_available() {
  const bool ended = status_ >= 0 && readable_within(status_, 0);
  read_output();
  read_socket();
  // Whatever holds the socket open now is not the worker.
  if (ended && socket_ >= 0) ::close(std::exchange(socket_, -1));
}

std::optional<Reply> WorkerProcess::take_reply() {
  if (std::exchange(too_long_, false)) {
    return JobCrash{fmt::format("the worker's answer is longer than {} MiB", kMostReplyBytes >> 20)};
  }
  const size_t end = received_.find('\n');
  if (end == std::string::npos) return std::nullopt;
  const std::string line = received_.substr(0, end);
  received_.erase(0, end + 1);
  if (!line.starts_with(secret_ + " ")) {
    return JobCrash{"something other than the worker wrote to its socket: what came from there is not used"};
  }
  try {
    return parse_reply(std::string_view(line).substr(secret_.size() + 1));
  } catch (const MessageError& error) {
    return JobCrash{fmt::format("the worker's answer is damaged: {}", error.what())};
  }
}

std::optional<Reply> WorkerProcess::wait_reply(double seconds, int interrupt) {
  TimeLimit until = limit(seconds);
  while (true) {
    if (auto reply = take_reply()) return reply;
    if (gone()) return std::nullopt;
    if (until.over()) return std::nullopt;
    const double left = std::chrono::duration<double>(until.end() - TimeLimit::Clock::now()).count();
    std::array<pollfd, 4> polled = {pollfd{socket_, POLLIN, 0}, pollfd{output_, POLLIN, 0},
                                    pollfd{interrupt, POLLIN, 0}, pollfd{status_, POLLIN, 0}};
    const int milliseconds = static_cast<int>(std::clamp(left * 1000 + 1, 0.0, 1e9));
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
  const bool ended_early = guard_ >= 0 && gone() && !taken_;
  std::string how = finish();
  if (!ended_early || outside_) return how;
  throw SystemError(fmt::format(
      "a worker ended before it had its job, which no engine does ({}): raise the limits of open files, processes and "
      "memory (ulimit -a)",
      how));
}

std::string WorkerProcess::finish() {
  if (guard_ < 0) return "";
  // It may be about to end by itself: its socket is closed before its exit status is there, on a busy machine seconds
  // before.
  constexpr double kPatience = 10;  // s
  const bool was_gone = gone();
  const bool by_us = !was_gone || !readable_within(status_, kPatience);
  if (by_us) {
    ::kill(guard_, SIGTERM);  // it ends the worker and all that the worker has started
    if (!readable_within(status_, kPatience)) ::kill(-guard_, SIGKILL);
  }
  int status = 0;
  const bool told = read_all(status_, &status, sizeof status);
  const int guard_status = wait_for(guard_);
  const pid_t guard = std::exchange(guard_, -1);
  if (!told) {  // the guard was ended, and the worker with it
    status = guard_status;
    end_orphans(guard, scratch_);
    std::error_code ignored;
    std::filesystem::remove_all(scratch_, ignored);
  }
  read_output();
  close_all({socket_, output_, status_});
  socket_ = output_ = status_ = -1;
  outside_ = !by_us && assay::ended_from_outside(status);
  std::string how = end_text(status);
  if (by_us && was_gone) how = "it closed its socket and did not end";
  const std::string printed = last_line();
  return printed.empty() ? how : fmt::format("{}, last line printed: {}", how, printed);
}

}  // namespace assay
