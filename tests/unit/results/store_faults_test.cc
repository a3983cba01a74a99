// What goes wrong with a results directory on a disk: bits that change, a power cut, files that are swapped or forged,
// results of an older program. Whatever it is, nothing wrong is read.
#include "store_faults.h"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <random>
#include <sstream>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "base/errors.h"
#include "base/hash.h"
#include "message_of.h"
#include "reliability.h"
#include "results/store/merge.h"
#include "results/store/references.h"
#include "results/store/store.h"
#include "results/store/trajectory.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

// ---- damage ---------------------------------------------------------------------------------------------------------

// One bit anywhere in the file: it is found, or nothing that is read has changed.
TEST_F(StoreFaultsTest, ABitThatChangesIsFoundOrChangesNothing) {
  fill(dir(), 30, 40);
  const fs::path path = fs::path(dir()) / "assay.sqlite";
  const std::string whole = bytes_of(path), before = content_of(Store::open(dir()));
  constexpr int kTries = 400;
  const unsigned seed = std::random_device{}();
  std::mt19937 random(seed);
  int found = 0;
  for (int i = 0; i < kTries; ++i) {
    std::string damaged = whole;
    const size_t at = std::uniform_int_distribution<size_t>(0, whole.size() - 1)(random);
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << std::uniform_int_distribution<int>(0, 7)(random)));
    write_bytes(path, damaged);
    std::string says;
    try {
      const std::string now = content_of(Store::open(dir()));
      EXPECT_EQ(now, before) << "byte " << at << ", seed " << seed;
    } catch (const InputError& error) {
      ++found;
      says = error.what();
    }
    if (says.empty()) continue;
    EXPECT_THAT(says, HasSubstr(path.string())) << "byte " << at;
  }
  EXPECT_GT(found, kTries / 5) << "seed " << seed;
  reliability("a bit of the database changes, anywhere", kTries,
              "a sentence that says where, or the bit is one that nothing reads", "nothing wrong is read");
}

// One bit makes the name of a table's entry bytes instead of text: SQLite still reads the table.
TEST_F(StoreFaultsTest, ATablesNameAsBytesLosesNoRows) {
  fill(dir(), 3, 4);
  const std::string before = content_of(Store::open(dir()));
  for (const char* table : {"nodes", "plan", "runs", "scenes"}) {
    change(
        dir(),
        fmt::format("PRAGMA writable_schema = 1; UPDATE sqlite_schema SET name = CAST(name AS BLOB) WHERE name = '{}'",
                    table));
    EXPECT_EQ(content_of(Store::open(dir())), before) << table;
  }
}

// In a value, a sample, a fact: what SQLite itself cannot know.
TEST_F(StoreFaultsTest, AChangedValueIsNamed) {
  const std::vector<std::pair<const char*, const char*>> changes = {
      {"UPDATE \"values\" SET value = value * 1.0001 WHERE cell_id = 3 AND name = 'consistency'",
       "1 of 5 cells is not what was written, the first is consistency of chain, ode-quick at 3 ms"},
      {"UPDATE cells SET outcome = 'unstable' WHERE id = 2", "1 of 5 cells"},
      {"UPDATE cells SET timestep_ms = 0 WHERE id = 2", "1 of 5 cells"},
      {"DELETE FROM \"values\" WHERE cell_id IN (2, 3)", "2 of 5 cells are"},
      {"UPDATE samples SET value = value + 1e-9 WHERE cell_id = 4 AND idx = 2", "the samples of the cell 4"},
      {"UPDATE systems SET json = '{}'", "the table 'systems'"},
      {"UPDATE manifest SET value = 'y' WHERE key = 'cpu'", "the table 'manifest'"},
      {"UPDATE runs SET address = 'def'", "the table 'runs'"},
      {"UPDATE conformance SET status = 'fail'", "the table 'conformance'"},
      {R"(UPDATE nodes SET json = '{"name": "two"}')", "the table 'nodes'"},
      {"UPDATE plan SET shard = 3 WHERE key = 'key0001'", "the table 'plan'"},
      {"DELETE FROM plan WHERE key = 'key0001'", "the table 'plan'"}};
  for (const auto& [sql, says] : changes) {
    fs::remove_all(dir());
    fill(dir(), 5, 5);
    change(dir(), sql);
    EXPECT_THAT(message_of<InputError>([&] { content_of(Store::open(dir())); }),
                AllOf(HasSubstr("is damaged"), HasSubstr(says)))
        << sql;
  }
  reliability("values, samples, outcomes and facts are changed behind the database's back",
              static_cast<int>(changes.size()), "a sentence that names the cell or the table", "nothing wrong is read");
}

