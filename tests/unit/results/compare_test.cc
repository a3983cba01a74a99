// What changed: found where it changed, not found where nothing did, refused where nothing can be said.
#include "results/compare/compare.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "measures/rank_test.h"
#include "measures/statistics.h"
#include "results/compare/change_points.h"
#include "results/compare/history.h"
#include "temp_folder.h"

namespace assay {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class CompareTest : public TempFolderTest {
 protected:
  struct Made {
    double slower = 1;    // the times of "engine-a"
    double error = 1e-3;  // of "engine-a"
    std::uint64_t seed = 1;
    double noise = 0.01;  // of processes, relative
    int processes = 10;
    double drift = 1;  // the machine's, of all times
    std::string model = "1", settings = {}, commit = "abc", cpu = "EPYC", plugin = "p1";
    Outcome outcome = Outcome::kOk;  // of engine-a's truth
    std::string started = "2026-01-01";
    std::vector<double> windows = {};  // begins of the timed windows, s; empty: samples of version 0.1
    Outcome timed_a = Outcome::kOk, timed_b = Outcome::kOk;  // of the timings of engine-a and engine-b
    bool has_a = true;                                       // cells of engine-a
    std::string node = {};                                   // that measured, "" for none that is known
    std::vector<double> states = {};                         // penetration of engine-a in each initial state, m
    int timings = 1;                                         // of each contender, at as many timesteps
    bool has_error = true;                                   // of engine-a
    std::vector<double> pieces = {}, piece_states = {};      // errors of engine-a's pieces of both lengths, m
  };

  std::string path(const std::string& name) const { return (dir_ / name).string(); }

  void make(const std::string& name, const Made& made) const {
    Store store = Store::create(path(name), {"nightly", "0123"});
    store.set_manifest({{"commit", made.commit}, {"cpu", made.cpu}, {"seed", "1"}, {"started", made.started}});
    store.set_systems({{"chain", fmt::format(R"({{"model_hash":"{}","duration_s":1}})", made.model)}});
    store.set_contenders(
        {{"engine-a", "a", "1", "engine-a", made.settings, "{}", fmt::format(R"({{"plugin":"{}"}})", made.plugin)},
         {"engine-b", "b", "1", "engine-b", "", "{}", "{}"}});
    std::mt19937_64 random(made.seed);
    std::normal_distribution<double> normal(0, made.noise);
    int key = 0;
    if (!made.node.empty()) store.set_node({"n", fmt::format(R"({{"name":"{}"}})", made.node)});
    for (const std::string contender : {"engine-a", "engine-b"}) {
      const bool is_a = contender == "engine-a";
      if (is_a && !made.has_a) continue;
      if (is_a && !made.states.empty()) {
        Cell violation = cell(fmt::format("{}", ++key), contender, "violation");
        violation.values = {{"penetration_rms", "m", mean(made.states), {}, {}}};
        store.put_cell(violation, {{"penetration_rms of states", made.states}});
      }
      if (is_a && !made.pieces.empty()) {
        Cell pieces = cell(fmt::format("{}", ++key), contender, "consistency");
        std::vector<SampleSeries> samples;
        for (const std::string length : {"", " 100 ms"}) {
          const std::string value = length.empty() ? "consistency" : "consistency_100ms";
          pieces.values.push_back({value, "m", mean(made.pieces), {}, {}});
          samples.push_back({"piece_error_m" + length, made.pieces});
          if (!made.piece_states.empty()) samples.push_back({"piece_state" + length, made.piece_states});
        }
        store.put_cell(pieces, samples);
      }
      Cell truth = cell(fmt::format("{}", ++key), contender, "truth");
      truth.outcome = is_a ? made.outcome : Outcome::kOk;
      const bool has_error = truth.outcome == Outcome::kOk || truth.outcome == Outcome::kUnstable;
      if (has_error && (!is_a || made.has_error))
        truth.values = {{"truth_error", "m", is_a ? made.error : 1e-3, {}, {}}};
      store.put_cell(truth);
      for (int timing = 0; timing < made.timings; ++timing) {
        Cell speed = cell(fmt::format("{}", ++key), contender, "raw_speed");
        speed.timestep_ms = 1 + timing;
        speed.outcome = is_a ? made.timed_a : made.timed_b;
        if (speed.outcome != Outcome::kOk) {
          store.put_cell(speed);
          continue;
        }
        std::vector<double> rounds, processes;
        for (int process = 0; process < made.processes; ++process) {
          const double time = made.drift * (is_a ? 2 * made.slower : 3) * std::exp(normal(random));
          for (int round = 0; round < 3; ++round) {
            rounds.push_back(time * std::exp(0.2 * normal(random)));
            processes.push_back(process);
          }
        }
        const double middle = std::accumulate(rounds.begin(), rounds.end(), 0.0) / static_cast<double>(rounds.size());
        speed.values = {{"step_time", "us", middle, 0.99 * middle, 1.01 * middle},
                        {"clock_share", "1", middle, {}, {}}};
        std::vector<SampleSeries> samples = {{"round_step_time_us", rounds}, {"process", processes}};
        if (!made.windows.empty()) {
          // The step of the last window takes twice as long as the others' mean, in every round.
          const size_t count = made.windows.size();
          SampleSeries times = {"window_step_time_us", {}};
          for (const double round : rounds) {
            for (size_t w = 0; w < count; ++w) times.values.push_back(w + 1 == count ? 2 * round : round);
          }
          samples.push_back(times);
          samples.push_back({"window_begin_s", made.windows});
          samples.push_back({"window_steps", std::vector<double>(count, 10)});
          samples.push_back({"window_weight", std::vector<double>(count, 1 / static_cast<double>(count))});
        }
        store.put_cell(speed, samples);
      }
    }
  }

