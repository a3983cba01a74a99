// An output file that appears under its name only when it is complete.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace assay {

// "PATH.partial", where PATH is written first. What an earlier command left there is removed, so that it is made anew.
// Throws InputError for what is no regular file: a link would be written through.
std::string fresh_partial(const std::string& path);

// Throws InputError where `out`, the value of `option`, is one of the files that a command is given to read, under
// whatever name, or the database of a results directory that it is given. `given` may hold other words, too.
void refuse_to_overwrite(const std::string& option, const std::string& out, const std::vector<std::string>& given);

// Writes to "PATH.partial", made anew, which finish() renames to PATH; until then an earlier file at PATH stays
// untouched. "-" is standard output; a device or a pipe is written directly. If the program ends before finish(),
// "PATH.partial" remains, unless it is empty.
class OutputFile {
 public:
  // Throws InputError for a path that cannot be a file, SystemError for one that cannot be written.
  explicit OutputFile(const std::string& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  // Writes the whole text or nothing. Throws SystemError when the disk is full.
  void write(std::string_view text);

  // Throws SystemError when the rest cannot be written or the name cannot be given.
  void finish();

  const std::string& path() const { return path_; }

  // Where the text is before finish(): "'x.csv.partial'", "standard output".
  std::string whereabouts() const;
  // Whether nothing was written, by this process or by one that it forked.
  bool empty() const;

 private:
  std::string path_, written_;  // the name in the end, the name now; equal when written directly
  int fd_ = -1;
  std::int64_t size_ = 0;
};

}  // namespace assay
