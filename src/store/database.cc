#include "store/database.h"

#include <cctype>
#include <cstring>

#include <fmt/format.h>

#include "base/errors.h"

namespace assay::sql {

sqlite3* open_database(const std::string& path, int flags) {
  sqlite3* db = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &db, flags, nullptr);
  if (code != SQLITE_OK && db == nullptr) throw SystemError(fmt::format("cannot open '{}': out of memory", path));
  sqlite3_busy_timeout(db, 10000);
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

void fail(sqlite3* db) {
  const std::string path = sqlite3_db_filename(db, "main");
  const int code = sqlite3_errcode(db) & 0xff;
  if (code == SQLITE_FULL) {
    throw SystemError(fmt::format("cannot write '{}': the disk is full; what was finished is kept", path));
  }
  if (code == SQLITE_NOTADB) {
    throw InputError(fmt::format("'{}' is not a results database of assay: give another directory", path));
  }
  if (code == SQLITE_CORRUPT) {
    throw InputError(
        fmt::format("'{}' is damaged ({}): restore it from a copy, or measure again into another directory", path,
                    sqlite3_errmsg(db)));
  }
  const int why = sqlite3_system_errno(db);
  throw SystemError(fmt::format("cannot use '{}': {}{}", path, sqlite3_errmsg(db),
                                why != 0 ? fmt::format(" ({})", std::strerror(why)) : ""));
}

void execute(sqlite3* db, const char* sql) {
  if (sqlite3_exec(db, sql, nullptr, nullptr, nullptr) != SQLITE_OK) fail(db);
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

}  // namespace assay::sql
