// One owner for results: speeds, fronts, what is sound, recommendations, looks.
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "engines/about.h"
#include "engines/describe.h"
#include "report/cards.h"
#include "report/views.h"
#include "results/front.h"
#include "results/line_up.h"
#include "results/looks.h"
#include "results/recommend.h"
#include "results/store/store.h"
#include "results/values.h"
#include "temp_folder.h"

namespace assay {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

template <typename T>
T there(const std::optional<T>& found) {
  EXPECT_TRUE(found);
  return found.value_or(T());
}

// ---- values -----------------------------------------------------------------------------------------------------------------

TEST(Values, WhatAnEngineDoesNotGiveOfContactForces) {
  const auto missing = [](ContactForces given) { return values_not_given(contact_forces_given(given)); };
  EXPECT_THAT(missing(ContactForces::kNone),
              ElementsAre("contact_depth", "signorini_residual", "cone_violation", "dissipation_residual"));
  EXPECT_THAT(missing(ContactForces::kNormal), ElementsAre("cone_violation", "dissipation_residual"));
  EXPECT_THAT(missing(ContactForces::kAll), IsEmpty());
  EXPECT_THAT(values_not_given(""), IsEmpty()) << "what results of an earlier version have";
  for (const std::string& name : missing(ContactForces::kNone)) EXPECT_NE(find_value_info(name), nullptr) << name;
}

TEST(Values, OneRowEachAndAMeasureStandsForItsFirst) {
  std::set<std::string> names;
  for (const ValueInfo& info : value_catalogue()) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_FALSE(info.label.empty() || info.meaning.empty() || info.measure.empty()) << info.name;
    EXPECT_TRUE(!info.limit || info.better == Better::kLow) << info.name << ": only an error has an upper limit";
    EXPECT_TRUE(!info.plot || info.limit) << info.name;
  }
  EXPECT_EQ(value_named("truth"), "truth_error_max");
  EXPECT_EQ(value_named("truth", {value_info("truth_error")}), "truth_error")
      << "what results of an earlier version have";
  EXPECT_EQ(value_named("truth_error", {value_info("truth_error_max")}), "truth_error") << "a value's own name";
  EXPECT_EQ(value_named("drift"), "energy_drift");
  EXPECT_EQ(value_named("violation"), "joint_dislocation_max");
  EXPECT_EQ(value_named("penetration_rms"), "penetration_rms");
  EXPECT_EQ(value_named("unheard_of"), "");
  EXPECT_EQ(value_info("unheard_of").label, "Unheard of");
  EXPECT_FALSE(value_info("unheard_of").limit);
  EXPECT_EQ(value_info("consistency_8ms").label, "Self-consistency error (the paper's), pieces of 8 ms");
  EXPECT_EQ(value_info("consistency_cold_8ms").label, "Self-consistency error, pieces of 8 ms");
  EXPECT_EQ(value_info("consistency_cold_share_8ms").unit, "1");
  EXPECT_TRUE(can_limit("consistency_8ms"));
  EXPECT_FALSE(can_limit("consistency_ms"));
  EXPECT_FALSE(can_limit("consistency_floor"));
}

// ---- speed ------------------------------------------------------------------------------------------------------------------

TEST(Speed, IsInterpolatedBetweenTimedStepsAndNeverBeyond) {
  // 10 µs a step at 1 ms, 40 µs at 4 ms
  const SpeedCurve curve = {{1, {100, 90, 110}}, {4, {100, 100, 100}}};
  const Speed timed = there(speed_at(curve, 1 * (1 + 1e-12)));
  EXPECT_TRUE(timed.timed);
  EXPECT_EQ(timed.factor.low, 90);
  const Speed between = there(speed_at(curve, 2));
  EXPECT_FALSE(between.timed);
  EXPECT_NEAR(between.factor.value, 100, 1e-12) << "20 µs";
  EXPECT_NEAR(between.factor.low, std::sqrt(90 * 100), 1e-12);
  EXPECT_EQ(between.below_ms, 1);
  EXPECT_EQ(between.above_ms, 4);
  EXPECT_FALSE(speed_at(curve, 0.5));
  EXPECT_FALSE(speed_at(curve, 8));
  EXPECT_FALSE(speed_at({}, 1));
}

// ---- front ------------------------------------------------------------------------------------------------------------------

FrontPoint front_point(const std::string& contender, double speed, double error, double timestep_ms = 1) {
  return {contender, timestep_ms, {speed, 0.99 * speed, 1.01 * speed}, error};
}

