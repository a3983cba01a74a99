#include "match/log_table.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include <fmt/format.h>
#include <zlib.h>
#ifdef ASSAY_LZMA
#include <lzma.h>
#endif

#include "base/errors.h"
#include "base/input_file.h"
#include "base/text.h"

namespace assay::match {
namespace {

constexpr size_t kMostNumbers = 50'000'000;
constexpr const char* kGive = "a CSV file (.csv, .csv.gz, .csv.xz) or an .npz";

[[noreturn]] void refuse_size(const std::string& path) {
  throw InputError(
      fmt::format("the log '{}' has more than {} MiB unpacked: give files of parts of it", path, kMostLogBytes >> 20));
}

// Unpacked by `step`, which fills the buffer and says how many bytes are new and whether it was the end.
struct Portion {
  size_t bytes = 0;
  bool end = false;
};
template <typename Step>
std::string unpacked(const std::string& path, const Step& step) {
  std::string text;
  std::array<char, 1 << 16> buffer{};
  for (bool end = false; !end;) {
    const Portion portion = step(buffer);
    text.append(buffer.data(), portion.bytes);
    if (text.size() > kMostLogBytes) refuse_size(path);
    end = portion.end;
  }
  return text;
}

[[noreturn]] void refuse_packed(const std::string& path, const char* format) {
  throw InputError(
      fmt::format("the log '{}' is damaged or no {} file: copy it again, or unpack it first", path, format));
}

std::string gunzipped(const std::string& packed, const std::string& path) {
  z_stream stream{};
  constexpr int kGzip = 16;
  if (inflateInit2(&stream, MAX_WBITS + kGzip) != Z_OK) throw SystemError("zlib cannot start: out of memory");
  const struct End {
    z_stream* stream;
    ~End() { inflateEnd(stream); }
  } end{&stream};
  // NOLINTNEXTLINE(*-reinterpret-cast,*-const-cast): zlib's bytes are unsigned, and it does not write here
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  return unpacked(path, [&](auto& buffer) -> Portion {
    stream.next_out = reinterpret_cast<Bytef*>(buffer.data());  // NOLINT(*-reinterpret-cast): as above
    stream.avail_out = static_cast<uInt>(buffer.size());
    const int result = inflate(&stream, Z_NO_FLUSH);
    const size_t bytes = buffer.size() - stream.avail_out;
    if (result == Z_STREAM_END) {
      // gzip files may be several behind each other
      if (stream.avail_in == 0) return {bytes, true};
      if (inflateReset(&stream) != Z_OK) refuse_packed(path, "gzip");
      return {bytes, false};
    }
    if (result != Z_OK || (bytes == 0 && stream.avail_in == 0)) refuse_packed(path, "gzip");
    return {bytes, false};
  });
}

#ifdef ASSAY_LZMA
std::string unxzed(const std::string& packed, const std::string& path) {
  constexpr std::uint64_t kMostMemory = std::uint64_t{128} << 20;
  lzma_stream stream = LZMA_STREAM_INIT;
  if (lzma_stream_decoder(&stream, kMostMemory, LZMA_CONCATENATED) != LZMA_OK) {
    throw SystemError("liblzma cannot start: out of memory");
  }
  const struct End {
    lzma_stream* stream;
    ~End() { lzma_end(stream); }
  } end{&stream};
  // NOLINTNEXTLINE(*-reinterpret-cast): liblzma's bytes are unsigned
  stream.next_in = reinterpret_cast<const std::uint8_t*>(packed.data());
  stream.avail_in = packed.size();
  return unpacked(path, [&](auto& buffer) -> Portion {
    stream.next_out = reinterpret_cast<std::uint8_t*>(buffer.data());  // NOLINT(*-reinterpret-cast): as above
    stream.avail_out = buffer.size();
    const lzma_ret result = lzma_code(&stream, LZMA_FINISH);
    if (result == LZMA_MEMLIMIT_ERROR) {
      throw InputError(fmt::format("the log '{}' takes more than {} MiB of memory to unpack: unpack it with xz -d",
                                   path, kMostMemory >> 20));
    }
    if (result != LZMA_OK && result != LZMA_STREAM_END) refuse_packed(path, "xz");
    return {buffer.size() - stream.avail_out, result == LZMA_STREAM_END};
  });
}
#else
std::string unxzed(const std::string& /*packed*/, const std::string& path) {
  throw InputError(
      fmt::format("the log '{}' is an .xz, which this build of assay does not read: unpack it with xz -d", path));
}
#endif

// ---- CSV ------------------------------------------------------------------------------------------------------------

// The text without blanks around it.
std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const size_t first = text.find_first_not_of(kBlank);
  return first == std::string_view::npos ? "" : text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

// Splits a line at `delimiter`; a field in quotes may hold it, and "" for a quote. `storage` keeps such fields.
void split(std::string_view line, char delimiter, std::vector<std::string_view>& fields, std::string& unquoted) {
  fields.clear();
  if (line.find('"') == std::string_view::npos) {
    for (size_t from = 0;;) {
      const size_t to = line.find(delimiter, from);
      fields.push_back(trimmed(line.substr(from, to == std::string_view::npos ? to : to - from)));
      if (to == std::string_view::npos) return;
      from = to + 1;
    }
  }
  unquoted.clear();
  unquoted.reserve(line.size());  // views into it stay
  bool quoted = false;
  size_t begin = 0;
  for (size_t i = 0; i <= line.size(); ++i) {
    if (i == line.size() || (!quoted && line[i] == delimiter)) {
      fields.push_back(trimmed(std::string_view(unquoted).substr(begin)));
      begin = unquoted.size();
    } else if (line[i] != '"') {
      unquoted += line[i];
    } else if (quoted && i + 1 < line.size() && line[i + 1] == '"') {
      unquoted += '"';
      ++i;
    } else {
      quoted = !quoted;
    }
  }
}

char delimiter_of(std::string_view header) {
  const size_t at = header.find_first_of(",;\t");
  return at == std::string_view::npos ? ',' : header[at];
}

// Whether the line may be a row of numbers under a header that is a comment.
bool has_number(const std::vector<std::string_view>& fields) {
  return std::ranges::any_of(fields, [](std::string_view field) { return parse_number(field).has_value(); });
}

// What to do about a field that is no number.
std::string fix_of_field(std::string_view field) {
  std::string pointed(field);
  std::ranges::replace(pointed, ',', '.');
  if (field.find(',') != std::string_view::npos && parse_number(pointed)) {
    return fmt::format("write decimals with a point, as in {}", pointed);
  }
  constexpr std::string_view kDigits = "0123456789";
  if (field.find(':') != std::string_view::npos && kDigits.find(field.front()) != std::string_view::npos) {
    return "write times as one number of seconds, or of the unit that [units] gives";
  }
  return "remove the line";
}

// A field as a message shows it.
std::string shown(std::string_view field) {
  constexpr size_t kMost = 40;
  return field.size() <= kMost ? std::string(field) : std::string(field.substr(0, kMost)) + "...";
}

void refuse_repeated(const std::vector<std::string>& names, const std::string& path, size_t line) {
  std::vector<std::string> sorted = names;
  std::ranges::sort(sorted);
  const auto twice = std::ranges::adjacent_find(sorted);
  if (twice != sorted.end()) {
    throw InputError(fmt::format("{}:{}: two columns are called '{}': rename one", path, line, *twice));
  }
}

void refuse_rows(const std::string& path) {
  throw InputError(fmt::format("the log '{}' has more than {} rows or {} numbers: give files of parts of it", path,
                               kMostLogRows, kMostNumbers));
}

}  // namespace

void LogFaults::add(size_t line, const std::string& column, const std::string& text, const std::string& fix) {
  if (faults_.size() < kMost) {
    faults_.push_back({.source = source_, .line = line, .column = column, .text = text, .fix = fix});
  } else {
    ++more_;
  }
}

std::string log_name(const std::string& path) {
  std::string name = std::filesystem::path(path).filename().string();
  for (const char* ending : {".gz", ".xz", ".csv", ".npz"}) {
    if (name.ends_with(ending)) name.resize(name.size() - std::string_view(ending).size());
  }
  return name.empty() ? path : name;
}

LogTable parse_csv_table(const std::string& text, const std::string& path, const SelectColumns& select,
                         LogFaults& faults) {
  LogTable table;
  TableSelection selection;
  std::vector<std::string> names;
  std::vector<std::string_view> fields;
  std::vector<double> row;
  std::string unquoted;
  char delimiter = ',';
  const auto begin = [&](std::string_view header, size_t number) {
    delimiter = delimiter_of(header);
    split(header, delimiter, fields, unquoted);
    if (fields.size() > kMostLogColumns) {
      throw InputError(
          fmt::format("{}:{}: the header has more than {} columns: leave out those that are no "
                      "measurements",
                      path, number, kMostLogColumns));
    }
    names.assign(fields.begin(), fields.end());
    if (std::ranges::all_of(fields, [](std::string_view field) { return parse_number(field).has_value(); })) {
      throw InputError(
          fmt::format("{}:{}: the first line has numbers where names of columns should be: begin with "
                      "a header, as in time,knee,knee.torque",
                      path, number));
    }
    if (names.size() == 1 && names.front().find(' ') != std::string::npos) {
      throw InputError(
          fmt::format("{}:{}: the header '{}' has no comma, semicolon or tab: separate the columns by one of them, as "
                      "in time,knee,knee.torque",
                      path, number, shown(names.front())));
    }
    refuse_repeated(names, path, number);
    selection = select(names);
    table.numbers.resize(selection.numbers.size());
    row.resize(selection.numbers.size());
  };
  std::string_view rest = text;
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  if (rest.starts_with(kByteOrderMark)) rest.remove_prefix(kByteOrderMark.size());
  const char line_end = rest.find('\n') == std::string_view::npos ? '\r' : '\n';
  std::string_view comment;  // the last one above the rows
  size_t comment_line = 0;
  for (size_t number = 1; !rest.empty(); ++number) {
    const size_t end = rest.find(line_end);
    const std::string_view line = trimmed(rest.substr(0, end));
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    if (line.empty()) continue;
    if (line.front() == '#') {
      if (names.empty()) comment = trimmed(line.substr(1)), comment_line = number;
      continue;
    }
    if (names.empty()) {
      split(line, delimiter_of(line), fields, unquoted);
      if (comment.empty() || !has_number(fields)) {
        begin(line, number);
        continue;
      }
      begin(comment, comment_line);  // as numpy.savetxt() writes headers
    }
    split(line, delimiter, fields, unquoted);
    if (fields.size() != names.size()) {
      faults.add(number, "",
                 fmt::format("the line has {}, and the header {}", counted(fields.size(), "field"), names.size()),
                 "give one value for each column, or remove the line");
      continue;
    }
    bool fine = true;
    for (size_t i = 0; i < row.size(); ++i) {
      const size_t column = selection.numbers[i];
      const auto value = parse_number(fields[column]);
      if (!value) {
        faults.add(number, names[column], fmt::format("'{}' is no finite number", shown(fields[column])),
                   fix_of_field(fields[column]));
        fine = false;
        break;
      }
      row[i] = *value;
    }
    if (!fine) continue;
    if (table.line.size() >= kMostLogRows || table.line.size() * row.size() >= kMostNumbers) refuse_rows(path);
    for (size_t i = 0; i < row.size(); ++i) table.numbers[i].push_back(row[i]);
    if (selection.motion) table.motion.emplace_back(fields[*selection.motion]);
    table.line.push_back(number);
  }
  if (names.empty() && !comment.empty()) begin(comment, comment_line);
  if (names.empty()) {
    throw InputError(fmt::format("the log '{}' is empty: begin with a header, as in time,knee,knee.torque", path));
  }
  return table;
}

LogTable read_log_table(const std::string& path, const SelectColumns& select, LogFaults& faults) {
  std::string bytes = input_file(path, "the log", kGive, kMostLogBytes);
  const std::string name = std::filesystem::path(path).filename().string();
  if (bytes.starts_with("PK\x03\x04") || bytes.starts_with("PK\x05\x06") || name.ends_with(".npz")) {
    return parse_npz_table(bytes, path, select, faults);
  }
  if (bytes.starts_with("\x1f\x8b")) {
    bytes = gunzipped(bytes, path);
  } else if (bytes.starts_with("\xfd\x37zXZ")) {
    bytes = unxzed(bytes, path);
  }
  if (const size_t at = bytes.find('\0'); at != std::string::npos) {
    const auto line = 1 + std::count(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    throw InputError(
        fmt::format("the log '{}' is no text, with a NUL character in line {}: give {}", path, line, kGive));
  }
  return parse_csv_table(bytes, path, select, faults);
}

}  // namespace assay::match
