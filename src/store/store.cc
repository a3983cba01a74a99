#include "store/store.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <string_view>
#include <sys/file.h>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <sqlite3.h>

#include "base/errors.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

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
    cpu_s REAL, engine_s REAL, steal REAL, started REAL, finished REAL);
  CREATE TABLE "values"(cell_id INTEGER NOT NULL REFERENCES cells(id) ON DELETE CASCADE, name TEXT NOT NULL,
    unit TEXT NOT NULL, value REAL, low REAL, high REAL, PRIMARY KEY(cell_id, name)) WITHOUT ROWID;
  CREATE TABLE samples(cell_id INTEGER NOT NULL REFERENCES cells(id) ON DELETE CASCADE, name TEXT NOT NULL,
    idx INTEGER NOT NULL, value REAL, PRIMARY KEY(cell_id, name, idx)) WITHOUT ROWID;
)sql";

// Added after the schema's version: made where they are missing.
constexpr const char* kLaterSchema = R"sql(
  CREATE TABLE IF NOT EXISTS runs(address TEXT NOT NULL, system TEXT NOT NULL, contender TEXT NOT NULL,
    timestep_ms REAL NOT NULL, PRIMARY KEY(system, contender, timestep_ms)) WITHOUT ROWID;
  CREATE TABLE IF NOT EXISTS scenes(system TEXT PRIMARY KEY, json TEXT NOT NULL) WITHOUT ROWID;
)sql";

std::string database_path(const std::string& dir) { return dir + "/assay.sqlite"; }

// SQLite's code in terms of who is to mend it.
[[noreturn]] void fail(sqlite3* db, const std::string& path) {
  const int code = sqlite3_errcode(db) & 0xff;
  if (code == SQLITE_FULL) {
    throw SystemError(fmt::format("cannot write '{}': the disk is full; what was finished is kept", path));
  }
  if (code == SQLITE_NOTADB || code == SQLITE_CORRUPT) {
    throw InputError(fmt::format("'{}' is not a results database of assay: give another directory", path));
  }
  const int why = sqlite3_system_errno(db);
  throw SystemError(fmt::format("cannot use '{}': {}{}", path, sqlite3_errmsg(db),
                                why != 0 ? fmt::format(" ({})", std::strerror(why)) : ""));
}

// A prepared statement; columns and parameters count from 0.
class Statement {
 public:
  Statement(sqlite3* db, std::string_view sql) : db_(db) {
    check(sqlite3_prepare_v2(db, sql.data(), static_cast<int>(sql.size()), &statement_, nullptr) == SQLITE_OK);
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void bind(int at, const std::string& text) {
    check(sqlite3_bind_text(statement_, at + 1, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT) ==
          SQLITE_OK);
  }
  void bind(int at, std::int64_t number) { check(sqlite3_bind_int64(statement_, at + 1, number) == SQLITE_OK); }
  void bind(int at, std::optional<double> number) {
    const bool there = number && std::isfinite(*number);
    check((there ? sqlite3_bind_double(statement_, at + 1, *number) : sqlite3_bind_null(statement_, at + 1)) ==
          SQLITE_OK);
  }
  template <typename... Values>
  Statement& bind_all(const Values&... values) {
    int at = 0;
    (bind(at++, values), ...);
    return *this;
  }
  // True while there is a row.
  bool step() {
    const int code = sqlite3_step(statement_);
    check(code == SQLITE_ROW || code == SQLITE_DONE);
    return code == SQLITE_ROW;
  }
  void run() {
    step();
    check(sqlite3_reset(statement_) == SQLITE_OK);
  }

  std::string text(int column) const {
    const auto* bytes = static_cast<const char*>(sqlite3_column_blob(statement_, column));
    return bytes == nullptr ? "" : std::string(bytes, static_cast<size_t>(sqlite3_column_bytes(statement_, column)));
  }
  std::int64_t integer(int column) const { return sqlite3_column_int64(statement_, column); }
  double number(int column) const { return sqlite3_column_double(statement_, column); }
  std::optional<double> optional_number(int column) const {
    if (sqlite3_column_type(statement_, column) == SQLITE_NULL) return std::nullopt;
    return number(column);
  }

 private:
  void check(bool fine) const {
    if (!fine) fail(db_, sqlite3_db_filename(db_, "main"));
  }

  sqlite3* db_;
  sqlite3_stmt* statement_ = nullptr;
};

void execute(sqlite3* db, const char* sql) {
  if (sqlite3_exec(db, sql, nullptr, nullptr, nullptr) != SQLITE_OK) fail(db, sqlite3_db_filename(db, "main"));
}

std::int64_t pragma(sqlite3* db, const std::string& name) {
  Statement statement(db, "PRAGMA " + name);
  return statement.step() ? statement.integer(0) : 0;
}

bool has_table(sqlite3* db, const std::string& name) {
  Statement query(db, "SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = ?");
  query.bind(0, name);
  return query.step();
}

// Everything between construction and commit() is there afterwards, or nothing is.
class Transaction {
 public:
  explicit Transaction(sqlite3* db) : db_(db) { execute(db, "BEGIN IMMEDIATE"); }
  ~Transaction() {
    if (!done_) sqlite3_exec(db_, "ROLLBACK", nullptr, nullptr, nullptr);
  }
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit() {
    execute(db_, "COMMIT");
    done_ = true;
  }

