#include "results/claims/claims.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/paths.h"
#include "campaign/campaign.h"
#include "measures/statistics.h"
#include "message_of.h"
#include "report/report.h"
#include "results/results.h"
#include "results/store/store.h"
#include "temp_folder.h"

namespace assay {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kEngines = R"(
[engines]
"A" = ["a"]
"B" = ["b1", "b2"]
"C" = ["c"]
[[claim]]
number = 7
title = "A first"
statement = "A comes first"
paper = "a table"
[[claim.test]]
)";

ClaimsFile file_of(const std::string& test) { return parse_claims(kEngines + test, "claims.toml"); }

std::string claim_error(const std::string& test) {
  return message_of([&] { file_of(test); });
}

class ClaimsTest : public TempFolderTest {
 protected:
  void SetUp() override {
    store_.set_systems({{"s", "{}"}, {"t", "{}"}, {"n-10", R"({"family": "n"})"}, {"n-20", R"({"family": "n"})"}});
    std::vector<ContenderRow> rows;
    for (const std::string name : {"a", "b1", "b2", "c", "z", "null"})
      rows.push_back({name, name, "1", name, "", "", ""});
    rows.push_back({"absent", "", "", "absent", "", "", ""});
    store_.set_contenders(rows);
  }

  static Cell made(const std::string& contender, double timestep_ms, const std::string& measure,
                   const std::string& system) {
    Cell cell;
    cell.key = system + contender + measure + std::to_string(timestep_ms);
    cell.system = system;
    cell.contender = contender;
    cell.timestep_ms = timestep_ms;
    cell.measure = measure;
    return cell;
  }

  void put(const std::string& contender, double timestep_ms, const std::string& measure, std::vector<Value> values,
           Outcome outcome = Outcome::kOk, const std::string& system = "s") {
    Cell cell = made(contender, timestep_ms, measure, system);
    cell.outcome = outcome;
    if (outcome != Outcome::kOk) cell.reason = "at 1 s: too fast";
    cell.values = std::move(values);
    store_.put_cell(cell);
  }

  void grasp(const std::string& contender, double h, double value, Outcome outcome = Outcome::kOk) {
    put(contender, h, "grasp", {{"grasp_held", "1", value, {}, {}}}, outcome);
  }

  // A step time of 2 % either way.
  void time(const std::string& contender, double us, Outcome outcome = Outcome::kOk, const std::string& system = "s") {
    put(contender, 1, "raw_speed", {{"step_time", "us", us, 0.98 * us, 1.02 * us}}, outcome, system);
  }

  // Errors scale * h^order with 10 % either way, at 1, 2, 4 and 8 ms; a step takes `us`, or was not timed.
  void curve(const std::string& contender, double us, double scale, double order, const std::string& system = "s") {
    for (const double h : {1.0, 2.0, 4.0, 8.0}) {
      const double error = scale * std::pow(h, order);
      put(contender, h, "consistency", {{"consistency", "m", error, 0.9 * error, 1.1 * error}}, Outcome::kOk, system);
      const double factor = 1e3 * h / us;
      if (us > 0)
        put(contender, h, "raw_speed", {{"realtime_factor", "1", factor, factor, factor}}, Outcome::kOk, system);
    }
  }

  Judgement judged(const std::string& test) { return judge(file_of(test), Results(store_)).at(0); }
  Verdict verdict(const std::string& test) { return judged(test).verdict; }

  static const ClaimFigure& figure(const Judgement& judgement, const std::string& label) {
    const auto found = std::ranges::find(judgement.figures, label, &ClaimFigure::label);
    EXPECT_NE(found, judgement.figures.end()) << label;
    return *found;
  }

  Store store_ = Store::create(dir_.string(), {"made up", "1"});
};

const std::string kFastest =
    "kind = 'at-timestep'\nvalue = 'step_time'\ntimestep_ms = 1\nsystems = ['s']\nwho = ['A']\nagainst = ['B', 'C']\n"
    "above = 1\n";

TEST_F(ClaimsTest, FasterThanAllHolds) {
  time("a", 2);
  time("b1", 9);
  time("b2", 5);
  time("c", 8);
  const Judgement found = judged(kFastest);
  EXPECT_EQ(found.verdict, Verdict::kHolds);
  // the nearest is the better one of B
  EXPECT_THAT(found.summary, HasSubstr("s 2.5 [2.4, 2.6] (B over A)"));
  EXPECT_THAT(found.key, HasSubstr("s 2.5 times (B over A)"));
  EXPECT_EQ(found.reason, "");
  EXPECT_EQ(figure(found, "A").value, 2);
  EXPECT_EQ(figure(found, "A").unit, "us");
  const ClaimFigure& ratio = figure(found, "B / A");
  EXPECT_EQ(ratio.contender, "b2");
  EXPECT_EQ(ratio.timestep_ms, 1);
  EXPECT_DOUBLE_EQ(ratio.value, 2.5);
  EXPECT_DOUBLE_EQ(ratio.low.value_or(0), 2.5 * 0.98 / 1.02);
  EXPECT_DOUBLE_EQ(ratio.high.value_or(0), 2.5 * 1.02 / 0.98);
  EXPECT_DOUBLE_EQ(figure(found, "C / A").value, 4);
  EXPECT_EQ(figure(found, "C").contender, "c");
}

TEST_F(ClaimsTest, TurnedAroundIsChanged) {
  time("a", 5);
  time("b1", 9);
  time("b2", 2);
  time("c", 8);
  const Judgement found = judged(kFastest);
  EXPECT_EQ(found.verdict, Verdict::kChanged);
  EXPECT_THAT(found.summary, HasSubstr("s 0.4 [0.384, 0.416] (B over A)"));
}