TEST(Front, HoldsWhatNothingBeatsTheFastestFirst) {
  const auto front = pareto_front({front_point("a", 10, 1), front_point("b", 20, 2), front_point("c", 20, 3),
                                   front_point("d", 5, 0.5), front_point("e", 9, 1.5)});
  ASSERT_THAT(front, SizeIs(3));
  EXPECT_EQ(front[0].point, 1U);
  EXPECT_EQ(front[1].point, 0U);
  EXPECT_EQ(front[2].point, 3U);
  EXPECT_THAT(pareto_front({}), IsEmpty());
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_THAT(pareto_front({front_point("a", std::nan(""), 1), front_point("b", 1, infinite)}), IsEmpty());
}

TEST(Front, WhatNoFigureTellsApartStandsTogether) {
  const auto front = pareto_front({front_point("a", 10, 1), front_point("b", 10.1, 1.005), front_point("c", 10, 1, 2)});
  ASSERT_THAT(front, SizeIs(1));
  EXPECT_EQ(front[0].point, 0U) << "the first that was listed";
  EXPECT_THAT(front[0].equals, ElementsAre("b"));
  // Below the resolution all errors are alike.
  const auto fine = pareto_front({front_point("a", 10, 1e-13), front_point("b", 5, 1e-15)}, 1e-12);
  EXPECT_THAT(fine, SizeIs(1));
}

TEST(Front, APointOfAForgedIntervalStandsForItself) {
  // as a stranger's results may hold it: the interval does not contain the value
  FrontPoint forged = front_point("a", 10, 1), other = front_point("b", 5, 0.5);
  forged.speed.low = 1e308;
  other.speed.high = -1e308;
  const auto front = pareto_front({forged, other});
  ASSERT_THAT(front, SizeIs(2));
  EXPECT_EQ(front[0].point, 0U);
  EXPECT_EQ(front[1].point, 1U);
  EXPECT_THAT(front[0].equals, IsEmpty());
}

// ---- recommendations ----------------------------------------------------------------------------------------------------------

class RecommendTest : public TempFolderTest {
 protected:
  void SetUp() override {
    store_.set_systems({{"s", "{}"}});
    std::vector<ContenderRow> rows;
    for (const std::string name : {"fast", "slow", "null"}) rows.push_back({name, name, "1", name, "", "", ""});
    store_.set_contenders(rows);
  }

  void put(const std::string& contender, double timestep_ms, const std::string& measure, std::vector<Value> values,
           Outcome outcome = Outcome::kOk, const std::string& reason = "") {
    Cell cell;
    cell.key = contender + measure + std::to_string(timestep_ms);
    cell.system = "s";
    cell.contender = contender;
    cell.timestep_ms = timestep_ms;
    cell.measure = measure;
    cell.outcome = outcome;
    cell.reason = reason;
    cell.values = std::move(values);
    store_.put_cell(cell);
  }
  void speed(const std::string& contender, double timestep_ms, double factor) {
    put(contender, timestep_ms, "raw_speed", {{"realtime_factor", "1", factor, 0.9 * factor, 1.1 * factor}});
  }
  void error(const std::string& contender, double timestep_ms, double value) {
    put(contender, timestep_ms, "truth", {{"truth_error", "m", value, 0.5 * value, 2 * value}});
  }
  // Errors of 1, 2, 4 mm at 1, 2, 4 ms; speeds of 10, 20, 40.
  void line(const std::string& contender, double factor = 1) {
    for (const double step : {1.0, 2.0, 4.0}) {
      error(contender, step, 1e-3 * step);
      speed(contender, step, 10 * factor * step);
    }
  }
  SystemAnswers answers() { return answers_of(Results(store_), "s"); }
  // "fast at 2", or what is excluded at a place.
  static std::string best(const SystemAnswers& answers, const Limits& limits) {
    const auto found = recommend(answers, limits).best;
    if (!found) return "nobody";
    const Point& point = answers.at(answers.candidates[*found]);
    return point.contender + " at " + std::to_string(static_cast<int>(point.timestep_ms));
  }
  static std::string why(const SystemAnswers& answers, const std::string& contender, double timestep_ms) {
    for (const Excluded& each : answers.excluded) {
      const Point& point = answers.points[each.point];
      if (point.contender == contender && point.timestep_ms == timestep_ms) return each.why;
    }
    return "";
  }
  static Limits within(double error) { return {{{"truth_error", error}}, {}}; }

  Store store_ = Store::create(dir_, {"test", "1"});
};

