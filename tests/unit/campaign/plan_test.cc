// Plans: which cells, under which keys, in which shard.
#include "campaign/plan.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "base/paths.h"
#include "campaign/shards.h"

namespace assay {
namespace {

constexpr const char* kText = R"(
name = "plan"
contenders = ["mujoco-euler", "A", "B"]
timesteps_ms = ["1/4", 1, 4]
reference_ms = "1/4"

[[contender]]
name = "A"
base = "mujoco-rk4"
[[contender]]
name = "B"
base = "mujoco-rk4"

[[system]]
name = "planar-chain"
duration_s = 2
measures = ["raw_speed", "consistency", "truth", "drift"]
timing_ms = [1]

[[system]]
name = "capsules-27"
duration_s = 1
measures = ["consistency"]
)";

Campaign campaign(const std::string& text = kText) { return parse_campaign(text, "plan.toml"); }

std::set<std::string> keys(const Plan& plan) {
  std::set<std::string> found;
  for (const PlannedCell& cell : plan.cells) found.insert(cell.key);
  return found;
}

TEST(Plan, IsTheCrossProductAndAlwaysTheSame) {
  const Plan plan = make_plan(campaign());
  // chain: reference, 3 x consistency, truth, drift, 1 timing; capsules: reference, 3 x consistency; 3 contenders
  EXPECT_EQ(plan.cells.size(), 3U * (1 + 3 * 3 + 1 + 1 + 3));
  EXPECT_EQ(keys(plan).size(), plan.cells.size()) << "every cell has a key of its own";
  const Plan again = make_plan(campaign());
  ASSERT_EQ(again.cells.size(), plan.cells.size());
  for (size_t i = 0; i < plan.cells.size(); ++i) EXPECT_EQ(plan.cells[i].key, again.cells[i].key);
}

TEST(Plan, KeysFollowTheContent) {
  const std::set<std::string> before = keys(make_plan(campaign()));
  std::string text = kText;
  text.replace(text.find("duration_s = 2"), 14, "duration_s = 4");
  const std::set<std::string> after = keys(make_plan(campaign(text)));
  std::vector<std::string> common;
  std::ranges::set_intersection(before, after, std::back_inserter(common));
  EXPECT_EQ(common.size(), 3U * 4) << "only the capsules' cells are still the same";
}

TEST(Plan, ASystemsContendersAloneHaveCellsOfIt) {
  std::string text = kText;
  const std::string pile = "name = \"capsules-27\"";
  text.replace(text.find(pile), pile.size(), pile + "\ncontenders = [\"mujoco-implicit\", \"B\"]");
  const Campaign restricted = campaign(text);
  std::map<int, std::set<std::string>> names;
  for (const PlannedCell& cell : make_plan(restricted).cells) {
    names[cell.system].insert(restricted.contenders[static_cast<size_t>(cell.contender)].resolved.name);
  }
  EXPECT_EQ(names[0], (std::set<std::string>{"mujoco-euler", "A", "B"}));
  EXPECT_EQ(names[1], (std::set<std::string>{"mujoco-implicit", "B"}));
}

TEST(Plan, ViolationMayBeMeasuredOfFewerRuns) {
  std::string text = kText;
  const std::string measures = "measures = [\"consistency\"]";
  text.replace(text.find(measures), measures.size(),
               "measures = [\"consistency\", \"violation\"]\nviolation_ms = [\"1/4\", 4]");
  std::map<double, long long> steps;
  for (const PlannedCell& cell : make_plan(campaign(text)).cells) {
    if (cell.measure == "violation") steps[cell.timestep_ms] = cell.steps;
  }
  EXPECT_EQ(steps, (std::map<double, long long>{{0.25, 0}, {4, 250}})) << "the finest is the reference";
}

TEST(Plan, AnEngineThatStartsSlowlyCostsItsStartsToo) {
  const Campaign both = campaign(kText);
  const Plan plan = make_plan(both);
  long long starts = 0;
  std::vector<PlannedCell> cells;
  for (const PlannedCell& cell : plan.cells) {
    if (is_timed(cell)) continue;
    cells.push_back(cell);
    starts += cell.contender == 0 ? 1 : 0;
  }
  ASSERT_GT(starts, 0);
  const double without = estimate_seconds(both, cells, expected_step_us(both), 1);
  const double native =
      estimate_seconds(both, cells, expected_step_us(both), 1, {.worker_s = {{0, 1e-3}}, .instance_s = {}});
  const double slow =
      estimate_seconds(both, cells, expected_step_us(both), 1, {.worker_s = {{0, 10}}, .instance_s = {}});
  EXPECT_DOUBLE_EQ(native, without);
  EXPECT_NEAR(slow - without, 9.95 * static_cast<double>(starts), 1e-6);
}

TEST(Plan, TimingCostsAnInstanceForEachWindowOfEachRound) {
  const Campaign both = campaign(kText);
  std::vector<PlannedCell> cells;
  std::ranges::copy_if(make_plan(both).cells, std::back_inserter(cells),
                       [](const PlannedCell& cell) { return cell.measure == "raw_speed"; });
  ASSERT_FALSE(cells.empty());
  std::map<std::pair<int, int>, double> instances;
  for (const PlannedCell& cell : cells) instances[{cell.system, cell.contender}] = 0.1;
  const auto seconds = [&](const StartTimes& starts) {
    return estimate_seconds(both, cells, expected_step_us(both), 1, starts);
  };
  const double least = 0.09 * both.timing.rounds * both.timing.windows * static_cast<double>(cells.size());
  EXPECT_GT(seconds({.worker_s = {}, .instance_s = instances}) - seconds({}), least);
}

TEST(Plan, ATimedRunIsRepeatedWhileItIsShort) {
  const auto seconds = [](double step_us) {
    const Campaign family = campaign(R"(
name = "family"
contenders = ["mujoco-euler"]
[[system]]
name = "capsules-27"
family = "capsules"
measures = ["scaling"]
timesteps_ms = [10]
duration_s = 10
)");
    return estimate_seconds(family, make_plan(family).cells, {{{0, 0}, step_us}}, 1);
  };
  EXPECT_NEAR(seconds(1e5), 100, 1) << "one run of 1000 steps";
  EXPECT_NEAR(seconds(1.9e3), 2 * 1.9, 0.3) << "until two seconds are spent";
  EXPECT_NEAR(seconds(1e2), 5 * 0.1, 0.3);
}

TEST(Plan, EqualContendersShareARunButNoCell) {
  const Plan plan = make_plan(campaign());
  std::map<std::string, std::set<std::string>> runs;  // of the chain, by contender
  const Campaign named = campaign();
  for (const PlannedCell& cell : plan.cells) {
    if (cell.measure == "reference" && cell.system == 0) {
      runs[named.contenders[static_cast<size_t>(cell.contender)].resolved.name].insert(cell.trajectory);
    }
  }
  EXPECT_EQ(runs.at("A"), runs.at("B"));
  EXPECT_NE(runs.at("A"), runs.at("mujoco-euler"));
}

TEST(Plan, ADriftAtTheReferencesTimestepReadsTheReference) {
  for (const PlannedCell& cell : make_plan(campaign()).cells) {
    if (cell.measure != "drift") continue;
    EXPECT_EQ(cell.trajectory.empty(), cell.timestep_ms != 0.25);
    EXPECT_EQ(cell.steps, 0) << "the error against the reference solution is measured on the same run";
  }
}

TEST(Plan, ShardsDivideTheWork) {
  const Campaign divided = campaign();
  const Plan plan = make_plan(divided, 3);
  EXPECT_EQ(keys(plan), keys(make_plan(divided))) << "the same cells";
  std::map<int, int> cells;
  std::map<int, std::set<int>> timing;                  // shards by system
  std::map<std::pair<int, int>, std::set<int>> pieces;  // shards by system and contender
  std::map<std::tuple<int, int, double>, std::set<int>> runs;
  for (const PlannedCell& cell : plan.cells) {
    ++cells[cell.shard];
    if (cell.measure == "raw_speed") {
      timing[cell.system].insert(cell.shard);
    } else if (!cell.trajectory.empty()) {
      pieces[{cell.system, cell.contender}].insert(cell.shard);
    } else {
      runs[{cell.system, cell.contender, cell.timestep_ms}].insert(cell.shard);
    }
  }
  EXPECT_EQ(cells.size(), 3U) << "every shard has work";
  EXPECT_EQ(cells.begin()->first, 1);
  for (const auto& [system, shards] : timing) EXPECT_EQ(shards.size(), 1U) << "speeds are compared on one machine";
  for (const auto& [pair, shards] : pieces) EXPECT_EQ(shards.size(), 1U) << "one shard makes the fine-step run";
  for (const auto& [run, shards] : runs) EXPECT_EQ(shards.size(), 1U) << "one shard makes a run for all its measures";
}

TEST(Plan, ALongGroupOfCellsIsTakenApart) {
  const Campaign one = campaign(R"(
name = "one"
contenders = ["mujoco-euler"]
timesteps_ms = ["1/4", "1/2", 1]
reference_ms = "1/4"
[[system]]
name = "planar-chain"
duration_s = 8
measures = ["consistency", "truth", "drift"]
)");
  const auto longest = [&](int shards) {
    const auto seconds = shard_seconds(one, make_plan(one, shards, ShardCells::kAccuracy));
    return std::ranges::max_element(seconds, {}, [](const auto& shard) { return shard.second; })->second;
  };
  std::set<int> used;
  std::map<double, std::set<int>> runs;
  double fine = 0;
  for (const PlannedCell& cell : make_plan(one, 8, ShardCells::kAccuracy).cells) {
    used.insert(cell.shard);
    if (cell.trajectory.empty()) {
      runs[cell.timestep_ms].insert(cell.shard);
    } else {
      fine += estimate_seconds(one, {cell}, expected_step_us(one), 1);
    }
  }
  EXPECT_EQ(used.size(), 3U) << "the fine-step run with what reads it, and two other runs";
  ASSERT_EQ(runs.size(), 2U);
  for (const auto& [timestep, shards] : runs) EXPECT_EQ(shards.size(), 1U) << timestep;
  EXPECT_NEAR(longest(8), fine, 1e-9);
  EXPECT_LT(longest(8), longest(1));
}

// Runs that are made before, and what reads them, are divided by themselves.
TEST(Plan, RunsAndWhatReadsThem) {
  const Campaign divided = campaign(R"(
name = "runs"
contenders = ["mujoco-euler", "ode-step", "mujoco-rk4"]
timesteps_ms = ["1/4", 1, 4]
reference_ms = "1/4"
measures = ["consistency", "truth", "agreement", "raw_speed"]
[[system]]
name = "planar-chain"
duration_s = 2
pieces = 4
initial_states = 4
[[system]]
name = "capsules-27"
duration_s = 1
measures = ["consistency"]
)");
  const Plan whole = make_plan(divided);
  EXPECT_TRUE(whole.runs.empty());
  std::set<std::string> read;  // fine-step runs
  for (const PlannedCell& cell : whole.cells) {
    if (!cell.trajectory.empty()) read.insert(cell.trajectory);
    read.insert(cell.other_states.begin(), cell.other_states.end());
  }
  EXPECT_EQ(read.size(), 3U * 4 + 3);
  constexpr int kParts = 6;
  const Plan runs = make_plan(divided, kParts, ShardCells::kRuns);
  std::multiset<std::string> made;
  std::map<int, std::set<int>> parts_of;  // by contender
  int solutions = 0;
  for (const PlannedRun& run : runs.runs) {
    ASSERT_TRUE(run.shard >= 1 && run.shard <= kParts);
    const PlannedCell& reads = runs.cells.at(run.cell);
    if (run.contender < 0) {
      ++solutions;
      EXPECT_EQ(reads.measure, "truth");
      continue;
    }
    made.insert(run.address);
    parts_of[run.contender].insert(run.shard);
    EXPECT_EQ(run.state == 0 ? reads.trajectory : reads.other_states.at(static_cast<size_t>(run.state) - 1),
              run.address);
  }
  EXPECT_EQ(made, std::multiset<std::string>(read.begin(), read.end())) << "each once";
  EXPECT_EQ(solutions, 1);
  size_t starts = 0;
  for (const auto& [contender, parts] : parts_of) starts += parts.size();
  EXPECT_LE(starts, size_t{kParts} + 2) << "a part has one contender, or two where one ends";
  for (const PlannedCell& cell : runs.cells) EXPECT_EQ(cell.shard, 0);
  const auto seconds = shard_seconds(divided, runs);
  EXPECT_LE(seconds.size(), size_t{kParts});
  EXPECT_GE(seconds.size(), size_t{kParts} - 1);
  EXPECT_TRUE(std::ranges::is_sorted(seconds, std::ranges::greater_equal(), [](const auto& part) {
    return part.second;
  })) << "the longest first";

  const Plan after = make_plan(divided, kParts, ShardCells::kAfterRuns);
  std::set<int> alone, waiting;
  for (const PlannedCell& cell : after.cells) {
    if (cell.shard > 0) (stands_alone(cell) ? alone : waiting).insert(cell.shard);
  }
  ASSERT_FALSE(alone.empty() || waiting.empty());
  EXPECT_LT(*alone.rbegin(), *waiting.begin()) << "the first need not wait for runs";
  std::map<std::tuple<int, int, std::string>, std::set<int>> shards;
  for (const PlannedCell& cell : after.cells) {
    EXPECT_EQ(cell.shard == 0, cell.measure == "raw_speed");
    if (cell.shard > 0) shards[{cell.system, cell.contender, cell.measure}].insert(cell.shard);
  }
  bool apart = false;
  for (const auto& [of, used] : shards) apart = apart || (std::get<2>(of) == "consistency" && used.size() > 1);
  EXPECT_TRUE(apart) << "what reads a run need not be where it is made";
  double all = 0, with_runs = 0;
  for (const auto& [shard, s] : shard_seconds(divided, after)) all += s;
  for (const auto& [shard, s] : shard_seconds(divided, make_plan(divided, kParts, ShardCells::kAccuracy)))
    with_runs += s;
  for (const auto& [shard, s] : seconds) all += s;
  EXPECT_GT(all, with_runs);
  EXPECT_LT(all, with_runs + 1 + 0.1 * static_cast<double>(runs.runs.size()))
      << "nothing is counted twice; a start for each run, and the reference solution";
}

TEST(Plan, ShardsAsText) {
  EXPECT_EQ(parse_shard("2/8").index, 2);
  EXPECT_EQ(parse_shard("2/8").count, 8);
  for (const char* wrong : {"", "1", "0/2", "3/2", "1/0", "a/b", "1/2/3", "-1/2", "1 / 2"}) {
    EXPECT_THROW(parse_shard(wrong), InputError) << wrong;
  }
}

TEST(Plan, EstimateGrowsWithStepsAndShrinksWithWorkers) {
  const Campaign estimated = campaign();
  const Plan plan = make_plan(estimated);
  std::vector<PlannedCell> accuracy;
  std::ranges::copy_if(plan.cells, std::back_inserter(accuracy),
                       [](const PlannedCell& cell) { return cell.measure != "raw_speed"; });
  std::map<std::pair<int, int>, double> slow, fast;
  for (int s = 0; s < 2; ++s) {
    for (int c = 0; c < 3; ++c) {
      slow[{s, c}] = 10000;
      fast[{s, c}] = 5000;
    }
  }
  const double one = estimate_seconds(estimated, accuracy, slow, 1);
  EXPECT_NEAR(estimate_seconds(estimated, accuracy, slow, 2) / one, 0.5, 0.01);
  EXPECT_LT(estimate_seconds(estimated, accuracy, fast, 1), one);
  EXPECT_GT(estimate_seconds(estimated, plan.cells, slow, 2), estimate_seconds(estimated, accuracy, slow, 2));
}

TEST(StepTimes, FollowTheFamilysGrowth) {
  EXPECT_EQ(time_at_size({}, 10), 0);
  EXPECT_DOUBLE_EQ(time_at_size({{20, 5}}, 80), 20) << "in proportion";
  const std::map<double, double> cubic = {{10, 1}, {40, 64}, {100, 6400}};
  EXPECT_DOUBLE_EQ(time_at_size(cubic, 10), 1);
  EXPECT_DOUBLE_EQ(time_at_size(cubic, 100), 6400);
  EXPECT_NEAR(time_at_size(cubic, 20), 8, 1e-12) << "between 10 and 40 it grows with the third power";
  EXPECT_NEAR(time_at_size(cubic, 5), 0.125, 1e-12) << "and below";
  EXPECT_NEAR(time_at_size(cubic, 200), 8 * 6400, 1e-6) << "beyond the largest no steeper than that";
  const std::map<double, double> robots = {{6, 10}, {13, 20}, {14, 60}};
  EXPECT_LT(time_at_size(robots, 57), 60 * std::pow(57.0 / 14, 3)) << "the last two are two robots, not a law";
  EXPECT_GT(time_at_size(robots, 57), 60 * (57.0 / 14));
}

}  // namespace
}  // namespace assay
