// NumPy's archives (https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html), as far as they hold
// arrays of numbers. Nothing is unpickled.
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <zip.h>

#include "base/errors.h"
#include "base/text.h"
#include "match/log_table.h"

namespace assay::match {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they are");

struct Array {
  std::string name;
  std::string type;  // "<f8"
  size_t rows = 0;
  size_t columns = 0;    // 0: of one dimension
  bool fortran = false;  // columns behind each other
  std::string bytes;     // of the numbers alone
};

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw InputError(fmt::format("the log '{}' {}: write it with numpy.savez", path, what));
}

// The text behind 'key': in the header's dictionary, as far as the next comma outside parentheses or brackets.
std::string_view entry(std::string_view header, std::string_view key) {
  const size_t at = header.find(fmt::format("'{}':", key));
  if (at == std::string_view::npos) return "";
  std::string_view rest = header.substr(at + key.size() + 3);
  int depth = 0;
  for (size_t i = 0; i < rest.size(); ++i) {
    depth += static_cast<int>(rest[i] == '(' || rest[i] == '[') - static_cast<int>(rest[i] == ')' || rest[i] == ']');
    if (depth < 0 || (depth == 0 && (rest[i] == ',' || rest[i] == '}'))) {
      rest = rest.substr(0, i);
      break;
    }
  }
  const size_t first = rest.find_first_not_of(' ');
  return first == std::string_view::npos ? "" : rest.substr(first, rest.find_last_not_of(' ') - first + 1);
}

// The lengths of "(3, 2)"; nothing where it is something else.
std::vector<std::uint64_t> shape_of(std::string_view text) {
  std::vector<std::uint64_t> shape;
  if (text.size() < 2 || text.front() != '(' || text.back() != ')') return {};
  text = text.substr(1, text.size() - 2);
  while (!text.empty()) {
    const size_t digit = text.find_first_of("0123456789");
    if (digit == std::string_view::npos) break;
    std::uint64_t length = 0;
    const auto [end, error] = std::from_chars(text.data() + digit, text.data() + text.size(), length);
    if (error != std::errc()) return {};
    shape.push_back(length);
    text.remove_prefix(static_cast<size_t>(end - text.data()));
  }
  return shape;
}

// Bytes of one number of a type that can be read; 0 for others.
size_t size_of_type(std::string_view type) {
  constexpr std::array<std::pair<std::string_view, size_t>, 11> kTypes = {{{"<f8", 8},
                                                                           {"<f4", 4},
                                                                           {"<i8", 8},
                                                                           {"<i4", 4},
                                                                           {"<i2", 2},
                                                                           {"|i1", 1},
                                                                           {"<u8", 8},
                                                                           {"<u4", 4},
                                                                           {"<u2", 2},
                                                                           {"|u1", 1},
                                                                           {"|b1", 1}}};
  for (const auto& [name, size] : kTypes) {
    if (name == type) return size;
  }
  return 0;
}

template <typename Number>
double as_double(const char* at) {
  Number number;
  std::memcpy(&number, at, sizeof number);
  return static_cast<double>(number);
}

double number_at(std::string_view type, const char* at) {
  if (type == "<f8") return as_double<double>(at);
  if (type == "<f4") return as_double<float>(at);
  if (type == "<i8") return as_double<std::int64_t>(at);
  if (type == "<i4") return as_double<std::int32_t>(at);
  if (type == "<i2") return as_double<std::int16_t>(at);
  if (type == "|i1") return as_double<std::int8_t>(at);
  if (type == "<u8") return as_double<std::uint64_t>(at);
  if (type == "<u4") return as_double<std::uint32_t>(at);
  if (type == "<u2") return as_double<std::uint16_t>(at);
  return as_double<std::uint8_t>(at);
}

