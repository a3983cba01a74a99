// What goes wrong with a results directory on a disk: bits that change, a power cut, files that are swapped or forged,
// results of an older program. Whatever it is, nothing wrong is read.
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
#include "reliability.h"
#include "results/store/merge.h"
#include "results/store/references.h"
#include "results/store/store.h"
#include "results/store/trajectory.h"
#include "temp_folder.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

const Identity kCampaign = {"faults", "0123"};

std::string bytes_of(const fs::path& path) {
  std::ostringstream content;
  content << std::ifstream(path, std::ios::binary).rdbuf();
  return content.str();
}

void write_bytes(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

template <typename Error>
std::string text_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "(nothing was thrown)";
}

Cell numbered_cell(int number) {
  Cell cell;
  cell.key = fmt::format("key{:04}", number);
  cell.system = "chain";
  cell.contender = "ode-quick";
  cell.timestep_ms = 1 + number;
  cell.measure = "consistency";
  cell.wall_s = 0.5 * number;
  cell.values = {{"consistency", "m", 1e-5 * (1 + number), 0.9e-5, 1.1e-5}, {"restart_floor", "m", {}, {}, {}}};
  return cell;
}

std::vector<SampleSeries> numbered_samples(int number, int count) {
  SampleSeries series = {"piece_error_m", {}};
  for (int i = 0; i < count; ++i) series.values.push_back(0.001 * i + number);
  return {series};
}

// Everything that can be read, as a text.
std::string content_of(const Store& store) {
  std::string text;
  for (const auto& [key, value] : store.manifest()) text += fmt::format("{}={}\n", key, value);
  for (const SystemRow& row : store.systems()) text += row.name + row.json + "\n";
  for (const ContenderRow& row : store.contenders())
    text += row.name + row.engine + row.settings + row.build_json + "\n";
  for (const ConformanceRow& row : store.conformance()) {
    text += fmt::format("{} {} {} {} {} {}\n", row.contender, row.test, row.status, row.figure, row.unit, row.note);
  }
  for (const RunRow& row : store.runs()) {
    text += fmt::format("{} {} {} {}\n", row.address, row.system, row.contender, row.timestep_ms);
  }
  for (const SceneRow& row : store.scenes()) text += row.system + row.json + "\n";
  for (const NodeRow& row : store.nodes()) text += row.id + row.json + "\n";
  for (const PlanRow& row : store.plan()) {
    text += fmt::format("{} {} {} {}\n", row.key, row.shard, row.cost_s, row.accuracy);
  }
  for (const Cell& cell : store.cells()) {
    text += fmt::format("{} {} {} {} {} {} {} {} {} {}\n", cell.key, cell.system, cell.contender, cell.timestep_ms,
                        cell.measure, outcome_text(cell.outcome), cell.reason, cell.wall_s, cell.started, cell.steal);
    for (const Value& value : cell.values) {
      text += fmt::format(" {} {} {} {} {}", value.name, value.unit, value.value.value_or(-1), value.low.value_or(-1),
                          value.high.value_or(-1));
    }
    for (const SampleSeries& series : store.samples(cell.id)) {
      text += series.name;
      for (const double sample : series.values) text += fmt::format(" {}", sample);
    }
  }
  return text;
}

void fill(const std::string& dir, int cells, int samples) {
  Store store = Store::create(dir, kCampaign);
  store.set_manifest({{"cpu", "x"}, {"assay_version", "9.8"}});
  store.set_systems({{"chain", R"({"dof": 5})"}});
  store.set_contenders({{"ode-quick", "ode", "0.16.2", "ode-quick", "iterations=20", "{}", "{}"}});
  store.set_conformance("ode-quick", {{"", "free-fall", "pass", 1e-6, 1e-5, "m", "note"}});
  store.set_runs({{"abc", "chain", "ode-quick", 1}});
  store.set_scenes({{"chain", "{\"bodies\": []}"}});
  store.set_node({"0123456789abcdef", R"({"name": "one", "shard": "1/1"})"});
  std::vector<PlanRow> plan;
  for (int i = 0; i <= cells; ++i) plan.push_back({numbered_cell(i).key, 1 + i % 2, 0.25 * i, i % 3 == 0});
  store.set_plan(plan);
  for (int i = 0; i < cells; ++i) store.put_cell(numbered_cell(i), numbered_samples(i, samples));
  store.set_derived({"truth_order"}, {{1, {"truth_order", "1", 1.0, {}, {}}}});
}

