#include "results/transfer_matrix.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/json.h"
#include "measures/transfer.h"
#include "model/kinematics.h"
#include "results/store/scene.h"
#include "results/store/store.h"
#include "temp_folder.h"

namespace assay {
namespace {

class TransferMatrixTest : public TempFolderTest {
 protected:
  // One contender in which the policy was trained, and one with these samples of three initial states.
  Store store(const std::vector<SampleSeries>& samples) {
    Store made = Store::create(dir_.string(), {"c", "h"});
    made.set_systems({{"walk",
                       R"({"control": "policy of 2 actions", "trained_in": "a", "trained_ms": 5, "duration_s": 10,
                           "shown_state": 1})"}});
    Model model;
    model.bodies.push_back({.name = "trunk", .X_PB = {}, .mass = 1});
    model.bodies.push_back({.name = "shank", .parent = 0, .joint = 0, .X_PB = {}, .mass = 1});
    model.joints.push_back({.name = "knee", .body = 1});
    model.initial = reference_state(model);
    made.set_scenes({{"walk", scene_text(scene_of(model))}});
    for (const char* contender : {"a", "b"}) {
      Cell cell;
      cell.key = cell.contender = contender;
      cell.system = "walk";
      cell.measure = "transfer";
      cell.timestep_ms = 5;
      cell.values = {{"fall_rate", "1", 0.0, 0.0, 0.15}};
      made.put_cell(cell, cell.contender == "a" ? std::vector<SampleSeries>() : samples);
    }
    return made;
  }
};

TEST_F(TransferMatrixTest, NamesWhatPartsFirstInMostRuns) {
  const Store made = store({{kPartingTimes, {0.5, 0.25, kNeverParted, kNotCompared, 0.75}},
                            {kPartingBodies, {1, 1, -1, -1, 0}},
                            {kPartingJoints, {0, 0, -1, -1, -1}},
                            {kPartingContacts, {1, 0, 0, 0, 0}}});
  const Results results(made);
  const TransferMatrix matrix = transfer_matrix(results, "walk").value_or(TransferMatrix());
  ASSERT_EQ(matrix.rows.size(), 2U);
  EXPECT_TRUE(matrix.rows[0].trained);
  EXPECT_EQ(matrix.rows[0].parting.starts, 0U);
  const TransferParting& parting = matrix.rows[1].parting;
  EXPECT_EQ(parting.starts, 4U);
  EXPECT_EQ(parting.parted, 3U);
  EXPECT_EQ(parting.body, "shank");
  EXPECT_EQ(parting.same_body, 2U);
  EXPECT_EQ(parting.joint, "knee");
  EXPECT_EQ(parting.contact, 1U);
  EXPECT_EQ(parting.first_s, 0.25);
  EXPECT_EQ(parting.median_s, 0.5);
  EXPECT_EQ(parting.shown_s, 0.25);  // of the second state, which is kept
  const auto found = transfer_json(matrix);
  EXPECT_EQ(found["rows"][1]["parting"]["joint"], "knee");
  EXPECT_TRUE(found["rows"][0]["parting"]["median_s"].is_null());
  EXPECT_EQ(found["trained_ms"], 5);
  EXPECT_THAT(found["answer"][0].get<std::string>(), testing::HasSubstr("2 of 2 contenders"));
}

TEST_F(TransferMatrixTest, NumbersThatNameNothingAreNoName) {
  const Store made =
      store({{kPartingTimes, {0.5}}, {kPartingBodies, {7}}, {kPartingJoints, {9}}, {kPartingContacts, {0}}});
  const Results results(made);
  const TransferMatrix matrix = transfer_matrix(results, "walk").value_or(TransferMatrix());
  ASSERT_EQ(matrix.rows.size(), 2U);
  EXPECT_EQ(matrix.rows[1].parting.body, "");
  EXPECT_EQ(matrix.rows[1].parting.joint, "");
  EXPECT_FALSE(matrix.rows[1].parting.shown_s);
}

// ---- against the run of training ------------------------------------------------------------------------------------

// A row that stays up in all of 40 runs, with one value and its interval.
TransferRow row_with(const char* name, double value, double low, double high) {
  TransferRow row;
  row.falls = std::vector<double>(40, 0);
  row.values["fall_rate"] = {"fall_rate", "1", 0.0, 0.0, 0.09};
  row.values[name] = {name, "m/s", value, low, high};
  return row;
}

TEST(TransferExcess, EvenTheNearEndsAreManyTimesApart) {
  const TransferRow trained = row_with("foot_slip", 0.95, 0.9, 1.0);
  for (const auto& [low, worse] : {std::pair(kManyTimes, true), {kManyTimes - 1e-9, false}}) {
    TransferRow row = row_with("foot_slip", 2.85, low, 3.5);
    row.excesses = excesses(row, trained);
    EXPECT_EQ(row.verdict(), worse ? "stays up, but worse" : "stays up") << low;
    ASSERT_EQ(row.excesses.size(), worse ? 1U : 0U) << low;
    EXPECT_EQ(excess_text(row.excesses), worse ? "slips 3 times as much" : "");
  }
}

TEST(TransferAnswer, NamesTheTimestepsThatWereTried) {
  const auto up = [](const char* contender, double timestep_ms) {
    TransferRow row = row_with("foot_slip", 1, 0.9, 1.1);
    row.contender = contender;
    row.timestep_ms = timestep_ms;
    return row;
  };
  TransferMatrix matrix;
  matrix.rows = {up("a", 5), up("b", 5)};
  EXPECT_THAT(transfer_answer(matrix), testing::ElementsAre("2 of 2 contenders stay up at 5 ms"));
  // 'b' was not run at 10 ms
  matrix.rows.push_back(up("a", 10));
  EXPECT_THAT(transfer_answer(matrix),
              testing::ElementsAre("1 of 2 contenders stays up at 5 and 10 ms: a", "stays up: b at 5 ms"));
  matrix.rows.back().values["fall_rate"] = {"fall_rate", "1", 1.0, 0.91, 1.0};
  EXPECT_THAT(transfer_answer(matrix), testing::ElementsAre("0 of 2 contenders stay up at 5 and 10 ms",
                                                            "falls: a at 10 ms", "stays up: a at 5 ms; b at 5 ms"));
  matrix.rows = {up("a", 20), up("a", 0.25), up("a", 1), up("a", 5), up("a", 10)};
  EXPECT_THAT(transfer_answer(matrix),
              testing::ElementsAre("1 of 1 contender stays up at all 5 timesteps from 1/4 to 20 ms"));
}

TEST(TransferExcess, LessIsNoneAndNeitherIsAValueWithoutAnInterval) {
  const TransferRow trained = row_with("foot_slip", 0.95, 0.9, 1.0);
  EXPECT_TRUE(excesses(row_with("foot_slip", 0.1, 0.09, 0.11), trained).empty());
  TransferRow single = row_with("foot_slip", 10, 10, 10);
  single.values["foot_slip"].low.reset();
  EXPECT_TRUE(excesses(single, trained).empty());
  // other values are no errors
  EXPECT_TRUE(excesses(row_with("time_up", 10, 9, 11), row_with("time_up", 1, 0.9, 1.1)).empty());
}

TEST(TransferExcess, TheLargestComesFirst) {
  TransferRow trained = row_with("foot_slip", 1, 0.9, 1.1), row = row_with("foot_slip", 4, 3, 5);
  trained.values["joint_power"] = {"joint_power", "W", 40.0, 39.0, 41.0};
  row.values["joint_power"] = {"joint_power", "W", 400.0, 390.0, 410.0};
  EXPECT_EQ(excess_text(excesses(row, trained)), "takes 10 times as much power and slips 4 times as much");
}

TEST(TransferExcess, OneThatFallsIsNotCalledUp) {
  TransferRow row = row_with("foot_slip", 4, 3, 5);
  row.values["fall_rate"] = {"fall_rate", "1", 1.0, 0.91, 1.0};
  row.excesses = excesses(row, row_with("foot_slip", 1, 0.9, 1.1));
  EXPECT_EQ(row.excesses.size(), 1U);
  EXPECT_EQ(row.verdict(), "falls");
}

class AgainstTrainingTest : public TempFolderTest {
 protected:
  // Contenders "a", in which the policy was trained, "b", "c", ... with so many falls in 40 runs.
  TransferMatrix matrix_of(const std::vector<int>& falls) {
    Store made = Store::create((dir_ / std::to_string(stores_++)).string(), {"c", "h"});
    made.set_systems({{"walk", R"({"trained_in": "a", "trained_ms": 5})"}});
    for (size_t i = 0; i < falls.size(); ++i) {
      Cell cell;
      cell.key = cell.contender = std::string(1, static_cast<char>('a' + i));
      cell.system = "walk";
      cell.measure = "transfer";
      cell.timestep_ms = 5;
      std::vector<double> runs(40, 0);
      std::fill_n(runs.begin(), falls[i], 1);
      cell.values = {{"fall_rate", "1", falls[i] / 40.0, 0.0, 1.0}};
      made.put_cell(cell, {{"fall_rate of states", runs}});
    }
    return transfer_matrix(Results(made), "walk").value_or(TransferMatrix());
  }
  static std::string_view against(const TransferMatrix& matrix, const std::string& contender) {
    return matrix.against_training(*std::ranges::find(matrix.rows, contender, &TransferRow::contender));
  }