TEST_F(ClaimsTest, AnIntervalAcrossTheBoundSettlesNothing) {
  time("a", 5);
  time("b1", 5.1);
  time("b2", 9);
  time("c", 8);
  const Judgement found = judged(kFastest);
  EXPECT_EQ(found.verdict, Verdict::kNotSettled);
  EXPECT_EQ(found.now, "Now: A is 1.02 times (0.980 to 1.06) faster than B on s.");
  EXPECT_EQ(verdict_words(found.verdict), "not settled");
  time("c", 2);  // what is otherwise in one part is otherwise as a whole
  EXPECT_EQ(verdict(kFastest), Verdict::kChanged);
}

TEST_F(ClaimsTest, SaysWhatIsTrueNow) {
  time("a", 5);
  time("b1", 2);
  time("c", 8);
  Judgement found = judged(kFastest);
  EXPECT_EQ(found.now, "Now: B is 2.50 times (2.40 to 2.60) faster than A on s.");
  EXPECT_EQ(found.threshold, "above 1");
  time("a", 1);
  found = judged(kFastest);
  EXPECT_EQ(found.now, "Now: A is 2.00 times (1.92 to 2.08) faster than B on s.");
  EXPECT_EQ(claims_json({found})[0]["now"], found.now);
  EXPECT_EQ(claims_json({found})[0]["threshold"], "above 1");
  EXPECT_THAT(claims_markdown({found}), HasSubstr(found.now));
}

TEST_F(ClaimsTest, AMissingRivalMakesItNotMeasurable) {
  time("a", 2);
  time("b1", 5);
  Judgement found = judged(kFastest);
  EXPECT_EQ(found.verdict, Verdict::kNotMeasurable);
  EXPECT_EQ(found.reason, "'step_time' of c on s was not measured at 1 ms");
  EXPECT_THAT(found.summary, HasSubstr("B over A"));
  time("c", 8, Outcome::kUnsupported);
  found = judged(kFastest);
  EXPECT_EQ(found.verdict, Verdict::kNotMeasurable);
  EXPECT_EQ(found.reason, "c on s at 1 ms: unsupported (at 1 s: too fast)");
}

// What is known to be otherwise is otherwise, whoever is missing.
TEST_F(ClaimsTest, AMissingRivalDoesNotHideAChange) {
  time("a", 2);
  time("b1", 1);
  EXPECT_EQ(verdict(kFastest), Verdict::kChanged);
}

TEST_F(ClaimsTest, NothingMeasuredHasAReasonAndNoSummary) {
  const Judgement found = judged(kFastest);
  EXPECT_EQ(found.verdict, Verdict::kNotMeasurable);
  EXPECT_EQ(found.summary, "");
  EXPECT_THAT(found.reason, HasSubstr("'step_time' of a on s was not measured"));
  std::string elsewhere = kFastest;
  elsewhere.replace(elsewhere.find("['s']"), 5, "['moon']");
  EXPECT_THAT(judged(elsewhere).reason, HasSubstr("no system 'moon'"));
}

TEST_F(ClaimsTest, AnAbsentEngineIsNamed) {
  time("a", 2);
  std::string text = kEngines + kFastest;
  text.replace(text.find("[\"c\"]"), 5, "[\"absent\"]");
  const Judgement found = judge(parse_claims(text, "x"), Results(store_)).at(0);
  EXPECT_EQ(found.verdict, Verdict::kNotMeasurable);
  EXPECT_THAT(found.reason, HasSubstr("the engine of 'absent' is absent"));
}

TEST_F(ClaimsTest, WhoGoesUnstableDoesNotCompete) {
  time("a", 2);
  time("b1", 1, Outcome::kUnstable);
  time("b2", 1, Outcome::kDiverged);
  time("c", 8);
  const Judgement found = judged(kFastest);
  EXPECT_EQ(found.verdict, Verdict::kHolds);
  EXPECT_THAT(found.summary, HasSubstr("without B, unstable there"));
}

TEST_F(ClaimsTest, WhoIsUnstableItselfIsNotFirst) {
  time("a", 2, Outcome::kUnstable);
  time("b1", 3);
  time("c", 8);
  const Judgement found = judged(kFastest);
  EXPECT_EQ(found.verdict, Verdict::kChanged);
  EXPECT_THAT(found.summary, HasSubstr("A unstable"));
}

TEST_F(ClaimsTest, AllSystemsHaveToHold) {
  std::string both = kFastest;
  both.replace(both.find("['s']"), 5, "['s', 't']");
  for (const std::string system : {"s", "t"}) {
    time("a", 2, Outcome::kOk, system);
    time("b1", 4, Outcome::kOk, system);
    time("c", system == "s" ? 8 : 1, Outcome::kOk, system);
  }
  EXPECT_EQ(verdict(kFastest), Verdict::kHolds);
  EXPECT_EQ(verdict(both), Verdict::kChanged);
}

TEST_F(ClaimsTest, OneOfSeveralIsEnoughUnlessEachIsAsked) {
  time("a", 2);
  time("b1", 20);
  time("c", 8);
  const std::string one =
      "kind = 'at-timestep'\nvalue = 'step_time'\ntimestep_ms = 1\nsystems = ['s']\nwho = ['A', 'B']\nagainst = ['C']\n"
      "above = 1\n";
  EXPECT_EQ(verdict(one), Verdict::kHolds);
  EXPECT_EQ(verdict(one + "each = true\n"), Verdict::kChanged);
  EXPECT_EQ(verdict(one + "each = true\nis = 'more'\n"), Verdict::kChanged);
}

TEST_F(ClaimsTest, TheSlowest) {
  const std::string slowest =
      "kind = 'at-timestep'\nvalue = 'step_time'\ntimestep_ms = 1\nsystems = ['s']\nwho = ['A']\nis = 'more'\n"
      "against = ['B', 'C']\nabove = 1\n";
  time("a", 10);
  time("b1", 50);  // of B the better one counts
  time("b2", 5);
  time("c", 4);
  const Judgement found = judged(slowest);
  EXPECT_EQ(found.verdict, Verdict::kHolds);
  EXPECT_DOUBLE_EQ(figure(found, "A / B").value, 2);
  time("b2", 20);
  EXPECT_EQ(verdict(slowest), Verdict::kChanged);
}