void change(const std::string& dir, const std::string& sql) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open((dir + "/assay.sqlite").c_str(), &db), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
  sqlite3_close(db);
}

std::string asked(const std::string& dir, const std::string& sql) {
  sqlite3* db = nullptr;
  sqlite3_open((dir + "/assay.sqlite").c_str(), &db);
  sqlite3_stmt* query = nullptr;
  std::string text;
  sqlite3_prepare_v2(db, sql.c_str(), -1, &query, nullptr);
  while (sqlite3_step(query) == SQLITE_ROW) {
    text += reinterpret_cast<const char*>(sqlite3_column_text(query, 0));
    text += ";";
  }
  sqlite3_finalize(query);
  sqlite3_close(db);
  return text;
}

class StoreFaultsTest : public TempFolderTest {
 protected:
  std::string dir(const std::string& name = "results") const { return (dir_ / name).string(); }
};

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
    EXPECT_THAT(text_of<InputError>([&] { content_of(Store::open(dir())); }),
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
  EXPECT_THAT(text_of<InputError>([&] { store.cells(); }), HasSubstr("--retry"));
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
  EXPECT_THAT(text_of<InputError>([&] { Store::create(dir(), kCampaign); }), HasSubstr("the table 'manifest'"));
  change(dir(), "UPDATE manifest SET value = 'x' WHERE key = 'cpu'");
  for (const auto& writer : writers) {
    EXPECT_THAT(text_of<InputError>([&] {
                  Store store = Store::create(dir(), kCampaign);
                  writer.second(store);
                }),
                AllOf(HasSubstr("is damaged"), HasSubstr(writer.first)));
    EXPECT_THAT(text_of<InputError>([&] { content_of(Store::open(dir())); }), HasSubstr("is damaged"));
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
    EXPECT_THAT(text_of<InputError>([&] { Store::open(dir()); }), HasSubstr("is damaged")) << at;
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
    EXPECT_THAT(text_of<InputError>([&] { Store::open(dir()).cells(); }), HasSubstr("cannot be"));
    Store::create(dir(), kCampaign).set_runs({{"abc", "chain", "ode-quick", timestep}});
    EXPECT_THAT(text_of<InputError>([&] { Store::open(dir()).runs(); }), HasSubstr("cannot be"));
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
    EXPECT_THAT(text_of<InputError>([&] { Store::create(dir(), {"other", "0123"}); }), HasSubstr("other"));
    EXPECT_EQ(asked(dir(), "PRAGMA user_version"), "1;") << "refused results stay as they are";
    EXPECT_EQ(content_of(Store::create(dir(), kCampaign)), before);
    EXPECT_EQ(asked(dir(), "PRAGMA user_version"), "2;");
    EXPECT_EQ(asked(dir(), "PRAGMA integrity_check"), "ok;");
    EXPECT_EQ(content_of(Store::open(dir())), before);
    change(dir(), "UPDATE \"values\" SET value = 7 WHERE cell_id = 3 AND name = 'consistency'");
    EXPECT_THAT(text_of<InputError>([&] { Store::open(dir()).cells(); }), HasSubstr("is damaged"))
        << "hashes were made";
  }
}

// ---- a power cut ----------------------------------------------------------------------------------------------------

// A disk that keeps what was synced, and any part of what was not. All files are written through to the real system;
// beside that, what a power cut would leave is known at each moment.
class Disk {
 public:
  struct Write {
    sqlite3_int64 offset = 0;
    std::string bytes;
    bool truncates = false;
  };
  struct Image {
    std::string durable;
    std::vector<Write> pending;
  };

