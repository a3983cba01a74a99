#include "results/store/store.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <string_view>
#include <sys/file.h>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/regular_file.h"
#include "base/write_file.h"
#include "results/store/cell_hash.h"
#include "results/store/database.h"
#include "results/store/schema.h"

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

// Of version 1: in its runs a column that is no key came first, which SQLite's integrity check takes for damage.
constexpr const char* kFalseAlarm = "NULL value in runs.address";

std::string database_path(const std::string& dir) { return dir + "/assay.sqlite"; }

// Throws InputError for a database that this program cannot read. An empty file has version 0. Returns the version.
std::int64_t check_readable(sqlite3* db, const std::string& path) {
  const std::int64_t application = pragma(db, "application_id"), version = pragma(db, "user_version");
  if (application != kApplicationId) {
    if (sql::looks_like_results(path)) {
      throw InputError(sql::damaged_text(path, "its header does not say that it is a results database"));
    }
    // As a process leaves it that was ended at once, or one whose write-ahead log was lost.
    if (application == 0 && pragma(db, "schema_version") == 0) {
      throw InputError(fmt::format(
          "'{}' is empty, so it is not a results database of assay: start the command that makes it again, or give "
          "another directory",
          path));
    }
    throw InputError(fmt::format("'{}' is not a results database of assay: give another directory", path));
  }
  constexpr size_t kShownLetters = 40;
  std::string writer;
  if (sql::has_manifest(db)) {
    Statement query(db, "SELECT value FROM manifest WHERE key = 'assay_version'");
    if (query.step()) writer = fmt::format(", written by assay {}", query.text(0).substr(0, kShownLetters));
  }
  if (version < 1 || version > kSchemaVersion) {
    throw InputError(fmt::format("'{}' has results of schema version {}{}, and this assay reads versions 1 to {}: {}",
                                 path, version, writer, kSchemaVersion,
                                 version > kSchemaVersion ? "use the assay that wrote them, or a newer one"
                                                          : "measure again into another directory"));
  }
  sql::check_schema(db, path, version, writer);
  sql::check_integrity(db, path, Store::kIntegritySeconds, version == 1 ? kFalseAlarm : "");
  return version;
}

void set_version(sqlite3* db) {
  execute(db,
          fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {}", kApplicationId, kSchemaVersion).c_str());
}

// All or nothing: a version 1 that was not migrated to its end stays one.
void migrate(sqlite3* db) {
  Transaction transaction(db);
  sql::migrate_tables(db);
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

// Throws InputError for what is there under a name of the results and is no regular file: a link would be followed, a
// pipe waited for.
void refuse_other(const std::string& path) {
  if (const std::string other = other_than_file(path); !other.empty()) {
    throw InputError(
        fmt::format("'{}' is {}, and in results only a regular file can have this name: remove it", path, other));
  }
}

// The writer's lock ends with the process that holds it, however that ends.
int take_writer_lock(const std::string& dir) {
  const std::string path = dir + "/.lock";
  refuse_other(path);
  const int lock = ::open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0644);
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
  refuse_other(path);
  sql::check_side_files(path);
  // A worker would write through it, elsewhere.
  refuse_linked_folder(dir + "/trajectories");
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
    sql::create_tables(db);
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
  refuse_other(dir + "/.lock");
  Store store(dir, std::unique_ptr<sqlite3, Deleter>(sql::open_to_read(path)), -1);
  store.hashed_ = check_readable(store.db_.get(), path) >= kSchemaVersion;
  return store;
}

}  // namespace assay