TEST_F(ClaimsTest, AboutSoManyTimes) {
  const std::string about =
      "kind = 'at-timestep'\nvalue = 'step_time'\ntimestep_ms = 1\nsystems = ['s']\nwho = ['A']\nis = 'more'\n"
      "against = ['C']\nbetween = [2, 4.5]\n";
  time("a", 9);
  time("c", 3);
  EXPECT_EQ(verdict(about), Verdict::kHolds);
  time("c", 2.02);  // 4.46, whose interval goes beyond
  EXPECT_EQ(verdict(about), Verdict::kNotSettled);
  time("c", 1);
  EXPECT_EQ(verdict(about), Verdict::kChanged);
}

TEST_F(ClaimsTest, AllContendersAreToldApartFromTheLineUp) {
  time("a", 2);
  time("b1", 5);
  time("c", 8);
  EXPECT_THAT(judged(kFastest).today, HasSubstr("s none of 2 have less than a, the nearest b1 (2.5 [2.4, 2.6] times)"));
  time("z", 1);
  time("null", 0.01);  // the harness is no contender
  const Judgement found = judged(kFastest);
  EXPECT_EQ(found.verdict, Verdict::kHolds) << "the verdict is the line-up's";
  EXPECT_THAT(found.today, HasSubstr("s 1 of 3 have less than a, the least z (0.5 [0.48, 0.52] times)"));
  EXPECT_EQ(judged(kFastest + "today = false\n").today, "");
}

const std::string kConsistent =
    "kind = 'at-equal-speed'\nvalue = 'consistency'\nsystems = ['s']\nwho = ['A']\nagainst = ['C']\nabove = 10\n";

// Straight lines in logarithms: at a realtime factor R, A has h = R / 500 and C has h = R / 250.
TEST_F(ClaimsTest, EqualSpeedIsNotEqualTimestep) {
  curve("a", 2, 1e-3, 1);
  curve("c", 4, 8e-3, 1);
  const Judgement found = judged(kConsistent);
  // at equal timestep it is 8; at equal speed C has twice the timestep. At C's first point A waits at its smallest.
  EXPECT_EQ(found.verdict, Verdict::kHolds);
  const ClaimFigure& ratio = figure(found, "C / A");
  EXPECT_NEAR(ratio.value, std::pow(8.0 * 16 * 16 * 16, 0.25), 1e-9);
  EXPECT_NEAR(ratio.low.value_or(0), ratio.value * 0.9 / 1.1, 1e-9);
  EXPECT_NEAR(ratio.high.value_or(0), ratio.value * 1.1 / 0.9, 1e-9);
  EXPECT_EQ(ratio.timestep_ms, std::nullopt);
  EXPECT_THAT(found.summary, HasSubstr("at equal speed"));
  EXPECT_THAT(found.summary, HasSubstr("8 to 16 along the curve"));
  curve("c", 4, 5e-3, 1);  // 8.4 [6.9, 10.3]
  EXPECT_EQ(verdict(kConsistent), Verdict::kNotSettled);
  curve("c", 4, 3e-3, 1);
  EXPECT_EQ(verdict(kConsistent), Verdict::kChanged);
}

// Where both fail on the same pieces of the motion, drawing the pieces alike shows how far apart they are for certain.
TEST_F(ClaimsTest, PiecesAreDrawnAlikeForBoth) {
  const auto pieces = [&](const std::string& contender, const std::vector<double>& factors, double scale) {
    for (const double h : {1.0, 2.0, 4.0, 8.0}) {
      Cell cell = made(contender, h, "consistency", "s");
      std::vector<double> errors;
      errors.reserve(factors.size());
      for (const double factor : factors) errors.push_back(scale * h * factor);
      const Interval mean = bootstrap_mean(errors, 1);
      cell.values = {{"consistency", "m", mean.value, mean.low, mean.high}};
      store_.put_cell(cell, {{"piece_error_m", errors}});
      const double factor = 500 * h;
      put(contender, h, "raw_speed", {{"realtime_factor", "1", factor, factor, factor}});
    }
  };
  pieces("a", {1, 1, 2, 1, 1, 90, 1, 3, 1, 1, 1, 40}, 1e-3);
  pieces("c", {1, 1, 2, 1, 1, 90, 1, 3, 1, 1, 1, 40}, 20e-3);
  Judgement found = judged(kConsistent);
  EXPECT_EQ(found.verdict, Verdict::kHolds);
  const ClaimFigure ratio = figure(found, "C / A");
  EXPECT_NEAR(ratio.value, 20, 1e-9);
  EXPECT_NEAR(ratio.low.value_or(0), 20, 1e-9);
  EXPECT_NEAR(ratio.high.value_or(0), 20, 1e-9);
  // the same errors on other pieces: as far apart in the mean, and nothing is certain
  pieces("c", {90, 40, 1, 1, 3, 1, 1, 1, 1, 2, 1, 1}, 20e-3);
  found = judged(kConsistent);
  EXPECT_EQ(found.verdict, Verdict::kNotSettled);
  EXPECT_NEAR(figure(found, "C / A").value, 20, 1e-9);
  EXPECT_LT(figure(found, "C / A").low.value_or(20), 10);
  EXPECT_GT(figure(found, "C / A").high.value_or(20), 40);
  // another number of pieces cannot be drawn alike: worst cases
  pieces("c", {1, 1, 2, 1, 1, 90, 1, 3, 1, 1, 1, 40, 1}, 20e-3);
  EXPECT_LT(figure(judged(kConsistent), "C / A").low.value_or(20), 10);
}