// An array of numbers of one or two dimensions; for everything else that an archive may hold the reason why it is not
// read. Objects are refused, because what is pickled is a program.
std::string read_array(std::string bytes, const std::string& name, const std::string& path, Array& array) {
  const auto damaged = [&] { refuse(path, fmt::format("has a damaged array '{}'", name)); };
  constexpr std::string_view kMagic = "\x93NUMPY";
  constexpr size_t kVersion = 6, kShort = 10, kLong = 12;
  if (!bytes.starts_with(kMagic) || bytes.size() < kLong) damaged();
  const auto byte = [&](size_t at) { return static_cast<size_t>(static_cast<unsigned char>(bytes[at])); };
  const bool is_short = byte(kVersion) == 1;
  const size_t begin = is_short ? kShort : kLong;
  size_t length = byte(8) | byte(9) << 8;
  if (!is_short) length |= byte(10) << 16 | byte(11) << 24;
  if (length > bytes.size() - begin) damaged();
  const std::string_view header(bytes.data() + begin, length);
  std::string_view type = entry(header, "descr");
  if (type.size() < 2 || (type.front() != '\'' && type.front() != '"')) return "it is a structured array";
  type = type.substr(1, type.size() - 2);
  if (type == "|O") {
    throw InputError(
        fmt::format("the log '{}' has an array '{}' of Python objects, which are pickled and never read: write "
                    "numbers alone, as of array.astype(float)",
                    path, name));
  }
  const size_t size = size_of_type(type);
  const std::vector<std::uint64_t> shape = shape_of(entry(header, "shape"));
  if (size == 0) return fmt::format("its type is '{}': give float64", type);
  if (shape.empty()) return "it is a single value";
  if (shape.size() > 2) return fmt::format("it has {} dimensions", shape.size());
  if (shape.back() == 0) return "it is empty";
  const std::uint64_t columns = shape.size() == 2 ? shape[1] : 1;
  if (shape[0] > kMostLogRows || columns > kMostLogColumns) {
    refuse(path,
           fmt::format("has an array '{}' of more than {} rows or {} columns", name, kMostLogRows, kMostLogColumns));
  }
  if (shape[0] * columns * size != bytes.size() - begin - length) damaged();
  array = {.name = name,
           .type = std::string(type),
           .rows = shape[0],
           .columns = shape.size() == 2 ? shape[1] : 0,
           .fortran = entry(header, "fortran_order") == "True",
           .bytes = {}};
  bytes.erase(0, begin + length);
  array.bytes = std::move(bytes);
  return "";
}

struct Discard {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};
struct CloseFile {
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};

// `unread` gets what is left out, in words.
std::vector<Array> arrays_of(const std::string& bytes, const std::string& path, std::vector<std::string>& unread) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  std::unique_ptr<zip_t, Discard> archive(source == nullptr ? nullptr
                                                            : zip_open_from_source(source, ZIP_RDONLY, &error));
  if (!archive) {
    if (source != nullptr) zip_source_free(source);
    const std::string why = zip_error_strerror(&error);
    zip_error_fini(&error);
    refuse(path, fmt::format("is no .npz ({})", why));
  }
  zip_error_fini(&error);
  std::vector<Array> arrays;
  std::uint64_t total = 0;
  const zip_int64_t entries = zip_get_num_entries(archive.get(), 0);
  for (zip_uint64_t i = 0; i < static_cast<zip_uint64_t>(std::max<zip_int64_t>(entries, 0)); ++i) {
    zip_stat_t facts;
    if (zip_stat_index(archive.get(), i, 0, &facts) != 0 || (facts.valid & ZIP_STAT_NAME) == 0 ||
        (facts.valid & ZIP_STAT_SIZE) == 0) {
      refuse(path, "is damaged");
    }
    std::string name = facts.name;
    if (!name.ends_with(".npy")) continue;
    name.resize(name.size() - 4);
    // what the archive says of a size is a claim, so the sum of what is really read is bounded, too
    if (facts.size > kMostLogBytes || (total += facts.size) > kMostLogBytes) {
      throw InputError(fmt::format("the log '{}' has more than {} MiB unpacked: give files of parts of it", path,
                                   kMostLogBytes >> 20));
    }
    const std::unique_ptr<zip_file_t, CloseFile> file(zip_fopen_index(archive.get(), i, 0));
    if (!file) refuse(path, fmt::format("has an array '{}' that cannot be read", name));
    std::string content;
    std::array<char, 1 << 16> buffer{};
    for (;;) {
      const zip_int64_t got = zip_fread(file.get(), buffer.data(), buffer.size());
      if (got < 0) refuse(path, fmt::format("has a damaged array '{}'", name));
      if (got == 0) break;
      content.append(buffer.data(), static_cast<size_t>(got));
      if (content.size() > facts.size) refuse(path, fmt::format("has a damaged array '{}'", name));
    }
    Array array;
    if (const std::string why = read_array(std::move(content), name, path, array); why.empty()) {
      arrays.push_back(std::move(array));
    } else if (constexpr size_t kMostNamed = 5; unread.size() < kMostNamed) {
      unread.push_back(fmt::format("'{}' is not read: {}", name, why));
    }
    if (arrays.size() > kMostLogColumns) refuse(path, fmt::format("has more than {} arrays", kMostLogColumns));
  }
  return arrays;
}

