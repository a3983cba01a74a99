// What a question limits, which questions contradict themselves, what to relax where nothing is within the limits, and
// where an answer lies at an edge of what was tried.
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "results/answer.h"
#include "results/limits.h"
#include "results/recommend.h"
#include "results/results.h"
#include "results/store/store.h"
#include "temp_folder.h"

namespace assay {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

class QuestionTest : public TempFolderTest {
 protected:
  void SetUp() override {
    TempFolderTest::SetUp();
    store_.set_systems({{"hand", "{}"}, {"chain", "{}"}});
    store_.set_contenders(
        {{"fast", "fast", "1", "fast", "", "{}", "{}"}, {"stiff", "stiff", "1", "stiff", "", "{}", "{}"}});
  }

  void put(const std::string& system, const std::string& contender, double timestep_ms, const std::string& measure,
           std::vector<Value> values, Outcome outcome = Outcome::kOk) {
    Cell cell;
    cell.system = system;
    cell.contender = contender;
    cell.timestep_ms = timestep_ms;
    cell.measure = measure;
    cell.key = system + contender + measure + std::to_string(timestep_ms);
    cell.outcome = outcome;
    cell.values = std::move(values);
    store_.put_cell(cell);
  }
  // A cell of each measure; `added` may be unmeasured, `speed` untimed.
  void point(const std::string& contender, double timestep_ms, std::optional<double> speed, double error,
             std::optional<double> added, double slip, double limit = 2e-3) {
    if (speed) put("hand", contender, timestep_ms, "raw_speed", {{"realtime_factor", "1", *speed, {}, {}}});
    put("hand", contender, timestep_ms, "consistency", {{"consistency_cold", "m", error, {}, {}}});
    if (added) {
      put("hand", contender, timestep_ms, "violation",
          {{"penetration_max", "m", *added + 3e-3, {}, {}},
           {"penetration_added_max", "m", *added, {}, {}},
           {"penetration_limit", "m", limit, {}, {}}});
    }
    put("hand", contender, timestep_ms, "grasp", {{"grasp_held", "1", 1, {}, {}}, {"grasp_slip", "m", slip, {}, {}}});
  }
  SystemAnswers answers(const std::string& system = "hand") const { return answers_of(Results(store_), system); }