// Pieces of one motion depend on each other: initial states are drawn, each with all of its pieces.
TEST_F(ClaimsTest, InitialStatesAreDrawnAndNotTheirPieces) {
  // two contenders, whose errors differ between motions and hardly within one
  const auto pieces = [&](const std::string& contender, const std::vector<double>& of_states, int each, bool told) {
    for (const double h : {1.0, 2.0, 4.0, 8.0}) {
      Cell cell = made(contender, h, "consistency", "s");
      std::vector<double> errors, states;
      for (int piece = 0; piece < each; ++piece) {
        for (size_t state = 0; state < of_states.size(); ++state) {
          errors.push_back(1e-3 * h * of_states[state]);
          states.push_back(static_cast<double>(state));
        }
      }
      const double value = mean(errors);
      cell.values = {{"consistency", "m", value, 0.5 * value, 2 * value}};
      std::vector<SampleSeries> samples = {{"piece_error_m", errors}};
      if (told) samples.push_back({"piece_state", states});
      store_.put_cell(cell, samples);
      put(contender, h, "raw_speed", {{"realtime_factor", "1", 500 * h, 500 * h, 500 * h}});
    }
  };
  const std::vector<double> even(8, 1.0), uneven = {2, 50, 8, 40, 12, 30, 5, 13};
  const auto width = [&] {
    const ClaimFigure ratio = figure(judged(kConsistent), "C / A");
    EXPECT_NEAR(ratio.value, 20, 1e-9);
    return std::log(ratio.high.value_or(0) / ratio.low.value_or(1));
  };
  pieces("a", even, 1, true);
  pieces("c", uneven, 1, true);
  const double by_state = width();
  // more pieces of the same motions say nothing new
  pieces("a", even, 9, true);
  pieces("c", uneven, 9, true);
  EXPECT_NEAR(width(), by_state, 1e-9);
  // as if each were a motion of its own, they would seem three times as certain
  pieces("a", even, 9, false);
  pieces("c", uneven, 9, false);
  EXPECT_LT(width(), by_state / 2.5);
  // the draw is paired: where both have the same factor in every state, the ratio is certain
  pieces("a", uneven, 3, true);
  std::vector<double> times_20 = uneven;
  for (double& factor : times_20) factor *= 20;
  pieces("c", times_20, 3, true);
  EXPECT_NEAR(width(), 0, 1e-9);
  // other numbers of pieces a state cannot be drawn alike: worst cases of the stored intervals
  pieces("c", times_20, 4, true);
  EXPECT_NEAR(width(), 2 * std::log(4), 1e-9);
}

// A speed that is not known well widens what the pieces alone would say.
TEST_F(ClaimsTest, PairedPiecesDoNotHideTheSpeedsInterval) {
  const auto pieces = [&](const std::string& contender, double scale, double wide) {
    for (const double h : {1.0, 2.0, 4.0, 8.0}) {
      Cell cell = made(contender, h, "consistency", "s");
      cell.values = {{"consistency", "m", scale * h, scale * h, scale * h}};
      store_.put_cell(cell, {{"piece_error_m", {scale * h, scale * h, scale * h}}});
      const double factor = 500 * h;
      put(contender, h, "raw_speed", {{"realtime_factor", "1", factor, factor / wide, factor * wide}});
    }
  };
  pieces("a", 1e-3, 1);
  pieces("c", 20e-3, 1.1);
  const Judgement found = judged(kConsistent);
  // the first's error is as the speed: 10 % either way, but the first point cannot be slower and the last not faster
  EXPECT_NEAR(figure(found, "C / A").low.value_or(0), 20 * std::pow(1.1, -0.75), 1e-9);
  EXPECT_NEAR(figure(found, "C / A").high.value_or(0), 20 * std::pow(1.1, 0.75), 1e-9);
}

TEST_F(ClaimsTest, EqualSpeedTurnedAround) {
  curve("a", 4, 8e-2, 1);
  curve("c", 2, 1e-3, 1);
  EXPECT_EQ(verdict(kConsistent), Verdict::kChanged);
  const std::string worst =
      "kind = 'at-equal-speed'\nvalue = 'consistency'\nsystems = ['s']\nwho = ['A']\nis = 'more'\nagainst = ['C']\n"
      "above = 10\n";
  EXPECT_EQ(verdict(worst), Verdict::kHolds);
}

TEST_F(ClaimsTest, EqualSpeedInterpolatesAlongPowers) {
  curve("a", 2, 1e-6, 4);
  curve("c", 3, 1e-3, 2);  // its speeds lie between those of A
  const Judgement found = judged(kConsistent);
  EXPECT_EQ(found.verdict, Verdict::kHolds);
  double product = 1;
  for (const double h : {1.0, 2.0, 4.0, 8.0}) {
    const double mine = std::max(1.0, h * 2 / 3);  // A's timestep at C's speed
    product *= 1e-3 * h * h / (1e-6 * std::pow(mine, 4));
  }
  EXPECT_NEAR(figure(found, "C / A").value, std::pow(product, 0.25), 1e-6 * product);
}

TEST_F(ClaimsTest, WithoutCommonSpeedsThereIsNoComparison) {
  curve("a", 1000, 1e-3, 1);
  curve("c", 2, 1e-3, 1);
  const Judgement found = judged(kConsistent);
  EXPECT_EQ(found.verdict, Verdict::kNotMeasurable);
  EXPECT_THAT(found.reason, HasSubstr("no common speed"));
}

TEST_F(ClaimsTest, UntimedSystemsAreComparedAtEqualTimestep) {
  curve("a", 0, 1e-3, 1);
  curve("c", 0, 20e-3, 1);
  const Judgement found = judged(kConsistent);
  EXPECT_EQ(found.verdict, Verdict::kHolds);
  EXPECT_NEAR(figure(found, "C / A").value, 20, 1e-9);
  EXPECT_THAT(found.summary, HasSubstr("at equal timestep"));
}