TEST_F(RecommendTest, TheFastestWithinTheLimit) {
  line("fast", 2);
  line("slow");
  const SystemAnswers all = answers();
  EXPECT_EQ(all.main, "truth_error");
  EXPECT_EQ(best(all, within(4e-3)), "fast at 4") << "at most is enough";
  EXPECT_EQ(best(all, within(3e-3)), "fast at 2");
  EXPECT_EQ(best(all, within(0.5e-3)), "nobody");
  EXPECT_EQ(best(all, {{{"truth_error", 1}}, 81}), "nobody");
  EXPECT_EQ(best(all, {{{"truth_error", 1}}, 80}), "fast at 4");
  const Recommendation found = recommend(all, within(0.5e-3));
  EXPECT_EQ(all.at(all.candidates.at(there(found.nearest))).timestep_ms, 1);
}

TEST_F(RecommendTest, AnIntervalBeyondTheLimitIsNotCertain) {
  line("fast", 2);
  line("slow");
  const SystemAnswers all = answers();
  const Recommendation found = recommend(all, within(4e-3));  // upper ends are twice the errors
  EXPECT_NE(found.best, found.certain);
  EXPECT_EQ(all.at(all.candidates.at(there(found.certain))).timestep_ms, 2);
}

TEST_F(RecommendTest, SpeedsWhoseIntervalsMeetAreNotToldApart) {
  line("fast", 1.1);
  line("slow");
  const SystemAnswers all = answers();
  const Recommendation found = recommend(all, within(4e-3));
  ASSERT_THAT(found.alike, SizeIs(1));
  EXPECT_EQ(all.at(all.candidates[found.alike[0]]).contender, "slow");
  EXPECT_THAT(found.contenders, SizeIs(2));
}

// The run at 2 ms failed in another measure: neither it nor any larger timestep counts, however small its error.
TEST_F(RecommendTest, WhatFailsInAnyMeasureAtThisOrASmallerStepIsOut) {
  line("fast", 2);
  line("slow");
  put("fast", 2, "violation", {}, Outcome::kUnstable, "hinge 'a' is 1 m apart");
  const SystemAnswers all = answers();
  EXPECT_EQ(best(all, within(1)), "slow at 4");
  EXPECT_EQ(why(all, "fast", 2), "violation: unstable, hinge 'a' is 1 m apart");
  EXPECT_EQ(why(all, "fast", 4), "at 2 ms, violation: unstable, hinge 'a' is 1 m apart");
  EXPECT_EQ(why(all, "fast", 1), "");
  for (const Candidate& candidate : all.candidates) {
    if (all.at(candidate).contender != "fast") continue;
    EXPECT_EQ(candidate.margin,
              "fails at 2 times this step (2 ms): violation: unstable, hinge 'a' is 1 m apart; this is the smallest "
              "timestep measured");
  }
}

TEST_F(RecommendTest, EveryOutcomeButOkIsOutAndSoIsADrop) {
  for (const Outcome outcome : {Outcome::kDiverged, Outcome::kTimeout, Outcome::kCrashed, Outcome::kUnsupported}) {
    line("fast");
    put("fast", 1, "grasp", {}, outcome);
    EXPECT_EQ(best(answers(), within(1)), "nobody") << outcome_text(outcome);
  }
  put("fast", 1, "grasp", {{"grasp_held", "1", 0, {}, {}}, {"drop_time", "s", 3.2, {}, {}}});
  EXPECT_EQ(best(answers(), within(1)), "nobody");
  EXPECT_EQ(why(answers(), "fast", 1), "grasp: the object was dropped at 3.20 s");
  put("fast", 1, "grasp", {{"grasp_held", "1", 1, {}, {}}});
  EXPECT_EQ(best(answers(), within(1)), "fast at 4");
}

TEST_F(RecommendTest, AGraspQualifiesOnlyWhereAllInitialStatesHeld) {
  line("fast");
  put("fast", 1, "grasp", {{"grasp_held", "1", 1, 0.83, 1}});
  put("fast", 2, "grasp", {{"grasp_held", "1", 1, 0.75, 1}});
  put("fast", 4, "grasp", {{"grasp_held", "1", 0.95, 0.75, 0.999}, {"drop_time", "s", 3.2, {}, {}}});
  const SystemAnswers all = answers();
  EXPECT_EQ(best(all, within(1)), "fast at 2");
  EXPECT_EQ(why(all, "fast", 4), "grasp: held from 95 % of the initial states only (75 to 100 %)");
  EXPECT_EQ(all.points[0].held.value_or(Interval{}).low, 0.83);
  EXPECT_EQ(all.points[1].held.value_or(Interval{}).low, 0.75) << "the least up to there";
}

