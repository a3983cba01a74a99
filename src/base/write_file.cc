#include "base/write_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <unistd.h>

#include <fmt/format.h>

#include "base/errors.h"

namespace assay {

void write_file(const std::string& path, const std::string& content) {
  const std::string part = fmt::format("{}.part-{}", path, getpid());
  const auto fail = [&](const char* what) {
    const int error = errno;
    std::remove(part.c_str());
    throw SystemError(fmt::format("cannot {} '{}': {}", what, path, std::strerror(error)));
  };
  // Made here, so that no link that lies there is followed.
  std::remove(part.c_str());
  std::FILE* file = std::fopen(part.c_str(), "wbx");
  if (file == nullptr) fail("write");
  const bool written = std::fwrite(content.data(), 1, content.size(), file) == content.size() &&
                       std::fflush(file) == 0 && fsync(fileno(file)) == 0;
  const int error = errno;
  const bool closed = std::fclose(file) == 0;
  if (!written) errno = error;
  if (!written || !closed) fail("write");
  if (std::rename(part.c_str(), path.c_str()) != 0) fail("write");
}

void refuse_linked_folder(const std::string& folder) {
  std::error_code ignored;  // what cannot be looked at is no link that leads anywhere
  if (!std::filesystem::is_symlink(std::filesystem::symlink_status(folder, ignored))) return;
  throw InputError(fmt::format(
      "'{}' is a symbolic link, and results are only written below their own folder: put the folder there", folder));
}

void make_own_folder(const std::string& folder) {
  refuse_linked_folder(folder);
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw SystemError(fmt::format("cannot make the folder '{}': {}", folder, error.message()));
}

}  // namespace assay
