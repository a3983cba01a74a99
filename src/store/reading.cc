// What a results directory says.
#include <fmt/format.h>

#include "base/errors.h"
#include "store/database.h"
#include "store/store.h"

namespace assay {

using sql::Statement;

std::vector<ManifestEntry> Store::manifest() const {
  std::vector<ManifestEntry> entries;
  Statement query(db_.get(), "SELECT key, value FROM manifest ORDER BY key");
  while (query.step()) entries.push_back({query.text(0), query.text(1)});
  return entries;
}

std::optional<std::string> Store::manifest(const std::string& key) const {
  Statement query(db_.get(), "SELECT value FROM manifest WHERE key = ?");
  query.bind(0, key);
  if (!query.step()) return std::nullopt;
  return query.text(0);
}

std::vector<SystemRow> Store::systems() const {
  std::vector<SystemRow> rows;
  Statement query(db_.get(), "SELECT name, json FROM systems ORDER BY rowid");
  while (query.step()) rows.push_back({query.text(0), query.text(1)});
  return rows;
}

std::vector<ContenderRow> Store::contenders() const {
  std::vector<ContenderRow> rows;
  Statement query(db_.get(),
                  "SELECT name, engine, version, base, settings, capabilities_json, build_json FROM contenders "
                  "ORDER BY rowid");
  while (query.step()) {
    rows.push_back(
        {query.text(0), query.text(1), query.text(2), query.text(3), query.text(4), query.text(5), query.text(6)});
  }
  return rows;
}

std::vector<ConformanceRow> Store::conformance() const {
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

std::vector<Cell> Store::cells() const {
  std::vector<Cell> cells;
  Statement query(db_.get(),
                  "SELECT c.id, c.key, c.system, c.contender, c.timestep_ms, c.measure, c.outcome, c.reason, c.wall_s, "
                  "c.cpu_s, c.engine_s, c.steal, c.started, c.finished FROM cells c "
                  "LEFT JOIN systems s ON s.name = c.system LEFT JOIN contenders n ON n.name = c.contender "
                  "ORDER BY s.rowid, c.system, n.rowid, c.contender, c.measure, c.timestep_ms, c.key");
  Statement values(db_.get(), "SELECT name, unit, value, low, high FROM \"values\" WHERE cell_id = ? ORDER BY name");
  std::map<std::string, std::string> nodes;  // by cell's key
  if (sql::has_table(db_.get(), "measured_on")) {
    Statement measured(db_.get(), "SELECT key, node FROM measured_on");
    while (measured.step()) nodes.emplace(measured.text(0), measured.text(1));
  }
  while (query.step()) {
    Cell cell;
    cell.id = query.integer(0);
    cell.key = query.text(1);
    cell.system = query.text(2);
    cell.contender = query.text(3);
    cell.timestep_ms = query.number(4);
    cell.measure = query.text(5);
    const std::optional<Outcome> outcome = parse_outcome(query.text(6));
    if (!outcome) {
      throw InputError(fmt::format("'{}' has a cell of the unknown outcome '{}': it was written by another program",
                                   dir_ + "/assay.sqlite", query.text(6)));
    }
    cell.outcome = *outcome;
    cell.reason = query.text(7);
    cell.wall_s = query.number(8);
    cell.cpu_s = query.number(9);
    cell.engine_s = query.number(10);
    cell.steal = query.number(11);
    cell.started = query.number(12);
    cell.finished = query.number(13);
    if (const auto found = nodes.find(cell.key); found != nodes.end()) cell.node = found->second;
    values.bind(0, cell.id);
    while (values.step()) {
      cell.values.push_back({values.text(0), values.text(1), values.optional_number(2), values.optional_number(3),
                             values.optional_number(4)});
    }
    values.run();  // steps past the end, which resets it
    cells.push_back(std::move(cell));
  }
  return cells;
}

std::vector<std::string> Store::cell_keys() const {
  std::vector<std::string> keys;
  Statement query(db_.get(), "SELECT key FROM cells ORDER BY key");
  while (query.step()) keys.push_back(query.text(0));
  return keys;
}

std::vector<SampleSeries> Store::samples(std::int64_t cell_id) const {
  std::vector<SampleSeries> series;
  Statement query(db_.get(), "SELECT name, value FROM samples WHERE cell_id = ? ORDER BY name, idx");
  query.bind(0, cell_id);
  while (query.step()) {
    const std::string name = query.text(0);
    if (series.empty() || series.back().name != name) series.push_back({name, {}});
    series.back().values.push_back(query.number(1));
  }
  return series;
}

std::vector<RunRow> Store::runs() const {
  std::vector<RunRow> rows;
  if (!sql::has_table(db_.get(), "runs")) return rows;
  Statement query(db_.get(),
                  "SELECT r.address, r.system, r.contender, r.timestep_ms FROM runs r "
                  "LEFT JOIN systems s ON s.name = r.system LEFT JOIN contenders n ON n.name = r.contender "
                  "ORDER BY s.rowid, r.system, n.rowid, r.contender, r.timestep_ms");
  while (query.step()) rows.push_back({query.text(0), query.text(1), query.text(2), query.number(3)});
  return rows;
}

std::vector<SceneRow> Store::scenes() const {
  std::vector<SceneRow> rows;
  if (!sql::has_table(db_.get(), "scenes")) return rows;
  Statement query(db_.get(),
                  "SELECT c.system, c.json FROM scenes c LEFT JOIN systems s ON s.name = c.system "
                  "ORDER BY s.rowid, c.system");
  while (query.step()) rows.push_back({query.text(0), query.text(1)});
  return rows;
}

}  // namespace assay
