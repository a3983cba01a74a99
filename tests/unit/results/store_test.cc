// The results directory: what is written is read back, what must not be touched is left alone.
#include "results/store/store.h"

#include <array>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "base/errors.h"
#include "message_of.h"
#include "results/store/trajectory.h"
#include "temp_folder.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class StoreTest : public TempFolderTest {
 protected:
  std::string dir() const { return dir_.string(); }

  static Cell cell(const std::string& key) {
    Cell cell;
    cell.key = key;
    cell.system = "chain";
    cell.contender = "ode-quick";
    cell.timestep_ms = 1.0 / 64;
    cell.measure = "consistency";
    cell.wall_s = 1.5;
    cell.values = {{"consistency", "m", 1e-5, 0.9e-5, 1.1e-5}, {"restart_floor", "m", {}, {}, {}}};
    return cell;
  }
};

const Identity kIdentity = {"quick", "0123"};

TEST_F(StoreTest, WhatIsWrittenIsReadBack) {
  std::int64_t id = 0;
  {
    Store store = Store::create(dir(), kIdentity);
    store.set_manifest({{"cpu", "x"}, {"cores", "2"}});
    store.set_systems({{"chain", "{}"}, {"capsules", R"({"dof": 162})"}});
    store.set_contenders({{"ode-quick", "ode", "0.16.2", "ode-quick", "iterations=20", "{}", "{}"},
                          {"bullet", "", "", "bullet", "", "{}", "{}"}});
    store.set_conformance("ode-quick", {{"", "free-fall", "pass", 1e-6, 1e-5, "m", "note"},
                                        {"", "buoyancy", "fail", std::nan(""), 1, "", ""}});
    id = store.put_cell(cell("k1"), {{"piece_error_m", {1, 2, 3}}});
  }
  const Store store = Store::open(dir());
  EXPECT_EQ(store.manifest("campaign"), "quick");
  EXPECT_EQ(store.manifest("cores"), "2");
  EXPECT_EQ(store.manifest("nothing"), std::nullopt);
  ASSERT_EQ(store.systems().size(), 2U);
  EXPECT_EQ(store.systems()[0].name, "chain") << "in the campaign's order, not the alphabet's";
  EXPECT_EQ(store.contenders()[0].settings, "iterations=20");
  ASSERT_EQ(store.conformance().size(), 2U);
  EXPECT_EQ(store.conformance()[0].test, "free-fall") << "in the suite's order";
  EXPECT_EQ(store.conformance()[0].tolerance, 1e-5);
  ASSERT_EQ(store.cells().size(), 1U);
  const Cell read = store.cells()[0];
  EXPECT_EQ(read.id, id);
  EXPECT_EQ(read.timestep_ms, 1.0 / 64);
  EXPECT_EQ(read.outcome, Outcome::kOk);
  EXPECT_EQ(read.wall_s, 1.5);
  ASSERT_EQ(read.values.size(), 2U);
  EXPECT_EQ(read.values[0].value, 1e-5);
  EXPECT_EQ(read.values[0].high, 1.1e-5);
  EXPECT_EQ(read.values[1].value, std::nullopt);
  ASSERT_EQ(store.samples(id).size(), 1U);
  EXPECT_THAT(store.samples(id)[0].values, ElementsAre(1, 2, 3));
}

TEST_F(StoreTest, NoNanIsStored) {
  Store store = Store::create(dir(), kIdentity);
  Cell broken = cell("k");
  broken.values = {{"consistency", "m", std::nan(""), -std::numeric_limits<double>::infinity(), 1.0}};
  store.put_cell(broken);
  const Value value = store.cells()[0].values[0];
  EXPECT_EQ(value.value, std::nullopt);
  EXPECT_EQ(value.low, std::nullopt);
  EXPECT_EQ(value.high, 1);
}

