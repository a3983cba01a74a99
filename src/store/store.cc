#include "store/store.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <set>
#include <string_view>
#include <sys/file.h>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "store/cell_hash.h"
#include "store/database.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
using sql::execute;
using sql::open_database;
using sql::pragma;
using sql::Statement;
using sql::Transaction;

constexpr std::array<std::pair<Outcome, std::string_view>, 6> kOutcomes = {{
    {Outcome::kOk, "ok"},
    {Outcome::kUnstable, "unstable"},
    {Outcome::kDiverged, "diverged"},
    {Outcome::kTimeout, "timeout"},
    {Outcome::kCrashed, "crashed"},
    {Outcome::kUnsupported, "unsupported"},
}};

constexpr int kApplicationId = 0x61737361;  // "assa": tells our databases from others

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

// Of version 1: in its runs a column that is no key came first, which SQLite's integrity check takes for damage.
constexpr const char* kFalseAlarm = "NULL value in runs.address";

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

// What version 2 has beyond version 1.
bool is_new_in_2(const std::string& table, const std::string& column) {
  return table == "hashes" || table == "runs" || table == "scenes" || table == "nodes" || table == "plan" ||
         (table == "cells" && (column == "hash" || column == "samples_hash" || column == "node"));
}

std::string database_path(const std::string& dir) { return dir + "/assay.sqlite"; }

// The results' schema, as (table, column).
std::set<std::pair<std::string, std::string>> columns_of(sqlite3* db) {
  std::set<std::pair<std::string, std::string>> columns;
  Statement query(db,
                  "SELECT t.name, c.name FROM sqlite_schema t JOIN pragma_table_info(t.name) c WHERE t.type = 'table'");
  while (query.step()) columns.insert({query.text(0), query.text(1)});
  return columns;
}

// Throws InputError for a database that this program cannot read. An empty file has version 0. Returns the version.
std::int64_t check_readable(sqlite3* db, const std::string& path) {
  const std::int64_t application = pragma(db, "application_id"), version = pragma(db, "user_version");
  if (application != kApplicationId) {
    if (sql::looks_like_results(path)) {
      throw InputError(sql::damaged_text(path, "its header does not say that it is a results database"));
    }
    throw InputError(fmt::format("'{}' is not a results database of assay: give another directory", path));
  }
  const auto present = columns_of(db);
  std::string writer;
  if (present.contains({"manifest", "key"}) && present.contains({"manifest", "value"})) {
    Statement query(db, "SELECT value FROM manifest WHERE key = 'assay_version'");
    if (query.step()) writer = fmt::format(", written by assay {}", query.text(0));
  }
  if (version < 1 || version > kSchemaVersion) {
    throw InputError(fmt::format("'{}' has results of schema version {}{}, and this assay reads versions 1 to {}: {}",
                                 path, version, writer, kSchemaVersion,
                                 version > kSchemaVersion ? "use the assay that wrote them, or a newer one"
                                                          : "measure again into another directory"));
  }
  sql::check_integrity(db, path, Store::kIntegritySeconds, version == 1 ? kFalseAlarm : "");
  const std::unique_ptr<sqlite3, int (*)(sqlite3*)> model(
      open_database(":memory:", SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE), sqlite3_close_v2);
  execute(model.get(), kSchema);
  for (const auto& [table, column] : columns_of(model.get())) {
    if (present.contains({table, column}) || (version == 1 && is_new_in_2(table, column))) continue;
    throw InputError(
        fmt::format("'{}' has no column '{}' in the table '{}'{}: it is damaged, or another assay's; measure again "
                    "into another directory",
                    path, column, table, writer));
  }
  return version;
}

void set_version(sqlite3* db) {
  execute(db,
          fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {}", kApplicationId, kSchemaVersion).c_str());
}

// All or nothing: a version 1 that was not migrated to its end stays one.
void migrate(sqlite3* db) {
  Transaction transaction(db);
  execute(db, kMigration);
  std::vector<std::int64_t> cells;
  Statement query(db, "SELECT id FROM cells");
  while (query.step()) cells.push_back(query.integer(0));
  sql::CellHasher hasher(db);
  for (const std::int64_t id : cells) {
    hasher.put_samples_hash(id);
    hasher.put_cell_hash(id);
  }
  for (const auto& [table, order] : sql::hashed_tables()) sql::put_table_hash(db, table);
  set_version(db);
  transaction.commit();
}

// The writer's lock ends with the process that holds it, however that ends.
int take_writer_lock(const std::string& dir) {
  const std::string path = dir + "/.lock";
  const int lock = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (lock < 0) throw SystemError(fmt::format("cannot write to '{}': {}", dir, std::strerror(errno)));
  // A worker that a killed run was just starting holds the lock for a moment longer than the run.
  constexpr int kTries = 20;
  constexpr useconds_t kPauseMicroseconds = 50'000;
  int why = EWOULDBLOCK;
  for (int i = 0; i < kTries && why == EWOULDBLOCK; ++i) {
    if (i > 0) ::usleep(kPauseMicroseconds);
    if (::flock(lock, LOCK_EX | LOCK_NB) == 0) return lock;
    why = errno;
  }
  ::close(lock);
  if (why == EWOULDBLOCK) {
    throw InputError(fmt::format("another assay is writing to '{}': wait for it, or give another directory", dir));
  }
  throw SystemError(fmt::format("cannot lock '{}': {}", path, std::strerror(why)));
}

}  // namespace