TEST_F(StoreFaultsTest, DamagedCellsCanBeMeasuredAgain) {
  fill(dir(), 5, 5);
  change(dir(), "UPDATE \"values\" SET value = 7 WHERE cell_id = 3 AND name = 'consistency'");
  Store store = Store::create(dir(), kCampaign);
  EXPECT_THAT(message_of<InputError>([&] { store.cells(); }), HasSubstr("--retry"));
  EXPECT_THAT(store.remove_damaged_cells(), ElementsAre("consistency of chain, ode-quick at 3 ms"));
  EXPECT_THAT(store.cells(), SizeIs(4));
  EXPECT_THAT(store.remove_damaged_cells(), SizeIs(0));
}

// Cells are sound without them.
TEST_F(StoreFaultsTest, CellsOfDamagedSamplesCanBeMeasuredAgain) {
  fill(dir(), 5, 5);
  change(
      dir(),
      "UPDATE samples SET value = value + 1e-9 WHERE cell_id = 4 AND idx = 2; DELETE FROM samples WHERE cell_id = 2");
  {
    Store store = Store::create(dir(), kCampaign);
    EXPECT_THAT(store.cells(), SizeIs(5));
    EXPECT_THAT(store.remove_damaged_cells(),
                ElementsAre("consistency of chain, ode-quick at 2 ms", "consistency of chain, ode-quick at 4 ms"));
    EXPECT_THAT(store.remove_damaged_cells(), SizeIs(0));
  }
  EXPECT_THAT(content_of(Store::open(dir())), Not(HasSubstr("key0001 chain")));
}

// What is written beside damage does not make it right.
TEST_F(StoreFaultsTest, ADamagedTableIsNotAddedTo) {
  fill(dir(), 2, 2);
  change(dir(),
         "UPDATE nodes SET json = '{}'; UPDATE conformance SET status = 'fail'; UPDATE manifest SET value = 'y' WHERE "
         "key = 'cpu'");
  const std::vector<std::pair<const char*, std::function<void(Store&)>>> writers = {
      {"the table 'nodes'", [](Store& store) { store.set_node({"other", "{}"}); }},
      {"the table 'conformance'",
       [](Store& store) { store.set_conformance("other", {{"", "free-fall", "pass", 1e-6, 1e-5, "m", ""}}); }}};
  EXPECT_THAT(message_of<InputError>([&] { Store::create(dir(), kCampaign); }), HasSubstr("the table 'manifest'"));
  change(dir(), "UPDATE manifest SET value = 'x' WHERE key = 'cpu'");
  for (const auto& writer : writers) {
    EXPECT_THAT(message_of<InputError>([&] {
                  Store store = Store::create(dir(), kCampaign);
                  writer.second(store);
                }),
                AllOf(HasSubstr("is damaged"), HasSubstr(writer.first)));
    EXPECT_THAT(message_of<InputError>([&] { content_of(Store::open(dir())); }), HasSubstr("is damaged"));
  }
}

// Results of before have no hash of the plan.
TEST_F(StoreFaultsTest, APlanWithoutAHashIsRead) {
  fill(dir(), 5, 5);
  const std::string before = content_of(Store::open(dir()));
  change(dir(), "DELETE FROM hashes WHERE name = 'plan'");
  EXPECT_EQ(content_of(Store::open(dir())), before);
  merge_results({dir()}, dir("union"), {}, {}, {});
  EXPECT_THAT(asked(dir("union"), "SELECT name FROM hashes"), HasSubstr("plan;"));
}

TEST_F(StoreFaultsTest, ADamagedHeaderIsDamageAndNotAnotherProgramsFile) {
  fill(dir(), 5, 5);
  const fs::path path = fs::path(dir()) / "assay.sqlite";
  const std::string whole = bytes_of(path);
  for (const size_t at : {size_t{3}, size_t{70}}) {  // SQLite's own mark, the application's
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    write_bytes(path, damaged);
    EXPECT_THAT(message_of<InputError>([&] { Store::open(dir()); }), HasSubstr("is damaged")) << at;
  }
}