 private:
  sqlite3* db_;
  bool done_ = false;
};

// Throws InputError for a database that is not ours or of another version. An empty file is version 0.
void check_version(sqlite3* db, const std::string& path) {
  const std::int64_t application = pragma(db, "application_id"), version = pragma(db, "user_version");
  if (application == kApplicationId && version == kSchemaVersion) return;
  if (application == kApplicationId) {
    throw InputError(
        fmt::format("'{}' has results of schema version {} and this assay writes {}: give another directory", path,
                    version, kSchemaVersion));
  }
  throw InputError(fmt::format("'{}' is not a results database of assay: give another directory", path));
}

// The writer's lock goes with the process that holds it, however it ends.
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

sqlite3* open_database(const std::string& path, int flags) {
  sqlite3* db = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &db, flags, nullptr);
  if (code != SQLITE_OK && db == nullptr) throw SystemError(fmt::format("cannot open '{}': out of memory", path));
  sqlite3_busy_timeout(db, 10000);
  return db;
}

// A path as the path part of a URI.
std::string uri_of(const std::string& path) {
  std::string uri = "file:";
  for (const char c : path) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || std::strchr("/._-", c) != nullptr;
    uri += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return uri;
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
    : dir_(std::move(other.dir_)), db_(std::move(other.db_)), lock_(std::exchange(other.lock_, -1)) {}

Store& Store::operator=(Store&& other) noexcept {
  std::swap(dir_, other.dir_);
  std::swap(db_, other.db_);
  std::swap(lock_, other.lock_);
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
  std::error_code ignored;  // what cannot be looked at is no file that is in the way
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
  if (!fresh) {
    check_version(db, path);
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
    execute(
        db,
        fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {}", kApplicationId, kSchemaVersion).c_str());
    Statement put(db, "INSERT INTO manifest VALUES(?, ?)");
    put.bind_all(std::string("campaign"), identity.campaign).run();
    put.bind_all(std::string("campaign_hash"), identity.campaign_hash).run();
    transaction.commit();
  }
  execute(db, kLaterSchema);
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
  Store store(dir, std::unique_ptr<sqlite3, Deleter>(open_database(path, SQLITE_OPEN_READONLY)), -1);
  // On a read-only medium SQLite cannot make the index of the write-ahead log; nobody can be writing there either.
  sqlite3_exec(store.db_.get(), "SELECT count(*) FROM sqlite_schema", nullptr, nullptr, nullptr);
  if ((sqlite3_errcode(store.db_.get()) & 0xff) == SQLITE_CANTOPEN) {
    store.db_.reset(open_database(uri_of(path) + "?immutable=1", SQLITE_OPEN_READONLY | SQLITE_OPEN_URI));
  }
  check_version(store.db_.get(), path);
  return store;
}

// ---- reading --------------------------------------------------------------------------------------------------------

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
                                   database_path(dir_), query.text(6)));
    }
    cell.outcome = *outcome;
    cell.reason = query.text(7);
    cell.wall_s = query.number(8);
    cell.cpu_s = query.number(9);
    cell.engine_s = query.number(10);
    cell.steal = query.number(11);
    cell.started = query.number(12);
    cell.finished = query.number(13);
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
  if (!has_table(db_.get(), "runs")) return rows;
  Statement query(db_.get(),
                  "SELECT r.address, r.system, r.contender, r.timestep_ms FROM runs r "
                  "LEFT JOIN systems s ON s.name = r.system LEFT JOIN contenders n ON n.name = r.contender "
                  "ORDER BY s.rowid, r.system, n.rowid, r.contender, r.timestep_ms");
  while (query.step()) rows.push_back({query.text(0), query.text(1), query.text(2), query.number(3)});
  return rows;
}