TEST_F(RecommendTest, TheLargestErrorOverTheRunCountsNotTheOneAtItsEnd) {
  line("fast");
  for (const double step : {1.0, 2.0, 4.0}) {
    put("fast", step, "truth",
        {{"truth_error_max", "m", 1e-2 * step, {}, {}}, {"truth_error", "m", 1e-3 * step, {}, {}}});
    put("slow", step, "truth", {{"truth_error_max", "m", 2e-2 * step, {}, {}}});
  }
  const SystemAnswers all = answers();
  EXPECT_EQ(all.main, kTruthError);
  EXPECT_EQ(best(all, {{{all.main, 1.5e-2}}, {}}), "fast at 1");
}

// Near a floor an error is an upper bound: it qualifies by the bound, and is on no front.
TEST_F(RecommendTest, AnErrorNearItsFloorIsABound) {
  speed("fast", 1, 10);
  put("fast", 1, "consistency",
      {{"consistency", "m", 2e-4, 1e-4, 3e-4},
       {"consistency_floor", "m", 2e-4, {}, {}},
       {"consistency_bound", "m", 5e-4, {}, {}}});
  const SystemAnswers all = answers();
  EXPECT_EQ(best(all, {{{"consistency", 5e-4}}, {}}), "fast at 1");
  EXPECT_EQ(best(all, {{{"consistency", 4e-4}}, {}}), "nobody") << "2e-4 was measured, and says nothing below 5e-4";
  EXPECT_TRUE(all.candidates.at(0).worst.at("consistency").is_bound);
  EXPECT_FALSE(all.fronts.contains("consistency"));
  const Figure figure = Results(store_).figure("s", "fast", "consistency", 1.0);
  EXPECT_TRUE(figure.is_bound);
  EXPECT_EQ(figure.value.low, 0);
  EXPECT_EQ(figure.value.high, 5e-4);
}

TEST_F(RecommendTest, TheErrorIsTheLargestUpToTheStep) {
  line("slow");
  error("slow", 2, 1.0);  // worse than at 4 ms
  const SystemAnswers all = answers();
  EXPECT_EQ(best(all, within(10e-3)), "slow at 1") << "4 ms is lucky";
  const Candidate& fastest = all.candidates.front();
  EXPECT_EQ(fastest.worst.at("truth_error").value.value, 1.0);
  EXPECT_EQ(fastest.worst.at("truth_error").at_ms, 2);
  EXPECT_EQ(fastest.worst.at("truth_error").value.high, 2.0);
  EXPECT_EQ(fastest.margin, "this is the largest timestep measured: a larger one may do, and be faster");
  EXPECT_EQ(fastest.end_of_grid, "largest");
}

TEST_F(RecommendTest, AnAnswerAtAnEndOfTheTimestepsThatWereTriedSaysSo) {
  line("slow");
  const SystemAnswers all = answers();
  const auto candidate = [&](double timestep_ms) -> const Candidate& {
    return *std::ranges::find(all.candidates, timestep_ms,
                              [&](const Candidate& each) { return all.at(each).timestep_ms; });
  };
  EXPECT_EQ(candidate(1).end_of_grid, "smallest");
  EXPECT_THAT(candidate(1).margin, testing::EndsWith("this is the smallest timestep measured"));
  EXPECT_EQ(candidate(2).end_of_grid, "");
  EXPECT_EQ(candidate(4).end_of_grid, "largest");
  const Results results(store_);
  EXPECT_EQ(answers_together(results, {"s"}, "all").candidates.front().end_of_grid, "largest");
}

TEST_F(RecommendTest, OfTheLargestSoundTimestepTheLeastErrorIsNamedWhetherTimedOrNot) {
  line("fast");
  line("slow");
  error("fast", 8, 5e-3);
  error("slow", 8, 4.5e-3);
  const Results results(store_);
  const nlohmann::json cards = card_data(results, answers_of(results, "s"));
  EXPECT_THAT(cards["answers"].back()["text"].get<std::string>(), testing::StartsWith("slow at 8 ms"));
}

TEST_F(RecommendTest, WithdrawnCellsHaveNoFigureAndSayWhy) {
  store_.set_systems({{"s", R"({"contacts": true, "contact_pairs": 1, "hinges": 2})"}});
  line("fast");
  Cell cell;
  cell.key = "withdrawn";
  cell.system = "s";
  cell.contender = "physx-art-tgs";
  cell.timestep_ms = 1;
  cell.measure = "truth";
  cell.started = 1.7e9;  // in 2023
  cell.values = {{"truth_error", "m", 1e-9, {}, {}}};
  store_.put_cell(cell);
  const SystemAnswers all = answers();
  EXPECT_THAT(why(all, "physx-art-tgs", 1), testing::HasSubstr("withdrawn until it is measured again: PhysX 5.1.3"));
  EXPECT_EQ(Results(store_).figure("s", "physx-art-tgs", "truth_error", 1.0).found, Found::kMissing);
}