TEST_F(StoreFaultsTest, SQLitesIntegrityCheckFindsNothingInASoundOne) {
  fill(dir(), 5, 5);
  EXPECT_EQ(asked(dir(), "PRAGMA integrity_check"), "ok;");
}

TEST_F(StoreFaultsTest, ATimestepThatCannotBeIsRefused) {
  for (const double timestep : {0.0, -1.0}) {
    fs::remove_all(dir());
    Cell cell = numbered_cell(1);
    cell.timestep_ms = timestep;
    Store::create(dir(), kCampaign).put_cell(cell);
    EXPECT_THAT(message_of<InputError>([&] { Store::open(dir()).cells(); }), HasSubstr("cannot be"));
    Store::create(dir(), kCampaign).set_runs({{"abc", "chain", "ode-quick", timestep}});
    EXPECT_THAT(message_of<InputError>([&] { Store::open(dir()).runs(); }), HasSubstr("cannot be"));
  }
}

// ---- results of version 1 -------------------------------------------------------------------------------------------

// As version 0.1 wrote them.
void make_version_1(const std::string& dir, bool with_runs) {
  fill(dir, 3, 4);
  change(dir,
         "CREATE TABLE c AS SELECT id, key, system, contender, timestep_ms, measure, outcome, reason, wall_s, cpu_s, "
         "engine_s, steal, started, finished FROM cells; PRAGMA foreign_keys = OFF; DROP TABLE cells; CREATE TABLE "
         "cells(id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, system TEXT NOT NULL, contender TEXT NOT NULL, "
         "timestep_ms REAL NOT NULL, measure TEXT NOT NULL, outcome TEXT NOT NULL, reason TEXT NOT NULL, wall_s REAL, "
         "cpu_s REAL, engine_s REAL, steal REAL, started REAL, finished REAL); INSERT INTO cells SELECT * FROM c; DROP "
         "TABLE c; DROP TABLE hashes; DROP TABLE nodes; DROP TABLE plan; DROP TABLE runs; PRAGMA user_version = 1");
  if (with_runs) {
    change(dir,
           "CREATE TABLE runs(address TEXT NOT NULL, system TEXT NOT NULL, contender TEXT NOT NULL, timestep_ms REAL "
           "NOT NULL, PRIMARY KEY(system, contender, timestep_ms)) WITHOUT ROWID; INSERT INTO runs VALUES('abc', "
           "'chain', 'ode-quick', 1)");
  } else {
    change(dir, "DROP TABLE scenes");
  }
}

TEST_F(StoreFaultsTest, ResultsOfVersion1AreReadAsTheyAreAndBecomeVersion2WhenWritten) {
  for (const bool with_runs : {true, false}) {
    fs::remove_all(dir());
    make_version_1(dir(), with_runs);
    const std::string bytes = bytes_of(fs::path(dir()) / "assay.sqlite");
    const std::string before = content_of(Store::open(dir()));
    EXPECT_THAT(before, HasSubstr("key0002"));
    EXPECT_EQ(bytes_of(fs::path(dir()) / "assay.sqlite"), bytes) << "reading changes nothing";
    EXPECT_THAT(message_of<InputError>([&] { Store::create(dir(), {"other", "0123"}); }), HasSubstr("other"));
    EXPECT_EQ(asked(dir(), "PRAGMA user_version"), "1;") << "refused results stay as they are";
    EXPECT_EQ(content_of(Store::create(dir(), kCampaign)), before);
    EXPECT_EQ(asked(dir(), "PRAGMA user_version"), "2;");
    EXPECT_EQ(asked(dir(), "PRAGMA integrity_check"), "ok;");
    EXPECT_EQ(content_of(Store::open(dir())), before);
    change(dir(), "UPDATE \"values\" SET value = 7 WHERE cell_id = 3 AND name = 'consistency'");
    EXPECT_THAT(message_of<InputError>([&] { Store::open(dir()).cells(); }), HasSubstr("is damaged"))
        << "hashes were made";
  }
}

// ---- a damaged write-ahead log --------------------------------------------------------------------------------------

