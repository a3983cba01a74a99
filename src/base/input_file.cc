#include "base/input_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

#include "base/errors.h"

namespace assay {
namespace {

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }

 private:
  int number_;
};

// "3 MiB", "20 KiB"
std::string bytes_text(std::uintmax_t bytes) {
  constexpr std::uintmax_t kMiB = 1 << 20;
  return bytes >= kMiB ? fmt::format("{} MiB", bytes >> 20) : fmt::format("{} KiB", bytes >> 10);
}

// errno's text, by which the user knows whether it is the path or the machine.
[[noreturn]] void cannot_be_read(const std::string& what, const std::string& path) {
  const int error = errno;
  const std::string text = fmt::format("{} '{}' cannot be read ({})", what, path, std::strerror(error));
  constexpr std::array kMachine = {EMFILE, ENFILE, ENOMEM};
  if (std::ranges::find(kMachine, error) != kMachine.end()) {
    throw SystemError(text + ": raise the limits of open files and memory (ulimit -a)");
  }
  throw InputError(text + ": check the path");
}

}  // namespace

std::string input_file(const std::string& path, const std::string& what, const std::string& give,
                       std::uintmax_t most_bytes) {
  // without O_NONBLOCK a pipe that nobody writes to would be waited for
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));  // NOLINT(*-vararg)
  struct stat facts{};
  if (file.number() < 0 || ::fstat(file.number(), &facts) != 0) {
    // a socket cannot even be opened
    if (errno != ENXIO) cannot_be_read(what, path);
    facts.st_mode = 0;
  }
  if (!S_ISREG(facts.st_mode)) {
    throw InputError(fmt::format("{} '{}' is not a regular file: give {}", what, path, give));
  }
  const auto refuse = [&](const std::string& size) {
    throw InputError(fmt::format("{} '{}' has {}, and at most {} are read: give {} of less", what, path, size,
                                 bytes_text(most_bytes), give));
  };
  const auto size = static_cast<std::uintmax_t>(std::max<off_t>(facts.st_size, 0));
  if (size > most_bytes) refuse(bytes_text(size));
  std::string text;
  text.reserve(size);
  std::array<char, 1 << 16> block;
  while (true) {
    const ssize_t got = ::read(file.number(), block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) cannot_be_read(what, path);
    if (got == 0) return text;
    text.append(block.data(), static_cast<size_t>(got));
    // files of /proc do not tell their size, and others grow
    if (text.size() > most_bytes) refuse("more");
  }
}

std::string input_text(const std::string& path, const std::string& what, const std::string& give,
                       std::uintmax_t most_bytes) {
  std::string text = input_file(path, what, give, most_bytes);
  if (const size_t at = text.find('\0'); at != std::string::npos) {
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    throw InputError(
        fmt::format("{} '{}' is no text, with a NUL character in line {}: give {}", what, path, line, give));
  }
  return text;
}

}  // namespace assay