TEST_F(RecommendTest, AStepThatWasNotTimedIsSaidSoAndNoneIsBeyondTheTimedOnes) {
  line("slow");
  error("slow", 3, 3e-3);
  error("slow", 8, 8e-3);
  error("slow", 0.5, 0.5e-3);
  const SystemAnswers all = answers();
  EXPECT_EQ(best(all, within(1)), "slow at 4");
  EXPECT_THAT(why(all, "slow", 8), HasSubstr("not timed"));
  EXPECT_THAT(why(all, "slow", 0.5), HasSubstr("not timed"));
  for (const Candidate& candidate : all.candidates) {
    const Point& point = all.at(candidate);
    EXPECT_EQ(candidate.speed.timed, point.timestep_ms != 3);
  }
}

TEST_F(RecommendTest, AMissingValueDoesNotPass) {
  line("slow");
  put("slow", 1, "violation", {{"penetration_max", "m", 1e-3, {}, {}}});
  const SystemAnswers all = answers();
  EXPECT_EQ(best(all, {{{"truth_error", 1}, {"penetration_max", 1}}, {}}), "slow at 1");
  EXPECT_EQ(best(all, {{{"penetration_max", 0.1e-3}}, {}}), "nobody");
}

TEST_F(RecommendTest, TheFineStepRunsOwnTimestepHasNoSelfConsistencyError) {
  for (const double step : {0.5, 1.0}) {
    speed("slow", step, 10 * step);
    std::vector<Value> values = {{"consistency", "m", step == 1 ? 1e-3 : 5e-3, {}, {}}};
    if (step < 1) values.push_back({"restart_floor", "m", 5e-3, {}, {}});
    put("slow", step, "consistency", std::move(values));
  }
  const SystemAnswers all = answers();
  ASSERT_THAT(all.candidates, SizeIs(1));
  EXPECT_EQ(all.candidates[0].worst.at("consistency").value.value, 1e-3);
}

TEST_F(RecommendTest, TheReportSaysTheSame) {
  line("fast", 2);
  line("slow");
  put("fast", 4, "violation", {}, Outcome::kDiverged, "far away");
  const Results results(store_);
  const nlohmann::json views = views_data(results);
  ASSERT_THAT(views, SizeIs(1));
  const nlohmann::json& view = views[0];
  EXPECT_EQ(view["main"], "truth_error");
  ASSERT_THAT(view["candidates"], SizeIs(5));
  const nlohmann::json& first = view["candidates"][0];
  const nlohmann::json& point = view["points"][first["point"].get<size_t>()];
  EXPECT_TRUE(point["sound"].get<bool>());
  EXPECT_EQ(point["worst"]["truth_error"]["value"], 2e-3) << "equally fast, and more accurate";
  EXPECT_EQ(point["worst"]["truth_error"]["line"], "2.00 mm (1.00 mm to 4.00 mm)");
  EXPECT_EQ(view["fronts"]["truth_error"][0]["point"], first["point"]);
  ASSERT_THAT(view["left_out"], SizeIs(1));
  EXPECT_EQ(view["left_out"][0]["when"], "from 4 ms");
  EXPECT_EQ(view["left_out"][0]["why"], "violation: diverged, far away");
  const nlohmann::json& answer = view["card"]["answers"][0];
  EXPECT_EQ(answer["id"], "fastest-1mm");
  EXPECT_EQ(answer["contender"], "fast");
  EXPECT_EQ(answer["timestep_ms"], 1);
  EXPECT_EQ(answer["figures"], "20.0× real time, error at the end 1.00 mm (the smallest timestep tried)");
  EXPECT_EQ(answer["text"], "fast at 1 ms: 20.0× real time, error at the end 1.00 mm (the smallest timestep tried)");
  EXPECT_THAT(catalogue_data(results).dump(), HasSubstr("truth_error"));
}