std::vector<SceneRow> Store::scenes() const {
  std::vector<SceneRow> rows;
  if (!has_table(db_.get(), "scenes")) return rows;
  Statement query(db_.get(),
                  "SELECT c.system, c.json FROM scenes c LEFT JOIN systems s ON s.name = c.system "
                  "ORDER BY s.rowid, c.system");
  while (query.step()) rows.push_back({query.text(0), query.text(1)});
  return rows;
}

// ---- writing --------------------------------------------------------------------------------------------------------

void Store::set_manifest(const std::vector<ManifestEntry>& entries) {
  Transaction transaction(db_.get());
  Statement put(db_.get(), "INSERT OR REPLACE INTO manifest VALUES(?, ?)");
  for (const ManifestEntry& entry : entries) put.bind_all(entry.key, entry.value).run();
  transaction.commit();
}

void Store::set_systems(const std::vector<SystemRow>& rows) {
  Transaction transaction(db_.get());
  execute(db_.get(), "DELETE FROM systems");
  Statement put(db_.get(), "INSERT INTO systems VALUES(?, ?)");
  for (const SystemRow& row : rows) put.bind_all(row.name, row.json).run();
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
  transaction.commit();
}

void Store::set_runs(const std::vector<RunRow>& rows) {
  Transaction transaction(db_.get());
  execute(db_.get(), "DELETE FROM runs");
  Statement put(db_.get(), "INSERT OR REPLACE INTO runs VALUES(?, ?, ?, ?)");
  for (const RunRow& row : rows) {
    put.bind_all(row.address, row.system, row.contender, std::optional(row.timestep_ms)).run();
  }
  transaction.commit();
}

void Store::set_scenes(const std::vector<SceneRow>& rows) {
  Transaction transaction(db_.get());
  execute(db_.get(), "DELETE FROM scenes");
  Statement put(db_.get(), "INSERT INTO scenes VALUES(?, ?)");
  for (const SceneRow& row : rows) put.bind_all(row.system, row.json).run();
  transaction.commit();
}

void Store::set_conformance(const std::string& contender, const std::vector<ConformanceRow>& rows) {
  Transaction transaction(db_.get());
  Statement(db_.get(), "DELETE FROM conformance WHERE contender = ?").bind_all(contender).run();
  Statement put(db_.get(), "INSERT INTO conformance VALUES(?, ?, ?, ?, ?, ?, ?)");
  for (const ConformanceRow& row : rows) {
    put.bind_all(contender, row.test, row.status, std::optional(row.figure), std::optional(row.tolerance), row.unit,
                 row.note)
        .run();
  }
  transaction.commit();
}

std::int64_t Store::put_cell(const Cell& cell, const std::vector<SampleSeries>& samples) {
  Transaction transaction(db_.get());
  Statement(db_.get(), "DELETE FROM cells WHERE key = ?").bind_all(cell.key).run();
  Statement put(db_.get(),
                "INSERT INTO cells(key, system, contender, timestep_ms, measure, outcome, reason, wall_s, cpu_s, "
                "engine_s, steal, started, finished) VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  put.bind_all(cell.key, cell.system, cell.contender, std::optional(cell.timestep_ms), cell.measure,
               std::string(outcome_text(cell.outcome)), cell.reason, std::optional(cell.wall_s),
               std::optional(cell.cpu_s), std::optional(cell.engine_s), std::optional(cell.steal),
               std::optional(cell.started), std::optional(cell.finished))
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
  transaction.commit();
  return id;
}

void Store::set_derived(const std::vector<std::string>& names, const std::vector<Derived>& values) {
  Transaction transaction(db_.get());
  Statement remove(db_.get(), "DELETE FROM \"values\" WHERE name = ?");
  for (const std::string& name : names) remove.bind_all(name).run();
  Statement put(db_.get(), "INSERT INTO \"values\" VALUES(?, ?, ?, ?, ?, ?)");
  for (const auto& [cell_id, value] : values) {
    put.bind_all(cell_id, value.name, value.unit, value.value, value.low, value.high).run();
  }
  transaction.commit();
}

}  // namespace assay