TEST_F(ClaimsTest, APartialCurveIsComparedWhereItIs) {
  curve("a", 2, 1e-3, 1);
  curve("c", 2, 20e-3, 1);
  for (const double h : {4.0, 8.0}) put("c", h, "consistency", {}, Outcome::kDiverged);
  EXPECT_NEAR(figure(judged(kConsistent), "C / A").value, 20, 1e-9);
  for (const double h : {1.0, 2.0}) put("c", h, "consistency", {}, Outcome::kDiverged);
  const Judgement found = judged(kConsistent);
  EXPECT_EQ(found.verdict, Verdict::kNotMeasurable) << "no rival is left";
  EXPECT_THAT(found.reason, HasSubstr("diverged"));
}

// A run compared with itself says nothing of the timestep.
TEST_F(ClaimsTest, TheReferencesOwnTimestepIsLeftOut) {
  curve("a", 2, 1e-3, 1);
  curve("c", 2, 20e-3, 1);
  put("c", 0.5, "consistency", {{"consistency", "m", 1e-9, 1e-9, 1e-9}, {"restart_floor", "m", 1e-9, 1e-9, 1e-9}});
  EXPECT_NEAR(figure(judged(kConsistent), "C / A").value, 20, 1e-9);
}

// Such an error is only bounded: neither it nor one interpolated beside it is compared.
TEST_F(ClaimsTest, PointsNearAFloorAreLeftOut) {
  const auto near_floor = [&](const std::string& contender, double h) {
    put(contender, h, "consistency",
        {{"consistency", "m", 1e-9, 0.9e-9, 1.1e-9}, {"consistency_bound", "m", 3e-9, {}, {}}});
  };
  curve("a", 2, 1e-3, 1);
  curve("c", 2, 20e-3, 1);
  near_floor("c", 1);
  ClaimFigure ratio = figure(judged(kConsistent), "C / A");
  EXPECT_NEAR(ratio.value, 20, 1e-9);
  EXPECT_NEAR(ratio.low.value_or(0), 20 * 0.9 / 1.1, 1e-9);
  // C's speeds lie between those of A: its second point lies beside A's first
  curve("c", 3, 20e-3, 1);
  near_floor("a", 1);
  ratio = figure(judged(kConsistent), "C / A");
  EXPECT_NEAR(ratio.value, 30, 1e-9);
  for (const double h : {2.0, 4.0, 8.0}) near_floor("a", h);
  const Judgement found = judged(kConsistent);
  EXPECT_EQ(found.verdict, Verdict::kNotMeasurable);
  EXPECT_THAT(found.reason, HasSubstr("near the floors"));
}

TEST_F(ClaimsTest, NoGain) {
  const std::string no_gain =
      "kind = 'at-equal-speed'\nvalue = 'consistency'\nsystems = ['s']\nwho = ['A']\nagainst = ['C']\nnot_above = 2\n";
  curve("a", 2, 1e-3, 1);
  curve("c", 2, 1.5e-3, 1);  // 1.5 [1.2, 1.8]
  EXPECT_EQ(verdict(no_gain), Verdict::kHolds);
  curve("c", 2, 2.2e-3, 1);  // 2.2 [1.8, 2.7]: ignorance shows nothing
  EXPECT_EQ(verdict(no_gain), Verdict::kNotSettled);
  curve("c", 2, 3e-3, 1);
  EXPECT_EQ(verdict(no_gain), Verdict::kChanged);
  // who goes unstable gains nothing; against whom goes unstable there is no telling
  for (const double h : {1.0, 2.0, 4.0, 8.0}) put("a", h, "consistency", {}, Outcome::kUnstable);
  const Judgement found = judged(no_gain);
  EXPECT_EQ(found.verdict, Verdict::kHolds);
  EXPECT_THAT(found.summary, HasSubstr("s A unstable"));
  curve("a", 2, 1e-3, 1);
  for (const double h : {1.0, 2.0, 4.0, 8.0}) put("c", h, "consistency", {}, Outcome::kUnstable);
  EXPECT_EQ(verdict(no_gain), Verdict::kNotMeasurable);
}

TEST_F(ClaimsTest, TestsThatAskTheSameShareASentence) {
  for (const std::string system : {"s", "t"}) {
    time("a", 2, Outcome::kOk, system);
    time("b1", 4, Outcome::kOk, system);
    time("c", 8, Outcome::kOk, system);
  }
  std::string other = kFastest;
  other.replace(other.find("['s']"), 5, "['t']");
  const Judgement found = judged(kFastest + "[[claim.test]]\n" + other);
  EXPECT_EQ(found.verdict, Verdict::kHolds);
  EXPECT_EQ(found.summary,
            "Step time at 1 ms, ratio to the nearest rival: s 2 [1.92, 2.08] (B over A); t 2 [1.92, 2.08] (B over A) "
            "(above 1 needed).");
}

TEST_F(ClaimsTest, Slope) {
  const std::string falls = "kind = 'slope'\nvalue = 'consistency'\nsystems = ['s']\nwho = ['A', 'C']\nbelow = 0\n";
  curve("a", 2, 1e-3, -1);
  curve("c", 2, 1e-3, -0.5);
  const Judgement found = judged(falls);
  EXPECT_EQ(found.verdict, Verdict::kHolds);
  EXPECT_NEAR(figure(found, "C").value, -0.5, 1e-9);
  EXPECT_EQ(figure(found, "C").measure, "consistency_slope");
  EXPECT_THAT(found.today, HasSubstr("2 of 2"));
  curve("c", 2, 1e-3, 0.5);
  EXPECT_EQ(verdict(falls), Verdict::kChanged);
  for (const double h : {2.0, 4.0, 8.0}) put("c", h, "consistency", {}, Outcome::kTimeout);
  EXPECT_EQ(verdict(falls), Verdict::kNotMeasurable);
}

