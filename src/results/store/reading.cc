// What a results directory says.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/hash.h"
#include "base/text.h"
#include "results/store/cell_hash.h"
#include "results/store/database.h"
#include "results/store/facts.h"
#include "results/store/store.h"

namespace assay {

using sql::Snapshot;
using sql::Statement;

// Throws InputError when the table is not what was written.
void Store::verify(const std::string& table) const {
  if (!hashed_) return;
  Statement query(db_.get(), "SELECT hash FROM hashes WHERE name = ?");
  query.bind(0, table);
  // A table that was never written has no hash and no rows.
  const bool written = query.step();
  if (!written && table == "plan") return;  // written by an assay that gave it none, or a merge has not come to its end
  const std::string hash = written ? query.text(0) : content_hash("");
  if (sql::table_hash(db_.get(), table) == hash) return;
  throw InputError(sql::damaged_text(database(), fmt::format("the table '{}' is not what was written", table)));
}

std::vector<ManifestEntry> Store::manifest() const {
  const Snapshot snapshot(db_.get());
  verify("manifest");
  std::vector<ManifestEntry> entries;
  Statement query(db_.get(), "SELECT key, value FROM manifest ORDER BY key");
  while (query.step()) entries.push_back({query.text(0), query.text(1)});
  return entries;
}

std::optional<std::string> Store::manifest(const std::string& key) const {
  const Snapshot snapshot(db_.get());
  verify("manifest");
  Statement query(db_.get(), "SELECT value FROM manifest WHERE key = ?");
  query.bind(0, key);
  if (!query.step()) return std::nullopt;
  return query.text(0);
}

std::vector<SystemRow> Store::systems() const {
  const Snapshot snapshot(db_.get());
  verify("systems");
  std::vector<SystemRow> rows;
  Statement query(db_.get(), "SELECT name, json FROM systems ORDER BY rowid");
  while (query.step()) rows.push_back({query.text(0), query.text(1)});
  return rows;
}

namespace {

// Results of earlier versions have settings only as "key=value key=value", and what an engine gives of contact forces
// only in words: both are read here and nowhere else.
void read_texts(ContenderRow& row) {
  const nlohmann::json described = facts_of(row.capabilities_json);
  const std::string in_words = text_fact(described, "contact_forces");
  row.contact_forces = text_fact(described, "contact_forces_given");
  if (row.contact_forces.empty() && in_words.starts_with("not given")) row.contact_forces = "none";
  if (row.contact_forces.empty() && in_words.starts_with("along the normal")) row.contact_forces = "normal";
  if (described.contains("changes") && described["changes"].is_array()) {
    for (const nlohmann::json& each : described["changes"]) {
      if (!each.is_object()) continue;
      row.changes.push_back({text_fact(each, "setting"), text_fact(each, "value"), text_fact(each, "default"),
                             text_fact(each, "unit"), text_fact(each, "meaning")});
    }
    return;
  }
  for (size_t at = 0; at < row.settings.size();) {
    const size_t end = std::min(row.settings.find(' ', at), row.settings.size());
    const std::string word = row.settings.substr(at, end - at);
    if (const size_t equals = word.find('='); equals != std::string::npos) {
      row.changes.push_back({word.substr(0, equals), word.substr(equals + 1)});
    }
    at = end + 1;
  }
}

}  // namespace

std::vector<ContenderRow> Store::contenders() const {
  const Snapshot snapshot(db_.get());
  verify("contenders");
  std::vector<ContenderRow> rows;
  Statement query(db_.get(),
                  "SELECT name, engine, version, base, settings, capabilities_json, build_json FROM contenders "
                  "ORDER BY rowid");
  while (query.step()) {
    rows.push_back(
        {query.text(0), query.text(1), query.text(2), query.text(3), query.text(4), query.text(5), query.text(6)});
    read_texts(rows.back());
  }
  return rows;
}

std::vector<ConformanceRow> Store::conformance() const {
  const Snapshot snapshot(db_.get());
  verify("conformance");
  std::vector<ConformanceRow> rows;
  Statement query(db_.get(),
                  "SELECT c.contender, c.test, c.status, c.figure, c.tolerance, c.unit, c.note FROM conformance c "
                  "LEFT JOIN contenders n ON n.name = c.contender ORDER BY n.rowid, c.contender, c.rowid");
  while (query.step()) {
    rows.push_back(
        {query.text(0), query.text(1), query.text(2), query.number(3), query.number(4), query.text(5), query.text(6)});
  }
  return rows;
}

namespace {

// The places of names in a table that lists them: rowid by name.
std::map<std::string, std::int64_t> places(sqlite3* db, const std::string& table) {
  std::map<std::string, std::int64_t> found;
  Statement query(db, fmt::format("SELECT name, rowid FROM {}", table));
  while (query.step()) found[query.text(0)] = query.integer(1);
  return found;
}

// As the campaign lists systems and contenders; what it does not list comes first.
void sort_cells(sqlite3* db, std::vector<Cell>& cells) {
  const auto systems = places(db, "systems"), contenders = places(db, "contenders");
  const auto place = [](const std::map<std::string, std::int64_t>& in, const std::string& name) {
    const auto found = in.find(name);
    return found == in.end() ? std::numeric_limits<std::int64_t>::min() : found->second;
  };
  struct Placed {
    std::int64_t system, contender;
    const Cell* cell;
  };
  std::vector<Placed> order;
  order.reserve(cells.size());
  for (const Cell& cell : cells) {
    order.push_back({place(systems, cell.system), place(contenders, cell.contender), &cell});
  }
  std::ranges::sort(order, {}, [](const Placed& each) {
    const Cell& cell = *each.cell;
    return std::tie(each.system, cell.system, each.contender, cell.contender, cell.measure, cell.timestep_ms, cell.key);
  });
  std::vector<Cell> sorted;
  sorted.reserve(cells.size());
  for (const Placed& each : order) sorted.push_back(std::move(cells[static_cast<size_t>(each.cell - cells.data())]));
  cells = std::move(sorted);
}

}  // namespace

// Cells in their order; those that are not what was written go to `damaged`. One pass over the table of cells and that
// of their values, which lie in the same order.
std::vector<Cell> Store::read_cells(std::vector<Cell>& damaged) const {
  const Snapshot snapshot(db_.get());
  std::vector<Cell> cells;
  Statement query(db_.get(), fmt::format("SELECT {}, {} FROM cells c ORDER BY c.id", sql::kCellColumns,
                                         hashed_ ? "c.node, c.samples_hash, c.hash" : "NULL, NULL, NULL"));
  Statement values(db_.get(), sql::kAllValuesQuery);
  bool more = values.step();
  std::string bytes;
  while (query.step()) {
    Cell cell;
    cell.id = query.integer(0);
    cell.key = query.text(1);
    cell.system = query.text(2);
    cell.contender = query.text(3);
    cell.timestep_ms = query.number(4);
    cell.measure = query.text(5);
    const std::optional<Outcome> outcome = parse_outcome(query.text(6));
    cell.outcome = outcome.value_or(Outcome::kCrashed);
    cell.reason = query.text(7);
    cell.wall_s = query.number(8);
    cell.cpu_s = query.number(9);
    cell.engine_s = query.number(10);
    cell.steal = query.number(11);
    cell.started = query.number(12);
    cell.finished = query.number(13);
    cell.node = query.text(14);
    bytes.clear();
    for (int column = 1; column <= sql::kCellColumnCount; ++column) query.append_to(bytes, column);
    while (more && values.integer(sql::kValueColumnCount) < cell.id) more = values.step();  // of no cell
    for (; more && values.integer(sql::kValueColumnCount) == cell.id; more = values.step()) {
      cell.values.push_back({values.text(0), values.text(1), values.optional_number(2), values.optional_number(3),
                             values.optional_number(4)});
      for (int column = 0; column < sql::kValueColumnCount; ++column) values.append_to(bytes, column);
    }
    if (hashed_ && content_hash(bytes) != query.text(sql::kCellColumnCount + 1)) {
      damaged.push_back(std::move(cell));
      continue;
    }
    if (!outcome) {
      throw InputError(fmt::format("'{}' has a cell of the unknown outcome '{}': it was written by another program",
                                   database(), query.text(6)));
    }
    if (!std::isfinite(cell.timestep_ms) || cell.timestep_ms <= 0) {
      throw InputError(
          fmt::format("'{}' has a cell ({}) whose timestep of {} ms cannot be: it was written by another "
                      "program",
                      database(), sql::cell_title(cell), shortest(cell.timestep_ms)));
    }
    cells.push_back(std::move(cell));
  }
  sort_cells(db_.get(), cells);
  sort_cells(db_.get(), damaged);
  return cells;
}

std::vector<Cell> Store::cells() const {
  std::vector<Cell> damaged;
  std::vector<Cell> cells = read_cells(damaged);
  if (damaged.empty()) return cells;
  const std::string what =
      fmt::format("{} of {} cells {} not what was written, the first is {}", damaged.size(),
                  damaged.size() + cells.size(), damaged.size() == 1 ? "is" : "are", sql::cell_title(damaged.front()));
  throw InputError(
      fmt::format("'{}' is damaged ({}): restore it from a copy, or add --retry to the command that "
                  "measured it, which measures these cells again",
                  database(), what));
}

std::vector<std::string> Store::cell_keys() const {
  std::vector<std::string> keys;
  // of the table itself: an index is not covered by the cells' hashes
  Statement query(db_.get(), "SELECT key FROM cells NOT INDEXED");
  while (query.step()) keys.push_back(query.text(0));
  std::ranges::sort(keys);
  return keys;
}

std::vector<SampleSeries> Store::samples(std::int64_t cell_id) const {
  const Snapshot snapshot(db_.get());
  std::vector<SampleSeries> series;
  Statement query(db_.get(), sql::kSamplesQuery);
  query.bind(0, cell_id);
  std::string bytes;
  while (query.step()) {
    const std::string name = query.text(0);
    if (series.empty() || series.back().name != name) series.push_back({name, {}});
    series.back().values.push_back(query.number(2));
    for (int column = 0; column < sql::kSampleColumnCount; ++column) query.append_to(bytes, column);
  }
  if (!hashed_) return series;
  Statement hash(db_.get(), "SELECT samples_hash, measure, system, contender FROM cells WHERE id = ?");
  hash.bind(0, cell_id);
  if (hash.step() && hash.text(0) == content_hash(bytes)) return series;
  throw InputError(
      sql::damaged_text(database(), fmt::format("the samples of the cell {} ({} of {}, {}) are not what was written",
                                                cell_id, hash.text(1), hash.text(2), hash.text(3))));
}

std::vector<RunRow> Store::runs() const {
  std::vector<RunRow> rows;
  if (!sql::has_table(db_.get(), "runs")) return rows;
  const Snapshot snapshot(db_.get());
  verify("runs");
  Statement query(db_.get(),
                  "SELECT r.address, r.system, r.contender, r.timestep_ms FROM runs r "
                  "LEFT JOIN systems s ON s.name = r.system LEFT JOIN contenders n ON n.name = r.contender "
                  "ORDER BY s.rowid, r.system, n.rowid, r.contender, r.timestep_ms");
  while (query.step()) {
    rows.push_back({query.text(0), query.text(1), query.text(2), query.number(3)});
    // it becomes a file's name
    if (rows.back().address.find_first_of(std::string_view("/\0", 2)) != std::string::npos) {
      throw InputError(
          fmt::format("'{}' lists a run of {} whose address '{}' cannot be: it was written by another program",
                      database(), rows.back().contender, rows.back().address));
    }
    if (std::isfinite(rows.back().timestep_ms) && rows.back().timestep_ms > 0) continue;
    throw InputError(
        fmt::format("'{}' lists a run of {} whose timestep of {} ms cannot be: it was written by another "
                    "program",
                    database(), rows.back().contender, shortest(rows.back().timestep_ms)));
  }
  return rows;
}

std::vector<SceneRow> Store::scenes() const {
  std::vector<SceneRow> rows;
  if (!sql::has_table(db_.get(), "scenes")) return rows;
  const Snapshot snapshot(db_.get());
  verify("scenes");
  Statement query(db_.get(),
                  "SELECT c.system, c.json FROM scenes c LEFT JOIN systems s ON s.name = c.system "
                  "ORDER BY s.rowid, c.system");
  while (query.step()) rows.push_back({query.text(0), query.text(1)});
  return rows;
}

}  // namespace assay
