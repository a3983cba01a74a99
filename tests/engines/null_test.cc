#include <gtest/gtest.h>

#include "engines/registry.h"
#include "model/kinematics.h"

namespace assay {
namespace {

TEST(NullEngine, PassesTimeAndMovesNothing) {
  Model model;
  model.bodies.emplace_back();
  model.bodies[0].mass = 1;
  State start = reference_state(model);
  start.time = 0.5;
  start.bodies[0].v_WBcm = {1, 2, 3};
  ResolvedContender contender = Registry::instance().resolve("null");
  contender.settings.timestep = 0.25;

  const auto simulation = contender.engine->create(model, start, contender.settings);
  simulation->advance(3);
  State end;
  simulation->read_state(end);

  EXPECT_EQ(end.time, 1.25);
  EXPECT_EQ(end.bodies[0].p_WBcm, start.bodies[0].p_WBcm);
  EXPECT_EQ(end.bodies[0].v_WBcm, start.bodies[0].v_WBcm);
}

}  // namespace
}  // namespace assay
