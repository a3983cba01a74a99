#include "base/regular_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace assay {
namespace {

std::string other_kind(mode_t mode) {
  if (S_ISREG(mode)) return "";
  if (S_ISLNK(mode)) return "a symbolic link";
  if (S_ISDIR(mode)) return "a directory";
  if (S_ISFIFO(mode)) return "a named pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

}  // namespace

RegularFile::RegularFile(const std::string& path) {
  struct stat facts{};
  // Looked at first: opening a device can have effects, and a socket cannot be opened.
  if (::stat(path.c_str(), &facts) == 0) other_ = other_kind(facts.st_mode);
  if (!other_.empty()) return;
  file_ = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);  // NOLINT(*-vararg)
  if (file_ < 0 || ::fstat(file_, &facts) != 0) {
    error_ = errno;
    return;
  }
  other_ = other_kind(facts.st_mode);
  size_ = static_cast<std::uintmax_t>(facts.st_size);
}

RegularFile::~RegularFile() {
  if (file_ >= 0) ::close(file_);
}

int RegularFile::read(std::string& bytes, std::uintmax_t most) const {
  std::array<char, 1 << 16> buffer{};
  while (most > 0) {
    const ssize_t got = ::read(file_, buffer.data(), std::min<std::uintmax_t>(most, buffer.size()));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return errno;
    if (got == 0) break;
    bytes.append(buffer.data(), static_cast<size_t>(got));
    most -= static_cast<std::uintmax_t>(got);
  }
  return 0;
}

std::string other_than_file(const std::string& path) {
  struct stat facts{};
  return ::lstat(path.c_str(), &facts) == 0 ? other_kind(facts.st_mode) : "";
}

}  // namespace assay