  static void apply(std::string& image, const Write& write) {
    const auto offset = static_cast<size_t>(write.offset);
    if (write.truncates) {
      image.resize(offset);
      return;
    }
    if (image.size() < offset + write.bytes.size()) image.resize(offset + write.bytes.size());
    std::ranges::copy(write.bytes, image.begin() + static_cast<std::ptrdiff_t>(offset));
  }

  void note(const std::string& path, Write write) {
    files[path].pending.push_back(std::move(write));
    if (on_operation) on_operation();
  }
  void sync(const std::string& path) {
    Image& image = files[path];
    for (const Write& write : image.pending) apply(image.durable, write);
    image.pending.clear();
    if (on_operation) on_operation();
  }

  // What is there after a power cut now: of writes that were not synced any subset, sector by sector.
  std::map<std::string, std::string> after_power_cut(std::mt19937& random) const {
    constexpr size_t kSector = 512;
    std::map<std::string, std::string> left;
    for (const auto& [path, image] : files) {
      std::string content = image.durable;
      for (const Write& write : image.pending) {
        if (write.truncates) {
          if ((random() & 1U) != 0) apply(content, write);
          continue;
        }
        for (size_t at = 0; at < write.bytes.size(); at += kSector) {
          if ((random() & 1U) == 0) continue;
          apply(content, {write.offset + static_cast<sqlite3_int64>(at), write.bytes.substr(at, kSector), false});
        }
      }
      left[path] = content;
    }
    return left;
  }

  std::map<std::string, Image> files;
  std::function<void()> on_operation;
};

Disk* disk = nullptr;
sqlite3_vfs* real_vfs = nullptr;

// NOLINTBEGIN: SQLite's interface is C
struct RecordedFile {
  sqlite3_file base;
  char path[1024];
  // the real file follows
};
sqlite3_file* real_of(sqlite3_file* file) {
  return reinterpret_cast<sqlite3_file*>(reinterpret_cast<RecordedFile*>(file) + 1);
}
std::string path_of(sqlite3_file* file) { return reinterpret_cast<RecordedFile*>(file)->path; }

const sqlite3_io_methods kMethods = {
    2,
    [](sqlite3_file* f) { return real_of(f)->pMethods->xClose(real_of(f)); },
    [](sqlite3_file* f, void* to, int n, sqlite3_int64 at) {
      return real_of(f)->pMethods->xRead(real_of(f), to, n, at);
    },
    [](sqlite3_file* f, const void* from, int n, sqlite3_int64 at) {
      disk->note(path_of(f), {at, std::string(static_cast<const char*>(from), static_cast<size_t>(n)), false});
      return real_of(f)->pMethods->xWrite(real_of(f), from, n, at);
    },
    [](sqlite3_file* f, sqlite3_int64 size) {
      disk->note(path_of(f), {size, "", true});
      return real_of(f)->pMethods->xTruncate(real_of(f), size);
    },
    [](sqlite3_file* f, int flags) {
      disk->sync(path_of(f));
      return real_of(f)->pMethods->xSync(real_of(f), flags);
    },
    [](sqlite3_file* f, sqlite3_int64* size) { return real_of(f)->pMethods->xFileSize(real_of(f), size); },
    [](sqlite3_file* f, int lock) { return real_of(f)->pMethods->xLock(real_of(f), lock); },
    [](sqlite3_file* f, int lock) { return real_of(f)->pMethods->xUnlock(real_of(f), lock); },
    [](sqlite3_file* f, int* out) { return real_of(f)->pMethods->xCheckReservedLock(real_of(f), out); },
    [](sqlite3_file* f, int op, void* arg) { return real_of(f)->pMethods->xFileControl(real_of(f), op, arg); },
    [](sqlite3_file* f) { return real_of(f)->pMethods->xSectorSize(real_of(f)); },
    [](sqlite3_file* f) { return real_of(f)->pMethods->xDeviceCharacteristics(real_of(f)); },
    [](sqlite3_file* f, int region, int size, int extend, void volatile** to) {
      return real_of(f)->pMethods->xShmMap(real_of(f), region, size, extend, to);
    },
    [](sqlite3_file* f, int offset, int n, int flags) {
      return real_of(f)->pMethods->xShmLock(real_of(f), offset, n, flags);
    },
    [](sqlite3_file* f) { real_of(f)->pMethods->xShmBarrier(real_of(f)); },
    [](sqlite3_file* f, int remove) { return real_of(f)->pMethods->xShmUnmap(real_of(f), remove); },
    nullptr,
    nullptr};

