// Results directories.
#include "results/results.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include <nlohmann/json.hpp>
#include <sqlite3.h>

#include "base/errors.h"
#include "base/hash.h"
#include "report/report.h"
#include "results/compare/compare.h"
#include "results/store/cell_hash.h"
#include "results/store/merge.h"
#include "results/store/scene.h"
#include "results/store/store.h"
#include "results/store/trajectory.h"
#include "run/coordinator/run.h"
#include "targets.h"

namespace assay::fuzz {
namespace {

namespace fs = std::filesystem;

using Database = std::unique_ptr<sqlite3, int (*)(sqlite3*)>;

// Everything that commands read of a results directory.
void read_results(const std::string& dir) {
  try {
    const Store store = Store::open(dir);
    for (const SceneRow& row : store.scenes()) {
      try {
        parse_scene(row.json);
      } catch (const InputError&) {  // NOLINT(bugprone-empty-catch): a refusal
      }
    }
    store.runs();
    store.nodes();
    report_html(report_data(store));
    comparison_json(compare(store, store, CompareOptions{}));
  } catch (const InputError&) {   // NOLINT(bugprone-empty-catch)
  } catch (const SystemError&) {  // NOLINT(bugprone-empty-catch)
  }
}

// As `assay merge` does, into a union of its own.
void unite(const std::string& dir) {
  const std::string out = scratch() + "/union";
  fs::remove_all(out);
  try {
    merge_results({dir}, out, derived_values(), {}, [](Store& merged) { derive_values(merged); });
  } catch (const InputError&) {   // NOLINT(bugprone-empty-catch)
  } catch (const SystemError&) {  // NOLINT(bugprone-empty-catch)
  }
}

std::string folder() {
  const std::string dir = scratch() + "/results";
  fs::create_directories(dir);
  return dir;
}

// A database that assay has written.
const std::string& seed() {
  static const std::string bytes = [] {
    std::ifstream file(ASSAY_FUZZ_SEED, std::ios::binary);
    std::string all((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    if (all.empty()) std::abort();
    return all;
  }();
  return bytes;
}

// No other file than this one, and an end after a while.
int authorize(void* /*nothing*/, int action, const char* what, const char* /*b*/, const char* /*c*/,
              const char* /*d*/) {
  const bool other_file = action == SQLITE_ATTACH || action == SQLITE_DETACH;
  const std::string name = what == nullptr ? "" : what;
  const bool elsewhere = action == SQLITE_PRAGMA && name.find("directory") != std::string::npos;
  return other_file || elsewhere ? SQLITE_DENY : SQLITE_OK;
}
int enough(void* /*nothing*/) { return 1; }

// Hashes that say that what is there was written so.
void forge_hashes(sqlite3* db) {
  for (const auto& [table, order] : sql::hashed_tables()) sql::put_table_hash(db, table);
  sql::Statement query(db, "SELECT id FROM cells");
  std::vector<std::int64_t> cells;
  while (query.step()) cells.push_back(query.integer(0));
  sql::CellHasher hasher(db);
  for (const std::int64_t id : cells) {
    hasher.put_samples_hash(id);
    hasher.put_cell_hash(id);
  }
}

}  // namespace

void read_store(std::string_view bytes) {
  const std::string dir = folder();
  for (const char* rest : {"assay.sqlite-wal", "assay.sqlite-shm", "assay.sqlite-journal"})
    fs::remove(dir + "/" + rest);
  write_file("results/assay.sqlite", bytes);
  read_results(dir);
}

void read_rows(std::string_view bytes) {
  const std::string dir = folder();
  for (const char* rest : {"assay.sqlite-wal", "assay.sqlite-shm", "assay.sqlite-journal"})
    fs::remove(dir + "/" + rest);
  const std::string path = write_file("results/assay.sqlite", seed());
  {
    sqlite3* opened = nullptr;
    if (sqlite3_open_v2(path.c_str(), &opened, SQLITE_OPEN_READWRITE, nullptr) != SQLITE_OK) std::abort();
    const Database db(opened, sqlite3_close_v2);
    constexpr int kInstructions = 100000, kMostBytes = 1 << 20;
    sqlite3_limit(opened, SQLITE_LIMIT_LENGTH, kMostBytes);
    sqlite3_set_authorizer(opened, authorize, nullptr);
    sqlite3_progress_handler(opened, kInstructions, enough, nullptr);
    sqlite3_exec(opened, "PRAGMA journal_mode = DELETE", nullptr, nullptr, nullptr);
    sqlite3_exec(opened, std::string(bytes).c_str(), nullptr, nullptr, nullptr);
    sqlite3_progress_handler(opened, 0, nullptr, nullptr);
    sqlite3_exec(opened, "COMMIT", nullptr, nullptr, nullptr);
    try {
      forge_hashes(opened);
    } catch (const InputError&) {   // NOLINT(bugprone-empty-catch): what is left is read all the same
    } catch (const SystemError&) {  // NOLINT(bugprone-empty-catch)
    }
  }
  read_results(dir);
  unite(dir);
}

void read_trajectory(std::string_view bytes) {
  const std::string dir = scratch(), address = "a";
  write_file(address + ".bin", std::string(bytes) + content_hash(bytes));
  try {
    const std::string fault = trajectory_fault(dir, address);
    const auto trajectory = assay::read_trajectory(dir, address);
    if (trajectory.has_value() && fault.empty() && trajectory->states.size() > bytes.size()) std::abort();
    count_states(dir, address);
  } catch (const SystemError&) {  // NOLINT(bugprone-empty-catch)
  }
}

}  // namespace assay::fuzz
