// The union of results directories: the same whatever way it is made, and nothing taken from what does not fit.
#include "results/store/merge.h"

#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "base/errors.h"
#include "message_of.h"
#include "results/store/differences.h"
#include "results/store/trajectory.h"
#include "temp_folder.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

const Identity kMergedCampaign = {"quick", "0123"};
const std::vector<std::string> kDerived = {"truth_order"};

// Everything that a directory says, but for the ids of its cells.
std::string content_of(const std::string& dir) {
  const Store store = Store::open(dir);
  std::string text;
  for (const ManifestEntry& entry : store.manifest()) text += fmt::format("{}={}\n", entry.key, entry.value);
  for (const SystemRow& row : store.systems()) text += fmt::format("system {} {}\n", row.name, row.json);
  for (const ContenderRow& row : store.contenders()) text += fmt::format("contender {} {}\n", row.name, row.settings);
  for (const ConformanceRow& row : store.conformance()) {
    text += fmt::format("test {} {} {} {} {}\n", row.contender, row.test, row.status, row.figure, row.note);
  }
  for (const Cell& cell : store.cells()) {
    text += fmt::format("cell {} {} {} {} {} {} {} {} {} {} {}\n", cell.key, cell.system, cell.contender,
                        cell.timestep_ms, cell.measure, outcome_text(cell.outcome), cell.reason, cell.wall_s,
                        cell.started, cell.finished, cell.node);
    for (const Value& value : cell.values) {
      text += fmt::format("  {} {} {} {}\n", value.name, value.value.value_or(-1), value.low.value_or(-1),
                          value.high.value_or(-1));
    }
    for (const SampleSeries& series : store.samples(cell.id)) {
      text += fmt::format("  {}: {}\n", series.name, fmt::join(series.values, " "));
    }
  }
  for (const RunRow& row : store.runs()) {
    text += fmt::format("run {} {} {} {}\n", row.address, row.system, row.contender, row.timestep_ms);
  }
  for (const SceneRow& row : store.scenes()) text += fmt::format("scene {} {}\n", row.system, row.json);
  for (const NodeRow& row : store.nodes()) text += fmt::format("node {} {}\n", row.id, row.json);
  for (const PlanRow& row : store.plan()) text += fmt::format("plan {} {} {}\n", row.key, row.shard, row.cost_s);
  std::error_code error;
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(store.trajectories_dir(), error)) {
    files.push_back(entry.path().filename().string());
  }
  std::ranges::sort(files);
  return text + fmt::format("{}", fmt::join(files, "\n"));
}

class MergeTest : public TempFolderTest {
 protected:
  std::string path(const std::string& name) const { return (dir_ / name).string(); }

  static Cell cell(const std::string& key, const std::string& measure, double value, double started) {
    Cell cell;
    cell.key = key;
    cell.system = "chain";
    cell.contender = "ode-quick";
    cell.timestep_ms = 1;
    cell.measure = measure;
    cell.started = started;
    cell.finished = started + 1;
    cell.wall_s = 0.5;
    cell.values = {{measure == "raw_speed" ? "step_time" : "consistency", "m", value, 0.9 * value, 1.1 * value},
                   {"truth_order", "1", started, {}, {}}};
    return cell;
  }

  // A part of the campaign, measured on a machine of this name.
  Store part(const std::string& name, const std::string& machine, const std::string& more = "") const {
    Store store = Store::create(path(name), kMergedCampaign);
    store.set_manifest({{"commit", "abc"},
                        {"cpu", machine == "other" ? "Xeon" : "EPYC"},
                        {"wall_s", "3.0"},
                        {"command", "assay run quick --out " + name},
                        {"part", name}});
    store.set_systems({{"chain", R"({"model_hash": "1"})"}, {"pile", R"({"model_hash": "2"})"}});
    store.set_contenders({{"ode-quick", "ode", "0.16", "ode-quick", more, "{}", "{}"}});
    store.set_conformance(
        "ode-quick", {{"", "free-fall", "pass", 1e-6, 1e-5, "m", ""}, {"", "bounce", "pass", 1e-6, 1e-5, "m", ""}});
    store.set_node({"node-" + name, fmt::format(R"({{"name":"{}","cpu":"EPYC","wall_s":"3.0","cpu_s":"2.0",)"
                                                R"("started":"2026-01-0{} 10:00","finished":"2026-01-02 10:00"}})",
                                                machine, 1 + name.size() % 2)});
    return store;
  }

