// How figures and failures of an engine become verdicts.
#include <algorithm>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "conformance/conformance.h"
#include "faulty_engine.h"

namespace assay {
namespace {

constexpr const char* kPasses = "mujoco-euler";

class Verdicts : public testing::Test {
 protected:
  void SetUp() override {
    const auto names = Registry::instance().contender_names();
    if (std::ranges::find(names, kPasses) == names.end()) GTEST_SKIP() << kPasses << " is not built";
    sound_ = Registry::instance().resolve(kPasses);
  }

  ConformanceResult result_of(const Fault& fault, const std::string& test) const {
    const FaultyEngine engine(sound_, fault);
    return run_conformance(engine.contender(), {.tests = {test}}).at(0);
  }

  ResolvedContender sound_;
};

// A fault whose figure is known: mass 1 % too large, and a declaration with a bound.
Fault heavy(const std::string& test, double bound) {
  Fault fault;
  fault.name = "heavy";
  fault.model = [](Model& model) {
    for (Body& body : model.bodies) body.mass *= 1.01;
  };
  fault.capabilities = [=](Capabilities& can) { can.deviations.push_back({test, bound, "masses are rounded up"}); };
  return fault;
}

TEST_F(Verdicts, DeclaredDeviationWithinItsBoundIsOne) {
  const ConformanceResult result = result_of(heavy("readback", 0.0101), "readback");
  EXPECT_EQ(result.status, ConformanceStatus::kDeviation);
  EXPECT_NEAR(result.figure, 0.01, 1e-9);
  EXPECT_LT(result.tolerance, 1e-9);
  EXPECT_THAT(result.note, testing::HasSubstr("masses are rounded up"));
  EXPECT_TRUE(conforms({result}));
}

TEST_F(Verdicts, DeclaredDeviationBeyondItsBoundFails) {
  const ConformanceResult result = result_of(heavy("readback", 0.0099), "readback");
  EXPECT_EQ(result.status, ConformanceStatus::kFail);
  EXPECT_THAT(result.note, testing::HasSubstr("0.0099"));
  EXPECT_FALSE(conforms({result}));
}

TEST_F(Verdicts, DeviationOfAnotherTestDoesNotCount) {
  EXPECT_EQ(result_of(heavy("free-fall", 1), "readback").status, ConformanceStatus::kFail);
}

TEST_F(Verdicts, DeclaredDeviationThatDoesNotShowIsAPass) {
  EXPECT_EQ(result_of(heavy("free-fall", 1), "free-fall").status, ConformanceStatus::kPass);
}

// Turns of at most 0.1 mrad in ten steps are lost: at 4 and 1 ms a body with 10 mrad/s turns by more.
Fault drops_slow_turns(double finest, double coarsest) {
  Fault fault;
  fault.name = "drops slow turns";
  fault.step = [](const State& before, State& after, double) {
    for (size_t i = 0; i < after.bodies.size(); ++i) {
      const Quat turned = after.bodies[i].q_WB * before.bodies[i].q_WB.conjugate();
      if (2 * turned.vec().norm() <= 1e-5) after.bodies[i].q_WB = before.bodies[i].q_WB;
    }
  };
  fault.capabilities = [=](Capabilities& can) {
    can.deviations.push_back({"slow-rotations", 0.011, "slow turns are lost", finest, coarsest});
  };
  return fault;
}

TEST_F(Verdicts, DeviationCountsAtItsTimestepsOnly) {
  const ConformanceResult covered = result_of(drops_slow_turns(0, 1e-3), "slow-rotations");
  EXPECT_EQ(covered.status, ConformanceStatus::kDeviation) << covered.note;
  EXPECT_THAT(covered.note,
              testing::AllOf(testing::HasSubstr("slow turns are lost"), testing::HasSubstr("passes at 4 ms")));
  ASSERT_EQ(covered.timesteps.size(), 4U);
  EXPECT_EQ(covered.timesteps.front().timestep, 4e-3);
  EXPECT_EQ(covered.timesteps.front().status, ConformanceStatus::kPass);
  EXPECT_EQ(covered.timesteps.back().status, ConformanceStatus::kDeviation);

  const ConformanceResult beyond = result_of(drops_slow_turns(0, 1e-4), "slow-rotations");
  EXPECT_EQ(beyond.status, ConformanceStatus::kFail);
  EXPECT_EQ(beyond.timesteps.back().status, ConformanceStatus::kDeviation);
  EXPECT_THAT(beyond.note, testing::HasSubstr("fails at 1, 1/4 ms"));
}

TEST_F(Verdicts, TimestepsBelowTheFinestDeclaredAreNotTried) {
  Fault fault = drops_slow_turns(0, 0);
  fault.capabilities = [](Capabilities& can) { can.finest_timestep = 4e-3; };
  const ConformanceResult result = result_of(fault, "slow-rotations");
  EXPECT_EQ(result.status, ConformanceStatus::kPass) << result.note;
  EXPECT_EQ(result.timesteps.size(), 1U);
}

TEST_F(Verdicts, MissingCapabilityIsNamed) {
  Fault fault;
  fault.capabilities = [](Capabilities& can) {
    can.contact = false;
    can.springs = SpringKind::kNone;
  };
  const FaultyEngine engine(sound_, fault);
  const auto results =
      run_conformance(engine.contender(), {.tests = {"sliding-capsule", "spring-damper", "free-fall", "determinism"}});
  ASSERT_EQ(results.size(), 4U);
  for (const ConformanceResult& result : results) {
    const bool lacks = result.test == "sliding-capsule" || result.test == "spring-damper";
    EXPECT_EQ(result.status, lacks ? ConformanceStatus::kNotApplicable : ConformanceStatus::kPass) << result.test;
    if (result.test == "sliding-capsule") {
      EXPECT_THAT(result.note, testing::HasSubstr("contact"));
    }
  }
  EXPECT_TRUE(conforms(results));
}

TEST_F(Verdicts, EngineThatThrowsFailsAndTheNextTestRuns) {
  Fault fault;
  fault.fails_at_step = 150;
  const FaultyEngine engine(sound_, fault);
  const auto results = run_conformance(engine.contender(), {.tests = {"readback", "free-fall", "torque-for-one-step"}});
  ASSERT_EQ(results.size(), 3U);
  for (const ConformanceResult& result : results) {
    if (result.test == "free-fall") {
      EXPECT_EQ(result.status, ConformanceStatus::kFail);
      EXPECT_EQ(result.note, "the solver gave up");
    } else {
      EXPECT_EQ(result.status, ConformanceStatus::kPass) << result.test;
    }
  }
}

TEST_F(Verdicts, NotANumberFailsWithAFiniteFigure) {
  Fault fault;
  fault.read = [](const Model&, State& state) {
    for (BodyState& body : state.bodies) body.p_WBcm.setConstant(std::numeric_limits<double>::quiet_NaN());
    for (double& angle : state.position) angle = std::numeric_limits<double>::quiet_NaN();
  };
  const FaultyEngine engine(sound_, fault);
  int figures = 0;
  for (const ConformanceResult& result : run_conformance(engine.contender())) {
    EXPECT_TRUE(std::isfinite(result.figure) && std::isfinite(result.tolerance)) << result.test;
    // what never looks at positions or angles cannot see it
    const std::vector<std::string> blind = {
        "readback",        "determinism",         "independence",      "batches",      "fast-motion",
        "torque-free-top", "torque-for-one-step", "friction-per-pair", "sphere-rolls", "tree-readback",
        "ball-limit",      "ball-dry-friction",   "box-tips",          "hull-tips",    "ellipsoid-rocks",
        "spinning-bodies", "far-from-origin"};
    if (std::ranges::find(blind, result.test) != blind.end()) continue;
    EXPECT_NE(result.status, ConformanceStatus::kPass) << result.test;
    ++figures;
  }
  EXPECT_GT(figures, 10);
}

TEST_F(Verdicts, AreReportedAsTheyArrive) {
  std::vector<std::string> seen;
  const ConformanceOptions options = {
      .tests = {"free-fall", "readback"},
      .on_result = [&](const ConformanceResult& result) { seen.push_back(result.test); }};
  const auto results = run_conformance(sound_, options);
  // in the suite's order, not in the caller's
  EXPECT_THAT(seen, testing::ElementsAre("readback", "free-fall"));
  EXPECT_EQ(results.size(), 2U);
}

TEST_F(Verdicts, UnknownTestIsTheUsersMistake) {
  try {
    run_conformance(sound_, {.tests = {"free-fal"}});
    FAIL() << "no exception";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("'free-fal'"), testing::HasSubstr("'free-fall'")));
  }
}

TEST(ConformanceTests, HaveNamesAndMeanings) {
  std::vector<std::string> names;
  for (const ConformanceTest& test : conformance_tests()) {
    EXPECT_FALSE(test.meaning.empty()) << test.name;
    EXPECT_EQ(std::ranges::count(names, test.name), 0) << test.name;
    names.push_back(test.name);
  }
  EXPECT_GE(names.size(), 20U);
}

TEST(StatusText, IsWhatIsStored) {
  EXPECT_EQ(status_text(ConformanceStatus::kPass), "pass");
  EXPECT_EQ(status_text(ConformanceStatus::kFail), "fail");
  EXPECT_EQ(status_text(ConformanceStatus::kDeviation), "deviation");
  EXPECT_EQ(status_text(ConformanceStatus::kNotApplicable), "not-applicable");
}

}  // namespace
}  // namespace assay