// "slow" in three settings: of one line, and recommended once.
class SweptTest : public RecommendTest {
 protected:
  void SetUp() override {
    RecommendTest::SetUp();
    std::vector<ContenderRow> rows = {{"fast", "fast", "1", "fast", "", "{}", "{}"},
                                      {"slow", "slow", "1", "slow", "", R"({"changes": []})", "{}"}};
    for (const std::string it : {"2", "10"}) {
      const nlohmann::json described = {{"varies", "slow"},
                                        {"changes",
                                         {{{"setting", "iterations"},
                                           {"value", it},
                                           {"default", "50"},
                                           {"unit", ""},
                                           {"meaning", "sweeps over all constraints a step (own default: 20)"}}}}};
      rows.push_back({"slow it=" + it, "slow", "1", "slow", "iterations=" + it, described.dump(), "{}"});
    }
    store_.set_contenders(rows);
    line("fast", 0.5);
    line("slow");
    for (const double step : {1.0, 2.0, 4.0}) {
      error("slow it=10", step, 1.5e-3 * step);
      speed("slow it=10", step, 30 * step);
      error("slow it=2", step, 10e-3 * step);  // neither faster than it=10 nor more accurate
      speed("slow it=2", step, 25 * step);
    }
  }
};

TEST_F(SweptTest, AnAnswerHasSettingsAndOneForEachContenderThatWasVaried) {
  const SystemAnswers all = answers();
  const Recommendation found = recommend(all, within(2e-3));
  EXPECT_EQ(best(all, within(2e-3)), "slow it=10 at 1") << "30, before slow at 2 with 20";
  std::vector<std::string> lines;
  lines.reserve(found.contenders.size());
  for (const size_t i : found.contenders) lines.push_back(all.at(all.candidates[i]).contender);
  EXPECT_THAT(lines, ElementsAre("slow it=10", "fast"));
  ASSERT_THAT(all.changes.at("slow it=10"), SizeIs(1));
  EXPECT_EQ(change_text(all.changes.at("slow it=10").front()),
            "iterations 10 instead of 50 (sweeps over all constraints a step)");
  EXPECT_THAT(all.changes.at("slow"), IsEmpty());
}

TEST_F(SweptTest, TheFrontOfWhatWasVariedIsOverTimestepsAndSettings) {
  const SystemAnswers all = answers();
  ASSERT_TRUE(all.swept.contains("truth_error"));
  EXPECT_THAT(all.swept.at("truth_error"), SizeIs(1)) << "nothing else was varied";
  std::vector<std::string> front;
  for (const FrontMember& member : all.swept.at("truth_error").at("slow")) {
    const Point& point = all.points[member.point];
    front.push_back(point.contender + " at " + std::to_string(static_cast<int>(point.timestep_ms)));
  }
  EXPECT_THAT(front, ElementsAre("slow it=10 at 4", "slow it=10 at 2", "slow it=10 at 1", "slow at 1"))
      << "slow at 2 is as fast as no other, and less accurate than slow it=10 at 1";
}

TEST_F(SweptTest, SettingsOfAContenderLookAlikeAndCountOnce) {
  const Results results(store_);
  EXPECT_EQ(results.varied("slow it=2"), "slow");
  EXPECT_EQ(results.varied("fast"), "fast");
  EXPECT_EQ(results.look("slow it=2").light, results.look("slow").light);
  EXPECT_EQ(results.look("slow it=2").mark, results.look("slow").mark);
  const nlohmann::json view = views_data(results)[0];
  EXPECT_THAT(view["swept"]["truth_error"]["slow"], SizeIs(4));
}

TEST_F(RecommendTest, ResultsOfBeforeTellContactForcesInWords) {
  const auto given = [&](const nlohmann::json& described) {
    store_.set_contenders({{"old", "old", "1", "old", "", described.dump(), "{}"}});
    return store_.contenders().front().contact_forces;
  };
  Capabilities can;
  for (const ContactForces forces : {ContactForces::kNone, ContactForces::kNormal}) {
    can.contact_forces = forces;
    EXPECT_EQ(given({{"contact_forces", contact_forces_text(can)}}), contact_forces_given(forces));
  }
  EXPECT_EQ(given({{"contact_forces", "of no use"}, {"contact_forces_given", "all"}}), "all");
  EXPECT_EQ(given(nlohmann::json::object()), "");
}

TEST_F(RecommendTest, ResultsOfBeforeTellTheirSettingsAsTheyStoredThem) {
  store_.set_contenders({{"old", "old", "1", "old", "iterations=10 cone=elliptic", "{}", "{}"}});
  const Results results(store_);
  const std::vector<SettingChange> changes = results.changes("old");
  ASSERT_THAT(changes, SizeIs(2));
  EXPECT_EQ(change_text(changes[0]), "iterations 10");
  EXPECT_EQ(change_text(changes[1]), "cone elliptic");
}

// ---- looks --------------------------------------------------------------------------------------------------------------------