TEST_F(StoreTest, WhatAnEngineSaysDoesNotTellTheHomeFolder) {
  const char* before = std::getenv("HOME");
  const std::string kept = before == nullptr ? "" : before;
  ::setenv("HOME", "/home/alice", 1);
  Store store = Store::create(dir(), kIdentity);
  Cell failed = cell("k");
  failed.outcome = Outcome::kDiverged;
  failed.reason = "failed in [/home/alice/ode/a.cpp:460], not in /home/alicent/b";
  store.put_cell(failed);
  store.set_conformance("ode", {{"", "free-fall", "fail", 0, 0, "", "crashed: failed in /home/alice/ode/a.cpp"}});
  ::setenv("HOME", kept.c_str(), 1);
  EXPECT_EQ(store.conformance().at(0).note, "crashed: failed in ~/ode/a.cpp");
  EXPECT_EQ(store.cells().at(0).reason, "failed in [~/ode/a.cpp:460], not in /home/alicent/b");
}

TEST_F(StoreTest, ACellOfTheSameKeyIsReplacedWithAllThatBelongsToIt) {
  Store store = Store::create(dir(), kIdentity);
  store.put_cell(cell("k"), {{"piece_error_m", {1, 2, 3}}});
  Cell again = cell("k");
  again.outcome = Outcome::kDiverged;
  again.reason = "by 0.5 s: gone";
  again.values.clear();
  const std::int64_t id = store.put_cell(again, {{"piece_error_m", {4}}});
  ASSERT_EQ(store.cells().size(), 1U);
  EXPECT_EQ(store.cells()[0].outcome, Outcome::kDiverged);
  EXPECT_EQ(store.cells()[0].reason, "by 0.5 s: gone");
  EXPECT_TRUE(store.cells()[0].values.empty());
  EXPECT_THAT(store.samples(id)[0].values, ElementsAre(4));
  EXPECT_THAT(store.cell_keys(), ElementsAre("k"));
}

TEST_F(StoreTest, DerivedValuesReplaceThemselves) {
  Store store = Store::create(dir(), kIdentity);
  const std::int64_t a = store.put_cell(cell("a")), b = store.put_cell(cell("b"));
  store.set_derived({"truth_order"}, {{a, {"truth_order", "1", 1.0, {}, {}}}});
  store.set_derived({"truth_order"}, {{b, {"truth_order", "1", 2.0, {}, {}}}});
  EXPECT_EQ(store.cells()[0].values.size(), 2U);
  EXPECT_EQ(store.cells()[1].values.size(), 3U);
}

TEST_F(StoreTest, TheSameCampaignGoesOn) {
  Store::create(dir(), kIdentity).put_cell(cell("a"));
  Store store = Store::create(dir(), kIdentity);
  store.put_cell(cell("b"));
  EXPECT_THAT(store.cell_keys(), ElementsAre("a", "b"));
}

TEST_F(StoreTest, RefusesAnotherCampaignAndChangesNothing) {
  Store::create(dir(), kIdentity).put_cell(cell("a"));
  const auto bytes = [&] {
    std::ifstream file(dir_ / "assay.sqlite", std::ios::binary);
    std::stringstream content;
    content << file.rdbuf();
    return content.str();
  };
  const std::string before = bytes();
  EXPECT_THAT(message_of<InputError>([&] { Store::create(dir(), {"paper", "0123"}); }),
              AllOf(HasSubstr("'quick'"), HasSubstr("'paper'"), HasSubstr("another directory")));
  EXPECT_THAT(message_of<InputError>([&] { Store::create(dir(), {"quick", "4567"}); }),
              AllOf(HasSubstr("'quick'"), HasSubstr("another directory")));
  EXPECT_EQ(bytes(), before);
}

// A results directory with two cells and its writer's version, to which `sql` is done afterwards.
void make_changed(const std::string& dir, const std::string& sql) {
  {
    Store store = Store::create(dir, kIdentity);
    store.set_manifest({{"assay_version", "9.8"}});
    for (const char* key : {"a", "b"}) {
      Cell cell;
      cell.key = key;
      cell.timestep_ms = 1;
      cell.values = {{"consistency", "m", 1e-5, {}, {}}};
      store.put_cell(cell);
    }
  }
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open((dir + "/assay.sqlite").c_str(), &db), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
  sqlite3_close(db);
}

