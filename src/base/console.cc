#include "base/console.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <limits>
#include <numeric>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"

namespace assay {
namespace {

constexpr size_t kUnlimited = std::numeric_limits<size_t>::max();
constexpr size_t kGap = 2;  // spaces between columns

size_t output_columns() { return terminal_columns(stdout).value_or(kUnlimited); }

void write_output(const std::string& text) {
  errno = 0;
  if (std::fwrite(text.data(), 1, text.size(), stdout) == text.size()) return;
  throw SystemError(fmt::format("standard output cannot be written ({}): free some space or redirect it elsewhere",
                                std::strerror(errno != 0 ? errno : EIO)));
}

// To standard error. What cannot be written there is lost: nothing ends because of it.
void write_note(const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
}

constexpr std::array<std::string_view, 5> kGood = {"exact", "pass", "conforms", "ok", "holds"};
constexpr std::array<std::string_view, 6> kWarning = {"approximated", "deviation", "changed",
                                                      "not settled",  "unstable",  "unsupported"};
constexpr std::array<std::string_view, 6> kBad = {"refused",  "fail",    "does not conform",
                                                  "diverged", "crashed", "timeout"};

// ---- tables ---------------------------------------------------------------------------------------------------------

struct Layout {
  std::vector<size_t> widths;
  bool fits = true;
};

// Columns as wide as they need to be; where that is too wide, the widest ones give way first.
Layout layout(const std::vector<std::string>& headings, const std::vector<std::vector<std::string>>& rows,
              const std::vector<size_t>& right, size_t columns) {
  Layout found;
  std::vector<size_t> least;
  for (size_t column = 0; column < headings.size(); ++column) {
    const bool numbers = std::ranges::find(right, column) != right.end();
    size_t width = display_width(headings[column]), narrowest = longest_word(headings[column]);
    for (const auto& row : rows) {
      const size_t cell = display_width(row[column]);
      width = std::max(width, cell);
      narrowest = std::max(narrowest, numbers ? cell : longest_word(row[column]));
    }
    found.widths.push_back(width);
    least.push_back(narrowest);
  }
  size_t total = std::reduce(found.widths.begin(), found.widths.end(), kGap * (headings.size() - 1));
  for (; total > columns; --total) {
    size_t widest = headings.size();
    for (size_t column = 0; column < headings.size(); ++column) {
      if (found.widths[column] == least[column]) continue;
      if (widest == headings.size() || found.widths[column] > found.widths[widest]) widest = column;
    }
    if (widest == headings.size()) return {found.widths, false};
    --found.widths[widest];
  }
  return found;
}

}  // namespace

bool is_terminal(const std::string& file) {
  if (file == "-") return ::isatty(STDOUT_FILENO) == 1;
  struct stat facts{};
  if (::stat(file.c_str(), &facts) != 0 || !S_ISCHR(facts.st_mode)) return false;
  const int opened = ::open(file.c_str(), O_WRONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);  // NOLINT(*-vararg)
  const bool is_one = opened >= 0 && ::isatty(opened) == 1;
  if (opened >= 0) ::close(opened);
  return is_one;
}

void print(const std::string& text) { write_output(terminal_text(text, stdout)); }

void print_json(const Json& json) { write_output(json_text(json, 0) + "\n"); }

std::string json_text(const Json& json, int depth) {
  std::string text = dump_json(json, 2);
  if (depth == 0) return text;
  const std::string indent(static_cast<size_t>(depth), ' ');
  std::string moved;
  for (const char c : text) {
    moved += c;
    if (c == '\n') moved += indent;
  }
  return moved;
}

void print_json_members(const std::vector<std::pair<std::string, std::string>>& members) {
  std::string text = "{";
  for (const auto& [key, value] : members) {
    text += fmt::format("{}\n  {}: {}", text.size() > 1 ? "," : "", json_text(key, 0), value);
  }
  write_output(text + (members.empty() ? "" : "\n") + "}\n");
}

void flush_output() {
  errno = 0;
  if (std::fflush(stdout) != 0) {
    throw SystemError(fmt::format("standard output cannot be written ({}): free some space or redirect it elsewhere",
                                  std::strerror(errno != 0 ? errno : EIO)));
  }
}

void message(const std::string& text) {
  std::fflush(stdout);
  for (const std::string& line : wrapped("assay: " + text, terminal_columns(stderr).value_or(kUnlimited), kGap)) {
    write_note(terminal_text(line, stderr) + "\n");
  }
}

std::string heading(const std::string& text) { return styled(printable(text), Style::kHeading); }

std::string status(const std::string& word) {
  const auto is_in = [&](const auto& words) { return std::ranges::find(words, word) != words.end(); };
  if (is_in(kGood)) return styled(word, Style::kGood);
  if (is_in(kWarning)) return styled(word, Style::kWarning);
  return is_in(kBad) ? styled(word, Style::kBad) : word;
}

std::string paragraph(const std::string& text, size_t indent) {
  const size_t columns = output_columns();
  if (columns == kUnlimited) return printable(text) + "\n";
  std::string out;
  for (const std::string& line : wrapped(text, columns, indent)) out += line + "\n";
  return out;
}

std::string table(const std::vector<std::string>& headings, const std::vector<std::vector<std::string>>& rows,
                  const std::vector<size_t>& right) {
  const size_t columns = output_columns();
  const auto [widths, fits] = layout(headings, rows, right, columns);
  std::string text;
  if (!fits) {
    for (const auto& row : rows) {
      std::string cells(kGap, ' ');
      for (size_t column = 1; column < row.size(); ++column) {
        if (row[column].empty()) continue;
        cells += fmt::format("{}{}: {}", cells.size() > kGap ? "; " : "", headings[column], row[column]);
      }
      text += paragraph(heading(row.front()), kGap) + paragraph(cells, kGap);
    }
    return text;
  }
  const auto add_row = [&](const std::vector<std::string>& row, bool is_heading) {
    std::vector<std::vector<std::string>> cells;
    size_t height = 1;
    for (size_t column = 0; column < row.size(); ++column) {
      cells.push_back(wrapped(row[column], widths[column]));
      height = std::max(height, cells.back().size());
    }
    for (size_t i = 0; i < height; ++i) {
      std::string line;
      for (size_t column = 0; column < row.size(); ++column) {
        if (column > 0) line.append(kGap, ' ');
        // headings end above their column, cells begin in line with the first
        const size_t above = is_heading ? height - cells[column].size() : 0;
        const bool there = i >= above && i - above < cells[column].size();
        const std::string cell = there ? cells[column][i - above] : "";
        const std::string padding(widths[column] - display_width(cell), ' ');
        const std::string shown = is_heading && !cell.empty() ? heading(cell) : cell;
        const bool flush_right = std::ranges::find(right, column) != right.end();
        line += flush_right ? padding + shown : shown + padding;
      }
      line.erase(line.find_last_not_of(' ') + 1);
      text += line + "\n";
    }
  };
  add_row(headings, true);
  for (const auto& row : rows) add_row(row, false);
  return text;
}

// ---- progress -------------------------------------------------------------------------------------------------------

ProgressLine::ProgressLine() : terminal_(terminal_columns(stderr).has_value()) {}

bool ProgressLine::due() const {
  return Clock::now() - last_ >= (terminal_ ? std::chrono::milliseconds(200) : std::chrono::seconds(30));
}

void ProgressLine::show(const std::string& text) {
  last_ = Clock::now();
  if (!terminal_) {
    message(text);
    return;
  }
  // a line that fills the last column would wrap on some terminals
  const std::string line = terminal_text(clipped(text, terminal_columns(stderr).value_or(2) - 1), stderr);
  write_note("\r\x1b[K" + line);
  shown_ = true;
}

void ProgressLine::clear() {
  if (shown_) write_note("\r\x1b[K");
  shown_ = false;
}

}  // namespace assay