int open_recorded(sqlite3_vfs* /*vfs*/, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  auto* recorded = reinterpret_cast<RecordedFile*>(file);
  std::memset(recorded, 0, sizeof *recorded);
  std::snprintf(recorded->path, sizeof recorded->path, "%s", name == nullptr ? "temporary" : name);
  const int code = real_vfs->xOpen(real_vfs, name, real_of(file), flags, out_flags);
  recorded->base.pMethods = real_of(file)->pMethods == nullptr ? nullptr : &kMethods;
  return code;
}

int delete_recorded(sqlite3_vfs* /*vfs*/, const char* name, int sync_dir) {
  disk->files.erase(name);
  return real_vfs->xDelete(real_vfs, name, sync_dir);
}
// NOLINTEND

class RecordingDisk {
 public:
  explicit RecordingDisk(Disk& recorded) : vfs_(*sqlite3_vfs_find(nullptr)) {
    disk = &recorded;
    real_vfs = sqlite3_vfs_find(nullptr);
    vfs_.zName = "recorded";
    vfs_.szOsFile = static_cast<int>(sizeof(RecordedFile)) + real_vfs->szOsFile;
    vfs_.xOpen = open_recorded;
    vfs_.xDelete = delete_recorded;
    sqlite3_vfs_register(&vfs_, 1);
  }
  ~RecordingDisk() {
    sqlite3_vfs_unregister(&vfs_);
    sqlite3_vfs_register(real_vfs, 1);
  }
  RecordingDisk(const RecordingDisk&) = delete;
  RecordingDisk& operator=(const RecordingDisk&) = delete;

 private:
  sqlite3_vfs vfs_{};
};

TEST_F(StoreFaultsTest, APowerCutLosesNoFinishedCell) {
  constexpr int kCells = 60, kSamples = 400;
  const unsigned seed = std::random_device{}();
  std::mt19937 random(seed);
  std::vector<std::pair<fs::path, int>> cuts;  // what is left, and how many cells were finished
  {
    Disk recorded;
    int finished = 0;
    recorded.on_operation = [&] {
      constexpr unsigned kOneIn = 12;
      if (random() % kOneIn != 0) return;
      const fs::path folder = dir_ / fmt::format("cut{}", cuts.size());
      fs::create_directories(folder);
      for (const auto& [path, content] : recorded.after_power_cut(random)) {
        write_bytes(folder / fs::path(path).filename(), content);
      }
      cuts.emplace_back(folder, finished);
    };
    const RecordingDisk recording(recorded);
    Store store = Store::create(dir(), kCampaign);
    for (int i = 0; i < kCells; ++i) {
      store.put_cell(numbered_cell(i), numbered_samples(i, kSamples));
      finished = i + 1;
    }
  }
  ASSERT_GT(cuts.size(), 20U);
  for (const auto& [folder, finished] : cuts) {
    SCOPED_TRACE(fmt::format("{}, seed {}", folder.string(), seed));
    Store store = Store::create(folder, kCampaign);
    const std::vector<Cell> cells = store.cells();
    EXPECT_GE(std::ssize(cells), finished);
    for (const Cell& cell : cells) {
      const int number = static_cast<int>(cell.timestep_ms) - 1;
      EXPECT_EQ(cell.values.at(0).value, 1e-5 * (1 + number));
      EXPECT_EQ(store.samples(cell.id).at(0).values, numbered_samples(number, kSamples).at(0).values);
    }
    store.put_cell(numbered_cell(kCells));
  }
  reliability("a power cut while cells are stored (unsynced sectors are lost at random)", static_cast<int>(cuts.size()),
              "the same command goes on", "no finished cell");
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
    for (const std::string& text : {text_of<InputError>([&] { Store::open(dir()); }),
                                    text_of<InputError>([&] { Store::create(dir(), kCampaign); }),
                                    text_of<InputError>([&] { merge_results({dir()}, dir("union"), {}, {}, {}); })}) {
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
    EXPECT_THAT(text_of<InputError>([&] { content_of(Store::open(dir())); }), says);
    EXPECT_THAT(text_of<InputError>([&] { merge_results({dir()}, dir("union"), {}, {}, {}); }), says);
  }
  reliability("a value of 80 MB in a results database", static_cast<int>(changes.size()) * 2,
              "a sentence that names the table", "nothing wrong is read");
}

