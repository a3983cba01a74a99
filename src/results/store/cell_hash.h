// Hashes by which a database notices that its content is not what was written. Internal to src/store.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "results/store/database.h"
#include "results/store/store.h"

namespace assay::sql {

// Columns of the query that `cell_hash` continues: all that is hashed but `id`, which comes first, in this order.
inline constexpr const char* kCellColumns =
    "c.id, c.key, c.system, c.contender, c.timestep_ms, c.measure, c.outcome, c.reason, c.wall_s, c.cpu_s, c.engine_s, "
    "c.steal, c.started, c.finished";  // then c.node, of version 2
inline constexpr int kCellColumnCount = 15;
inline constexpr const char* kValuesQuery =
    "SELECT name, unit, value, low, high FROM \"values\" WHERE cell_id = ? ORDER BY name";
inline constexpr int kValueColumnCount = 5;
// Those of all cells, and whose they are, in the order of the table.
inline constexpr const char* kAllValuesQuery =
    "SELECT name, unit, value, low, high, cell_id FROM \"values\" ORDER BY cell_id, name";
inline constexpr const char* kSamplesQuery =
    "SELECT name, idx, value FROM samples WHERE cell_id = ? ORDER BY name, idx";
inline constexpr int kSampleColumnCount = 3;
inline constexpr const char* kAllSamplesQuery =
    "SELECT name, idx, value, cell_id FROM samples ORDER BY cell_id, name, idx";

// Tables with a hash of their own, and the order in which their rows count.
const std::vector<std::pair<std::string, std::string>>& hashed_tables();

// Computes what is stored of cells now, and stores its hash. Use it within the transaction of the change; its
// statements are prepared once for many cells.
class CellHasher {
 public:
  explicit CellHasher(sqlite3* db);
  void put_samples_hash(std::int64_t cell_id);
  void put_cell_hash(std::int64_t cell_id);  // after its samples' hash

 private:
  Statement samples_, cell_, values_, set_samples_, set_cell_;
};

// The same of a table.
void put_table_hash(sqlite3* db, const std::string& table);

std::string table_hash(sqlite3* db, const std::string& table);

// The cells whose samples are not what was written, by id. One pass over both tables, which lie in the same order.
std::set<std::int64_t> cells_of_damaged_samples(sqlite3* db);

// "drift of chain, ode-quick at 1 ms"
std::string cell_title(const Cell& cell);

}  // namespace assay::sql