TEST_F(StoreTest, ANewerProgramsResultsAreRefusedWithBothVersions) {
  make_changed(dir(), "PRAGMA user_version = 99; DROP TABLE samples");
  const auto says = AllOf(HasSubstr("version 99"), HasSubstr("written by assay 9.8"),
                          HasSubstr("reads versions 1 to 2"), HasSubstr("or a newer one"));
  EXPECT_THAT(message_of<InputError>([&] { Store::create(dir(), kIdentity); }), says);
  EXPECT_THAT(message_of<InputError>([&] { Store::open(dir()); }), says);
}

TEST_F(StoreTest, AnOlderSchemasResultsAreRefusedWithWhatToDo) {
  make_changed(dir(), "PRAGMA user_version = 0; DROP TABLE manifest");
  const auto says = AllOf(HasSubstr("version 0, and this assay reads versions 1 to 2"), HasSubstr("measure again"));
  EXPECT_THAT(message_of<InputError>([&] { Store::create(dir(), kIdentity); }), says);
  EXPECT_THAT(message_of<InputError>([&] { Store::open(dir()); }), says);
}

TEST_F(StoreTest, AMissingTableOrColumnIsNamed) {
  for (const auto& [sql, says] :
       {std::pair{"DROP TABLE samples", "in the table 'samples'"}, std::pair{"DROP TABLE manifest", "'manifest'"},
        std::pair{"DROP TABLE runs", "in the table 'runs'"},
        std::pair{"ALTER TABLE cells DROP COLUMN steal", "no column 'steal' in the table 'cells'"}}) {
    fs::remove_all(dir());
    make_changed(dir(), sql);
    EXPECT_THAT(message_of<InputError>([&] { Store::open(dir()); }),
                AllOf(HasSubstr(says), HasSubstr("measure again")));
    EXPECT_THAT(message_of<InputError>([&] { Store::create(dir(), kIdentity); }), HasSubstr(says));
  }
}

// Wherever the damage is, reading ends with one sentence or does not touch it.
TEST_F(StoreTest, ADamagedDatabaseIsSaidToBeDamaged) {
  make_changed(dir(), "");
  std::string whole;
  {
    std::ostringstream content;
    content << std::ifstream(dir_ / "assay.sqlite", std::ios::binary).rdbuf();
    whole = content.str();
  }
  constexpr size_t kPage = 4096;
  ASSERT_GT(whole.size(), 4 * kPage);
  const auto reading_says = [&](const std::string& content) {
    std::ofstream(dir_ / "assay.sqlite", std::ios::binary) << content;
    return message_of<InputError>([&] {
      const Store store = Store::open(dir());
      for (const Cell& cell : store.cells()) static_cast<void>(store.samples(cell.id));
      static_cast<void>(store.manifest());
    });
  };
  EXPECT_THAT(reading_says(whole.substr(0, whole.size() / 2)), AllOf(HasSubstr("is damaged"), HasSubstr("restore it")));
  size_t seen = 0;
  for (size_t page = 1; page * kPage < whole.size(); ++page) {
    std::string damaged = whole;
    damaged.replace(page * kPage, kPage, kPage, '\xaa');
    const std::string says = reading_says(damaged);
    if (says.find("is damaged") != std::string::npos) ++seen;
  }
  EXPECT_GE(seen, 4U);
}