TEST_F(StoreFaultsTest, AValueThatIsTooLongIsNotWritten) {
  Store store = Store::create(dir(), kCampaign);
  Cell cell = numbered_cell(1);
  cell.reason.assign(size_t{65} << 20, 'x');
  EXPECT_THAT(text_of<SystemError>([&] { store.put_cell(cell); }), HasSubstr("more than 64 MiB"));
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
      EXPECT_THAT(text_of<InputError>([&] { Store::open(dir()); }), says);
      EXPECT_THAT(text_of<InputError>([&] { Store::create(dir(), kCampaign); }), says);
      EXPECT_THAT(text_of<InputError>([&] { merge_results({dir()}, dir("union"), {}, {}, {}); }), says);
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
  EXPECT_THAT(text_of<InputError>([&] { Store::create(dir(), kCampaign); }), HasSubstr("a symbolic link"));
  EXPECT_FALSE(fs::exists(dir_ / "elsewhere.sqlite"));
  fs::remove(fs::path(dir()) / "assay.sqlite");
  fs::create_directories(dir_ / "elsewhere");
  fs::create_symlink(dir_ / "elsewhere", fs::path(dir()) / "trajectories");
  EXPECT_THAT(text_of<InputError>([&] { Store::create(dir(), kCampaign); }),
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
  for (const std::string& text : {text_of<InputError>([&] { content_of(Store::open(dir())); }),
                                  text_of<InputError>([&] { Store::create(dir(), kCampaign); })}) {
    EXPECT_THAT(text, AllOf(HasSubstr(journal.string()), HasSubstr("remove it")));
  }
  EXPECT_TRUE(fs::exists(victim));
}

// ---- trajectories ---------------------------------------------------------------------------------------------------

Trajectory moving(int states, int bodies, double offset) {
  Trajectory trajectory;
  for (int i = 0; i < states; ++i) {
    State state;
    state.time = 0.1 * i;
    state.bodies.resize(static_cast<size_t>(bodies));
    for (BodyState& body : state.bodies) body.p_WBcm = Vec3(offset, i, 0);
    state.position = {0.1};
    state.velocity = {0.2};
    trajectory.states.push_back(state);
  }
  return trajectory;
}

TEST_F(StoreFaultsTest, ASwappedTrajectoryIsRefusedByName) {
  write_trajectory(dir(), "aaaa", moving(5, 2, 0));
  write_trajectory(dir(), "bbbb", moving(5, 2, 1));
  fs::rename(trajectory_path(dir(), "aaaa"), trajectory_path(dir(), "x"));
  fs::rename(trajectory_path(dir(), "bbbb"), trajectory_path(dir(), "aaaa"));
  fs::rename(trajectory_path(dir(), "x"), trajectory_path(dir(), "bbbb"));
  EXPECT_FALSE(read_trajectory(dir(), "aaaa"));
  EXPECT_EQ(trajectory_fault(dir(), "aaaa"), "holds the run bbbb");
  EXPECT_EQ(count_states(dir(), "aaaa"), 0U);
  const References references(dir());
  EXPECT_FALSE(references.fetch("bbbb", dir("other"))) << "not for another campaign either";
}

TEST_F(StoreFaultsTest, EveryDamageOfATrajectoryIsFound) {
  write_trajectory(dir(), "aaaa", moving(5, 2, 0));
  const fs::path path = trajectory_path(dir(), "aaaa");
  const std::string whole = bytes_of(path);
  int tries = 0;
  for (size_t at = 0; at < whole.size(); at += 7, ++tries) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 1);
    write_bytes(path, damaged);
    EXPECT_FALSE(read_trajectory(dir(), "aaaa")) << at;
    EXPECT_FALSE(trajectory_fault(dir(), "aaaa").empty()) << at;
  }
  for (size_t size = 0; size < whole.size(); size += 13, ++tries) {
    write_bytes(path, whole.substr(0, size));
    EXPECT_FALSE(read_trajectory(dir(), "aaaa")) << size;
  }
  reliability("a trajectory is cut off, a bit of it changes, or it is another run's", tries + 2,
              "refused by name; made again at the next start", "the time of that run");
}