// Cells as they were written, however many of them; else nothing.
void expect_nothing_wrong(const Store& store, const std::string& campaign_text, int samples) {
  const std::vector<Cell> cells = store.cells();
  for (const Cell& cell : cells) {
    const int number = static_cast<int>(cell.timestep_ms) - 1;
    EXPECT_EQ(cell.key, numbered_cell(number).key);
    EXPECT_EQ(cell.values.at(0).value, 1e-5 * (1 + number));
    EXPECT_EQ(store.samples(cell.id).at(0).values, numbered_samples(number, samples).at(0).values);
  }
  if (cells.empty()) return;  // what comes before the cells is as it was
  std::string text;
  for (const SystemRow& row : store.systems()) text += row.name + row.json;
  for (const SceneRow& row : store.scenes()) text += row.system + row.json;
  EXPECT_EQ(text, campaign_text);
}

TEST_F(StoreFaultsTest, ADamagedWriteAheadLogGivesNothingWrong) {
  constexpr int kCells = 40, kSamples = 20, kTries = 200;
  const pid_t child = ::fork();
  if (child == 0) {
    Store store = Store::create(dir(), kCampaign);
    store.set_systems({{"chain", R"({"dof": 5})"}});
    store.set_scenes({{"chain", "{}"}});
    for (int i = 0; i < kCells; ++i) store.put_cell(numbered_cell(i), numbered_samples(i, kSamples));
    ::raise(SIGKILL);
  }
  ::waitpid(child, nullptr, 0);
  const std::string base = bytes_of(fs::path(dir()) / "assay.sqlite"),
                    log = bytes_of(fs::path(dir()) / "assay.sqlite-wal");
  ASSERT_GT(log.size(), 10000U) << "a killed process leaves its log";
  EXPECT_THAT(Store::open(dir()).cells(), SizeIs(kCells));
  const unsigned seed = std::random_device{}();
  std::mt19937 random(seed);
  int fewer = 0, sentences = 0;
  for (int i = 0; i < kTries; ++i) {
    std::string damaged = log;
    const size_t at = std::uniform_int_distribution<size_t>(0, log.size() - 1)(random);
    if (i % 3 == 0) {
      damaged.resize(at);
    } else {
      damaged[at] = static_cast<char>(damaged[at] ^ (1 << std::uniform_int_distribution<int>(0, 7)(random)));
    }
    SCOPED_TRACE(fmt::format("byte {}, {}, seed {}", at, i % 3 == 0 ? "cut off" : "a bit", seed));
    fs::remove_all(dir("copy"));
    fs::create_directories(dir("copy"));
    write_bytes(fs::path(dir("copy")) / "assay.sqlite", base);
    write_bytes(fs::path(dir("copy")) / "assay.sqlite-wal", damaged);
    try {
      const Store store = Store::open(dir("copy"));
      expect_nothing_wrong(store, R"(chain{"dof": 5}chain{})", kSamples);
      fewer += store.cells().size() < kCells ? 1 : 0;
    } catch (const InputError& error) {
      ++sentences;
      EXPECT_THAT(std::string(error.what()), HasSubstr("assay.sqlite"));
    }
    Store again = Store::create(dir("copy"), kCampaign);  // the same command goes on
    expect_nothing_wrong(again, R"(chain{"dof": 5}chain{})", kSamples);
    again.put_cell(numbered_cell(kCells), numbered_samples(kCells, kSamples));
  }
  EXPECT_GT(fewer + sentences, kTries / 2) << "seed " << seed;
  reliability("a bit of the write-ahead log of a killed run changes, or the log is cut off", kTries,
              "nothing wrong is read; the same command goes on", "cells that were only in the damaged part of the log");
}

// ---- what is no part of results ------------------------------------------------------------------------------------

