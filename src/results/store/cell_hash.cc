#include "results/store/cell_hash.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "base/hash.h"
#include "base/text.h"

namespace assay::sql {

const std::vector<std::pair<std::string, std::string>>& hashed_tables() {
  // Where rows have a rowid, it is the order in which the campaign lists them.
  static const std::vector<std::pair<std::string, std::string>> tables = {{"manifest", "key"},
                                                                          {"systems", "rowid"},
                                                                          {"contenders", "rowid"},
                                                                          {"conformance", "rowid"},
                                                                          {"runs", "system, contender, timestep_ms"},
                                                                          {"scenes", "system"},
                                                                          {"nodes", "id"},
                                                                          {"plan", "key"}};
  return tables;
}

std::string table_hash(sqlite3* db, const std::string& table) {
  const auto found = std::ranges::find(hashed_tables(), table, &std::pair<std::string, std::string>::first);
  Statement columns(db, "SELECT name FROM pragma_table_info(?) ORDER BY name");
  columns.bind(0, table);
  std::vector<std::string> names;
  while (columns.step()) names.push_back(columns.text(0));
  Statement query(db, fmt::format("SELECT {} FROM {} ORDER BY {}", join(names, ", "), table, found->second));
  std::string bytes;
  while (query.step()) {
    for (int column = 0; std::cmp_less(column, names.size()); ++column) query.append_to(bytes, column);
  }
  return content_hash(bytes);
}

CellHasher::CellHasher(sqlite3* db)
    : samples_(db, kSamplesQuery),
      cell_(db, fmt::format("SELECT {}, c.node, c.samples_hash FROM cells c WHERE c.id = ?", kCellColumns)),
      values_(db, kValuesQuery),
      set_samples_(db, "UPDATE cells SET samples_hash = ? WHERE id = ?"),
      set_cell_(db, "UPDATE cells SET hash = ? WHERE id = ?") {}

void CellHasher::put_samples_hash(std::int64_t cell_id) {
  std::string bytes;
  samples_.bind(0, cell_id);
  while (samples_.step()) {
    for (int column = 0; column < kSampleColumnCount; ++column) samples_.append_to(bytes, column);
  }
  samples_.run();  // steps past the end, which resets it; so below
  set_samples_.bind_all(content_hash(bytes), cell_id).run();
}

void CellHasher::put_cell_hash(std::int64_t cell_id) {
  std::string bytes;
  cell_.bind(0, cell_id);
  if (cell_.step()) {
    for (int column = 1; column <= kCellColumnCount; ++column) cell_.append_to(bytes, column);
    cell_.run();
  }
  values_.bind(0, cell_id);
  while (values_.step()) {
    for (int column = 0; column < kValueColumnCount; ++column) values_.append_to(bytes, column);
  }
  values_.run();
  set_cell_.bind_all(content_hash(bytes), cell_id).run();
}

void put_table_hash(sqlite3* db, const std::string& table) {
  Statement(db, "INSERT OR REPLACE INTO hashes VALUES(?, ?)").bind_all(table, table_hash(db, table)).run();
}

std::set<std::int64_t> cells_of_damaged_samples(sqlite3* db) {
  std::set<std::int64_t> damaged;
  Statement cells(db, "SELECT id, samples_hash FROM cells ORDER BY id");
  Statement samples(db, kAllSamplesQuery);
  bool more = samples.step();
  std::string bytes;
  while (cells.step()) {
    const std::int64_t id = cells.integer(0);
    bytes.clear();
    while (more && samples.integer(kSampleColumnCount) < id) more = samples.step();  // of no cell
    for (; more && samples.integer(kSampleColumnCount) == id; more = samples.step()) {
      for (int column = 0; column < kSampleColumnCount; ++column) samples.append_to(bytes, column);
    }
    if (content_hash(bytes) != cells.text(1)) damaged.insert(id);
  }
  return damaged;
}

std::string cell_title(const Cell& cell) {
  return fmt::format("{} of {}, {} at {} ms", cell.measure, cell.system, cell.contender,
                     timestep_label(cell.timestep_ms));
}

}  // namespace assay::sql