// With a checksum that is right.
TEST_F(StoreFaultsTest, AForgedTrajectoryIsRefused) {
  const auto forged = [&](std::uint64_t states, std::uint64_t bodies, std::uint64_t joints,
                          const std::string& numbers) {
    std::string bytes = "assay-trajectory-2\n";
    const auto put = [&](std::uint64_t number) { bytes.append(reinterpret_cast<const char*>(&number), sizeof number); };
    put(4);
    bytes += "aaaa";
    for (const std::uint64_t count : {states, bodies, joints}) put(count);
    bytes += numbers;
    fs::create_directories(dir());
    write_bytes(trajectory_path(dir(), "aaaa"), bytes + content_hash(bytes));
    return trajectory_fault(dir(), "aaaa");
  };
  constexpr std::uint64_t kHuge = std::uint64_t{1} << 61;
  constexpr size_t kState = 14 * sizeof(double);  // of one body
  EXPECT_THAT(forged(kHuge, 0, 0, ""), StartsWith("is damaged"));
  EXPECT_THAT(forged(1, kHuge, kHuge, std::string(8, '\0')), StartsWith("is damaged"));
  EXPECT_THAT(forged(2, 1, 0, std::string(kState, '\0')), StartsWith("is damaged"));
  EXPECT_THAT(forged(1, 1, 0, std::string(kState, '\0')), HasSubstr("an orientation of length 0"));
  EXPECT_THAT(forged(1, 1, 0, std::string(kState, '\xff')), HasSubstr("a non-finite number"));
  // each would take some 80 bytes of memory
  EXPECT_THAT(forged(1000, 0, 0, std::string(8000, '\0')), HasSubstr("states of no bodies"));
  EXPECT_FALSE(read_trajectory(dir(), "aaaa"));
}

// What pictures, replays and exports index and divide by.
TEST_F(StoreFaultsTest, ARunIsOfItsSystemAndItsTimesIncrease) {
  const auto fault = [](Trajectory run, const std::function<void(std::vector<State>&)>& work) {
    work(run.states);
    return run_fault(run, 2, 1);
  };
  EXPECT_EQ(fault(moving(5, 2, 0), [](auto&) {}), "");
  EXPECT_EQ(fault(moving(5, 2, 0), [](auto& states) { states.resize(1); }), "");
  EXPECT_EQ(fault(moving(5, 2, 0), [](auto& states) { states.clear(); }), "has no states");
  EXPECT_EQ(fault(moving(5, 3, 0), [](auto&) {}), "is another system's");
  EXPECT_EQ(fault(moving(5, 2, 0), [](auto& states) { states[4].bodies.pop_back(); }), "is another system's");
  EXPECT_EQ(fault(moving(5, 2, 0), [](auto& states) { states[4].position.clear(); }), "is another system's");
  EXPECT_EQ(run_fault(moving(5, 2, 0), 2), "") << "where the joints are not known";
  EXPECT_EQ(fault(moving(5, 2, 0), [](auto& states) { states[3].time = states[2].time; }),
            "has times that do not increase");
  EXPECT_EQ(fault(moving(5, 2, 0), [](auto& states) { states[4].time = 1e12; }), "has times that no run reaches");
  write_trajectory(dir(), "aaaa", moving(5, 2, 0));
  EXPECT_TRUE(read_run(dir(), "aaaa", 2, 1));
  EXPECT_FALSE(read_run(dir(), "aaaa", 2, 2));
  EXPECT_FALSE(read_run(dir(), "aaaa", 1));
}

