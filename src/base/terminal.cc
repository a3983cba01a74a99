#include "base/terminal.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <clocale>
#include <cstdlib>
#include <cwchar>
#include <sys/ioctl.h>
#include <unistd.h>

#include <fmt/format.h>

#include "base/text.h"

namespace assay {
namespace {

// Begins a mark of styled(); a third byte is its kind. A lone NUL, as in a text that somebody has cut, is no mark.
constexpr std::string_view kMark{"\0\1", 2};
constexpr size_t kMarkBytes = kMark.size() + 1;
constexpr std::string_view kEnd{"\0\1.", kMarkBytes};
constexpr size_t kDefaultColumns = 80;

// Whether an environment variable is there and not empty.
bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

// Null for what is no mark's last character.
const char* escape_sequence(char style) {
  switch (style) {
    case static_cast<char>(Style::kHeading):
      return "\x1b[1m";
    case static_cast<char>(Style::kGood):
      return "\x1b[32m";
    case static_cast<char>(Style::kWarning):
      return "\x1b[33m";
    case static_cast<char>(Style::kBad):
      return "\x1b[1;31m";
    case '.':
      return "\x1b[0m";
    default:
      return nullptr;
  }
}

// The C library's tables of characters, whatever the user's locale is.
class Utf8 {
 public:
  Utf8() : before_(uselocale(locale())) {}
  ~Utf8() { uselocale(before_); }
  Utf8(const Utf8&) = delete;
  Utf8& operator=(const Utf8&) = delete;

 private:
  static locale_t locale() {
    static const locale_t utf8 = newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr);
    return utf8;
  }
  locale_t before_;
};

struct Glyph {
  size_t bytes = 1;
  int columns = -1;      // -1: must not reach a terminal
  wchar_t code = 0;      // 0: no valid character
  bool is_mark = false;  // of styled()
};

// The first character of a text that is not empty. Needs a Utf8 around it for what is not ASCII.
Glyph first_glyph(std::string_view text) {
  const auto byte = static_cast<unsigned char>(text.front());
  if (byte >= 0x20 && byte < 0x7f) return {1, 1, byte, false};
  if (text.starts_with(kMark) && text.size() >= kMarkBytes && escape_sequence(text[kMark.size()]) != nullptr) {
    return {kMarkBytes, 0, 0, true};
  }
  wchar_t code = 0;
  std::mbstate_t state{};
  const size_t bytes = std::mbrtowc(&code, text.data(), text.size(), &state);
  if (bytes == 0 || bytes > text.size()) return {};
  return {bytes, steers(static_cast<char32_t>(code)) ? -1 : ::wcwidth(code), code, false};
}

std::string escaped(const Glyph& glyph, char first) {
  if (first == '\n') return "\\n";
  if (first == '\t') return "\\t";
  if (glyph.code >= 0x80) return fmt::format("\\u{:04x}", static_cast<unsigned>(glyph.code));
  return fmt::format("\\x{:02x}", static_cast<unsigned char>(first));
}

// A break would part a number from its unit, as in "4.34 mm".
bool is_number_and_unit(std::string_view word, std::string_view next) {
  constexpr std::array kUnits = {"nm",  "µm",  "mm",   "m",   "km", "ns",  "µs",  "ms",  "s",  "min",
                                 "h",   "Hz",  "kHz",  "MHz", "µJ", "mJ",  "J",   "kJ",  "kg", "Nm",
                                 "rad", "deg", "mrad", "°",   "%",  "DOF", "m/s", "m/s²"};
  if (word.empty() || std::isdigit(static_cast<unsigned char>(word.back())) == 0) return false;
  next = next.substr(0, next.find_last_not_of(".,;:)") + 1);
  return std::ranges::find(kUnits, next) != kUnits.end();
}

// Words in order; a number and its unit are one.
std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> words;
  std::string last;
  for (size_t start = 0; start < text.size();) {
    const size_t end = std::min(text.find(' ', start), text.size());
    const std::string_view word = text.substr(start, end - start);
    start = end + 1;
    if (word.empty()) continue;
    if (is_number_and_unit(last, word)) {
      words.back() += fmt::format(" {}", word);
    } else {
      words.emplace_back(word);
    }
    last = word;
  }
  return words;
}

// The longest beginning of `text` that fits into `columns`, at least one character: in bytes.
size_t fitting_bytes(std::string_view text, size_t columns) {
  const Utf8 utf8;
  size_t bytes = 0, taken = 0;
  while (bytes < text.size()) {
    const Glyph glyph = first_glyph(text.substr(bytes));
    const auto width = static_cast<size_t>(std::max(glyph.columns, 0));
    if (taken + width > columns && bytes > 0) break;
    bytes += glyph.bytes;
    taken += width;
  }
  return bytes;
}

