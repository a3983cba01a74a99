#include "base/input_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/regular_file.h"

namespace assay {
namespace {

// "3 MiB", "20 KiB"
std::string bytes_text(std::uintmax_t bytes) {
  constexpr std::uintmax_t kMiB = 1 << 20;
  return bytes >= kMiB ? fmt::format("{} MiB", bytes >> 20) : fmt::format("{} KiB", bytes >> 10);
}

// errno's text, by which the user knows whether it is the path or the machine.
[[noreturn]] void cannot_be_read(const std::string& what, const std::string& path, int error) {
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
  const RegularFile file(path);
  if (!file.other().empty()) {
    throw InputError(fmt::format("{} '{}' is {} and not a regular file: give {}", what, path, file.other(), give));
  }
  if (file.error() != 0) cannot_be_read(what, path, file.error());
  const auto refuse = [&](const std::string& size) {
    throw InputError(fmt::format("{} '{}' has {}, and at most {} are read: give {} of less", what, path, size,
                                 bytes_text(most_bytes), give));
  };
  if (file.size() > most_bytes) refuse(bytes_text(file.size()));
  std::string text;
  text.reserve(file.size());
  if (const int error = file.read(text, most_bytes + 1); error != 0) cannot_be_read(what, path, error);
  // files of /proc do not tell their size, and others grow
  if (text.size() > most_bytes) refuse("more");
  return text;
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