  MergeSummary merge(const std::vector<std::string>& names, const std::string& out) const {
    std::vector<std::string> dirs;
    dirs.reserve(names.size());
    for (const std::string& name : names) dirs.push_back(path(name));
    return merge_results(dirs, path(out), kDerived);
  }

  void three_parts() const {
    Store a = part("a", "n1"), b = part("bb", "n2"), c = part("ccc", "n1");
    a.put_cell(cell("k1", "consistency", 1, 10), {{"piece_error_m", {1, 2, 3}}});
    a.put_cell(cell("both", "consistency", 5, 12), {{"piece_error_m", {5, 5}}});
    b.put_cell(cell("k2", "consistency", 2, 11));
    b.put_cell(cell("both", "consistency", 5, 9), {{"piece_error_m", {5, 5}}});
    c.put_cell(cell("k3", "raw_speed", 3, 12), {{"round_step_time_us", {3, 3.1}}});
    a.set_plan({{"k1", 1, 2.0, true}, {"both", 1, 1.0, true}});
    b.set_plan({{"k2", 2, 2.0, true}});
    c.set_plan({{"k3", 3, 2.0, false}, {"k4", 3, 2.0, false}});
    a.set_runs({{"address1", "chain", "ode-quick", 1}});
    b.set_runs({{"address1", "chain", "ode-quick", 1}, {"address2", "pile", "ode-quick", 1}});
    a.set_scenes({{"chain", "{}"}});
    Trajectory run;
    run.states.resize(2);
    for (State& state : run.states) state.bodies.resize(1);
    write_trajectory(a.trajectories_dir(), "address1", run);
    write_trajectory(b.trajectories_dir(), "address1", run);
    write_trajectory(b.trajectories_dir(), "address2", run);
  }
};

TEST_F(MergeTest, TheUnionHasAllCellsAndRuns) {
  three_parts();
  const MergeSummary summary = merge({"a", "bb", "ccc"}, "out");
  EXPECT_EQ(summary.sources, 3U);
  EXPECT_EQ(summary.cells, 4U);
  EXPECT_EQ(summary.cells_before, 1U) << "one was measured twice";
  EXPECT_EQ(summary.trajectories, 2U);
  const Store out = Store::open(path("out"));
  EXPECT_EQ(out.cell_keys(), (std::vector<std::string>{"both", "k1", "k2", "k3"}));
  EXPECT_EQ(out.runs().size(), 2U);
  EXPECT_EQ(out.nodes().size(), 3U);
  EXPECT_EQ(out.plan().size(), 5U) << "what is still to be measured is known too";
  EXPECT_TRUE(read_trajectory(out.trajectories_dir(), "address2").has_value());
  EXPECT_EQ(out.manifest("wall_s"), "9.0");
  EXPECT_EQ(out.manifest("command"), std::nullopt) << "no command resumes the union";
  for (const Cell& each : out.cells()) {
    EXPECT_EQ(find_value(each, "truth_order"), nullptr) << "derived values are computed from the union";
    if (each.key == "both") {
      EXPECT_EQ(each.node, "node-bb") << "the one that was measured first";
      EXPECT_EQ(out.samples(each.id).size(), 1U);
    }
  }
  ASSERT_EQ(out.conformance().size(), 2U);
  EXPECT_EQ(out.conformance()[0].test, "free-fall") << "in the suite's order";
}

TEST_F(MergeTest, OrderGroupingAndRepetitionDoNotMatter) {
  three_parts();
  merge({"a", "bb", "ccc"}, "all");
  const std::string all = content_of(path("all"));
  merge({"ccc", "bb", "a"}, "reversed");
  EXPECT_EQ(content_of(path("reversed")), all);
  merge({"bb", "ccc"}, "two");
  merge({"a", "two"}, "nested");
  EXPECT_EQ(content_of(path("nested")), all);
  merge({"a"}, "stepwise");
  merge({"stepwise", "bb"}, "stepwise");
  merge({"stepwise", "ccc", "a"}, "stepwise");
  EXPECT_EQ(content_of(path("stepwise")), all);
  const MergeSummary again = merge({"a", "bb", "ccc"}, "all");
  EXPECT_EQ(again.cells, 0U);
  EXPECT_EQ(again.cells_before, 5U);
  EXPECT_EQ(content_of(path("all")), all);
}