TEST_F(StoreFaultsTest, WhatAssayDoesNotMakeIsRefusedByName) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> changes = {
      {"CREATE TRIGGER x AFTER INSERT ON cells BEGIN DELETE FROM cells; END", {"the trigger 'x'", "DROP TRIGGER"}},
      {"CREATE VIEW x AS SELECT * FROM cells", {"the view 'x'", "DROP VIEW"}},
      {"CREATE TABLE x(a)", {"the table 'x'", "DROP TABLE"}},
      {"CREATE INDEX x ON cells(abs(timestep_ms))", {"the index 'x'", "DROP INDEX"}},
      {"CREATE VIRTUAL TABLE x USING rtree(a, b, c)", {"the virtual table 'x'", "DROP TABLE"}},
      {"DROP TABLE scenes; CREATE VIEW scenes AS SELECT name AS system, json FROM systems", {"the view 'scenes'"}},
      {"ALTER TABLE cells ADD COLUMN x AS (length(zeroblob(1000000000)))", {"'cells'", "a column 'x'"}},
      {"ALTER TABLE cells ADD COLUMN x TEXT", {"'cells'", "a column 'x'"}},
      {"DROP TABLE plan; CREATE TABLE plan(key TEXT PRIMARY KEY, shard INTEGER NOT NULL, cost_s REAL NOT NULL, "
       "accuracy "
       "INTEGER NOT NULL CHECK(randomblob(1000000000) IS NOT NULL)) WITHOUT ROWID",
       {"'plan'", "types, keys, checks or defaults"}}};
  for (const auto& [sql, says] : changes) {
    SCOPED_TRACE(sql);
    fs::remove_all(dir());
    fill(dir(), 3, 3);
    change(dir(), sql);
    for (const std::string& text :
         {message_of<InputError>([&] { Store::open(dir()); }),
          message_of<InputError>([&] { Store::create(dir(), kCampaign); }),
          message_of<InputError>([&] { merge_results({dir()}, dir("union"), {}, {}, {}); })}) {
      EXPECT_THAT(text, AllOf(HasSubstr("assay.sqlite"), HasSubstr("that assay does not make")));
      for (const std::string& part : says) EXPECT_THAT(text, HasSubstr(part));
    }
  }
  reliability(
      "a results database has triggers, views, indexes, virtual tables, generated columns, checks or other tables",
      static_cast<int>(changes.size()) * 3, "refused by name; nothing of it is run", "nothing");
}

// Whoever gets past the check of the schema.
TEST_F(StoreFaultsTest, TriggersThatComeLaterAreNotRun) {
  fill(dir(), 3, 3);
  Store store = Store::create(dir(), kCampaign);
  change(dir(), "CREATE TRIGGER x AFTER INSERT ON cells BEGIN DELETE FROM cells; END");
  store.put_cell(numbered_cell(7), numbered_samples(7, 3));
  EXPECT_THAT(store.cells(), SizeIs(4));
}

TEST_F(StoreFaultsTest, AValueThatIsTooLongNamesItsTable) {
  constexpr const char* kLong = "zeroblob(80000000)";
  const std::vector<std::pair<std::string, std::string>> changes = {
      {"UPDATE systems SET json = ", "'systems'"},
      {"UPDATE cells SET reason = ", "'cells'"},
      {"UPDATE samples SET value = ", "'samples'"},
      {"UPDATE conformance SET note = ", "'conformance'"},
  };
  for (const auto& [sql, table] : changes) {
    SCOPED_TRACE(sql);
    fs::remove_all(dir());
    fs::remove_all(dir("union"));
    fill(dir(), 1, 1);
    change(dir(), sql + kLong);
    const auto says = AllOf(HasSubstr(dir() + "/assay.sqlite' is damaged"), HasSubstr(table), HasSubstr("64 MiB"));
    EXPECT_THAT(message_of<InputError>([&] { content_of(Store::open(dir())); }), says);
    EXPECT_THAT(message_of<InputError>([&] { merge_results({dir()}, dir("union"), {}, {}, {}); }), says);
  }
  reliability("a value of 80 MB in a results database", static_cast<int>(changes.size()) * 2,
              "a sentence that names the table", "nothing wrong is read");
}

TEST_F(StoreFaultsTest, AValueThatIsTooLongIsNotWritten) {
  Store store = Store::create(dir(), kCampaign);
  Cell cell = numbered_cell(1);
  cell.reason.assign(size_t{65} << 20, 'x');
  EXPECT_THAT(message_of<SystemError>([&] { store.put_cell(cell); }), HasSubstr("more than 64 MiB"));
  store.put_cell(numbered_cell(2));
  EXPECT_THAT(store.cells(), SizeIs(1));
}