// A style that a line leaves open ends with the line and begins again with the next.
void close_styles(std::vector<std::string>& lines) {
  std::string open;
  for (std::string& line : lines) {
    const size_t text_begins = std::min(line.find_first_not_of(' '), line.size());
    line.insert(text_begins, open);
    for (size_t at = line.find(kMark); at != std::string::npos && at + kMark.size() < line.size();
         at = line.find(kMark, at + kMarkBytes)) {
      open = line[at + kMark.size()] == '.' ? "" : line.substr(at, kMarkBytes);
    }
    if (!open.empty()) line += kEnd;
  }
}

}  // namespace

std::optional<size_t> terminal_columns(std::FILE* stream) {
  const int descriptor = ::fileno(stream);
  if (::isatty(descriptor) != 1) return std::nullopt;
  winsize size{};
  if (::ioctl(descriptor, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  const char* given = std::getenv("COLUMNS");
  const auto columns = parse_integer(given != nullptr ? given : "");
  return columns && *columns > 0 ? static_cast<size_t>(*columns) : kDefaultColumns;
}

bool has_color(std::FILE* stream) {
  if (is_set("NO_COLOR")) return false;
  if (is_set("CLICOLOR_FORCE") && std::string_view(std::getenv("CLICOLOR_FORCE")) != "0") return true;
  const char* kind = std::getenv("TERM");
  return ::isatty(::fileno(stream)) == 1 && kind != nullptr && *kind != '\0' && std::string_view(kind) != "dumb";
}

std::string styled(std::string_view text, Style style) {
  std::string out(kMark);
  out += static_cast<char>(style);
  out += text;
  return out += kEnd;
}

std::string printable(std::string_view text) {
  const Utf8 utf8;
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const Glyph glyph = first_glyph(text);
    if (glyph.columns < 0) {
      out += escaped(glyph, text.front());
    } else {
      out += text.substr(0, glyph.bytes);
    }
    text.remove_prefix(glyph.bytes);
  }
  return out;
}

std::string terminal_text(std::string_view text, std::FILE* stream) {
  const bool color = has_color(stream);
  std::string out;
  for (size_t start = 0; start < text.size();) {
    const size_t end = std::min(text.find('\n', start), text.size());
    const std::string line = printable(text.substr(start, end - start));
    for (size_t at = 0; at < line.size(); ++at) {
      // printable() has left no NUL but those of marks
      if (line[at] != kMark.front()) {
        out += line[at];
        continue;
      }
      at += kMark.size();
      if (color) out += escape_sequence(line[at]);
    }
    if (end < text.size()) out += '\n';
    start = end + 1;
  }
  return out;
}

size_t display_width(std::string_view line) {
  const Utf8 utf8;
  size_t columns = 0;
  while (!line.empty()) {
    const Glyph glyph = first_glyph(line);
    // what must not be shown is shown as its escape
    columns += glyph.columns < 0 ? escaped(glyph, line.front()).size() : static_cast<size_t>(glyph.columns);
    line.remove_prefix(glyph.bytes);
  }
  return columns;
}

std::string clipped(std::string_view line, size_t columns) {
  std::string text = printable(line);
  if (display_width(text) <= columns) return text;
  if (columns == 0) return "";
  std::vector<std::string> cut = {text.substr(0, columns > 1 ? fitting_bytes(text, columns - 1) : 0) + "…"};
  close_styles(cut);
  return cut.front();
}

std::vector<std::string> wrapped(std::string_view text, size_t columns, size_t indent) {
  const std::string line = printable(text);
  if (display_width(line) <= columns) return {line};
  // spaces that begin the text are its layout
  const size_t begins = std::min(line.find_first_not_of(' '), line.size());
  std::vector<std::string> lines = {std::string(begins, ' ')};
  size_t taken = begins;  // columns of the last line
  bool fresh = true;      // no word on it yet
  const auto next_line = [&] {
    lines.emplace_back(indent, ' ');
    taken = indent;
    fresh = true;
  };
  for (std::string word : words_of(std::string_view(line).substr(begins))) {
    size_t width = display_width(word);
    if (!fresh && taken + 1 + width > columns) next_line();
    while (taken + width > columns && columns > taken) {
      const size_t bytes = fitting_bytes(word, columns - taken);
      if (bytes >= word.size()) break;
      lines.back() += word.substr(0, bytes);
      word.erase(0, bytes);
      width = display_width(word);
      next_line();
    }
    if (!fresh) lines.back() += ' ';
    lines.back() += word;
    taken += width + (fresh ? 0 : 1);
    fresh = false;
  }
  close_styles(lines);
  return lines;
}

size_t longest_word(std::string_view text) {
  size_t longest = 0;
  for (const std::string& word : words_of(printable(text))) longest = std::max(longest, display_width(word));
  return longest;
}

}  // namespace assay
