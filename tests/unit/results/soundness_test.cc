// Results of older rules of soundness are judged again by what they have stored.
#include "results/soundness.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "measures/plausible.h"
#include "results/recommend.h"
#include "results/results.h"
#include "results/store/facts.h"
#include "results/store/store.h"
#include "temp_folder.h"

namespace assay {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Soundness : public TempFolderTest {
 protected:
  void put(const std::string& contender, double timestep_ms, const std::string& measure, std::vector<Value> values) {
    Cell cell;
    cell.key = contender + measure + std::to_string(timestep_ms);
    cell.system = "grasp";
    cell.contender = contender;
    cell.timestep_ms = timestep_ms;
    cell.measure = measure;
    cell.values = std::move(values);
    store_.put_cell(cell);
  }
  void put_runs(const std::string& contender, double timestep_ms, double beyond_rad) {
    put(contender, timestep_ms, "violation",
        {{"limit_violation_max", "rad", beyond_rad, {}, {}}, {"joint_dislocation_max", "m", 1e-4, {}, {}}});
    put(contender, timestep_ms, "grasp", {{"grasp_held", "1", 1, {}, {}}});
    put(contender, timestep_ms, "consistency", {{"consistency", "m", 1e-3 * timestep_ms, {}, {}}});
  }
  static const Cell& cell(const JudgedCells& judged, double timestep_ms, const std::string& measure) {
    const auto found = std::ranges::find_if(
        judged.cells, [&](const Cell& each) { return each.timestep_ms == timestep_ms && each.measure == measure; });
    if (found == judged.cells.end()) throw std::logic_error("no such cell");
    return *found;
  }

  Store store_ = Store::create(dir_, {"test", "1"});
};

TEST_F(Soundness, ARunFarBeyondALimitIsUnstableWithAllOfItsMeasures) {
  put_runs("havok", 1, 0.1);
  put_runs("havok", 2, 19.7);
  put_runs("havok", 4, 6.2);
  const JudgedCells judged = judged_cells(store_);
  EXPECT_EQ(judged.changed, 2U);
  EXPECT_THAT(judged.note, HasSubstr("2 cells that were stored as ok are unstable"));
  EXPECT_THAT(judged.note, HasSubstr("no value to judge again"));
  for (const char* measure : {"violation", "grasp"}) {
    EXPECT_EQ(cell(judged, 2, measure).outcome, Outcome::kUnstable) << measure;
    EXPECT_THAT(cell(judged, 2, measure).reason, HasSubstr("19.7 rad beyond its limit"));
    EXPECT_EQ(cell(judged, 4, measure).outcome, Outcome::kOk) << "a violation";
  }
  EXPECT_EQ(cell(judged, 2, "consistency").outcome, Outcome::kOk) << "its pieces are other runs";
  const Results results(store_);
  EXPECT_EQ(results.judged_note(), judged.note);
  const SystemAnswers answers = answers_of(results, "grasp");
  for (const Point& point : answers.points) {
    EXPECT_EQ(point.sound, point.timestep_ms < 2) << "not sound from 2 ms on";
  }
}

TEST_F(Soundness, OneInitialStateIsEnough) {
  Cell runs;
  runs.key = "one";
  runs.system = "grasp";
  runs.contender = "havok";
  runs.timestep_ms = 1;
  runs.measure = "violation";
  runs.values = {{"limit_violation_max", "rad", 4.0, {}, {}}};  // the mean
  store_.put_cell(runs, {{"limit_violation_max of states", {0.1, 11.8, 0.1}}});
  EXPECT_THAT(cell(judged_cells(store_), 1, "violation").reason, HasSubstr("11.8 rad beyond its limit"));
}

TEST_F(Soundness, TodaysResultsAreTakenAsTheyAre) {
  put_runs("havok", 2, 19.7);
  store_.set_manifest({{kSoundnessEntry, std::to_string(kSoundnessRules)}});
  const JudgedCells judged = judged_cells(store_);
  EXPECT_EQ(judged.changed, 0U);
  EXPECT_THAT(judged.note, IsEmpty());
  EXPECT_EQ(cell(judged, 2, "violation").outcome, Outcome::kOk);
  store_.set_manifest({{kSoundnessEntry, "1"}});
  EXPECT_EQ(judged_cells(store_).changed, 2U);
}

TEST_F(Soundness, WhatLayBelowTheGroundByAnOlderRuleStaysUnstableAndIsSaid) {
  Cell runs;
  runs.key = "foot";
  runs.system = "humanoid";
  runs.contender = "bullet-default";
  runs.timestep_ms = 8;
  runs.measure = "violation";
  runs.outcome = Outcome::kUnstable;
  runs.reason = "at 0.5 s: a shape of body 'foot' lies wholly below the ground, by 0.00028 m";
  store_.put_cell(runs);
  store_.set_manifest({{kSoundnessEntry, "2"}});
  EXPECT_THAT(judged_cells(store_).note, HasSubstr("1 cell is unstable by an older rule"));
  store_.set_manifest({{kSoundnessEntry, std::to_string(kSoundnessRules)}});
  EXPECT_THAT(judged_cells(store_).note, IsEmpty());
}

}  // namespace
}  // namespace assay
