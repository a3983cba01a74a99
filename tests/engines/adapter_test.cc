// Rules that all adapters share.
#include "engines/adapter.h"

#include <cmath>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "load/mjcf.h"

namespace assay {
namespace {

// Two balls of `radius`, one `height` above the other, and a plane.
Model balls(double radius, double height) {
  return load_model_text(
      fmt::format(R"(<mujoco><option gravity="0 0 -9.81"/><worldbody><geom type="plane" size="1 1 1"/>
  <body pos="0 0 {0}"><freejoint/><geom size="{0}"/></body>
  <body pos="0 0 {1}"><freejoint/><geom size="{0}"/></body></worldbody></mujoco>)",
                  radius, radius + height),
      "balls");
}

TEST(ContactMargin, AFiftiethOfTheSizeAndAStepOfTheFall) {
  EXPECT_NEAR(contact_margin(balls(0.05, 1), 0), 0.02 * 0.1, 1e-12);
  EXPECT_NEAR(contact_margin(balls(0.05, 1), 1e-3), 0.02 * 0.1 + 1e-3 * std::sqrt(2 * 9.81), 1e-12);
  EXPECT_NEAR(contact_margin(balls(0.008, 0), 1e-3), 0.02 * 0.016, 1e-12) << "a fingertip: no 20 mm around it";
}

// A model of another size falls in the same number of steps of a timestep that is as the root of the size: its margin
// has to be the same part of it.
TEST(ContactMargin, IsTheSamePartOfEverySize) {
  for (const double size : {0.02, 0.1, 2.0}) {
    EXPECT_NEAR(contact_margin(balls(0.05 * size, size), 1e-3 * std::sqrt(size)) / size,
                contact_margin(balls(0.05, 1), 1e-3), 1e-12)
        << size;
  }
}

TEST(ContactMargin, ShapesThatTouchNothingHaveNoPart) {
  Model model = balls(0.05, 1);
  const double before = contact_margin(model, 1e-3);
  Shape drawn = model.shapes.back();
  drawn.radius *= 100;
  drawn.collides = false;
  model.shapes.push_back(drawn);
  EXPECT_EQ(contact_margin(model, 1e-3), before);
}

// Two balls of 0.1 m at `far` metres from the origin.
Model far_away(double far) {
  Model model = balls(0.05, 1);
  for (BodyState& body : model.initial.bodies) body.p_WBcm.x() += far;
  return model;
}

TEST(CoarsePositions, AreSaidWhereRoundingIsAHundredthOfASpeed) {
  // 1 m high, so about 3.1 m/s; floats at 2^k m are 2^(k - 23) m apart
  for (const double far : {0.0, 1.0, 10.0, 100.0, 500.0})
    EXPECT_FALSE(coarse_positions(far_away(far), 1e-3, {})) << far;
  for (const double far : {1024.0, 1e4, 1e5}) {
    const auto found = coarse_positions(far_away(far), 1e-3, {});
    ASSERT_TRUE(found) << far;
    EXPECT_EQ(found->fidelity, Fidelity::kApproximated);
    EXPECT_THAT(found->element, testing::HasSubstr(fmt::format("{:.3g} m", far)));
  }
  // 2^(10 - 23) / 2 m of 1 ms
  EXPECT_THAT(coarse_positions(far_away(1024), 1e-3, {})->how, testing::HasSubstr("off by 0.061 m/s"));
  // at smaller steps nearer, with substeps nearer yet
  EXPECT_FALSE(coarse_positions(far_away(100), 1e-3, {}));
  EXPECT_TRUE(coarse_positions(far_away(100), 1e-3 / 16, {}));
  EXPECT_TRUE(coarse_positions(far_away(100), 1e-3, {.per_step = 50}));
}

TEST(CoarsePositions, AreOfSinglePrecisionAlone) {
  Capabilities capabilities;
  capabilities.precision = Precision::kSingle;
  const Settings settings;
  EXPECT_EQ(feature_limitations("engine", far_away(1e4), capabilities, settings).size(), 1);
  EXPECT_TRUE(feature_limitations("engine", far_away(1e4), capabilities, settings, {.in_double = true}).empty());
  capabilities.precision = Precision::kDouble;
  EXPECT_TRUE(feature_limitations("engine", far_away(1e4), capabilities, settings).empty());
}

}  // namespace
}  // namespace assay