TEST_F(MergeTest, ACellWithAnotherValueIsRefusedByName) {
  three_parts();
  {
    Store d = part("dddd", "n4");
    d.put_cell(cell("k1", "consistency", 1.0000000000000002, 10));
    d.put_cell(cell("k9", "consistency", 7, 10));
  }
  merge({"a"}, "out");
  const std::string before = content_of(path("out"));
  EXPECT_THAT(message_of([&] { merge({"dddd"}, "out"); }),
              AllOf(HasSubstr("dddd"), HasSubstr("consistency of ode-quick on chain at 1 ms"),
                    HasSubstr("1.0000000000000002"), HasSubstr("leave one of the two out")));
  EXPECT_EQ(content_of(path("out")), before) << "nothing of it was taken";
}

TEST_F(MergeTest, AnotherOutcomeAValueMoreOrLessIsRefused) {
  three_parts();
  const auto refused = [&](const std::function<void(Cell&)>& change) {
    fs::remove_all(path("d"));
    {
      Store d = part("d", "n1");
      Cell changed = cell("k1", "consistency", 1, 10);
      change(changed);
      d.put_cell(changed);
    }
    return message_of([&] { merge({"a", "d"}, "out"); });
  };
  EXPECT_THAT(refused([](Cell& cell) { cell.outcome = Outcome::kTimeout; }), HasSubstr("'timeout'"));
  EXPECT_THAT(refused([](Cell& cell) { cell.values.erase(cell.values.begin()); }), HasSubstr("another 'consistency'"));
  EXPECT_THAT(refused([](Cell& cell) { cell.values.push_back({"restart_floor", "m", 1.0, {}, {}}); }),
              HasSubstr("another 'restart_floor'"));
  EXPECT_EQ(refused([](Cell& cell) { cell.values[1].value = 99; }), "") << "derived values depend on the part";
}

TEST_F(MergeTest, TimingsOfASystemComeFromOneMachine) {
  three_parts();
  {
    Store d = part("d", "n7");
    d.put_cell(cell("k8", "raw_speed", 3, 12));
  }
  EXPECT_THAT(message_of([&] { merge({"ccc", "d"}, "out"); }),
              AllOf(HasSubstr("'chain'"), HasSubstr("'n1'"), HasSubstr("'n7'"), HasSubstr("one shard")));
  EXPECT_FALSE(fs::exists(path("out"))) << "refused before anything is written";
}

TEST_F(MergeTest, TimesOfManyWorldsComeFromOneMachineForEachDevice) {
  three_parts();  // "ccc" has a timing of one world from n1
  const auto batch = [&](const std::string& name, const std::string& machine, const std::string& measure) {
    Store store = part(name, machine);
    store.put_cell(cell("key-" + name, measure, 3, 12));
  };
  batch("d", "n7", "batch-256");
  batch("e", "n8", "batch-1024-cuda:0");
  batch("f", "n8", "batch-1024");
  merge({"a", "ccc", "d", "e"}, "out");
  EXPECT_EQ(Store::open(path("out")).cell_keys().size(), 5U) << "no reader compares times of two kinds";
  EXPECT_THAT(message_of([&] { merge({"a", "d", "f"}, "other"); }),
              AllOf(HasSubstr("many worlds on cpu"), HasSubstr("'n7'"), HasSubstr("'n8'")));
  EXPECT_FALSE(fs::exists(path("other"))) << "refused before anything is written";
}

TEST_F(MergeTest, WhatWasMergedBeforeARefusalIsAWholeUnion) {
  three_parts();
  {
    Store d = part("d", "n4");
    d.put_cell(cell("k1", "consistency", 9, 10));
  }
  size_t finished = 0;
  const auto work = [&] {
    merge_results({path("a"), path("bb"), path("d"), path("ccc")}, path("out"), kDerived, {},
                  [&](Store& merged) { finished = merged.cell_keys().size(); });
  };
  EXPECT_THAT(message_of(work),
              AllOf(HasSubstr("nothing of it was taken"), HasSubstr("2 directories before it were merged")));
  EXPECT_EQ(finished, 3U) << "derived values are computed for what is there";
  merge({"a", "bb"}, "same");
  EXPECT_EQ(content_of(path("out")), content_of(path("same")));
}

