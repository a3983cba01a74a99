#include "load/mujoco_messages.h"

#include <fcntl.h>
#include <unistd.h>

#include <fmt/format.h>

#include "base/errors.h"

namespace assay {
namespace {

std::mutex& one_at_a_time() {
  static std::mutex instance;
  return instance;
}

void handle(const mjLogMessage* message) {
  if (message->level == mjLOG_WARNING) MessageGuard::warnings().emplace_back(message->subject);
  if (message->level == mjLOG_ERROR) throw InputError(fmt::format("MuJoCo: {}", message->subject));
}

}  // namespace

MessageGuard::MessageGuard() : lock_(one_at_a_time()), previous_(mju_setLogHandler(&handle)) { warnings().clear(); }
MessageGuard::~MessageGuard() { mju_setLogHandler(previous_); }

std::vector<std::string>& MessageGuard::warnings() {
  static std::vector<std::string> collected;
  return collected;
}

std::string one_line(std::string_view message) {
  std::string line;
  for (const char c : message) {
    if (c != '\n') {
      line += c;
    } else if (!line.empty() && line.back() != ' ') {
      line += ' ';
    }
  }
  while (!line.empty() && (line.back() == ' ' || line.back() == '.')) line.pop_back();
  return line;
}

Silence::Silence() : before_(::dup(STDERR_FILENO)) {
  // a sandbox may forbid to open anything for writing; what cannot be written is dropped, too
  const int nothing = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  if (before_ >= 0 && nothing >= 0) ::dup2(nothing, STDERR_FILENO);
  if (nothing >= 0) ::close(nothing);
}

Silence::~Silence() {
  if (before_ < 0) return;
  ::dup2(before_, STDERR_FILENO);
  ::close(before_);
}

}  // namespace assay