TEST_F(ClaimsTest, ValueOfAFamily) {
  const std::string linear =
      "kind = 'value'\nvalue = 'scaling_exponent'\nfamily = 'n'\nwho = ['A']\nbetween = [0.75, 1.25]\n";
  EXPECT_EQ(verdict(linear), Verdict::kNotMeasurable);
  put("a", 10, "scaling", {{"run_time", "s", 1, 1, 1}}, Outcome::kOk, "n-10");
  put("a", 10, "scaling", {{"scaling_exponent", "1", 1.1, 1.0, 1.2}}, Outcome::kOk, "n-20");
  EXPECT_EQ(verdict(linear), Verdict::kHolds);
  put("a", 10, "scaling", {{"scaling_exponent", "1", 1.1, 0.9, 1.3}}, Outcome::kOk, "n-20");
  EXPECT_EQ(verdict(linear), Verdict::kNotSettled);
  put("a", 10, "scaling", {{"scaling_exponent", "1", 1.5, 1.4, 1.6}}, Outcome::kOk, "n-20");
  EXPECT_EQ(verdict(linear), Verdict::kChanged);
}

TEST_F(ClaimsTest, ValueAtTheSmallestTimestep) {
  const std::string held = "kind = 'value'\nvalue = 'grasp_held'\nsystems = ['s']\nwho = ['A', 'C']\nabove = 0.5\n";
  grasp("a", 1, 1);
  grasp("a", 2, 0);
  EXPECT_EQ(verdict(held), Verdict::kNotMeasurable);
  grasp("c", 1, 1);
  EXPECT_EQ(verdict(held), Verdict::kHolds);
  grasp("c", 0.5, 0);
  EXPECT_EQ(verdict(held), Verdict::kChanged);
  grasp("c", 0.5, 1, Outcome::kUnstable);
  EXPECT_EQ(verdict(held), Verdict::kChanged);
}

TEST_F(ClaimsTest, UnstableAtLargerTimesteps) {
  const std::string unstable = "kind = 'unstable'\nmeasure = 'grasp'\nsystems = ['s']\nwho = ['B']\n";
  const auto run = [&](const std::string& contender, double h, Outcome outcome) {
    put(contender, h, "grasp", {}, outcome);
  };
  EXPECT_EQ(verdict(unstable), Verdict::kNotMeasurable);
  run("b1", 1, Outcome::kOk);
  run("b1", 2, Outcome::kOk);
  run("b1", 4, Outcome::kDiverged);
  run("b1", 8, Outcome::kOk);
  Judgement found = judged(unstable);
  EXPECT_EQ(found.verdict, Verdict::kHolds);
  EXPECT_THAT(found.summary, HasSubstr("B stable up to 2 ms and not at 4 ms"));
  EXPECT_EQ(figure(found, "B").value, 2);
  for (const double h : {1.0, 2.0, 4.0, 8.0}) run("b2", h, Outcome::kOk);
  EXPECT_EQ(verdict(unstable), Verdict::kChanged) << "the better one counts";
  run("b2", 8, Outcome::kUnstable);
  EXPECT_EQ(verdict(unstable), Verdict::kHolds);
  for (const std::string name : {"b1", "b2"}) {
    for (const double h : {1.0, 2.0, 4.0, 8.0}) run(name, h, Outcome::kDiverged);
  }
  found = judged(unstable);
  EXPECT_EQ(found.verdict, Verdict::kChanged);
  EXPECT_THAT(found.summary, HasSubstr("B unstable at every timestep"));
}

// Who goes unstable first, and who always does.
TEST_F(ClaimsTest, UnstableBeforeOthers) {
  const std::string first = "kind = 'unstable'\nmeasure = 'grasp'\nsystems = ['s']\nwho = ['A']\nagainst = ['C']\n";
  const std::string always = "kind = 'unstable'\nmeasure = 'grasp'\nsystems = ['s']\nwho = ['A']\nalways = true\n";
  const auto runs = [&](const std::string& contender, double fails_from) {
    for (const double h : {1.0, 2.0, 4.0, 8.0}) {
      put(contender, h, "grasp", {}, h < fails_from ? Outcome::kOk : Outcome::kDiverged);
    }
  };
  runs("a", 2);
  EXPECT_EQ(verdict(first), Verdict::kNotMeasurable) << "nothing to compare with";
  runs("c", 4);
  EXPECT_EQ(verdict(first), Verdict::kHolds);
  EXPECT_THAT(judged(first).now, HasSubstr("A is stable up to 1 ms and not at 2 ms on s, C stable up to 2 ms"));
  runs("c", 2);
  EXPECT_EQ(verdict(first), Verdict::kNotSettled) << "timesteps are a factor apart";
  runs("c", 1);
  EXPECT_EQ(verdict(first), Verdict::kChanged);
  runs("c", 9);
  EXPECT_EQ(verdict(first), Verdict::kHolds) << "never fails";
  runs("a", 9);
  EXPECT_EQ(verdict(first), Verdict::kChanged) << "neither fails";
  EXPECT_EQ(verdict(always), Verdict::kChanged);
  runs("a", 2);
  EXPECT_EQ(verdict(always), Verdict::kChanged);
  runs("a", 1);
  EXPECT_EQ(verdict(always), Verdict::kHolds);
  EXPECT_EQ(verdict(first), Verdict::kHolds);
}

