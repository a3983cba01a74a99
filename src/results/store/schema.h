// What a results database consists of (store.h says what it means), and whether one consists of nothing else. Internal
// to src/store.
#pragma once

#include <cstdint>
#include <string>

#include <sqlite3.h>

namespace assay::sql {

// The tables of version kSchemaVersion, in an empty database.
void create_tables(sqlite3* db);

// The same from those of version 1. Hashes are the caller's.
void migrate_tables(sqlite3* db);

// Whether the manifest is there and is a table of assay, so that reading it runs no code of the database.
bool has_manifest(sqlite3* db);

// Throws InputError, which ends the sentence with `writer`, for a database of this version with a table or column
// missing, or with anything that assay does not make: triggers, views, indexes, virtual tables, generated columns,
// other tables, checks or defaults. Nothing of it is run.
void check_schema(sqlite3* db, const std::string& path, std::int64_t version, const std::string& writer);

}  // namespace assay::sql