TEST_F(StoreTest, RefusesWhatIsNoDatabaseOfOurs) {
  fs::create_directories(dir_);
  std::ofstream(dir_ / "assay.sqlite") << "this is a shopping list, and a long one: milk, bread, butter, cheese, salt";
  EXPECT_THAT(message_of<InputError>([&] { Store::create(dir(), kIdentity); }), HasSubstr("not a results database"));
  EXPECT_THAT(message_of<InputError>([&] { Store::open(dir()); }), HasSubstr("not a results database"));
  fs::remove(dir_ / "assay.sqlite");
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open((dir() + "/assay.sqlite").c_str(), &db), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(db, "CREATE TABLE cells(x)", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(db);
  EXPECT_THAT(message_of<InputError>([&] { Store::create(dir(), kIdentity); }), HasSubstr("not a results database"));
}

TEST_F(StoreTest, RefusesDirectoriesThatAreNotThereOrNoDirectories) {
  EXPECT_THAT(message_of<InputError>([&] { Store::open(dir()); }), HasSubstr("no directory"));
  fs::create_directories(dir_);
  EXPECT_THAT(message_of<InputError>([&] { Store::open(dir()); }), HasSubstr("holds no results"));
  std::ofstream(dir_ / "file") << "x";
  EXPECT_THAT(message_of<InputError>([&] { Store::create(dir() + "/file", kIdentity); }), HasSubstr("is a file"));
  EXPECT_THAT(message_of<InputError>([&] { Store::create(dir() + "/file/below", kIdentity); }),
              HasSubstr("lies below a file"));
  EXPECT_THAT(message_of<InputError>([&] { Store::create("", kIdentity); }), HasSubstr("empty"));
}

TEST_F(StoreTest, OneWriterAtATime) {
  const Store first = Store::create(dir(), kIdentity);
  EXPECT_THAT(message_of<InputError>([&] { Store::create(dir(), kIdentity); }), HasSubstr("another assay is writing"));
  EXPECT_EQ(Store::open(dir()).manifest("campaign"), "quick") << "reading goes on";
}

// Runs `work` in a process of its own, after `prepare` has restricted that; what it threw comes back.
std::string in_restricted_process(const std::function<void()>& prepare, const std::function<void()>& work) {
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0) return "no pipe";
  const pid_t child = ::fork();
  if (child == 0) {
    std::string text = "(nothing was thrown)";
    try {
      prepare();
      work();
    } catch (const SystemError& error) {
      text = error.what();
    } catch (const std::exception& error) {
      text = std::string("(wrong kind of exception) ") + error.what();
    }
    [[maybe_unused]] const ssize_t written = ::write(ends[1], text.data(), text.size());
    ::_exit(0);
  }
  ::close(ends[1]);
  std::string text;
  std::array<char, 256> buffer{};
  for (ssize_t got = 0; (got = ::read(ends[0], buffer.data(), buffer.size())) > 0;) {
    text.append(buffer.data(), static_cast<size_t>(got));
  }
  ::close(ends[0]);
  ::waitpid(child, nullptr, 0);
  return text;
}

// As on a full disk: no file may become longer than `bytes`.
std::string in_limited_process(rlim_t bytes, const std::function<void()>& work) {
  return in_restricted_process(
      [&] {
        ::signal(SIGXFSZ, SIG_IGN);
        const rlimit limit = {bytes, bytes};
        ::setrlimit(RLIMIT_FSIZE, &limit);
      },
      work);
}

TEST_F(StoreTest, WhenNothingMoreCanBeWrittenTheFinishedCellsStay) {
  Store::create(dir(), kIdentity).put_cell(cell("a"));
  const std::string message = in_limited_process(200'000, [&] {
    Store store = Store::create(dir(), kIdentity);
    for (int i = 0; i < 1000; ++i) {
      store.put_cell(cell("more" + std::to_string(i)), {{"noise", std::vector<double>(1000, 1.0)}});
    }
  });
  EXPECT_THAT(message, AllOf(HasSubstr("assay.sqlite"), HasSubstr("at most 195 KiB"), HasSubstr("ulimit -f"),
                             Not(HasSubstr("I/O"))));
  const std::vector<Cell> cells = Store::open(dir()).cells();
  ASSERT_FALSE(cells.empty());
  EXPECT_EQ(cells[0].key, "a");
  for (const Cell& each : cells) EXPECT_EQ(each.values.size(), 2U) << "all of a cell or nothing";
  // and with room again it goes on
  Store::create(dir(), kIdentity).put_cell(cell("z"));
}

TEST_F(StoreTest, AnUnwritableDirectoryIsSaid) {
  fs::create_directories(dir_);
  const auto message_for = [&](int permissions) {
    fs::permissions(dir_, static_cast<fs::perms>(permissions));
    return in_restricted_process(
        [] {
          constexpr uid_t kNobody = 65534;  // root may write everywhere
          if (::geteuid() == 0 && ::seteuid(kNobody) != 0) throw SystemError("cannot become nobody");
        },
        [&] { Store::create(dir(), kIdentity); });
  };
  EXPECT_THAT(message_for(0555), AllOf(HasSubstr("cannot write"), HasSubstr("Permission denied")));
  EXPECT_THAT(message_for(0444), HasSubstr("Permission denied")) << "nothing in it can be looked at";
}