// As people without green cones see it: Machado, Oliveira, Fernandes, "A Physiologically-based Model for Simulation of
// Color Vision Deficiency" (2009), severity 1, on linear light.
std::array<double, 3> without_green_cones(const std::array<double, 3>& c) {
  const auto part = [&](double r, double g, double b) {
    return std::min(1.0, std::max(0.0, r * c[0] + g * c[1] + b * c[2]));
  };
  return {part(0.367322, 0.860646, -0.227968), part(0.280085, 0.672501, 0.047413), part(-0.011820, 0.042940, 0.968881)};
}

double distance_of(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  const auto p = linear_to_oklab(a), q = linear_to_oklab(b);
  return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
}

double luminance_of(const std::array<double, 3>& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

TEST(Looks, FamiliesStayApartWithoutGreenConesAndFromTheGround) {
  for (const bool dark : {false, true}) {
    const std::vector<std::string> colors = family_colors(dark);
    ASSERT_THAT(colors, SizeIs(12));
    for (size_t i = 0; i < colors.size(); ++i) {
      const auto a = to_linear(parse_color(colors[i]));
      const double ground = luminance_of(to_linear(parse_color(dark ? "#1a1e22" : "#fbfaf7"))), own = luminance_of(a);
      EXPECT_GE((std::max(own, ground) + 0.05) / (std::min(own, ground) + 0.05), 3) << colors[i];
      for (size_t j = i + 1; j < colors.size(); ++j) {
        const auto b = to_linear(parse_color(colors[j]));
        EXPECT_GT(distance_of(without_green_cones(a), without_green_cones(b)), 0.06) << colors[i] << colors[j];
        EXPECT_GT(distance_of(a, b), 0.08) << colors[i] << colors[j];
      }
    }
  }
}

TEST(Looks, InAFamilyDashAndMarkDiffer) {
  std::vector<ContenderRow> rows;
  rows.reserve(20);
  for (int i = 0; i < 20; ++i) rows.push_back({"m" + std::to_string(i), "mujoco", "", "", "", "", ""});
  const auto looks = looks_of(rows);
  std::set<std::pair<std::vector<double>, Mark>> both;
  for (const auto& [name, look] : looks) EXPECT_TRUE(both.insert({look.dash, look.mark}).second) << name;
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < i; ++j) {
      const Look &a = looks.at("m" + std::to_string(i)), &b = looks.at("m" + std::to_string(j));
      EXPECT_NE(a.dash, b.dash);
      EXPECT_NE(a.mark, b.mark);
      EXPECT_NE(a.light, b.light);
    }
  }
}

TEST(Looks, MixedAsCssDoes) {
  const Color grey = mix(parse_color("#ffffff"), parse_color("#000000"), 0.5);
  EXPECT_EQ(color_text(grey), "#636363") << "color-mix(in oklab, white, black)";
  EXPECT_EQ(color_text(mix(parse_color("#1463c4"), parse_color("#000000"), 0)), "#1463c4");
}

TEST(Looks, JointCoordinatesAreAFamilyOfTheirOwnWhereAnEngineHasBoth) {
  const std::string joint = R"({"coordinates": "joint"})", maximal = R"({"coordinates": "maximal"})";
  const auto looks = looks_of({{"bullet-si-f64", "bullet-f64", "", "", "", maximal, "{}"},
                               {"bullet-si-f32", "bullet-f32", "", "", "", maximal, "{}"},
                               {"bullet-mb", "bullet-f64", "", "", "", joint, "{}"},
                               {"unheard-of", "new", "", "", "", joint, "{}"},
                               {"null", "null", "", "", "", "", ""}});
  ASSERT_THAT(looks, SizeIs(4)) << "the engine that does nothing is not drawn";
  EXPECT_EQ(looks.at("bullet-mb").family, "bullet/joint");
  EXPECT_EQ(looks.at("bullet-si-f32").family, "bullet");
  EXPECT_NE(looks.at("bullet-si-f64").light, looks.at("bullet-mb").light);
  EXPECT_THAT(looks.at("bullet-si-f64").dash, IsEmpty());
  EXPECT_THAT(looks.at("bullet-si-f32").dash, ElementsAre(7, 3));
  EXPECT_TRUE(looks.at("unheard-of").first);
}