  static Cell cell(const std::string& key, const std::string& contender, const std::string& measure) {
    Cell cell;
    cell.key = key;
    cell.system = "chain";
    cell.contender = contender;
    cell.measure = measure;
    cell.timestep_ms = 1;
    return cell;
  }

  Comparison compared(const std::string& a, const std::string& b, const CompareOptions& options = {}) const {
    return compare(Store::open(path(a)), Store::open(path(b)), options);
  }

  static const CellChange& row(const Comparison& found, const std::string& contender, const std::string& value) {
    const auto at = std::ranges::find_if(
        found.rows, [&](const CellChange& each) { return each.contender == contender && each.value == value; });
    EXPECT_NE(at, found.rows.end()) << contender << value;
    return *at;
  }

  std::string refusal(const Made& other, const CompareOptions& options = {}) const {
    make("a", {});
    make("b", other);
    try {
      compared("a", "b", options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "(nothing was refused)";
  }
};

TEST_F(CompareTest, ASlowerAndLessAccurateEngineIsFound) {
  make("a", {});
  make("b", {.slower = 1.05, .error = 1.1e-3, .seed = 2, .plugin = "p2"});
  const Comparison found = compared("a", "b");
  const CellChange& time = row(found, "engine-a", "step_time");
  EXPECT_EQ(time.change, Change::kWorse);
  EXPECT_NEAR(time.ratio.value_or(Interval{}).value, 1.05, 0.015);
  EXPECT_LT(time.ratio.value_or(Interval{}).low, 1.05);
  EXPECT_GT(time.ratio.value_or(Interval{}).high, 1.05);
  EXPECT_EQ(time.samples_a, 10U) << "processes, not rounds";
  EXPECT_FALSE(time.rounds);
  const CellChange& error = row(found, "engine-a", "truth_error");
  EXPECT_EQ(error.change, Change::kWorse);
  EXPECT_NEAR(error.ratio.value_or(Interval{}).value, 1.1, 1e-9);
  EXPECT_EQ(row(found, "engine-b", "step_time").change, Change::kNone);
  EXPECT_EQ(row(found, "engine-b", "truth_error").change, Change::kNone);
  EXPECT_EQ(found.builds.size(), 1U) << "another build is what the comparison is about";
  EXPECT_EQ(found.rows.size(), 4U) << "values that describe the measurement are not compared";
  EXPECT_EQ(regressions(found, 0.02).size(), 2U);
  EXPECT_EQ(regressions(found, 0.08).size(), 1U);
  EXPECT_TRUE(regressions(found, 0.2).empty());
  const Comparison back = compared("b", "a");
  EXPECT_EQ(row(back, "engine-a", "step_time").change, Change::kBetter);
  EXPECT_TRUE(regressions(back, 0).empty());
}

TEST_F(CompareTest, AProcessCountsByTheMeanOverItsWindows) {
  make("a", {.noise = 1e-6, .windows = {0, 0.5}});
  make("b", {.slower = 1.05, .noise = 1e-6, .windows = {0, 0.5}});
  const Comparison found = compared("a", "b");
  const CellChange& time = row(found, "engine-a", "step_time");
  EXPECT_NEAR(time.ratio.value_or(Interval{}).value, 1.05, 1e-4);
  EXPECT_EQ(time.samples_a, 10U);
  EXPECT_EQ(time.change, Change::kWorse);
}

TEST_F(CompareTest, TimesOfOtherWindowsAreNotCompared) {
  EXPECT_THAT(refusal({.slower = 2, .windows = {0, 0.5}}), AllOf(HasSubstr("other windows"), HasSubstr("engine-a")));
  make("c", {.windows = {0, 0.25}});
  make("d", {.slower = 2, .windows = {0, 0.5}});
  EXPECT_THROW(compared("c", "d"), InputError);
  EXPECT_EQ(compared("c", "d", {.across_machines = true}).rows.size(), 2U);
}

TEST_F(CompareTest, AnOutcomeThatChangedIsAChange) {
  make("a", {});
  make("b", {.outcome = Outcome::kDiverged});
  const Comparison found = compared("a", "b");
  EXPECT_EQ(row(found, "engine-a", "outcome").change, Change::kWorse);
  EXPECT_EQ(regressions(found, 10).size(), 1U) << "whatever the share";
}

TEST_F(CompareTest, ADifferenceInTheLastBitIsSeenAndIsWithinTheThreshold) {
  make("a", {});
  make("b", {.error = std::nextafter(1e-3, 1)});
  EXPECT_EQ(row(compared("a", "b"), "engine-a", "truth_error").change, Change::kWithin);
}

TEST_F(CompareTest, WhatDoesNotCompareIsRefusedByName) {
  EXPECT_THAT(refusal({.model = "2"}), AllOf(HasSubstr("the model of 'chain' is 1"), HasSubstr("2")));
  EXPECT_THAT(refusal({.settings = "iterations=9"}), HasSubstr("the settings of 'engine-a'"));
  EXPECT_THAT(refusal({.cpu = "Xeon"}), AllOf(HasSubstr("Xeon"), HasSubstr("--across-machines")));
  EXPECT_THAT(refusal({.commit = "def"}), AllOf(HasSubstr("def"), HasSubstr("--across-programs")));
  EXPECT_EQ(refusal({.commit = "def"}, {.across_programs = true}), "(nothing was refused)");
  EXPECT_THAT(refusal({}, {.control = "engine-x"}), HasSubstr("no times of the control 'engine-x'"));
  EXPECT_THAT(refusal({}, {.control = "null"}), HasSubstr("the harness without an engine"));
}

TEST_F(CompareTest, AcrossMachinesOnlyAccuracyCounts) {
  make("a", {});
  make("b", {.slower = 3, .error = 2e-3, .cpu = "Xeon"});
  const Comparison found = compared("a", "b", {.across_machines = true});
  EXPECT_EQ(found.rows.size(), 2U);
  EXPECT_EQ(row(found, "engine-a", "truth_error").change, Change::kWorse);
}

TEST_F(CompareTest, AControlTakesTheMachineOut) {
  make("a", {});
  make("b", {.seed = 2, .drift = 1.1});
  EXPECT_EQ(row(compared("a", "b"), "engine-a", "step_time").change, Change::kWorse) << "the machine's";
  const Comparison found = compared("a", "b", {.control = "engine-b"});
  EXPECT_EQ(row(found, "engine-a", "step_time").change, Change::kNone);
  make("c", {.slower = 1.08, .seed = 3, .drift = 1.1});
  EXPECT_EQ(row(compared("a", "c", {.control = "engine-b"}), "engine-a", "step_time").change, Change::kWorse);
}

// A rank test alone cannot do that: 6 processes have a p-value of 0.002 at the least.
TEST_F(CompareTest, FewProcessesShowALargeChangeAmongMany) {
  make("a", {.processes = 3, .timings = 100});
  make("b", {.slower = 2, .seed = 2, .processes = 3, .timings = 100});
  const Comparison found = compared("a", "b");
  EXPECT_EQ(regressions(found, 0.05).size(), 100U);
  EXPECT_TRUE(std::ranges::all_of(
      found.rows, [](const CellChange& each) { return each.contender == "engine-a" || each.change == Change::kNone; }));
}

TEST_F(CompareTest, WhatTheSamplesDoNotExcludeIsUndecided) {
  make("a", {.noise = 0.1, .processes = 3});
  make("b", {.slower = 1.05, .seed = 2, .noise = 0.1, .processes = 3});
  const Comparison found = compared("a", "b");
  EXPECT_TRUE(regressions(found, 0.05).empty());
  EXPECT_EQ(undecided(found, 0.05).size(), 2U);
  make("c", {.seed = 3, .processes = 10});
  make("d", {.seed = 4, .processes = 10});
  EXPECT_TRUE(undecided(compared("c", "d"), 0.05).empty());
}

TEST_F(CompareTest, CellsThatAreMissingAreAGap) {
  make("a", {});
  make("b", {.has_a = false});
  const Comparison found = compared("a", "b");
  EXPECT_EQ(found.only_a.size(), 2U);
  EXPECT_TRUE(regressions(found, 0.05).empty());
  EXPECT_THAT(gaps(found), AllOf(HasSubstr("2 cells"), HasSubstr("engine-a"), HasSubstr("chain")));
  EXPECT_EQ(gaps(compared("a", "a")), "");
}

TEST_F(CompareTest, AControlThatFailedIsWorseAndAGap) {
  make("a", {});
  make("b", {.slower = 2, .timed_b = Outcome::kCrashed});
  const Comparison found = compared("a", "b", {.control = "engine-b"});
  EXPECT_EQ(row(found, "engine-b", "outcome").change, Change::kWorse);
  EXPECT_EQ(found.without_control.size(), 1U);
  EXPECT_THAT(gaps(found), HasSubstr("without a time of the control"));
}

TEST_F(CompareTest, TimesOfASystemThatAnotherMachineTimedAreRefused) {
  make("a", {.node = "n1"});
  make("b", {.node = "n2"});
  EXPECT_THROW(compared("a", "b"), InputError);
  EXPECT_THROW(history({path("a"), path("b")}, {}), InputError);
  EXPECT_NO_THROW(history({path("a"), path("b")}, {.across_machines = true}));
}

TEST_F(CompareTest, RoundingIsNoRegressionAndTheSignOfAnErrorDoesNotCount) {
  make("a", {.error = 2e-13});
  make("b", {.error = 4e-13});
  make("zero", {.error = 0});
  EXPECT_EQ(row(compared("a", "b"), "engine-a", "truth_error").change, Change::kWithin);
  EXPECT_EQ(row(compared("zero", "b"), "engine-a", "truth_error").change, Change::kWithin);
  make("plus", {.error = 3e-4});
  make("minus", {.error = -3e-4});
  make("more", {.error = -6e-4});
  EXPECT_EQ(row(compared("plus", "minus"), "engine-a", "truth_error").change, Change::kWithin);
  EXPECT_EQ(row(compared("plus", "more"), "engine-a", "truth_error").change, Change::kWorse);
  const Comparison from_zero = compared("zero", "plus");
  const CellChange& grown = row(from_zero, "engine-a", "truth_error");
  EXPECT_EQ(grown.change, Change::kWorse);
  EXPECT_FALSE(grown.ratio);
}

// Another build rounds otherwise: in a chaotic motion some states get better and some worse.
TEST_F(CompareTest, AChangeThatIsNotAlikeInTheStatesIsUnsettled) {
  make("a", {.states = {1e-3, 2e-3, 1.5e-3, 3e-3, 0.7e-3, 1e-3}});
  make("worse", {.states = {1.05e-3, 2.1e-3, 1.575e-3, 3.15e-3, 0.735e-3, 1.05e-3}});
  make("chaos", {.states = {2e-3, 1e-3, 1.5e-3, 6e-3, 0.4e-3, 1.2e-3}});
  EXPECT_EQ(row(compared("a", "worse"), "engine-a", "penetration_rms").change, Change::kWorse);
  const Comparison chaos = compared("a", "chaos");
  EXPECT_EQ(row(chaos, "engine-a", "penetration_rms").change, Change::kUnsettled);
  EXPECT_TRUE(regressions(chaos, 0.05).empty());
  EXPECT_THAT(comparison_markdown(chaos), HasSubstr("| unsettled | chain | engine-a |"));
}

TEST_F(CompareTest, AMeanThatOneStateMovedAgainstTheOthersIsUnsettled) {
  std::vector<double> before(20, 1e-3), after(20, 0.9e-3);
  before.back() = 2e-2;
  after.back() = 2.6e-2;
  make("a", {.states = before});
  make("b", {.states = after});
  const Comparison found = compared("a", "b");
  const CellChange& penetration = row(found, "engine-a", "penetration_rms");
  EXPECT_GT(penetration.ratio.value_or(Interval{}).value, 1.1);
  EXPECT_EQ(penetration.change, Change::kUnsettled);
  const auto open = undecided(found, 0.05);
  ASSERT_EQ(open.size(), 1U) << "a CI is told";
  EXPECT_EQ(open.front()->value, "penetration_rms");
  EXPECT_TRUE(undecided(compared("b", "a"), 0.05).empty()) << "smaller is no matter";
}

TEST_F(CompareTest, FromZeroIsTestedToo) {
  std::vector<double> one(20, 0), all(20, 1e-3);
  one.front() = 1e-3;
  make("zero", {.states = std::vector<double>(20, 0)});
  make("one", {.states = one});
  make("all", {.states = all});
  EXPECT_EQ(row(compared("zero", "one"), "engine-a", "penetration_rms").change, Change::kUnsettled);
  EXPECT_EQ(regressions(compared("zero", "one"), 0.05).size(), 0U);
  EXPECT_EQ(row(compared("zero", "all"), "engine-a", "penetration_rms").change, Change::kWorse);
}

// Pieces of one motion depend on each other: three states are three figures, whatever their pieces.
TEST_F(CompareTest, PiecesOfOneMotionAreOneFigure) {
  const std::vector<double> states = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2};
  std::vector<double> before(12, 1e-3),
      after = {4e-3, 4.1e-3, 3.9e-3, 4e-3, 1.1e-3, 1.1e-3, 1.1e-3, 1.1e-3, 1.05e-3, 1.05e-3, 1.05e-3, 1.05e-3};
  make("a", {.pieces = before, .piece_states = states});
  make("b", {.pieces = after, .piece_states = states});
  const Comparison found = compared("a", "b");
  for (const char* value : {"consistency", "consistency_100ms"}) {
    EXPECT_EQ(row(found, "engine-a", value).samples_a, 3U) << value;
    EXPECT_EQ(row(found, "engine-a", value).change, Change::kUnsettled) << value;
  }
  make("one a", {.pieces = before});
  make("one b", {.pieces = after});
  EXPECT_EQ(row(compared("one a", "one b"), "engine-a", "consistency").samples_a, 12U) << "of one motion";
}

TEST_F(CompareTest, WhatIsSlowerByLessThanTheLimitMayStillBeSlowerByTheLimit) {
  make("a", {.noise = 0.02, .processes = 12});
  make("b", {.slower = 1.04, .seed = 2, .noise = 0.02, .processes = 12});
  const Comparison found = compared("a", "b");
  const CellChange& time = row(found, "engine-a", "step_time");
  ASSERT_EQ(time.change, Change::kWorse);
  const double high = time.ratio.value_or(Interval{}).high;
  EXPECT_TRUE(regressions(found, 0.99 * (high - 1)).empty());
  EXPECT_EQ(undecided(found, 0.99 * (high - 1)).size(), 1U);
  EXPECT_TRUE(undecided(found, 1.01 * (high - 1)).empty());
}

TEST_F(CompareTest, TwoProcessesNameNoChange) {
  make("a", {.noise = 0, .processes = 2});
  make("b", {.slower = 1.5, .noise = 0, .processes = 2});
  const Comparison found = compared("a", "b");
  EXPECT_EQ(row(found, "engine-a", "step_time").change, Change::kNone);
  EXPECT_EQ(undecided(found, 0.05).size(), 1U);
  make("c", {.noise = 0, .processes = 3});
  make("d", {.slower = 1.5, .noise = 0, .processes = 3});
  EXPECT_EQ(row(compared("c", "d"), "engine-a", "step_time").change, Change::kWorse);
}

TEST_F(CompareTest, FiguresOfUnstableCellsAreComparedAndMissingOnesAreAGap) {
  make("a", {.outcome = Outcome::kUnstable});
  make("b", {.error = 2e-3, .outcome = Outcome::kUnstable});
  EXPECT_EQ(row(compared("a", "b"), "engine-a", "truth_error").change, Change::kWorse);
  make("c", {});
  make("d", {.has_error = false});
  const Comparison found = compared("c", "d");
  EXPECT_EQ(found.values_only_in_a.size(), 1U);
  EXPECT_THAT(gaps(found), AllOf(HasSubstr("1 value"), HasSubstr("truth_error of 'engine-a'")));
  EXPECT_EQ(gaps(compared("d", "c")), "");
}

TEST_F(CompareTest, TablesHaveAllRowsAndNoNan) {
  make("a", {});
  make("b", {.slower = 1.2, .seed = 2});
  const Comparison found = compared("a", "b");
  const std::string csv = comparison_csv(found);
  EXPECT_EQ(std::ranges::count(csv, '\n'), 1 + std::ssize(found.rows));
  EXPECT_EQ(csv.find("nan"), std::string::npos);
  const nlohmann::json written = comparison_json(found);
  EXPECT_EQ(written["rows"].size(), found.rows.size());
  EXPECT_EQ(written.dump().find("nan"), std::string::npos);
  EXPECT_THAT(comparison_markdown(found), HasSubstr("| worse | chain | engine-a | 1 | step_time |"));
}

// In forty pairs of runs with the noise of a quiet machine.
TEST_F(CompareTest, FivePercentAreFoundAndNothingIsFoundInNothing) {
  int found = 0, false_alarms = 0;
  constexpr int kPairs = 40;
  for (int i = 0; i < kPairs; ++i) {
    const auto seed = 3 * static_cast<std::uint64_t>(i);
    const std::string a = fmt::format("a{}", i), b = fmt::format("b{}", i), same = fmt::format("s{}", i);
    make(a, {.seed = seed + 1, .noise = 0.015});
    make(b, {.slower = 1.05, .seed = seed + 2, .noise = 0.015});
    make(same, {.seed = seed + 3, .noise = 0.015});
    found += row(compared(a, b), "engine-a", "step_time").change == Change::kWorse ? 1 : 0;
    const Comparison nothing = compared(a, same);
    false_alarms += std::ranges::any_of(nothing.rows,
                                        [](const CellChange& each) {
                                          return each.change == Change::kWorse || each.change == Change::kBetter;
                                        })
                        ? 1
                        : 0;
  }
  EXPECT_GE(found, 38);
  EXPECT_LE(false_alarms, 2);
}

TEST_F(CompareTest, AHistoryNamesTheRunSinceWhichAnEngineIsSlower) {
  std::vector<std::string> dirs;
  for (int i = 0; i < 12; ++i) {
    dirs.push_back(path(fmt::format("run{}", i)));
    make(fmt::format("run{}", i), {.slower = i < 7 ? 1 : 1.05,
                                   .error = i < 4 ? 1e-3 : 1.2e-3,
                                   .seed = static_cast<std::uint64_t>(i),
                                   .started = fmt::format("2026-01-{:02}", i + 1)});
  }
  std::ranges::reverse(dirs);  // the order is that of time
  const History found = history(dirs, {});
  ASSERT_EQ(found.runs.size(), 12U);
  EXPECT_EQ(found.runs[0].started, "2026-01-01");
  for (const Course& course : found.courses) {
    if (course.contender == "engine-b") {
      EXPECT_TRUE(course.changes.empty()) << course.value;
      continue;
    }
    ASSERT_EQ(course.changes.size(), 1U) << course.value;
    EXPECT_EQ(course.changes[0].run, course.value == "step_time" ? 7U : 4U) << course.value;
    EXPECT_EQ(course.changes[0].change, Change::kWorse);
  }
  EXPECT_THAT(history_markdown(found), HasSubstr("run7 (2026-01-08)"));
  EXPECT_EQ(history_json(found)["courses"].size(), found.courses.size());
  EXPECT_THROW(history({dirs[0]}, {}), InputError);
  EXPECT_THROW(history({dirs[0], dirs[1], dirs[0] + "/."}, {}), InputError) << "the same one twice";
}

TEST_F(CompareTest, AHistoryNamesTheRunSinceWhichACellFails) {
  std::vector<std::string> dirs;
  for (int i = 0; i < 6; ++i) {
    dirs.push_back(path(fmt::format("run{}", i)));
    make(fmt::format("run{}", i), {.seed = static_cast<std::uint64_t>(i),
                                   .outcome = i < 2 ? Outcome::kDiverged : Outcome::kOk,
                                   .started = fmt::format("2026-01-{:02}", i + 1),
                                   .timed_a = i < 4 ? Outcome::kOk : Outcome::kCrashed});
  }
  const History found = history(dirs, {});
  const auto course = [&](const std::string& value) {
    return *std::ranges::find_if(
        found.courses, [&](const Course& each) { return each.contender == "engine-a" && each.value == value; });
  };
  const Course time = course("step_time"), error = course("truth_error");
  ASSERT_EQ(time.changes.size(), 1U);
  EXPECT_EQ(time.changes[0].run, 4U);
  EXPECT_EQ(time.changes[0].change, Change::kWorse);
  EXPECT_THAT(time.changes[0].text, HasSubstr("crashed"));
  ASSERT_EQ(error.changes.size(), 1U) << "failures before the first figure count";
  EXPECT_EQ(error.changes[0].run, 2U);
  EXPECT_EQ(error.changes[0].change, Change::kBetter);
}

TEST_F(CompareTest, AHistorySeesManySmallStepsAndSaysWhereItCannotLook) {
  std::vector<std::string> dirs;
  for (int i = 0; i < 3; ++i) {
    dirs.push_back(path(fmt::format("run{}", i)));
    make(fmt::format("run{}", i), {.slower = i < 1 ? 1 : 3.0,
                                   .error = 1e-3 * std::pow(1.015, i),
                                   .seed = static_cast<std::uint64_t>(i),
                                   .started = fmt::format("2026-01-{:02}", i + 1)});
  }
  const History found = history(dirs, {});
  size_t errors = 0;
  for (const Course& course : found.courses) {
    if (course.contender != "engine-a" || course.value != "truth_error") continue;
    ASSERT_EQ(course.changes.size(), 1U) << "3 % in two steps";
    EXPECT_EQ(course.changes[0].run, 2U);
    EXPECT_NEAR(course.changes[0].ratio, 1.015 * 1.015, 1e-6);
    ++errors;
  }
  EXPECT_EQ(errors, 1U);
  EXPECT_EQ(found.too_short, 2U);
  EXPECT_THAT(history_markdown(found), HasSubstr("fewer than 4"));
  for (const char* control : {"typo", "null"}) EXPECT_THROW(history(dirs, {.control = control}), InputError) << control;
  make("last", {.seed = 9, .started = "2026-01-09", .timed_b = Outcome::kCrashed});
  dirs.push_back(path("last"));
  EXPECT_EQ(history(dirs, {.control = "engine-b"}).without_control, 1U);
}

TEST_F(CompareTest, AHistoryLeavesOutTimesOfOtherWindows) {
  std::vector<std::string> dirs;
  for (int i = 0; i < 6; ++i) {
    dirs.push_back(path(fmt::format("run{}", i)));
    make(fmt::format("run{}", i), {.slower = i < 3 ? 1 : 1.3,
                                   .seed = static_cast<std::uint64_t>(i),
                                   .started = fmt::format("2026-01-{:02}", i + 1),
                                   .windows = i < 3 ? std::vector<double>{0, 0.5} : std::vector<double>{0, 0.25}});
  }
  const History found = history(dirs, {});
  EXPECT_EQ(found.other_windows, 6U);
  for (const Course& course : found.courses) EXPECT_TRUE(course.changes.empty()) << course.value;
  EXPECT_THAT(history_markdown(found), HasSubstr("other windows"));
}

}  // namespace
}  // namespace assay