TEST_F(StoreTest, AKilledWriterLosesNoFinishedCell) {
  const pid_t child = ::fork();
  if (child == 0) {
    Store store = Store::create(dir(), kIdentity);
    store.put_cell(cell("a"), {{"piece_error_m", {1, 2}}});
    store.put_cell(cell("b"));
    ::raise(SIGKILL);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_THAT(Store::open(dir()).cell_keys(), ElementsAre("a", "b"));
  EXPECT_THAT(Store::create(dir(), kIdentity).cell_keys(), ElementsAre("a", "b")) << "its lock went with it";
}

// ---- trajectories ---------------------------------------------------------------------------------------------------

Trajectory some_trajectory() {
  Trajectory trajectory;
  for (int i = 0; i < 3; ++i) {
    State state;
    state.time = 0.1 * i;
    state.bodies.resize(2);
    state.bodies[1].p_WBcm = Vec3(1.0 / 3, i, -0.0);
    state.bodies[1].q_WB = Quat(0.5, -0.5, 0.5, 0.5);
    state.bodies[0].w_WB = Vec3(1e-300, 1e300, 7);
    state.position = {i + 0.1};
    state.velocity = {-i - 0.1};
    trajectory.states.push_back(state);
  }
  return trajectory;
}

TEST_F(StoreTest, TrajectoriesAreReadBackToTheBit) {
  const Trajectory written = some_trajectory();
  write_trajectory(dir(), "abc", written);
  ASSERT_TRUE(has_trajectory(dir(), "abc"));
  EXPECT_EQ(count_states(dir(), "abc"), 3U);
  const auto read = read_trajectory(dir(), "abc");
  ASSERT_TRUE(read);
  const std::vector<State> states = read.value_or(Trajectory{}).states;
  ASSERT_EQ(states.size(), 3U);
  for (size_t i = 0; i < 3; ++i) {
    const State &a = written.states[i], &b = states[i];
    EXPECT_EQ(a.time, b.time);
    EXPECT_EQ(a.position, b.position);
    EXPECT_EQ(a.velocity, b.velocity);
    for (size_t k = 0; k < 2; ++k) {
      EXPECT_EQ(a.bodies[k].p_WBcm, b.bodies[k].p_WBcm);
      EXPECT_EQ(a.bodies[k].q_WB.coeffs(), b.bodies[k].q_WB.coeffs());
      EXPECT_EQ(a.bodies[k].v_WBcm, b.bodies[k].v_WBcm);
      EXPECT_EQ(a.bodies[k].w_WB, b.bodies[k].w_WB);
    }
  }
  EXPECT_TRUE(std::signbit(states[0].bodies[1].p_WBcm.z()));
}

TEST_F(StoreTest, DamagedTrajectoriesAreNoTrajectories) {
  EXPECT_FALSE(read_trajectory(dir(), "abc"));
  EXPECT_FALSE(has_trajectory(dir(), "abc"));
  EXPECT_EQ(count_states(dir(), "abc"), 0U);
  write_trajectory(dir(), "abc", some_trajectory());
  const std::string path = trajectory_path(dir(), "abc");
  {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(200);
    file.put('\x55');
  }
  EXPECT_FALSE(read_trajectory(dir(), "abc")) << "one byte changed";
  write_trajectory(dir(), "abc", some_trajectory());
  fs::resize_file(path, fs::file_size(path) - 8);
  EXPECT_FALSE(read_trajectory(dir(), "abc")) << "cut off";
  fs::resize_file(path, 3);
  EXPECT_FALSE(read_trajectory(dir(), "abc"));
}

TEST_F(StoreTest, ATrajectoryThatDoesNotFitLeavesNothingBehind) {
  Trajectory big = some_trajectory();
  big.states.resize(1000, big.states[0]);
  const std::string message = in_limited_process(10'000, [&] { write_trajectory(dir(), "big", big); });
  EXPECT_THAT(message, HasSubstr("cannot write"));
  EXPECT_TRUE(fs::is_empty(dir_));
}

}  // namespace
}  // namespace assay