// One column of an array.
struct Column {
  const Array* array = nullptr;
  size_t number = 0;

  double value(size_t row) const {
    const size_t width = std::max<size_t>(array->columns, 1);
    const size_t index = array->fortran ? number * array->rows + row : row * width + number;
    return number_at(array->type, array->bytes.data() + index * size_of_type(array->type));
  }
};

}  // namespace

LogTable parse_npz_table(const std::string& bytes, const std::string& path, const SelectColumns& select,
                         LogFaults& faults) {
  std::vector<std::string> unread;
  const std::vector<Array> arrays = arrays_of(bytes, path, unread);
  const auto with_unread = [&](const std::string& sentence) {
    return unread.empty() ? sentence : fmt::format("{} ({})", sentence, join(unread, "; "));
  };
  std::vector<std::string> names;
  std::vector<Column> columns;
  for (const Array& array : arrays) {
    for (size_t i = 0; i < std::max<size_t>(array.columns, 1); ++i) {
      if (array.columns == 0) {
        names.push_back(array.name);
      } else if (i < array.columns) {
        names.push_back(fmt::format("{}[{}]", array.name, i));
      }
      columns.push_back({&array, i});
      if (names.size() > kMostLogColumns) refuse(path, fmt::format("has more than {} columns", kMostLogColumns));
    }
  }
  if (names.empty()) {
    throw InputError(with_unread(fmt::format("the log '{}' has no array of numbers: write it with numpy.savez", path)));
  }
  const TableSelection selection = [&] {
    try {
      return select(names);
    } catch (const InputError& error) {
      throw InputError(with_unread(error.what()));
    }
  }();
  std::vector<size_t> used = selection.numbers;
  if (selection.motion) used.push_back(*selection.motion);
  const size_t rows = used.empty() ? 0 : columns[used.front()].array->rows;
  for (const size_t column : used) {
    if (columns[column].array->rows == rows) continue;
    throw InputError(fmt::format("{}: '{}' has {} rows and '{}' {}: give all columns one value for each time", path,
                                 names[used.front()], rows, names[column], columns[column].array->rows));
  }
  LogTable table;
  table.numbers.resize(selection.numbers.size());
  for (size_t row = 0; row < rows; ++row) {
    const auto bad = std::ranges::find_if(selection.numbers,
                                          [&](size_t column) { return !std::isfinite(columns[column].value(row)); });
    if (bad != selection.numbers.end()) {
      faults.add(row + 1, names[*bad], fmt::format("{} is no finite number", columns[*bad].value(row)),
                 "remove the row from all arrays");
      continue;
    }
    for (size_t i = 0; i < table.numbers.size(); ++i) {
      table.numbers[i].push_back(columns[selection.numbers[i]].value(row));
    }
    if (selection.motion) table.motion.push_back(shortest(columns[*selection.motion].value(row)));
    table.line.push_back(row + 1);
  }
  return table;
}

}  // namespace assay::match
