// Reading files that may be a stranger's: a named pipe is not waited for, a device is not read, and a size is known
// before memory is taken.
#pragma once

#include <cstdint>
#include <string>

namespace assay {

class RegularFile {
 public:
  // Opens for reading, through symbolic links. Never throws, never waits.
  explicit RegularFile(const std::string& path);
  ~RegularFile();
  RegularFile(const RegularFile&) = delete;
  RegularFile& operator=(const RegularFile&) = delete;

  // Why it is not open, as errno; 0 when it is, or when other() says what is there instead.
  int error() const { return error_; }
  // What is there instead of a regular file: "a named pipe", "a directory"; "" for a regular file.
  const std::string& other() const { return other_; }
  std::uintmax_t size() const { return size_; }  // bytes, when it was opened

  // Appends what follows to `bytes`, at most `most` bytes of it. Returns 0, or why it failed as errno.
  int read(std::string& bytes, std::uintmax_t most) const;

 private:
  int file_ = -1;
  int error_ = 0;
  std::string other_;
  std::uintmax_t size_ = 0;
};

// What lies under the path itself, links not followed, if that is no regular file: "a symbolic link", "a device"; ""
// for a regular file and for nothing.
std::string other_than_file(const std::string& path);

}  // namespace assay