std::string_view outcome_text(Outcome outcome) {
  return std::ranges::find(kOutcomes, outcome, &std::pair<Outcome, std::string_view>::first)->second;
}

std::optional<Outcome> parse_outcome(std::string_view text) {
  const auto* found = std::ranges::find(kOutcomes, text, &std::pair<Outcome, std::string_view>::second);
  if (found == kOutcomes.end()) return std::nullopt;
  return found->first;
}

const Value* find_value(const Cell& cell, std::string_view name) {
  const auto found = std::ranges::find(cell.values, name, &Value::name);
  return found == cell.values.end() || !found->value ? nullptr : &*found;
}

void Store::Deleter::operator()(sqlite3* db) const { sqlite3_close_v2(db); }

Store::Store(std::string dir, std::unique_ptr<sqlite3, Deleter> db, int lock)
    : dir_(std::move(dir)), db_(std::move(db)), lock_(lock) {}

Store::Store(Store&& other) noexcept
    : dir_(std::move(other.dir_)),
      db_(std::move(other.db_)),
      lock_(std::exchange(other.lock_, -1)),
      hashed_(other.hashed_),
      node_(std::move(other.node_)) {}

Store& Store::operator=(Store&& other) noexcept {
  std::swap(dir_, other.dir_);
  std::swap(db_, other.db_);
  std::swap(lock_, other.lock_);
  std::swap(node_, other.node_);
  std::swap(hashed_, other.hashed_);
  return *this;
}

Store::~Store() {
  db_.reset();
  if (lock_ >= 0) ::close(lock_);
}

Store Store::create(const std::string& dir, const Identity& identity) {
  if (dir.empty()) throw InputError("the results directory's name is empty: give one");
  std::error_code error;
  fs::create_directories(dir, error);
  std::error_code ignored;  // what cannot be read is not in the way
  if (error || !fs::is_directory(dir, ignored)) {
    if (fs::exists(dir, ignored) && !fs::is_directory(dir, ignored)) {
      throw InputError(fmt::format("'{}' is a file: give a directory for the results", dir));
    }
    if (error == std::errc::not_a_directory) {
      throw InputError(fmt::format("'{}' lies below a file: give a directory for the results", dir));
    }
    throw SystemError(fmt::format("cannot make the directory '{}': {}", dir, error.message()));
  }
  const std::string path = database_path(dir);
  if (fs::is_directory(path, ignored))
    throw InputError(fmt::format("'{}' is a directory: give another directory", path));
  const int lock = take_writer_lock(dir);
  Store store(dir, std::unique_ptr<sqlite3, Deleter>(), lock);  // owns the lock whatever happens below
  store.db_.reset(open_database(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE));
  sqlite3* db = store.db_.get();

  const bool fresh = pragma(db, "schema_version") == 0 && pragma(db, "application_id") == 0;
  std::int64_t version = kSchemaVersion;
  if (!fresh) {
    version = check_readable(db, path);
    store.hashed_ = version >= kSchemaVersion;
    const std::string campaign = store.manifest("campaign").value_or("");
    if (campaign != identity.campaign) {
      throw InputError(fmt::format("'{}' holds results of the campaign '{}' and this is '{}': give another directory",
                                   dir, campaign, identity.campaign));
    }
    if (store.manifest("campaign_hash") != identity.campaign_hash) {
      throw InputError(fmt::format(
          "'{}' holds results of the campaign '{}' with other systems, contenders, settings or engine builds: "
          "give another directory",
          dir, campaign));
    }
  }
  execute(db, "PRAGMA journal_mode = WAL");
  // Every commit reaches the disk: a power cut loses no finished cell either.
  execute(db, "PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON");
  if (fresh) {
    Transaction transaction(db);
    execute(db, kSchema);
    set_version(db);
    Statement put(db, "INSERT INTO manifest VALUES(?, ?)");
    put.bind_all(std::string("campaign"), identity.campaign).run();
    put.bind_all(std::string("campaign_hash"), identity.campaign_hash).run();
    sql::put_table_hash(db, "manifest");
    transaction.commit();
  }
  if (version < kSchemaVersion) migrate(db);
  store.hashed_ = true;
  return store;
}

Store Store::open(const std::string& dir) {
  const std::string path = database_path(dir);
  std::error_code error;
  if (!fs::is_directory(dir, error)) {
    throw InputError(fmt::format("there is no directory '{}': give one that `assay run` made", dir));
  }
  if (!fs::is_regular_file(path, error)) {
    throw InputError(fmt::format("'{}' holds no results: give a directory that `assay run` made", dir));
  }
  Store store(dir, std::unique_ptr<sqlite3, Deleter>(sql::open_to_read(path)), -1);
  store.hashed_ = check_readable(store.db_.get(), path) >= kSchemaVersion;
  return store;
}

}  // namespace assay
