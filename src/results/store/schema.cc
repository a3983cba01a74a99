#include "results/store/schema.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <memory>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "results/store/database.h"
#include "results/store/store.h"

namespace assay::sql {
namespace {

constexpr const char* kSchema = R"sql(
  CREATE TABLE manifest(key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
  CREATE TABLE systems(name TEXT PRIMARY KEY, json TEXT NOT NULL);
  CREATE TABLE contenders(name TEXT PRIMARY KEY, engine TEXT NOT NULL, version TEXT NOT NULL, base TEXT NOT NULL,
    settings TEXT NOT NULL, capabilities_json TEXT NOT NULL, build_json TEXT NOT NULL);
  CREATE TABLE conformance(contender TEXT NOT NULL, test TEXT NOT NULL, status TEXT NOT NULL, figure REAL,
    tolerance REAL, unit TEXT NOT NULL, note TEXT NOT NULL, PRIMARY KEY(contender, test));
  CREATE TABLE cells(id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, system TEXT NOT NULL, contender TEXT NOT NULL,
    timestep_ms REAL NOT NULL, measure TEXT NOT NULL, outcome TEXT NOT NULL, reason TEXT NOT NULL, wall_s REAL,
    cpu_s REAL, engine_s REAL, steal REAL, started REAL, finished REAL, node TEXT, samples_hash TEXT, hash TEXT);
  CREATE TABLE "values"(cell_id INTEGER NOT NULL REFERENCES cells(id) ON DELETE CASCADE, name TEXT NOT NULL,
    unit TEXT NOT NULL, value REAL, low REAL, high REAL, PRIMARY KEY(cell_id, name)) WITHOUT ROWID;
  CREATE TABLE samples(cell_id INTEGER NOT NULL REFERENCES cells(id) ON DELETE CASCADE, name TEXT NOT NULL,
    idx INTEGER NOT NULL, value REAL, PRIMARY KEY(cell_id, name, idx)) WITHOUT ROWID;
  CREATE TABLE runs(system TEXT NOT NULL, contender TEXT NOT NULL, timestep_ms REAL NOT NULL, address TEXT NOT NULL,
    PRIMARY KEY(system, contender, timestep_ms)) WITHOUT ROWID;
  CREATE TABLE scenes(system TEXT PRIMARY KEY, json TEXT NOT NULL) WITHOUT ROWID;
  CREATE TABLE nodes(id TEXT PRIMARY KEY, json TEXT NOT NULL) WITHOUT ROWID;
  CREATE TABLE plan(key TEXT PRIMARY KEY, shard INTEGER NOT NULL, cost_s REAL NOT NULL, accuracy INTEGER NOT NULL)
    WITHOUT ROWID;
  CREATE TABLE hashes(name TEXT PRIMARY KEY, hash TEXT NOT NULL) WITHOUT ROWID;
)sql";

// From version 1, whose tables runs and scenes came later.
constexpr const char* kMigration = R"sql(
  CREATE TABLE IF NOT EXISTS runs(address TEXT NOT NULL, system TEXT NOT NULL, contender TEXT NOT NULL,
    timestep_ms REAL NOT NULL, PRIMARY KEY(system, contender, timestep_ms)) WITHOUT ROWID;
  ALTER TABLE runs RENAME TO old_runs;
  CREATE TABLE runs(system TEXT NOT NULL, contender TEXT NOT NULL, timestep_ms REAL NOT NULL, address TEXT NOT NULL,
    PRIMARY KEY(system, contender, timestep_ms)) WITHOUT ROWID;
  INSERT INTO runs SELECT system, contender, timestep_ms, address FROM old_runs;
  DROP TABLE old_runs;
  CREATE TABLE IF NOT EXISTS scenes(system TEXT PRIMARY KEY, json TEXT NOT NULL) WITHOUT ROWID;
  CREATE TABLE hashes(name TEXT PRIMARY KEY, hash TEXT NOT NULL) WITHOUT ROWID;
  ALTER TABLE cells ADD COLUMN samples_hash TEXT;
  ALTER TABLE cells ADD COLUMN hash TEXT;
  ALTER TABLE cells ADD COLUMN node TEXT;
  CREATE TABLE nodes(id TEXT PRIMARY KEY, json TEXT NOT NULL) WITHOUT ROWID;
  CREATE TABLE plan(key TEXT PRIMARY KEY, shard INTEGER NOT NULL, cost_s REAL NOT NULL, accuracy INTEGER NOT NULL)
    WITHOUT ROWID;
)sql";

// Tables that version 1 had otherwise, as it made them.
constexpr const char* kVersion1 = R"sql(
  CREATE TABLE cells(id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, system TEXT NOT NULL, contender TEXT NOT NULL,
    timestep_ms REAL NOT NULL, measure TEXT NOT NULL, outcome TEXT NOT NULL, reason TEXT NOT NULL, wall_s REAL,
    cpu_s REAL, engine_s REAL, steal REAL, started REAL, finished REAL);
  CREATE TABLE runs(address TEXT NOT NULL, system TEXT NOT NULL, contender TEXT NOT NULL, timestep_ms REAL NOT NULL,
    PRIMARY KEY(system, contender, timestep_ms)) WITHOUT ROWID;
)sql";