TEST_F(ClaimsTest, OrderOfLargestSteps) {
  const std::string order = "kind = 'order'\nvalue = 'grasp_held'\nsystems = ['s']\norder = [['A', 'B'], ['C']]\n";
  const auto holds = [&](const std::string& contender, double up_to) {
    for (const double h : {1.0, 2.0, 4.0, 8.0}) grasp(contender, h, h <= up_to ? 1 : 0);
  };
  holds("a", 8);
  holds("b1", 4);
  EXPECT_EQ(verdict(order), Verdict::kNotMeasurable);
  holds("c", 2);
  Judgement found = judged(order);
  EXPECT_EQ(found.verdict, Verdict::kHolds);
  EXPECT_THAT(found.summary, HasSubstr("A 8, B 4, C 2 (A and B, then C needed)"));
  EXPECT_THAT(found.now, HasSubstr("B holds up to 4 ms on s and C up to 2 ms"));
  holds("c", 4);
  EXPECT_EQ(verdict(order), Verdict::kNotSettled);
  holds("b2", 8);
  EXPECT_EQ(verdict(order), Verdict::kHolds) << "the better one counts";
  holds("c", 8);
  holds("a", 1);
  found = judged(order);
  EXPECT_EQ(found.verdict, Verdict::kChanged);
  EXPECT_THAT(found.now, HasSubstr("A holds up to 1 ms on s and C up to 8 ms"));
}

// One rival may be better.
TEST_F(ClaimsTest, AllButOne) {
  const std::string all_but_one = kFastest + "but = 1\n";
  time("a", 5);
  time("b1", 2);
  time("c", 9);
  EXPECT_EQ(verdict(kFastest), Verdict::kChanged);
  Judgement found = judged(all_but_one);
  EXPECT_EQ(found.verdict, Verdict::kHolds);
  EXPECT_THAT(found.now, HasSubstr("faster than C"));
  EXPECT_EQ(found.threshold, "above 1 over all but 1");
  time("c", 5);
  EXPECT_EQ(verdict(all_but_one), Verdict::kNotSettled);
  time("c", 3);
  EXPECT_EQ(verdict(all_but_one), Verdict::kChanged);
}

TEST_F(ClaimsTest, LargestStep) {
  const std::string steps =
      "kind = 'largest-step'\nvalue = 'grasp_held'\nsystems = ['s']\nexpected = {A = 4, C = '1/4'}\n";
  for (const double h : {0.25, 0.5, 1.0, 2.0, 4.0}) grasp("a", h, h != 1);
  EXPECT_EQ(verdict(steps), Verdict::kNotMeasurable);
  for (const double h : {0.25, 0.5, 1.0}) grasp("c", h, h < 0.75);
  Judgement found = judged(steps);
  EXPECT_EQ(found.verdict, Verdict::kHolds);  // 4 and 1/2: each within a factor of 2
  EXPECT_THAT(found.summary, AllOf(HasSubstr("A 4 (paper 4; not at 1)"), HasSubstr("C 1/2 (paper 1/4)")));
  EXPECT_EQ(figure(found, "C").value, 0.5);
  EXPECT_EQ(figure(found, "C").timestep_ms, 0.5);
  EXPECT_THAT(found.today, HasSubstr("4 ms: a; 1/2 ms: c"));
  grasp("c", 1, 1);
  EXPECT_EQ(verdict(steps), Verdict::kChanged);
  grasp("c", 1, 1, Outcome::kUnstable);  // a run that ends unstable has not held
  EXPECT_EQ(verdict(steps), Verdict::kHolds);
  for (const double h : {0.25, 0.5, 1.0}) grasp("c", h, 0);
  found = judged(steps);
  EXPECT_EQ(found.verdict, Verdict::kChanged);
  EXPECT_THAT(found.summary, HasSubstr("C none"));
}

TEST_F(ClaimsTest, JsonHasTheLayout) {
  time("a", 2);
  time("b1", 5);
  time("c", 8);
  const nlohmann::json written = claims_json(judge(file_of(kFastest), Results(store_)));
  ASSERT_EQ(written.size(), 1);
  EXPECT_EQ(written[0]["number"], 7);
  EXPECT_EQ(written[0]["title"], "A first");
  EXPECT_EQ(written[0]["statement"], "A comes first");
  EXPECT_EQ(written[0]["paper"], "a table");
  EXPECT_EQ(written[0]["verdict"], "holds");
  EXPECT_EQ(written[0]["reason"], "");
  for (const std::string key : {"summary", "today", "key"}) EXPECT_TRUE(written[0][key].is_string()) << key;
  const nlohmann::json first = {{"label", "A"},     {"contender", "a"},       {"system", "s"},
                                {"timestep_ms", 1}, {"measure", "step_time"}, {"value", 2.0},
                                {"unit", "us"},     {"low", 0.98 * 2},        {"high", 1.02 * 2}};
  EXPECT_EQ(written[0]["figures"][0], first);
  const std::string markdown = claims_markdown(judge(file_of(kFastest), Results(store_)));
  EXPECT_THAT(markdown, AllOf(HasSubstr("| 7 | A first | holds |"), HasSubstr("### 7. A first")));
}

// Results that say nothing about the paper have no such section in their report.
TEST_F(ClaimsTest, ReportOfOtherResultsHasNone) {
  time("a", 2);
  EXPECT_EQ(report_data(store_)["claims"], nlohmann::json::array());
  store_.set_systems({{"planar-chain", "{}"}});
  std::vector<ContenderRow> rows;
  for (const std::string name : {"bullet-mb", "mujoco-euler"}) rows.push_back({name, name, "1", name, "", "", ""});
  store_.set_contenders(rows);
  time("mujoco-euler", 2, Outcome::kOk, "planar-chain");
  time("bullet-mb", 6, Outcome::kOk, "planar-chain");
  const nlohmann::json claims = report_data(store_)["claims"];
  ASSERT_EQ(claims.size(), 17);
  EXPECT_EQ(claims[2]["verdict"], "not-measurable");
  EXPECT_THAT(claims[2]["summary"].get<std::string>(), HasSubstr("BulletMB over MuJoCo Euler"));
}

