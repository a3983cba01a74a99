// Files of logs as columns of numbers: CSV, plain or compressed, and NumPy's archives. Nothing here knows what the
// columns mean.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "match/log.h"

namespace assay::match {

// Of a file, packed or not; columns also of an array.
inline constexpr std::uint64_t kMostLogBytes = std::uint64_t{512} << 20;
inline constexpr size_t kMostLogRows = 4'000'000, kMostLogColumns = 10'000;

// Which columns to keep, by their numbers from 0.
struct TableSelection {
  std::vector<size_t> numbers;   // each has to be a finite number
  std::optional<size_t> motion;  // a text
};
using SelectColumns = std::function<TableSelection(const std::vector<std::string>& names)>;

// The first faults of a file, and how many there are.
class LogFaults {
 public:
  explicit LogFaults(std::string source) : source_(std::move(source)) {}

  void add(size_t line, const std::string& column, const std::string& text, const std::string& fix);
  std::vector<LogFault> take() { return std::move(faults_); }
  bool empty() const { return faults_.empty(); }
  size_t more() const { return more_; }

 private:
  static constexpr size_t kMost = 20;
  std::string source_;
  std::vector<LogFault> faults_;
  size_t more_ = 0;
};

struct LogTable {
  std::vector<std::vector<double>> numbers;  // by TableSelection::numbers, then by row; finite
  std::vector<std::string> motion;           // by row; empty without such a column
  std::vector<size_t> line;                  // by row: the file's line, of an .npz the row from 1
};

// The file's content by its columns. Rows with a fault are left out and named in `faults`. Throws InputError for a file
// that cannot be read at all.
LogTable read_log_table(const std::string& path, const SelectColumns& select, LogFaults& faults);

// Of a file's name: "run" of "logs/run.csv.xz".
std::string log_name(const std::string& path);

// ---- parts, for tests -----------------------------------------------------------------------------------------------

LogTable parse_csv_table(const std::string& text, const std::string& path, const SelectColumns& select,
                         LogFaults& faults);
LogTable parse_npz_table(const std::string& bytes, const std::string& path, const SelectColumns& select,
                         LogFaults& faults);

}  // namespace assay::match
