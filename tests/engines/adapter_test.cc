// Rules that all adapters share.
#include "engines/adapter.h"

#include <cmath>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "model/mjcf.h"

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

}  // namespace
}  // namespace assay