TEST_F(MergeTest, ACampaignThatChangedIsRefusedAndTheChangeNamed) {
  three_parts();
  {
    Store other = Store::create(path("other"), {"quick", "4567"});
    other.set_manifest({{"commit", "abc"}});
    other.set_systems({{"chain", R"({"model_hash": "9"})"}, {"pile", R"({"model_hash": "2"})"}});
    other.set_contenders({{"ode-quick", "ode", "0.16", "ode-quick", "", "{}", "{}"}});
  }
  EXPECT_THAT(message_of([&] { merge({"a", "other"}, "out"); }),
              AllOf(HasSubstr("no parts of one campaign"), HasSubstr("the model of 'chain' is 1"), HasSubstr("and 9")));
  EXPECT_FALSE(fs::exists(path("out"))) << "refused before anything is written";
}

TEST_F(MergeTest, AnotherProgramIsRefused) {
  three_parts();
  {
    part("d", "n1").set_manifest({{"commit", "def"}});
  }
  EXPECT_THAT(message_of([&] { merge({"a", "d"}, "out"); }), HasSubstr("assay's commit is abc"));
}

// What is left of a merge, or of a part, that is killed before it has stored more than the campaign's name.
TEST_F(MergeTest, ADirectoryThatWasOnlyBegunIsOfNoOtherProgram) {
  three_parts();
  for (const char* name : {"a", "bb", "ccc"})
    Store::create(path(name), kMergedCampaign).set_manifest({{"assay_version", "0.1.0"}});
  merge({"a", "bb", "ccc"}, "all");
  const std::string all = content_of(path("all"));
  Store::create(path("out"), kMergedCampaign);
  merge({"a", "bb", "ccc"}, "out");
  EXPECT_EQ(content_of(path("out")), all);
  Store::create(path("part"), kMergedCampaign);
  merge({"part", "a", "bb", "ccc"}, "first");
  merge({"a", "bb", "part", "ccc"}, "among");
  EXPECT_EQ(content_of(path("first")), all);
  EXPECT_EQ(content_of(path("among")), all);
  {
    part("d", "n1").set_manifest({{"assay_version", "9"}});
  }
  EXPECT_THAT(message_of([&] { merge({"part", "a", "d"}, "refused"); }), HasSubstr("assay's version is 0.1.0"));
}

TEST_F(MergeTest, ARunWithOtherStatesIsRefused) {
  three_parts();
  {
    Store d = part("d", "n1");
    Trajectory run;
    run.states.resize(2);
    for (State& state : run.states) state.bodies.resize(1);
    run.states[1].time = 1;
    write_trajectory(d.trajectories_dir(), "address1", run);
  }
  EXPECT_THAT(message_of([&] { merge({"a", "d"}, "out"); }),
              AllOf(HasSubstr("address1"), HasSubstr("another content")));
}

TEST_F(MergeTest, ATestThatPassedAndFailedIsRefused) {
  three_parts();
  {
    part("d", "n1").set_conformance("ode-quick", {{"", "free-fall", "fail", 1, 1e-5, "m", ""}});
  }
  EXPECT_THAT(message_of([&] { merge({"a", "d"}, "out"); }),
              AllOf(HasSubstr("free-fall"), HasSubstr("'fail'"), HasSubstr("'pass'")));
}

