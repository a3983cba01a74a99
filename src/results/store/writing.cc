// Writing into a results directory: one transaction a call.
#include <cstdlib>
#include <set>
#include <string>

#include "results/store/cell_hash.h"
#include "results/store/database.h"
#include "results/store/store.h"

namespace assay {

using sql::execute;
using sql::Statement;
using sql::Transaction;

namespace {

// Results are shared, and an engine's message may hold the path of a file that it was compiled from.
std::string without_home(std::string text) {
  const char* given = std::getenv("HOME");
  const std::string home = given == nullptr ? "" : given;
  if (home.size() < 2) return text;
  const std::string folder = home + "/";
  for (size_t at = text.find(folder); at != std::string::npos; at = text.find(folder, at)) {
    text.replace(at, folder.size(), "~/");
  }
  return text;
}

}  // namespace

void Store::set_manifest(const std::vector<ManifestEntry>& entries) {
  Transaction transaction(db_.get());
  verify("manifest");  // the hash of what is there already must not become right by that
  Statement put(db_.get(), "INSERT OR REPLACE INTO manifest VALUES(?, ?)");
  for (const ManifestEntry& entry : entries) put.bind_all(entry.key, entry.value).run();
  sql::put_table_hash(db_.get(), "manifest");
  transaction.commit();
}

void Store::set_systems(const std::vector<SystemRow>& rows) {
  Transaction transaction(db_.get());
  execute(db_.get(), "DELETE FROM systems");
  Statement put(db_.get(), "INSERT INTO systems VALUES(?, ?)");
  for (const SystemRow& row : rows) put.bind_all(row.name, row.json).run();
  sql::put_table_hash(db_.get(), "systems");
  transaction.commit();
}

void Store::set_contenders(const std::vector<ContenderRow>& rows) {
  Transaction transaction(db_.get());
  execute(db_.get(), "DELETE FROM contenders");
  Statement put(db_.get(), "INSERT INTO contenders VALUES(?, ?, ?, ?, ?, ?, ?)");
  for (const ContenderRow& row : rows) {
    put.bind_all(row.name, row.engine, row.version, row.base, row.settings, row.capabilities_json, row.build_json)
        .run();
  }
  sql::put_table_hash(db_.get(), "contenders");
  transaction.commit();
}

void Store::set_runs(const std::vector<RunRow>& rows) {
  Transaction transaction(db_.get());
  execute(db_.get(), "DELETE FROM runs");
  Statement put(db_.get(), "INSERT OR REPLACE INTO runs(address, system, contender, timestep_ms) VALUES(?, ?, ?, ?)");
  for (const RunRow& row : rows) {
    put.bind_all(row.address, row.system, row.contender, std::optional(row.timestep_ms)).run();
  }
  sql::put_table_hash(db_.get(), "runs");
  transaction.commit();
}

void Store::set_scenes(const std::vector<SceneRow>& rows) {
  Transaction transaction(db_.get());
  execute(db_.get(), "DELETE FROM scenes");
  Statement put(db_.get(), "INSERT INTO scenes VALUES(?, ?)");
  for (const SceneRow& row : rows) put.bind_all(row.system, row.json).run();
  sql::put_table_hash(db_.get(), "scenes");
  transaction.commit();
}

void Store::set_conformance(const std::string& contender, const std::vector<ConformanceRow>& rows) {
  Transaction transaction(db_.get());
  verify("conformance");
  Statement(db_.get(), "DELETE FROM conformance WHERE contender = ?").bind_all(contender).run();
  Statement put(db_.get(), "INSERT INTO conformance VALUES(?, ?, ?, ?, ?, ?, ?)");
  for (const ConformanceRow& row : rows) {
    put.bind_all(contender, row.test, row.status, std::optional(row.figure), std::optional(row.tolerance), row.unit,
                 without_home(row.note))
        .run();
  }
  sql::put_table_hash(db_.get(), "conformance");
  transaction.commit();
}

std::int64_t Store::put_cell(const Cell& cell, const std::vector<SampleSeries>& samples) {
  Transaction transaction(db_.get());
  const std::int64_t id = insert_cell(cell, samples);
  transaction.commit();
  return id;
}

void Store::put_cells(const std::vector<MeasuredCell>& cells) {
  Transaction transaction(db_.get());
  for (const MeasuredCell& each : cells) insert_cell(each.cell, each.samples);
  transaction.commit();
}

std::int64_t Store::insert_cell(const Cell& cell, const std::vector<SampleSeries>& samples) {
  Statement(db_.get(), "DELETE FROM cells WHERE key = ?").bind_all(cell.key).run();
  Statement put(db_.get(),
                "INSERT INTO cells(key, system, contender, timestep_ms, measure, outcome, reason, wall_s, cpu_s, "
                "engine_s, steal, started, finished, node) VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  put.bind_all(cell.key, cell.system, cell.contender, std::optional(cell.timestep_ms), cell.measure,
               std::string(outcome_text(cell.outcome)), without_home(cell.reason), std::optional(cell.wall_s),
               std::optional(cell.cpu_s), std::optional(cell.engine_s), std::optional(cell.steal),
               std::optional(cell.started), std::optional(cell.finished), cell.node.empty() ? node_ : cell.node)
      .run();
  const std::int64_t id = sqlite3_last_insert_rowid(db_.get());
  Statement put_value(db_.get(), "INSERT INTO \"values\" VALUES(?, ?, ?, ?, ?, ?)");
  for (const Value& value : cell.values) {
    put_value.bind_all(id, value.name, value.unit, value.value, value.low, value.high).run();
  }
  Statement put_sample(db_.get(), "INSERT INTO samples VALUES(?, ?, ?, ?)");
  for (const SampleSeries& series : samples) {
    for (size_t i = 0; i < series.values.size(); ++i) {
      put_sample.bind_all(id, series.name, static_cast<std::int64_t>(i), std::optional(series.values[i])).run();
    }
  }
  sql::CellHasher hasher(db_.get());
  hasher.put_samples_hash(id);
  hasher.put_cell_hash(id);
  return id;
}

void Store::set_derived(const std::vector<std::string>& names, const std::vector<Derived>& values) {
  Transaction transaction(db_.get());
  std::set<std::int64_t> changed;
  Statement owners(db_.get(), "SELECT cell_id FROM \"values\" WHERE name = ?");
  Statement remove(db_.get(), "DELETE FROM \"values\" WHERE name = ?");
  for (const std::string& name : names) {
    owners.bind_all(name);
    while (owners.step()) changed.insert(owners.integer(0));
    owners.run();  // steps past the end, which resets it
    remove.bind_all(name).run();
  }
  Statement put(db_.get(), "INSERT INTO \"values\" VALUES(?, ?, ?, ?, ?, ?)");
  for (const auto& [cell_id, value] : values) {
    put.bind_all(cell_id, value.name, value.unit, value.value, value.low, value.high).run();
    changed.insert(cell_id);
  }
  sql::CellHasher hasher(db_.get());
  for (const std::int64_t id : changed) hasher.put_cell_hash(id);
  transaction.commit();
}

std::vector<std::string> Store::remove_damaged_cells() {
  std::vector<Cell> damaged;
  std::vector<Cell> others = read_cells(damaged);
  const std::set<std::int64_t> by_samples = sql::cells_of_damaged_samples(db_.get());
  for (Cell& cell : others) {
    if (by_samples.contains(cell.id)) damaged.push_back(std::move(cell));
  }
  std::vector<std::string> titles;
  Transaction transaction(db_.get());
  Statement remove(db_.get(), "DELETE FROM cells WHERE id = ?");
  for (const Cell& cell : damaged) {
    titles.push_back(sql::cell_title(cell));
    remove.bind_all(cell.id).run();
  }
  transaction.commit();
  return titles;
}

}  // namespace assay