TEST_F(StoreFaultsTest, FilesBesideTheDatabaseThatAreNoFilesAreRefusedByName) {
  int tries = 0;
  fs::create_directories(dir_);
  write_bytes(dir_ / "victim", "mine");
  for (const char* name : {"assay.sqlite-journal", "assay.sqlite-wal", "assay.sqlite-shm", ".lock"}) {
    const fs::path path = fs::path(dir()) / name;
    const std::vector<std::pair<std::string, std::function<void()>>> others = {
        {"a named pipe", [&] { ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0); }},
        {"a symbolic link", [&] { fs::create_symlink("/dev/zero", path); }},
        {"a symbolic link", [&] { fs::create_symlink(dir_ / "victim", path); }},
        {"a symbolic link", [&] { fs::create_symlink(dir_ / "made", path); }},
        {"a directory", [&] { fs::create_directory(path); }}};
    for (const auto& [what, make] : others) {
      SCOPED_TRACE(fmt::format("{} is {}", name, what));
      fs::remove_all(dir());
      fill(dir(), 2, 2);
      fs::remove(path);
      make();
      const auto says = AllOf(HasSubstr(path.string()), HasSubstr(what), HasSubstr("remove it"));
      EXPECT_THAT(message_of<InputError>([&] { Store::open(dir()); }), says);
      EXPECT_THAT(message_of<InputError>([&] { Store::create(dir(), kCampaign); }), says);
      EXPECT_THAT(message_of<InputError>([&] { merge_results({dir()}, dir("union"), {}, {}, {}); }), says);
      EXPECT_FALSE(Store::is_written(dir()));
      tries += 3;
    }
  }
  EXPECT_EQ(bytes_of(dir_ / "victim"), "mine");
  EXPECT_FALSE(fs::exists(dir_ / "made"));
  reliability("a pipe, a device, a link or a folder in place of the database's log, journal, index or lock", tries,
              "one sentence that names it", "nothing");
}

TEST_F(StoreFaultsTest, NothingIsWrittenThroughLinksOfAResultsFolder) {
  fs::create_directories(dir());
  fs::create_symlink(dir_ / "elsewhere.sqlite", fs::path(dir()) / "assay.sqlite");
  EXPECT_THAT(message_of<InputError>([&] { Store::create(dir(), kCampaign); }), HasSubstr("a symbolic link"));
  EXPECT_FALSE(fs::exists(dir_ / "elsewhere.sqlite"));
  fs::remove(fs::path(dir()) / "assay.sqlite");
  fs::create_directories(dir_ / "elsewhere");
  fs::create_symlink(dir_ / "elsewhere", fs::path(dir()) / "trajectories");
  EXPECT_THAT(message_of<InputError>([&] { Store::create(dir(), kCampaign); }),
              AllOf(HasSubstr("trajectories' is a symbolic link"), HasSubstr("put the folder there")));
}

// SQLite removes the file that the end of such a journal names, when it has rolled back.
TEST_F(StoreFaultsTest, AJournalRemovesNoOtherFile) {
  fill(dir(), 2, 2);
  change(dir(), "PRAGMA journal_mode = DELETE");
  const fs::path victim = dir_ / "victim", journal = fs::path(dir()) / "assay.sqlite-journal";
  write_bytes(victim, "mine");
  const std::string magic = "\xd9\xd5\x05\xf9\x20\xa1\x63\xd7", name = victim.string();
  std::string bytes = magic;
  const auto put = [&](std::uint32_t number) {
    for (const int shift : {24, 16, 8, 0}) bytes += static_cast<char>(number >> shift & 0xffU);
  };
  const auto pages = static_cast<std::uint32_t>(fs::file_size(fs::path(dir()) / "assay.sqlite") / 4096);
  for (const std::uint32_t number : {0U, 1U, pages, 512U, 4096U}) put(number);  // of a journal without pages
  bytes.resize(512);
  std::uint32_t sum = 0;
  for (const char c : name) sum += static_cast<std::uint32_t>(static_cast<int>(c));
  constexpr std::uint32_t kPendingByte = 0x40000000;
  put(kPendingByte / 4096 + 1);
  bytes += name;
  put(static_cast<std::uint32_t>(name.size()));
  put(sum);
  bytes += magic;
  write_bytes(journal, bytes);
  for (const std::string& text : {message_of<InputError>([&] { content_of(Store::open(dir())); }),
                                  message_of<InputError>([&] { Store::create(dir(), kCampaign); })}) {
    EXPECT_THAT(text, AllOf(HasSubstr(journal.string()), HasSubstr("remove it")));
  }
  EXPECT_TRUE(fs::exists(victim));
}

}  // namespace
}  // namespace assay