// Instead of a run's file: nothing is waited for, and no memory is taken for what is no run.
TEST_F(StoreFaultsTest, ATrajectoryThatIsNoFileOrFarTooLargeIsDamaged) {
  write_trajectory(dir(), "aaaa", moving(5, 2, 0));
  const fs::path path = trajectory_path(dir(), "aaaa");
  const std::string whole = bytes_of(path);
  constexpr std::uintmax_t kGiB = std::uintmax_t{1} << 30;
  const std::vector<std::pair<std::string, std::function<void()>>> others = {
      {"a named pipe", [&] { ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0); }},
      {"a device", [&] { fs::create_symlink("/dev/zero", path); }},
      {"a directory", [&] { fs::create_directory(path); }},
      {"102400 MiB",
       [&] {
         write_bytes(path, whole);
         fs::resize_file(path, 100 * kGiB);
       }},
      {"its size is not that of its states",
       [&] {
         write_bytes(path, whole);
         fs::resize_file(path, 3 * kGiB);
       }},
      {"does not begin as a trajectory", [&] {
         write_bytes(path, "");
         fs::resize_file(path, 3 * kGiB);
       }}};
  for (const auto& [what, make] : others) {
    SCOPED_TRACE(what);
    fs::remove_all(path);
    make();
    EXPECT_TRUE(has_trajectory(dir(), "aaaa"));
    EXPECT_FALSE(read_trajectory(dir(), "aaaa"));
    EXPECT_THAT(trajectory_fault(dir(), "aaaa"), AllOf(StartsWith("is damaged"), HasSubstr(what)));
    EXPECT_EQ(count_states(dir(), "aaaa"), 0U);
    const References kept(dir("kept"));
    kept.keep("aaaa", dir());
    EXPECT_FALSE(kept.fetch("aaaa", dir("other")));
  }
  reliability("a run's file is a pipe, a device, a folder, or has 100 GiB", static_cast<int>(others.size()),
              "damaged: named, and the others are read", "the time of that run");
}

// What a link means may be a file that is not to be shared.
TEST_F(StoreFaultsTest, AMergeTakesNoFilesThroughLinks) {
  fill(dir(), 2, 2);
  write_bytes(dir_ / "secret", "mine");
  for (const char* folder : {"trajectories/x.bin", "parity/x.json"}) {
    const fs::path path = fs::path(dir()) / folder;
    fs::create_directories(path.parent_path());
    fs::create_symlink(dir_ / "secret", path);
    fs::remove_all(dir("union"));
    EXPECT_THAT(text_of<InputError>([&] { merge_results({dir()}, dir("union"), {}, {}, {}); }),
                AllOf(HasSubstr(path.string()), HasSubstr("a symbolic link"), HasSubstr("remove it")));
    fs::remove(path);
  }
}

TEST_F(StoreFaultsTest, TrajectoriesOfTheOlderFormatAreReadAndNotMeasuredFrom) {
  write_trajectory(dir(), "aaaa", moving(5, 2, 0));
  std::string bytes = bytes_of(trajectory_path(dir(), "aaaa"));
  bytes = bytes.substr(0, bytes.size() - 32);
  bytes.replace(0, std::strlen("assay-trajectory-2\n") + 8 + 4, "assay-trajectory-1\n");
  write_bytes(trajectory_path(dir(), "aaaa"), bytes + content_hash(bytes));
  EXPECT_TRUE(read_trajectory(dir(), "aaaa"));
  EXPECT_EQ(count_states(dir(), "aaaa"), 5U);
  EXPECT_THAT(trajectory_fault(dir(), "aaaa"), HasSubstr("older format"));
}

}  // namespace
}  // namespace assay
