#include "results/transfer_matrix.h"

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

}  // namespace
}  // namespace assay