// What version 2 has beyond version 1.
bool is_new_in_2(const std::string& table, const std::string& column) {
  return table == "hashes" || table == "runs" || table == "scenes" || table == "nodes" || table == "plan" ||
         (table == "cells" && (column == "hash" || column == "samples_hash" || column == "node"));
}

using Database = std::unique_ptr<sqlite3, int (*)(sqlite3*)>;

Database in_memory() {
  return {open_database(":memory:", SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE), sqlite3_close_v2};
}

// The statement that made a table, however its lines are broken.
std::string on_one_line(const std::string& sql) {
  std::string line;
  for (const char c : sql) {
    const bool blank = std::isspace(static_cast<unsigned char>(c)) != 0;
    if (!blank) {
      line += c;
    } else if (!line.empty() && line.back() != ' ') {
      line += ' ';
    }
  }
  return line;
}

// What the statements of assay's tables can be, by name: in any version, and after its migration.
const std::map<std::string, std::set<std::string>>& known_tables() {
  static const auto known = [] {
    std::map<std::string, std::set<std::string>> tables;
    const auto note = [&](sqlite3* db) {
      Statement query(db, "SELECT name, sql FROM sqlite_schema WHERE type = 'table'");
      while (query.step()) tables[query.text(0)].insert(on_one_line(query.text(1)));
    };
    const Database now = in_memory(), before = in_memory();
    execute(now.get(), kSchema);
    note(now.get());
    execute(before.get(), kVersion1);
    note(before.get());
    execute(before.get(), kMigration);
    note(before.get());
    return tables;
  }();
  return known;
}

using Columns = std::set<std::pair<std::string, std::string>>;  // (table, column)

Columns columns_of(sqlite3* db) {
  Columns columns;
  Statement query(
      db, "SELECT t.name, c.name FROM sqlite_schema t JOIN pragma_table_xinfo(t.name) c WHERE t.type = 'table'");
  while (query.step()) columns.insert({query.text(0), query.text(1)});
  return columns;
}

const Columns& known_columns() {
  static const Columns known = [] {
    const Database db = in_memory();
    execute(db.get(), kSchema);
    return columns_of(db.get());
  }();
  return known;
}

struct Object {
  std::string type, name, sql;
};

// What assay has not made, "" for what it has. By the schema's rows alone: asking for the columns of a virtual table
// would run its module.
std::string foreign_kind(const Object& object) {
  if (object.type == "index" && object.sql.empty() && object.name.starts_with("sqlite_autoindex_")) return "";
  if (object.type == "trigger" || object.type == "view" || object.type == "index") return object.type;
  std::string begin = object.sql.substr(0, std::string_view("CREATE VIRTUAL").size());
  std::ranges::transform(begin, begin.begin(), [](unsigned char c) { return std::toupper(c); });
  if (begin == "CREATE VIRTUAL") return "virtual table";
  return known_tables().contains(object.name) ? "" : "table";
}

}  // namespace

void create_tables(sqlite3* db) { execute(db, kSchema); }

void migrate_tables(sqlite3* db) { execute(db, kMigration); }

bool has_manifest(sqlite3* db) {
  Statement query(db, "SELECT sql FROM sqlite_schema WHERE type = 'table' AND name = 'manifest'");
  return query.step() && known_tables().at("manifest").contains(on_one_line(query.text(0)));
}

void check_schema(sqlite3* db, const std::string& path, std::int64_t version, const std::string& writer) {
  constexpr size_t kShownLetters = 80;
  const auto shown = [](const std::string& name) { return name.substr(0, kShownLetters); };
  std::vector<Object> objects;
  Statement query(db, "SELECT type, name, sql FROM sqlite_schema");
  while (query.step()) objects.push_back({query.text(0), query.text(1), query.text(2)});
  for (const Object& object : objects) {
    const std::string kind = foreign_kind(object);
    if (kind.empty()) continue;
    std::string statement = kind.substr(kind.rfind(' ') + 1);
    std::ranges::transform(statement, statement.begin(), [](unsigned char c) { return std::toupper(c); });
    throw InputError(fmt::format(
        "'{}' has the {} '{}' that assay does not make{}: it is damaged, or another program has changed it; "
        "remove that with DROP {}, or measure again into another directory",
        path, kind, shown(object.name), writer, statement));
  }
  const Columns present = columns_of(db);
  for (const auto& [table, column] : known_columns()) {
    if (present.contains({table, column}) || (version == 1 && is_new_in_2(table, column))) continue;
    throw InputError(
        fmt::format("'{}' has no column '{}' in the table '{}'{}: it is damaged, or another assay's; measure again "
                    "into another directory",
                    path, column, table, writer));
  }
  for (const Object& object : objects) {
    if (object.type != "table" || known_tables().at(object.name).contains(on_one_line(object.sql))) continue;
    const auto more = std::ranges::find_if(present, [&](const std::pair<std::string, std::string>& each) {
      return each.first == object.name && !known_columns().contains(each);
    });
    throw InputError(fmt::format(
        "'{}' has the table '{}' with {} that assay does not make{}: it is damaged, or another program has changed it; "
        "measure again into another directory",
        path, object.name,
        more == present.end() ? std::string("types, keys, checks or defaults")
                              : fmt::format("a column '{}'", shown(more->second)),
        writer));
  }
}

}  // namespace assay::sql