TEST(ClaimsFile, RefusesWhatItCannotUse) {
  EXPECT_THAT(claim_error("kind = 'at-timestp'\n"),
              AllOf(HasSubstr("claims.toml:"), HasSubstr("did you mean 'at-timestep'")));
  EXPECT_THAT(claim_error("kind = 'unstable'\nmeasure = 'grasp'\nsystems = ['s']\nwho = ['D']\n"), HasSubstr("no 'D'"));
  EXPECT_THAT(claim_error("kind = 'unstable'\nmeasure = 'grasp'\nsystems = []\nwho = ['A']\n"), HasSubstr("'systems'"));
  EXPECT_THAT(claim_error("kind = 'unstable'\nmeasure = 'grasp'\nsystems = ['s']\nwho = ['A']\nabove = 1\n"),
              HasSubstr("no key 'above'"));
  EXPECT_THAT(claim_error("kind = 'value'\nvalue = 'x'\nsystems = ['s']\nwho = ['A']\n"), HasSubstr("'between'"));
  EXPECT_THAT(claim_error("kind = 'value'\nvalue = 'x'\nsystems = ['s']\nwho = ['A']\nabove = 1\nbelow = 2\n"),
              HasSubstr("one of 'above'"));
  EXPECT_THAT(claim_error("kind = 'value'\nvalue = 'x'\nsystems = ['s']\nwho = ['A']\nbetween = [2, 1]\n"),
              HasSubstr("from 2 to 1"));
  EXPECT_THAT(claim_error("kind = 'value'\nvalue = 'x'\nsystems = ['s']\nfamily = 'f'\nwho = ['A']\nabove = 1\n"),
              HasSubstr("either"));
  EXPECT_THAT(
      claim_error("kind = 'at-timestep'\nvalue = 'x'\nsystems = ['s']\nwho = ['A']\nagainst = ['C']\nabove = 1\n"),
      HasSubstr("'timestep_ms'"));
  EXPECT_THAT(claim_error("kind = 'largest-step'\nvalue = 'x'\nsystems = ['s']\nexpected = {A = 'soon'}\n"),
              HasSubstr("no number"));
  EXPECT_THAT(claim_error(kFastest + "but = 2\n"), HasSubstr("below the 2 of 'against'"));
  EXPECT_THAT(claim_error("kind = 'order'\nvalue = 'x'\nsystems = ['s']\norder = [['A']]\n"),
              HasSubstr("groups of engines"));
  EXPECT_THAT(claim_error("kind = 'order'\nvalue = 'x'\nsystems = ['s']\norder = [['A'], ['Z']]\n"),
              HasSubstr("no 'Z'"));
  EXPECT_THAT(claim_error("kind = 'unstable'\nmeasure = 'grasp'\nsystems = ['s']\nwho = ['A']\nagainst = ['C']\n"
                          "always = true\n"),
              HasSubstr("either"));
  EXPECT_THAT(claim_error("kind = \n"), HasSubstr("claims.toml:"));
  EXPECT_THROW(load_claims("/nowhere/claims.toml"), InputError);
  EXPECT_THROW(parse_claims("[engines]\nA = ['a']\n", "x"), InputError);
  EXPECT_THROW(parse_claims("engines = 1\n", "x"), InputError);
  for (const auto& [text, words] : {std::pair("\n[engines]\nA = [\"a\\u0000b\"]\n", "x:3: a text has a NUL character"),
                                    std::pair("\n= 1\n", "x:2: this is not TOML")}) {
    try {
      static_cast<void>(parse_claims(text, "x"));
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(words));
    }
  }
}

// Every contender of the paper's line-up exists, and the paper's campaign measures what the claims ask for.
TEST(ClaimsFile, OursFitsTheCampaign) {
  const std::string path = paper_claims_file().value_or("");
  ASSERT_NE(path, "");
  const ClaimsFile file = load_claims(path);
  EXPECT_EQ(file.claims.size(), 17);
  EXPECT_THAT(campaign_names(), Not(::testing::Contains("paper_claims")));
  const Campaign campaign = load_campaign(find_campaign("paper"));
  for (const auto& [engine, contenders] : file.engines) {
    for (const std::string& name : contenders) {
      EXPECT_TRUE(std::ranges::any_of(campaign.contenders,
                                      [&](const CampaignContender& each) { return each.resolved.name == name; }))
          << engine << ": " << name;
    }
  }
  const auto measured = [&](const CampaignSystem& system, const std::string& engine) {
    const auto found =
        std::ranges::find(file.engines, engine, &std::pair<std::string, std::vector<std::string>>::first);
    return std::ranges::any_of(system.contenders, [&](int i) {
      const std::string& name = campaign.contenders[static_cast<size_t>(i)].resolved.name;
      return std::ranges::find(found->second, name) != found->second.end();
    });
  };
  for (const Claim& claim : file.claims) {
    for (const ClaimTest& test : claim.tests) {
      std::vector<std::string> engines = test.who;
      engines.insert(engines.end(), test.against.begin(), test.against.end());
      for (const auto& [engine, timestep] : test.expected) engines.push_back(engine);
      for (const auto& group : test.order) engines.insert(engines.end(), group.begin(), group.end());
      size_t systems = 0;
      for (const CampaignSystem& system : campaign.systems) {
        const bool asked =
            test.family.empty() ? std::ranges::count(test.systems, system.name) > 0 : system.family == test.family;
        if (!asked) continue;
        ++systems;
        for (const std::string& engine : engines) {
          EXPECT_TRUE(measured(system, engine)) << claim.number << ": " << engine << " on " << system.name;
        }
        if (test.timestep_ms && test.value == "step_time") {
          EXPECT_THAT(system.timing_ms, ::testing::Contains(test.timestep_ms.value_or(0)))
              << claim.number << ": " << system.name;
        }
      }
      if (test.family.empty()) {
        EXPECT_EQ(systems, test.systems.size()) << claim.number;
      } else {
        EXPECT_GE(systems, 3) << claim.number;
      }
    }
  }
}

}  // namespace
}  // namespace assay