// Before nodes were stored, the manifest alone told the machine.
TEST_F(MergeTest, DirectoriesWithoutNodesGetTheirMachineFromTheManifest) {
  {
    Store old = Store::create(path("old"), kMergedCampaign);
    old.set_manifest({{"cpu", "EPYC"}, {"kernel", "6"}, {"started", "2025-01-01 10:00"}});
    old.put_cell(cell("k1", "consistency", 1, 10), {{"piece_error_m", {1, 2}}});
  }
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open((path("old") + "/assay.sqlite").c_str(), &db), SQLITE_OK);
  for (const char* sql : {"DROP TABLE nodes", "DROP TABLE plan", "DROP TABLE hashes",
                          "ALTER TABLE cells DROP COLUMN node", "ALTER TABLE cells DROP COLUMN hash",
                          "ALTER TABLE cells DROP COLUMN samples_hash", "PRAGMA user_version = 1"}) {
    ASSERT_EQ(sqlite3_exec(db, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sql;
  }
  sqlite3_close(db);
  merge({"old"}, "out");
  const Store out = Store::open(path("out"));
  ASSERT_EQ(out.nodes().size(), 1U);
  EXPECT_THAT(out.nodes()[0].json, HasSubstr("EPYC"));
  ASSERT_EQ(out.cells().size(), 1U);
  EXPECT_EQ(out.cells()[0].node, out.nodes()[0].id);
  EXPECT_EQ(out.samples(out.cells()[0].id).size(), 1U) << "with hashes of its own";
}

TEST_F(MergeTest, DamageIsNotTakenOver) {
  three_parts();
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open((path("a") + "/assay.sqlite").c_str(), &db), SQLITE_OK);
  ASSERT_EQ(
      sqlite3_exec(db, "UPDATE \"values\" SET value = 2 * value WHERE name = 'consistency'", nullptr, nullptr, nullptr),
      SQLITE_OK);
  sqlite3_close(db);
  EXPECT_THAT(message_of([&] { merge({"bb", "a"}, "out"); }),
              AllOf(HasSubstr("damaged"), HasSubstr("consistency of chain")));
}

// A union that is added to gets new hashes, after which no damage would show.
TEST_F(MergeTest, DamageOfTheUnionIsFoundBeforeItIsAddedTo) {
  three_parts();
  merge({"a"}, "out");
  int damaged = 0;
  for (const auto& [sql, says] : {std::pair("UPDATE nodes SET json = '{}'", "'nodes'"),
                                  {"UPDATE plan SET shard = 7", "'plan'"},
                                  {"DELETE FROM plan WHERE key = 'k1'", "'plan'"},
                                  {"UPDATE conformance SET note = 'x'", "'conformance'"},
                                  {"UPDATE runs SET timestep_ms = 2", "'runs'"},
                                  {"UPDATE systems SET json = '{}'", "'systems'"},
                                  {"UPDATE \"values\" SET value = 2 * value", "2 of 2 cells"}}) {
    SCOPED_TRACE(sql);
    const std::string name = fmt::format("damaged{}", damaged++);
    fs::copy(path("out"), path(name), fs::copy_options::recursive);
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open((path(name) + "/assay.sqlite").c_str(), &db), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(db, sql, nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(db);
    EXPECT_THAT(message_of([&] { merge({"bb"}, name); }),
                AllOf(HasSubstr(name), HasSubstr("damaged"), HasSubstr(says)));
    EXPECT_THAT(message_of([&] { merge({name}, "other"); }), AllOf(HasSubstr("damaged"), HasSubstr(says)));
  }
  merge({"bb", "ccc"}, "out");
  EXPECT_EQ(Store::open(path("out")).plan().size(), 5U);
}

TEST(Differences, SayWhatIsNotTheSame) {
  const Difference model = {DifferenceKind::kModel, "chain", "the model of 'chain'", "1", ""};
  EXPECT_EQ(model.text("a", "b"), "the model of 'chain' is 1 in 'a' and not stored in 'b'");
  const Difference lacking = {DifferenceKind::kCoverage, "chain", "system 'chain'", "", "there"};
  EXPECT_EQ(lacking.text("a", "b"), "only 'b' has the system 'chain'");
}

// Results of before have no notes on a model, and their words may change: the model's hash says what it is.
TEST(Differences, DoNotCountNotesOnAModel) {
  Description before, after;
  before.systems = {{"chain", R"({"model_hash": "1"})"}};
  after.systems = {{"chain", R"({"model_hash": "1", "notes": ["sensors are left out"]})"}};
  EXPECT_TRUE(differences(before, after).empty());
  after.systems = {{"chain", R"({"model_hash": "2", "notes": ["sensors are left out"]})"}};
  ASSERT_EQ(differences(before, after).size(), 1U);
  EXPECT_EQ(differences(before, after).front().kind, DifferenceKind::kModel);
}

}  // namespace
}  // namespace assay
