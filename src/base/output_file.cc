#include "base/output_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/regular_file.h"

namespace assay {

namespace fs = std::filesystem;

std::string fresh_partial(const std::string& path) {
  std::string partial = path + ".partial";
  if (const std::string other = other_than_file(partial); !other.empty()) {
    throw InputError(
        fmt::format("'{}', where --out is written first, is {}: remove it or give another file", partial, other));
  }
  unlink(partial.c_str());
  return partial;
}

void refuse_to_overwrite(const std::string& option, const std::string& out, const std::vector<std::string>& given) {
  std::error_code error;
  if (out == "-" || !fs::is_regular_file(out, error)) return;
  for (const std::string& read : given) {
    for (const fs::path& file : {fs::path(read), fs::path(read) / "assay.sqlite"}) {
      if (!fs::is_regular_file(file, error) || !fs::equivalent(out, file, error)) continue;
      throw InputError(file == fs::path(out)
                           ? fmt::format("{} '{}' is a file that the command reads: give another one", option, out)
                           : fmt::format("{} '{}' is the same file as '{}', which the command reads: give another one",
                                         option, out, file.string()));
    }
  }
}

OutputFile::OutputFile(const std::string& path) : path_(path) {
  if (path.empty()) throw InputError("--out is empty: give the name of a file");
  if (path == "-") {
    written_ = path_;
    fd_ = dup(STDOUT_FILENO);
  } else {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (fs::is_directory(status)) throw InputError(fmt::format("--out '{}' is a directory: give a file in it", path));
    const bool direct = fs::exists(status) && !fs::is_regular_file(status);
    if (fs::is_regular_file(status) && access(path.c_str(), W_OK) != 0) {
      throw SystemError(fmt::format("--out '{}' cannot be written ({}): change its permissions or give another file",
                                    path, std::strerror(errno)));
    }
    // through symbolic links, so that renaming replaces the file and not the link
    if (fs::is_symlink(fs::symlink_status(path, error)) && fs::exists(status)) path_ = fs::canonical(path);
    written_ = direct ? path_ : fresh_partial(path_);
    if (direct) {
      fd_ = open(written_.c_str(), O_WRONLY | O_CLOEXEC);  // NOLINT(*-vararg)
    } else {
      fd_ = open(written_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);  // NOLINT(*-vararg)
    }
  }
  if (fd_ >= 0) return;
  const int error = errno;
  if (error == ENOENT || error == ENOTDIR || error == ENAMETOOLONG) {
    throw InputError(fmt::format("--out '{}' cannot be created ({}): give a file in a directory that exists", path,
                                 std::strerror(error)));
  }
  throw SystemError(fmt::format("--out '{}' cannot be written ({}): give a file in a directory where you may write",
                                path, std::strerror(error)));
}

OutputFile::~OutputFile() {
  if (fd_ < 0) return;
  if (written_ != path_ && empty()) unlink(written_.c_str());
  close(fd_);
}

void OutputFile::write(std::string_view text) {
  for (size_t done = 0; done < text.size();) {
    const ssize_t count = ::write(fd_, text.data() + done, text.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      const int error = count < 0 ? errno : ENOSPC;
      // a row cut in two could pass for a complete one
      const bool cut = written_ == path_ || ftruncate(fd_, size_) == 0;
      throw SystemError(fmt::format("'{}' cannot be written ({}): {}", path_ == "-" ? "standard output" : path_,
                                    std::strerror(error),
                                    written_ != path_ && cut && size_ > 0
                                        ? fmt::format("free some space; the part that fitted is in '{}'", written_)
                                        : "free some space or give another file"));
    }
    done += static_cast<size_t>(count);
  }
  size_ += static_cast<std::int64_t>(text.size());
}

void OutputFile::finish() {
  const int fd = std::exchange(fd_, -1);
  if (close(fd) != 0 || (written_ != path_ && std::rename(written_.c_str(), path_.c_str()) != 0)) {
    throw SystemError(
        fmt::format("'{}' cannot be written ({}): the results are in '{}'", path_, std::strerror(errno), written_));
  }
}

bool OutputFile::empty() const {
  struct stat status = {};
  return fd_ >= 0 && fstat(fd_, &status) == 0 && status.st_size == 0;
}

std::string OutputFile::whereabouts() const {
  return written_ == "-" ? "standard output" : fmt::format("'{}'", written_);
}

}  // namespace assay