// Readers know an engine by these: they stay as they are.
TEST(Looks, KnownEnginesKeepColourAndMark) {
  const std::string joint = R"({"coordinates": "joint"})", maximal = R"({"coordinates": "maximal"})";
  const std::vector<std::string> colors = family_colors(false);
  std::vector<ContenderRow> rows;
  for (const char* engine :
       {"rapier", "jolt-f64", "havok", "physx", "dart", "simbody", "ode", "bullet-f32", "mujoco"}) {
    rows.push_back({engine, engine, "", "", "", maximal, ""});
  }
  for (const char* engine : {"bullet-f64", "physx", "rapier"}) {
    rows.push_back({std::string(engine) + "-joint", engine, "", "", "", joint, ""});
  }
  const auto looks = looks_of(rows);
  const auto look = [&](const std::string& name) { return std::pair(looks.at(name).light, looks.at(name).mark); };
  EXPECT_EQ(look("mujoco"), std::pair(colors.at(0), Mark::kCircle));
  EXPECT_EQ(look("bullet-f32"), std::pair(colors.at(1), Mark::kTriangle));
  EXPECT_EQ(look("bullet-f64-joint"), std::pair(colors.at(2), Mark::kTriangleDown));
  EXPECT_EQ(look("ode"), std::pair(colors.at(3), Mark::kDiamond));
  EXPECT_EQ(look("simbody"), std::pair(colors.at(4), Mark::kSquare));
  EXPECT_EQ(look("dart"), std::pair(colors.at(5), Mark::kTriangle));
  EXPECT_EQ(look("physx"), std::pair(colors.at(6), Mark::kCross));
  EXPECT_EQ(look("physx-joint"), std::pair(colors.at(7), Mark::kWye));
  EXPECT_EQ(look("havok"), std::pair(colors.at(8), Mark::kStar));
  EXPECT_EQ(look("jolt-f64"), std::pair(colors.at(9), Mark::kWye));
  EXPECT_EQ(look("rapier"), std::pair(colors.at(10), Mark::kDiamond));
  EXPECT_EQ(look("rapier-joint"), std::pair(colors.at(11), Mark::kTriangleDown));
}

TEST(Looks, FamiliesShareNeitherOrderNorColour) {
  std::set<int> orders;
  std::set<size_t> hues;
  for (const EngineAbout& about : engines_about()) {
    if (about.order) {
      EXPECT_TRUE(orders.insert(*about.order).second) << about.folder;
    }
    for (const std::optional<FamilyLook>& look : {about.look, about.joint_look}) {
      if (!look) continue;
      EXPECT_TRUE(hues.insert(look->hue).second) << about.folder;
      EXPECT_LT(look->hue, family_colors(false).size()) << about.folder;
      bool known = false;
      for (int mark = 0; mark <= static_cast<int>(Mark::kWye); ++mark) {
        known = known || mark_text(static_cast<Mark>(mark)) == look->mark;
      }
      EXPECT_TRUE(known) << about.folder << ": " << look->mark;
    }
  }
  EXPECT_GE(orders.size(), 11U);
}

TEST(LineUp, ThePapersEnginesAndThoseOfItsFigures) {
  const std::vector<StandIns> expected = {
      {"MuJoCo Euler", {"mujoco-euler"}},
      {"MuJoCo RK4", {"mujoco-rk4"}},
      {"Bullet", {"bullet-si-f64", "bullet-si-f32"}},
      {"BulletMB", {"bullet-mb"}},
      {"ODE", {"ode-quick"}},
      {"PhysX", {"physx-d6-pgs"}},
      {"Havok", {"havok"}},
      {"PhysX with drives", {"physx-d6-pgs-native-pd"}},
      {"MuJoCo sparse", {"mujoco-euler-cg", "mujoco-euler"}},
      {"MuJoCo dense", {"mujoco-euler-dense"}},
      {"ODE exact", {"ode-step"}},
      {"the fastest gaming engine", {"physx-d6-pgs", "havok", "bullet-si-f64", "bullet-si-f32", "ode-quick"}}};
  EXPECT_EQ(paper_line_up(), expected);
  const std::vector<std::string> present = {"ode-step", "mujoco-euler-dense", "havok", "mujoco-euler-cg"};
  EXPECT_THAT(papers_among(present), ElementsAre("havok"));
  EXPECT_THAT(papers_among(present, /*solvers=*/true), ElementsAre("havok", "mujoco-euler-dense"));
}

TEST(LineUp, ManyContendersOpenWithThePapers) {
  std::vector<std::string> present = {"mujoco-euler", "bullet-si-f32", "ode-quick"};
  for (int i = 0; i < 20; ++i) present.push_back("other-" + std::to_string(i));
  EXPECT_THAT(shown_first(present), ElementsAre("mujoco-euler", "bullet-si-f32", "ode-quick"));
  present.resize(10);
  EXPECT_EQ(shown_first(present), present);
  EXPECT_THAT(papers_among({"bullet-si-f32", "bullet-si-f64"}), ElementsAre("bullet-si-f64")) << "the preferred one";
}

}  // namespace
}  // namespace assay
