#include "results/store/database.h"

#include <array>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <sys/resource.h>
#include <sys/stat.h>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/regular_file.h"

namespace assay::sql {

namespace fs = std::filesystem;

sqlite3* open_database(const std::string& path, int flags) {
  sqlite3* db = nullptr;
  // No connection is used by two threads at once, so it needs no lock for each of its calls.
  const int code = sqlite3_open_v2(path.c_str(), &db, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  if (code != SQLITE_OK && db == nullptr) throw SystemError(fmt::format("cannot open '{}': out of memory", path));
  sqlite3_busy_timeout(db, 10000);
  sqlite3_limit(db, SQLITE_LIMIT_LENGTH, kMostValueBytes);
  for (const auto& [option, on] : {std::pair{SQLITE_DBCONFIG_ENABLE_TRIGGER, 0},
                                   {SQLITE_DBCONFIG_ENABLE_VIEW, 0},
                                   {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
                                   {SQLITE_DBCONFIG_DEFENSIVE, 1}}) {
    sqlite3_db_config(db, option, on, nullptr);
  }
  return db;
}

void check_side_files(const std::string& path) {
  std::error_code error;
  const fs::path followed = fs::canonical(path, error);  // SQLite's files lie beside the file that a link means
  const std::string beside = error ? path : followed.string();
  for (const char* ending : {"-journal", "-wal", "-shm"}) {
    const std::string file = beside + ending;
    if (const std::string other = other_than_file(file); !other.empty()) {
      throw InputError(
          fmt::format("'{}' is {}, and beside results only a regular file can have this name: remove it", file, other));
    }
  }
  // A journal of several databases ends with the name of a file that SQLite removes when it has rolled back, whatever
  // that file is.
  constexpr std::string_view kMagic("\xd9\xd5\x05\xf9\x20\xa1\x63\xd7", 8);
  std::ifstream journal(beside + "-journal", std::ios::binary | std::ios::ate);
  if (!journal || journal.tellg() < std::ssize(kMagic)) return;
  std::string end(kMagic.size(), '\0');
  journal.seekg(-std::ssize(kMagic), std::ios::end);
  journal.read(end.data(), std::ssize(end));
  if (end == kMagic) {
    throw InputError(
        fmt::format("'{}-journal' belongs to several databases, and assay writes no such journal: remove it, and "
                    "restore '{}' from a copy if it is damaged then",
                    beside, path));
  }
}

sqlite3* open_to_read(const std::string& path) {
  constexpr auto first_error = [](sqlite3* db) {
    sqlite3_exec(db, "SELECT count(*) FROM sqlite_schema", nullptr, nullptr, nullptr);
    return sqlite3_errcode(db) & 0xff;
  };
  check_side_files(path);
  sqlite3* db = open_database(path, SQLITE_OPEN_READONLY);
  int error = first_error(db);
  // What has to be rolled back cannot be through a connection that may only read.
  if (error == SQLITE_READONLY) {
    sqlite3* writer = open_database(path, SQLITE_OPEN_READWRITE);
    first_error(writer);
    sqlite3_close_v2(writer);
    error = first_error(db);
  }
  // On a read-only medium SQLite cannot make the index of the write-ahead log; nobody can be writing there either.
  if (error == SQLITE_CANTOPEN) {
    sqlite3_close_v2(db);
    db = open_database(uri_of(path) + "?immutable=1", SQLITE_OPEN_READONLY | SQLITE_OPEN_URI);
  }
  return db;
}

std::string uri_of(const std::string& path) {
  std::string uri = "file:";
  for (const char c : path) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || std::strchr("/._-", c) != nullptr;
    uri += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return uri;
}

namespace {

// Throws for the first table of the connection's databases with a value that is longer than what is read.
void refuse_long_value(sqlite3* db) {
  for (const char* schema : {"main", "src"}) {  // as results/store/merge.cc attaches
    const char* file = sqlite3_db_filename(db, schema);
    for (const char* table : {"manifest", "systems", "contenders", "conformance", "cells", "values", "samples", "runs",
                              "scenes", "nodes", "plan", "hashes"}) {
      sqlite3_stmt* query = nullptr;
      const std::string sql = fmt::format("SELECT * FROM {}.\"{}\"", schema, table);
      if (file == nullptr || sqlite3_prepare_v2(db, sql.c_str(), -1, &query, nullptr) != SQLITE_OK) continue;
      int code = SQLITE_ROW;
      while (code == SQLITE_ROW) code = sqlite3_step(query);
      sqlite3_finalize(query);
      if (code != SQLITE_TOOBIG) continue;
      throw InputError(damaged_text(
          file, fmt::format("a value in the table '{}' has more than {} MiB", table, kMostValueBytes >> 20)));
    }
  }
}

}  // namespace

void check_still_there(sqlite3* db) {
  int moved = 0;
  if (sqlite3_file_control(db, "main", SQLITE_FCNTL_HAS_MOVED, &moved) != SQLITE_OK || moved == 0) return;
  throw SystemError(fmt::format(
      "'{}' was removed, moved or replaced while it was written: what was measured since then is lost. Put it "
      "back where it was, or measure again",
      sqlite3_db_filename(db, "main")));
}

void fail(sqlite3* db) {
  const std::string path = sqlite3_db_filename(db, "main");
  const int code = sqlite3_errcode(db) & 0xff, why = sqlite3_system_errno(db);
  const std::string message = sqlite3_errmsg(db);
  check_still_there(db);  // it replaces the last error
  if (code == SQLITE_TOOBIG) {
    refuse_long_value(db);
    throw SystemError(fmt::format("cannot write '{}': a value has more than {} MiB", path, kMostValueBytes >> 20));
  }
  if (code == SQLITE_FULL) {
    throw SystemError(fmt::format("cannot write '{}': the disk is full; what was finished is kept", path));
  }
  if (code == SQLITE_NOTADB && looks_like_results(path)) {
    throw InputError(damaged_text(path, "its first page is not that of a database"));
  }
  if (code == SQLITE_NOTADB) {
    throw InputError(fmt::format("'{}' is not a results database of assay: give another directory", path));
  }
  // The statements are constant, so one that fails in itself met another schema than the one that was written.
  if (code == SQLITE_CORRUPT || (code == SQLITE_ERROR && looks_like_results(path))) {
    throw InputError(damaged_text(path, message));
  }
  rlimit limit{};
  const bool may_be_limit = why == EFBIG || (code == SQLITE_IOERR && why == 0);  // SQLite does not always keep it
  if (may_be_limit && ::getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
    throw SystemError(
        fmt::format("cannot write '{}': this shell lets a file have at most {} KiB; what was finished is kept: raise "
                    "the limit (ulimit "
                    "-f unlimited), and give the command again",
                    path, limit.rlim_cur >> 10U));
  }
  throw SystemError(
      fmt::format("cannot use '{}': {}{}", path, message, why != 0 ? fmt::format(" ({})", std::strerror(why)) : ""));
}

void execute(sqlite3* db, const char* sql) {
  if (sqlite3_exec(db, sql, nullptr, nullptr, nullptr) != SQLITE_OK) fail(db);
}

std::int64_t pragma(sqlite3* db, const std::string& name) {
  Statement statement(db, "PRAGMA " + name);
  return statement.step() ? statement.integer(0) : 0;
}

bool has_table(sqlite3* db, const std::string& name) {
  // As SQLite finds it: it reads over a bit in the type or the name of a table's entry.
  return sqlite3_table_column_metadata(db, "main", name.c_str(), nullptr, nullptr, nullptr, nullptr, nullptr,
                                       nullptr) == SQLITE_OK;
}

void Statement::append_to(std::string& bytes, int column) const {
  const auto append = [&](char type, const void* from, size_t size) {
    bytes += type;
    bytes.append(static_cast<const char*>(from), size);
  };
  switch (sqlite3_column_type(statement_, column)) {
    case SQLITE_NULL:
      bytes += 'n';
      break;
    case SQLITE_INTEGER: {
      const std::int64_t value = integer(column);
      append('i', &value, sizeof value);
      break;
    }
    case SQLITE_FLOAT: {
      const double value = number(column);
      append('f', &value, sizeof value);
      break;
    }
    default: {
      const std::string value = text(column);
      const std::uint64_t size = value.size();
      // One bit of a row's header turns a text into a blob of the same bytes, which is equal to no text.
      append(sqlite3_column_type(statement_, column) == SQLITE_BLOB ? 'b' : 't', &size, sizeof size);
      bytes += value;
    }
  }
}

std::string damaged_text(const std::string& path, const std::string& what) {
  return fmt::format("'{}' is damaged ({}): restore it from a copy, or measure again into another directory", path,
                     what);
}

bool looks_like_results(const std::string& path) {
  // The schema's text lies in the first pages.
  std::string bytes(1 << 17, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<size_t>(file.gcount()));
  return bytes.find("CREATE TABLE cells(") != std::string::npos &&
         bytes.find("CREATE TABLE samples(") != std::string::npos;
}

namespace {

using Clock = std::chrono::steady_clock;

int is_over(void* end) { return Clock::now() >= *static_cast<const Clock::time_point*>(end) ? 1 : 0; }

// Within a long statement: ends it after some seconds.
class TimeLimit {
 public:
  TimeLimit(sqlite3* db, double seconds)
      : db_(db),
        end_(Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds))) {
    constexpr int kInstructions = 1000;
    sqlite3_progress_handler(db_, kInstructions, is_over, &end_);
  }
  ~TimeLimit() { sqlite3_progress_handler(db_, 0, nullptr, nullptr); }
  TimeLimit(const TimeLimit&) = delete;
  TimeLimit& operator=(const TimeLimit&) = delete;

 private:
  sqlite3* db_;
  Clock::time_point end_;
};

}  // namespace

void check_integrity(sqlite3* db, const std::string& path, double seconds, const std::string& false_alarm) {
  // Once for each state of the file: a command may open it several times.
  static std::set<std::string> checked;
  struct stat facts{};
  std::string state;
  if (::stat(path.c_str(), &facts) == 0) {
    state =
        fmt::format("{} {} {} {}.{}", path, facts.st_ino, facts.st_size, facts.st_mtim.tv_sec, facts.st_mtim.tv_nsec);
    if (checked.contains(state)) return;
  }
  const TimeLimit limit(db, seconds);
  std::vector<std::string> found;
  sqlite3_stmt* check = nullptr;
  if (sqlite3_prepare_v2(db, "PRAGMA integrity_check(100000)", -1, &check, nullptr) != SQLITE_OK) fail(db);
  int code = SQLITE_OK;
  while ((code = sqlite3_step(check)) == SQLITE_ROW) {
    const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(check, 0));
    const std::string line = bytes == nullptr ? "" : bytes;
    if (line != "ok" && line != false_alarm) found.push_back(line);
  }
  sqlite3_finalize(check);
  if (found.empty() && (code == SQLITE_DONE || code == SQLITE_INTERRUPT)) {
    if (!state.empty()) checked.insert(state);
    return;
  }
  if (found.empty()) fail(db);
  std::string what = found.front();
  for (char& c : what) {
    if (c == '\n') c = ' ';
  }
  if (found.size() > 1) what += fmt::format("; {} more", found.size() - 1);
  throw InputError(damaged_text(path, what));
}

}  // namespace assay::sql