 private:
  int stores_ = 0;
};

// z^2 = (n m |difference| - 1)^2 (N - 1) / (n m k (N - k)) of k falls in N = n + m runs: 3.27 and 4.10 for 20 and 21
// against 12 of 40, and 3.84 at p = 0.05.
TEST_F(AgainstTrainingTest, SharesAreToldApartByTheRankTest) {
  EXPECT_EQ(against(matrix_of({12, 20}), "b"), "not told apart");
  EXPECT_EQ(against(matrix_of({12, 21}), "b"), "falls more often");
  EXPECT_EQ(against(matrix_of({21, 12}), "b"), "falls less often");
  EXPECT_EQ(against(matrix_of({0, 0}), "b"), "not told apart");
}

TEST_F(AgainstTrainingTest, IsCorrectedForTheNumberOfRows) {
  const TransferMatrix matrix = matrix_of({12, 21, 12, 40});
  EXPECT_EQ(against(matrix, "a"), "");
  EXPECT_EQ(against(matrix, "b"), "not told apart");  // 3/2 of 0.043
  EXPECT_EQ(against(matrix, "d"), "falls more often");
  EXPECT_THAT(transfer_answer(matrix), testing::Contains("falls more often than a at 5 ms: d at 5 ms"));
  EXPECT_THAT(transfer_answer(matrix), testing::Contains("not told apart from a at 5 ms: c at 5 ms, b at 5 ms"));
}

}  // namespace
}  // namespace assay
