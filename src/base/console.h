// What the subcommands print: the one way to standard output and standard error, and text laid out for a terminal. A
// terminal gets lines that fit it and colour where base/terminal.h says so; a file or a pipe gets whole lines.
#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/terminal.h"

namespace assay {

using Json = nlohmann::ordered_json;

// Text for people on standard output, lines as they are. Throws SystemError when it cannot be written (a full disk); a
// closed pipe ends the program by SIGPIPE.
void print(const std::string& text);
void print_json(const Json& json);
// As print_json() writes it, all lines but the first behind `depth` spaces.
std::string json_text(const Json& json, int depth);
// An object of these names and texts of JSON, each written for a depth of 2.
void print_json_members(const std::vector<std::pair<std::string, std::string>>& members);
void flush_output();

// Whether `file`, the value of an --out, is a terminal; "-" is standard output. Bytes of tables go there through
// printable(), and to files and pipes as they are.
bool is_terminal(const std::string& file);

// "assay: <text>" on standard error, as one sentence.
void message(const std::string& text);

// A heading, bold on a terminal.
std::string heading(const std::string& text);

// A verdict or an outcome ("exact", "refused", "ok", "diverged", ...) in the colour of its kind; other words as they
// are.
std::string status(const std::string& word);

// `text` as a line for standard output; on a terminal as lines that fit it, all but the first behind `indent` spaces.
// Spaces that begin the text stay.
std::string paragraph(const std::string& text, size_t indent = 0);

// Columns under their headings for standard output. Columns in `right` hold numbers and are flush right. On a terminal
// that is too narrow, the other columns are wrapped between words; where that is not enough, each row becomes a list of
// its cells.
std::string table(const std::vector<std::string>& headings, const std::vector<std::vector<std::string>>& rows,
                  const std::vector<size_t>& right = {});

// How far a long task is, on standard error: on a terminal one line, written again and never wider than it; elsewhere a
// message each half a minute.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine() { clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  bool due() const;  // whether it is time for show()
  void show(const std::string& text);
  void clear();

 private:
  using Clock = std::chrono::steady_clock;
  bool terminal_, shown_ = false;
  Clock::time_point last_ = Clock::now();
};

}  // namespace assay