  static LimitOptions asks(const std::string& error) {
    LimitOptions options;
    options.error = error;
    return options;
  }
  std::string text(const LimitOptions& options, const std::string& system = "hand") const {
    return limits_text(question_of(options, answers(system)));
  }
  std::string refusal(const LimitOptions& options, const std::string& system = "hand") const {
    try {
      question_of(options, answers(system));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  std::string edge(const std::string& contender, double timestep_ms, const Limits& limits) const {
    const SystemAnswers all = answers();
    for (const Candidate& candidate : all.candidates) {
      const Point& point = all.at(candidate);
      if (point.contender == contender && point.timestep_ms == timestep_ms) {
        return edge_text(edge_of(all, candidate, limits));
      }
    }
    return "no candidate";
  }

  Store store_ = Store::create(dir_, {"test", "1"});
};

TEST_F(QuestionTest, ContactsAreLimitedUnlessTheyAreNamed) {
  point("fast", 1, 100, 1e-3, 1e-3, 1e-3);
  EXPECT_EQ(text(asks("1mm")),
            "self-consistency error within 1mm, added penetration within 2 mm (default), "
            "slip within 5 mm (default)");
  LimitOptions options = asks("1mm");
  options.penetration = "7mm";
  options.slip = "any";
  EXPECT_EQ(text(options), "self-consistency error within 1mm, added penetration within 7mm");
  options = asks("1mm");
  options.limits = {"penetration_max=9mm"};
  options.penetration = {};
  EXPECT_EQ(text(options), "self-consistency error within 1mm, penetration within 9mm, slip within 5 mm (default)");
  options = {};
  options.realtime = "5";
  EXPECT_EQ(text(options),
            "added penetration within 2 mm (default), slip within 5 mm (default), at least 5.00× real time");
}

TEST_F(QuestionTest, TheSmallestLimitOfSeveralCellsAndSystemsCounts) {
  point("fast", 1, 100, 1e-3, 1e-3, 1e-3, 4e-3);
  point("fast", 2, 100, 1e-3, 1e-3, 1e-3, 3e-3);
  put("chain", "fast", 1, "violation",
      {{"penetration_added_max", "m", 1e-3, {}, {}}, {"penetration_limit", "m", 1.5e-3, {}, {}}});
  ASSERT_THAT(answers().usual, SizeIs(2));
  EXPECT_EQ(answers().usual[0].largest, 3e-3);
  EXPECT_EQ(answers_together(Results(store_), {"hand", "chain"}, "all").usual[0].largest, 1.5e-3);
}

TEST_F(QuestionTest, OlderResultsLimitTheWholeDepthAndSaySo) {
  put("hand", "fast", 1, "violation", {{"penetration_max", "m", 4e-3, {}, {}}});
  put("hand", "fast", 1, "consistency", {{"consistency", "m", 1e-3, {}, {}}});
  put("hand", "fast", 1, "raw_speed", {{"realtime_factor", "1", 10, {}, {}}});
  const SystemAnswers all = answers();
  const Question question = question_of(asks("2mm"), all);
  EXPECT_EQ(limits_text(question),
            "self-consistency error (the paper's) within 2mm, penetration within 5 mm (default)");
  EXPECT_THAT(grounds(all, question), ElementsAre(HasSubstr("paper's"), HasSubstr("whole depth")));
  EXPECT_EQ(best_answer(all, question, recommend(all, question.limits)).parts().back().heading,
            "What the limits rest on");
  point("fast", 1, 100, 1e-3, 1e-3, 1e-3);
  EXPECT_THAT(answers().stand_ins, IsEmpty());
}

TEST_F(QuestionTest, SystemsWithoutContactsAreAskedAsBefore) {
  put("chain", "fast", 1, "truth", {{"truth_error_max", "m", 1e-3, {}, {}}});
  EXPECT_EQ(text(asks("1mm"), "chain"), "error within 1mm");
}

TEST_F(QuestionTest, ContradictionsAreRefusedInOneSentence) {
  point("fast", 1, 100, 1e-3, 1e-3, 1e-3);
  put("chain", "fast", 1, "truth", {{"truth_error_max", "m", 1e-3, {}, {}}});
  EXPECT_EQ(refusal(asks("0mm")), "--error is '0mm': no figure is below 0, give a limit above it");
  EXPECT_THAT(refusal(asks("-1mm")), HasSubstr("not negative"));
  LimitOptions options = asks("1mm");
  options.penetration = "any";
  options.limits = {"penetration_added_max=1mm"};
  EXPECT_EQ(refusal(options),
            "--penetration is 'any', but 'penetration_added_max' is limited: leave one of the two out");
  options = asks("1mm");
  options.slip = "1mm";
  EXPECT_EQ(refusal(options, "chain"),
            "--slip is '1mm', but nothing is held, or no slip is measured, on 'chain': leave it out");
  options.slip = "any";
  EXPECT_EQ(refusal(options, "chain"), "");
  options.penetration = "1mm";
  EXPECT_THAT(refusal(options, "chain"), HasSubstr("no penetration is measured, on 'chain'"));
  options = {};
  options.penetration = "any";
  EXPECT_THAT(refusal(options), HasSubstr("no limit was given"));
  // the shapes overlap by 3 mm before anything moves
  options = asks("1mm");
  options.limits = {"penetration_max=2mm"};
  EXPECT_THAT(refusal(options), HasSubstr("overlap by 3.00 mm when they start, so no run is within it"));
  options.limits = {"penetration_max=4mm"};
  EXPECT_EQ(refusal(options), "");
}

// Both begin 7 mm deep, and only one goes deeper.
TEST_F(QuestionTest, OlderResultsTellTheStartsOverlapByEnginesThatAgree) {
  const auto has = [&](const char* engine, const char* fast, const char* stiff, double of_stiff) {
    store_.set_contenders(
        {{"fast", "physx", "1", "fast", "", fast, "{}"}, {"stiff", engine, "1", "stiff", "", stiff, "{}"}});
    put("hand", "fast", 1, "violation", {{"penetration_max", "m", 7e-3, {}, {}}});
    put("hand", "fast", 2, "violation", {{"penetration_max", "m", 9e-3, {}, {}}});
    put("hand", "stiff", 1, "violation", {{"penetration_max", "m", of_stiff, {}, {}}});
    return answers().start_overlap;
  };
  const char *joint = R"({"coordinates": "joint"})", *maximal = R"({"coordinates": "maximal"})";
  EXPECT_EQ(has("ode", joint, maximal, 7.1e-3), 0) << "one alone may have sunk in";
  EXPECT_EQ(has("ode", joint, joint, 7.0000001e-3), 0) << "two in joint coordinates may have the same solver";
  EXPECT_EQ(has("physx56", maximal, maximal, 7.0000001e-3), 0) << "versions of one engine";
  EXPECT_EQ(has("ode", maximal, maximal, 7.0000001e-3), 7e-3);
  EXPECT_EQ(has("ode", joint, maximal, 7.0000001e-3), 7e-3);
  EXPECT_THAT(grounds(answers(), question_of(asks("8mm"), answers())),
              testing::Contains(HasSubstr("shapes overlap by 7.00 mm when they start")));
  LimitOptions options = asks("1mm");
  options.limits = {"penetration_max=5mm"};
  EXPECT_THAT(refusal(options), HasSubstr("no run is within it; give a larger limit"));
}

TEST_F(QuestionTest, EachLimitThatCanGiveWayAloneIsNamedWithWhatThenAnswers) {
  point("fast", 1, 100, 0.4e-3, 4.123e-3, 1e-3);
  point("fast", 2, 200, 0.9e-3, 9e-3, 1e-3);
  point("stiff", 1, 50, 2.4e-3, 1e-3, 1e-3);
  point("stiff", 2, 90, 2.405e-3, 1e-3, 1e-3);
  const SystemAnswers all = answers();
  const Question question = question_of(asks("1mm"), all);
  const Recommendation found = recommend(all, question.limits);
  ASSERT_FALSE(found.best);
  ASSERT_THAT(found.relaxed, SizeIs(2));
  // The least that is needed, and never less: 2.4 mm as it is, 4.123 mm rounded up.
  EXPECT_EQ(found.relaxed[0].text, "2.4 mm");
  EXPECT_EQ(found.relaxed[1].text, "4.13 mm");
  EXPECT_EQ(none_text(all, question, found),
            "no contender on hand has self-consistency error within 1mm, added penetration within 2 mm (default), slip "
            "within 5 mm (default): relax the self-consistency error to 2.4 mm: stiff at 1 ms, 50.0× real time, the "
            "smallest timestep tried; or relax the added penetration to 4.13 mm: fast at 1 ms, 100× real time, the "
            "smallest timestep tried; to relax the slip alone is not enough");
  for (const Relaxation& each : found.relaxed) {
    Limits relaxed = question.limits;
    for (auto& [value, largest] : relaxed.largest) {
      if (value == each.value) largest = each.to;
    }
    EXPECT_EQ(recommend(all, relaxed).best, each.candidate) << each.value << ": what is named is what it gives";
  }
  const auto told = recommendation_json(all, question, found);
  EXPECT_EQ(told["relaxations"][1]["value"], "penetration_added_max");
  EXPECT_EQ(told["relaxations"][1]["recommended"]["contender"], "fast");
}

TEST_F(QuestionTest, ARelaxedLimitIsNeverBelowTheFigure) {
  for (const double error : {1.0000000001e-3, 9.9999999e-3, 0.12345, 7e-10, 1.005e-5, 2.41e-3}) {
    point("fast", 1, 100, error, 1e-3, 1e-3);
    const SystemAnswers all = answers();
    const Recommendation found = recommend(all, {{{"consistency_cold", 1e-10}}, {}});
    ASSERT_THAT(found.relaxed, SizeIs(1));
    EXPECT_FALSE(exceeds(error, found.relaxed[0].to)) << error;
    EXPECT_LE(found.relaxed[0].to, 1.0101 * error);
    LimitOptions typed = asks(found.relaxed[0].text);
    EXPECT_EQ(question_of(typed, all).limits.largest[0].second, found.relaxed[0].to) << "typed, it is the same";
  }
}

TEST_F(QuestionTest, WhereNoLimitAloneIsInTheWayTheNearestIsNamed) {
  point("fast", 1, 100, 1e-3, 4e-3, 1e-3);
  point("fast", 2, 200, 2e-3, 4e-3, 1e-3);
  const SystemAnswers all = answers();
  const Question question = question_of(asks("0.1mm"), all);
  const Recommendation found = recommend(all, question.limits);
  EXPECT_THAT(found.relaxed, IsEmpty());
  EXPECT_THAT(none_text(all, question, found),
              HasSubstr("to relax one of these alone is not enough, and the nearest is fast at 1 ms, the smallest "
                        "timestep tried, with self-consistency error 1.00 mm, 10 times the limit"));
}

TEST_F(QuestionTest, ASpeedGivesWayToo) {
  point("fast", 1, 99.97, 1e-3, 1e-3, 1e-3);
  point("stiff", 1, 70, 0.1e-3, 1e-3, 1e-3);
  LimitOptions options = asks("0.5mm");
  options.realtime = "90";
  const SystemAnswers all = answers();
  const Question question = question_of(options, all);
  const std::string none = none_text(all, question, recommend(all, question.limits));
  EXPECT_THAT(none, HasSubstr("relax the self-consistency error to 1 mm: fast at 1 ms"));
  EXPECT_THAT(none, HasSubstr("or relax the speed to 70.0× real time: stiff at 1 ms"));
  options.error = "5mm";
  options.realtime = "200";
  EXPECT_EQ(recommend(all, question_of(options, all).limits).relaxed.back().to, 99.9) << "never more than there is";
}

TEST_F(QuestionTest, AnEdgeIsWhereNothingTellsOfTheTimestepsBeyond) {
  const Limits error = {{{"consistency_cold", 10e-3}}, {}};
  const Limits both = {{{"consistency_cold", 10e-3}, {"penetration_added_max", 5e-3}}, {}};
  point("fast", 1, 100, 1e-3, 1e-3, 1e-3);
  EXPECT_EQ(edge("fast", 1, error), "the only timestep tried");
  point("fast", 2, 200, 2e-3, 1e-3, 1e-3);
  EXPECT_EQ(edge("fast", 1, error), "the smallest timestep tried");
  EXPECT_EQ(edge("fast", 2, error), "the largest timestep tried");
  point("fast", 4, {}, 4e-3, 2e-3, 1e-3);
  EXPECT_EQ(edge("fast", 2, error), "the largest timestep timed");
  EXPECT_EQ(edge("fast", 2, {{{"consistency_cold", 3e-3}}, {}}), "") << "4 ms is beyond the limit, timed or not";
  point("fast", 4, 400, 4e-3, {}, 1e-3);
  put("hand", "fast", 4, "violation", {});
  EXPECT_EQ(edge("fast", 4, error), "the largest timestep tried");
  EXPECT_EQ(edge("fast", 2, both), "the largest timestep measured in full");
  point("fast", 8, 800, 8e-3, 6e-3, 1e-3);
  EXPECT_EQ(edge("fast", 2, both), "not measured in full at 4 ms");
  put("hand", "fast", 8, "grasp", {}, Outcome::kDiverged);
  EXPECT_EQ(edge("fast", 4, error), "") << "8 ms fails";
  point("fast", 0.5, {}, 0.5e-3, 0.5e-3, 1e-3);
  EXPECT_EQ(edge("fast", 1, error), "the smallest timestep timed");
}

TEST_F(QuestionTest, AnAnswerAtAnEdgeSaysSoInItsFirstLineAndItsTable) {
  point("fast", 1, 100, 1e-3, 1e-3, 1e-3);
  point("fast", 2, 200, 2e-3, 1e-3, 1e-3);
  point("stiff", 1, 60, 1e-3, 1e-3, 1e-3);
  const SystemAnswers all = answers();
  const Question question = question_of(asks("5mm"), all);
  const Recommendation found = recommend(all, question.limits);
  const Answer answer = best_answer(all, question, found);
  EXPECT_EQ(answer.parts()[0].heading, "hand: fast at 2 ms, 200× real time, the largest timestep tried");
  EXPECT_EQ(answer.parts()[1].rows[0][1], "2 ms +");
  EXPECT_EQ(answer.parts()[1].rows[1][1], "1 ms ±");
  ASSERT_THAT(answer.parts()[1].lines, SizeIs(2));
  EXPECT_THAT(answer.parts()[1].lines[0].text, HasSubstr("+ larger timesteps"));
  EXPECT_EQ(recommendation_json(all, question, found)["recommended"]["edge"], "the largest timestep tried");
  put("hand", "fast", 4, "grasp", {}, Outcome::kDiverged);
  const SystemAnswers again = answers();
  EXPECT_THAT(best_answer(again, question, recommend(again, question.limits)).parts()[0].heading,
              Not(HasSubstr("timestep tried")));
}

}  // namespace
}  // namespace assay
