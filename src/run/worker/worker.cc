// The worker's side of the socket.
#include "run/worker/worker.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <fcntl.h>
#include <optional>
#include <string>
#include <string_view>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fmt/format.h>

#include "base/errors.h"
#include "isolate/guard.h"
#include "isolate/processes.h"
#include "run/messages/messages.h"
#include "run/worker/confinement.h"
#include "run/worker/failures.h"
#include "run/worker/jobs.h"
#include "run/worker/stepper.h"

namespace assay {
namespace {

class Channel {
 public:
  Channel() : socket_(moved(kWorkerSocket)) { secret_ = receive_line().value_or(""); }

  // Empty when the parent is gone.
  std::optional<Request> receive() {
    const std::optional<std::string> line = receive_line();
    if (!line) return std::nullopt;
    return parse_request(*line);
  }

  void send(const Reply& reply) const { send_line(to_line(reply)); }

  void send_taken() const { send_line(std::string(kJobTaken) + "\n"); }

 private:
  // Away from its well-known number, far above what an engine opens, and from programs that an engine starts. A small
  // limit of open files leaves it where it can be.
  static int moved(int socket) {
    constexpr rlim_t kFarAbove = 100;
    rlimit files{};
    ::getrlimit(RLIMIT_NOFILE, &files);
    const int above = static_cast<int>(std::min(kFarAbove, files.rlim_cur / 2));
    const int there = ::fcntl(socket, F_DUPFD_CLOEXEC, above);
    if (there < 0) {
      ::fcntl(socket, F_SETFD, FD_CLOEXEC);
      return socket;
    }
    ::close(socket);
    return there;
  }

  void send_line(const std::string& message) const {
    const std::string line = fmt::format("{} {}", secret_, message);
    for (size_t at = 0; at < line.size();) {
      const ssize_t sent = ::send(socket_, line.data() + at, line.size() - at, MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0) return;
      at += static_cast<size_t>(sent);
    }
  }

  std::optional<std::string> receive_line() {
    size_t end = std::string::npos;
    while ((end = received_.find('\n')) == std::string::npos) {
      std::array<char, 1 << 14> buffer;
      const ssize_t got = ::recv(socket_, buffer.data(), buffer.size(), 0);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return std::nullopt;
      received_.append(buffer.data(), static_cast<size_t>(got));
    }
    std::string line = received_.substr(0, end);
    received_.erase(0, end + 1);
    return line;
  }

  int socket_;
  std::string secret_, received_;
};

int serve() {
  Channel channel;
  Reply answer;
  try {
    const std::optional<Request> job = channel.receive();
    if (!job) return 1;
    channel.send_taken();
    confine_worker(*job);
    answer = do_job(*job, [&](const Reply& reply) { channel.send(reply); }, [&] { return channel.receive(); });
  } catch (...) {
    answer = jobs::reply_to_exception();
  }
  channel.send(answer);
  // No destructors: an engine that crashes in them must not spoil the answer.
  std::fflush(nullptr);
  return 0;
}

}  // namespace

int worker_main(int /*argc*/, char** /*argv*/) {
  constexpr int kWrongUse = 2;
  int type = 0;
  socklen_t size = sizeof type;
  if (::getsockopt(kWorkerSocket, SOL_SOCKET, SO_TYPE, &type, &size) != 0) {
    std::fputs("assay: 'worker' is started by `assay run`, not by hand\n", stderr);
    return kWrongUse;
  }
  // A full disk has to be an error message and a crash has to be quick.
  ::signal(SIGXFSZ, SIG_IGN);
  const rlimit no_core = {0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  be_expendable();

  run_guarded(serve, kWorkerStatus, {kWorkerSocket});
}

}  // namespace assay
