#include "report/write_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
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

}  // namespace assay
