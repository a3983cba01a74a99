// SQLite as the store uses it. Internal to src/store. Errors are SystemError (the disk, the machine) or InputError (a
// file that is no database or a damaged one), and name the file.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <sqlite3.h>

namespace assay::sql {

// No value of a results database is longer: what a worker sends has at most 64 MiB, the scene of a large robot 1.
inline constexpr int kMostValueBytes = 64 << 20;

// A connection that runs none of the database's own code (triggers, views, functions in its schema) and reads no value
// above kMostValueBytes. Never null. Errors other than a lack of memory show at the first use.
sqlite3* open_database(const std::string& path, int flags);

// A results database, to be read only. A transaction that a killed process left half written to it is rolled back.
// Never null. Throws as check_side_files().
sqlite3* open_to_read(const std::string& path);

// Throws InputError for what SQLite would open beside the database and assay has not made: files that are no regular
// files, and a journal that makes SQLite remove another file.
void check_side_files(const std::string& path);

// A path as a URI.
std::string uri_of(const std::string& path);

// Throws what the database's last error calls for.
[[noreturn]] void fail(sqlite3* db);

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
  // The column's type and bytes behind those of others, so that equal texts are equal rows.
  void append_to(std::string& bytes, int column) const;
  std::optional<double> optional_number(int column) const {
    if (sqlite3_column_type(statement_, column) == SQLITE_NULL) return std::nullopt;
    return number(column);
  }

 private:
  void check(bool fine) const {
    if (!fine) fail(db_);
  }

  sqlite3* db_;
  sqlite3_stmt* statement_ = nullptr;
};

void execute(sqlite3* db, const char* sql);
std::int64_t pragma(sqlite3* db, const std::string& name);
bool has_table(sqlite3* db, const std::string& name);

// Throws InputError that names the damage which SQLite finds in the file within `seconds`. `false_alarm` is a finding
// that does not count.
void check_integrity(sqlite3* db, const std::string& path, double seconds, const std::string& false_alarm = "");

// Whether the beginning of a file that SQLite does not take for a database is one of a results database.
bool looks_like_results(const std::string& path);

// "'DIR/assay.sqlite' is damaged (what): restore it from a copy, or ..."
std::string damaged_text(const std::string& path, const std::string& what);

// What is read between construction and destruction is of one moment, whoever writes meanwhile.
class Snapshot {
 public:
  explicit Snapshot(sqlite3* db) : db_(sqlite3_get_autocommit(db) != 0 ? db : nullptr) {
    if (db_ != nullptr) execute(db_, "BEGIN");
  }
  ~Snapshot() {
    if (db_ != nullptr) sqlite3_exec(db_, "ROLLBACK", nullptr, nullptr, nullptr);
  }
  Snapshot(const Snapshot&) = delete;
  Snapshot& operator=(const Snapshot&) = delete;

 private:
  sqlite3* db_;
};

// Throws SystemError when the database's file is no longer where it was opened: what is written goes nowhere then.
void check_still_there(sqlite3* db);

// All or nothing of what is written between construction and commit() is kept.
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
    check_still_there(db_);
  }

 private:
  sqlite3* db_;
  bool done_ = false;
};

}  // namespace assay::sql
