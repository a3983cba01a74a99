// The worker's side of the socket: one line with the job, lines with what is told on the way, one line with the answer.
#include "worker/worker.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <string>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "messages/messages.h"
#include "worker/jobs.h"

namespace assay {
namespace {

class Channel {
 public:
  // Null when the parent is gone.
  nlohmann::json receive() {
    size_t end = std::string::npos;
    while ((end = received_.find('\n')) == std::string::npos) {
      std::array<char, 1 << 14> buffer;
      const ssize_t got = ::recv(kWorkerSocket, buffer.data(), buffer.size(), 0);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return nullptr;
      received_.append(buffer.data(), static_cast<size_t>(got));
    }
    nlohmann::json message = nlohmann::json::parse(received_.substr(0, end), nullptr, false);
    received_.erase(0, end + 1);
    return message.is_discarded() ? nullptr : message;
  }

  static void send(const nlohmann::json& message) {
    // Engines' messages may hold any bytes.
    const std::string line = message.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
    for (size_t at = 0; at < line.size();) {
      const ssize_t sent = ::send(kWorkerSocket, line.data() + at, line.size() - at, MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0) return;
      at += static_cast<size_t>(sent);
    }
  }

 private:
  std::string received_;
};

}  // namespace

int worker_main(int /*argc*/, char** /*argv*/) {
  constexpr int kWrongUse = 2;
  int type = 0;
  socklen_t size = sizeof type;
  if (::getsockopt(kWorkerSocket, SOL_SOCKET, SO_TYPE, &type, &size) != 0) {
    std::fputs("assay: 'worker' is started by `assay run` alone\n", stderr);
    return kWrongUse;
  }
  // A full disk has to be an error message and a crash has to be quick.
  ::signal(SIGXFSZ, SIG_IGN);
  const rlimit no_core = {0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);

  Channel channel;
  const nlohmann::json job = channel.receive();
  if (job.is_null()) return 1;
  nlohmann::json answer;
  try {
    answer =
        do_job(job, [](const nlohmann::json& message) { Channel::send(message); }, [&] { return channel.receive(); });
  } catch (const InputError& error) {
    answer = {{"error", error.what()}, {"kind", "input"}};
  } catch (const SystemError& error) {
    answer = {{"error", error.what()}, {"kind", "system"}};
  } catch (const std::exception& error) {
    // An adapter threw what it must not.
    answer = {{"failed", error.what()}};
  } catch (...) {
    answer = {{"failed", "of a type that is no std::exception"}};
  }
  Channel::send(answer);
  // The answer is given: an engine that crashes in its destructors has nothing more to spoil.
  std::fflush(nullptr);
  ::_exit(0);
}

}  // namespace assay
