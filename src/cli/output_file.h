// A file that somebody waits for: it appears under its name only when it is complete.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace assay::cli {

// Writes to "PATH.partial", which finish() renames to PATH; whatever was under PATH stays untouched until then. "-" is
// standard output; a device or pipe is written directly. What was written stays in "PATH.partial" when the program ends
// before finish(), unless nothing was.
class OutputFile {
 public:
  // Throws InputError for a path that cannot be a file, SystemError for one that may not be written.
  explicit OutputFile(const std::string& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  // The whole text or nothing of it. Throws SystemError when the disk is full.
  void write(std::string_view text);

  // Throws SystemError when the rest cannot be written or the name cannot be given.
  void finish();

  const std::string& path() const { return path_; }

  // Where what was written can be found before finish(): "'x.csv.partial'", "standard output".
  std::string whereabouts() const;
  // Whether nothing was written, by this process or by one that it forked.
  bool empty() const;

 private:
  std::string path_, written_;  // the name in the end, the name now; equal when written directly
  int fd_ = -1;
  std::int64_t size_ = 0;
};

}  // namespace assay::cli
