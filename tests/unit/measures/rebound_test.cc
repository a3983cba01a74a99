// Rebound of impacts: the probe has the system's scale and reaches the plane at every phase of a step.
#include "measures/rebound.h"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "load/mjcf.h"
#include "measures/violation.h"

namespace assay {
namespace {

Model things(const std::string& more) {
  return load_model_text(R"(<mujoco model="things"><worldbody>
    <geom name="floor" type="plane" size="0 0 1"/>
    <body name="ball" pos="0 0 3"><freejoint/><geom type="sphere" size="0.1" mass="4"/></body>)" +
                             more + "</worldbody></mujoco>",
                         "things");
}

TEST(Rebound, TheProbeHasTheSizeAndMassOfTheSmallestShape) {
  const auto expect = [](const std::string& more, double radius, double mass) {
    const auto probe = impact_experiment(things(more), 1e-3);
    ASSERT_TRUE(probe);
    EXPECT_EQ(probe->model.bodies.size() + 1, probe->model.shapes.size());
    for (const Body& body : probe->model.bodies) EXPECT_DOUBLE_EQ(body.mass, mass);
    for (const ContactPair& pair : probe->model.contacts) {
      EXPECT_NEAR(probe->model.shapes[static_cast<size_t>(pair.shape_b)].radius, radius, 1e-12);
    }
    EXPECT_TRUE(probe->model.gravity.isZero());
  };
  expect("", 0.1, 4);
  expect(R"(<body pos="2 0 3"><freejoint/><geom type="box" size="0.3 0.02 0.2" mass="7"/></body>)", 0.02, 7);
  expect(R"(<body pos="2 0 3"><freejoint/><geom type="capsule" size="0.03 0.5" mass="2"/></body>)", 0.03, 2);
  // what touches nothing does not count
  expect(
      R"(<body pos="2 0 3"><freejoint/><geom type="sphere" size="0.001" mass="2" contype="0" conaffinity="0"/></body>)",
      0.1, 4);
}

TEST(Rebound, ImpactsAreAtEveryPhaseOfAStep) {
  constexpr double kTimestep = 4e-3;
  const auto made = impact_experiment(things(""), kTimestep);
  ASSERT_TRUE(made);
  const Experiment probe = made.value_or(Experiment{});
  std::set<int> phases;
  double last = 0;
  const Separations separations(probe.model);
  for (size_t i = 0; i < probe.model.contacts.size(); ++i) {
    const double gap = separations.of(static_cast<int>(i), probe.model.initial);
    const double steps = gap / (-probe.model.initial.bodies[i].v_WBcm.z() * kTimestep);
    EXPECT_GT(steps, 1) << "no contact at the start";
    phases.insert(static_cast<int>(std::lround(16 * (steps - std::floor(steps)))));
    last = std::max(last, steps);
  }
  EXPECT_EQ(phases.size(), 16U);
  EXPECT_GE(static_cast<double>(probe.steps) * kTimestep, last * kTimestep + 0.045) << "time to leave";
}

TEST(Rebound, ThereIsNoneWithoutImpacts) {
  EXPECT_FALSE(impact_experiment(without_contacts(things("")), 1e-3));
  EXPECT_TRUE(impact_experiment(things(""), 0.09));
  EXPECT_FALSE(impact_experiment(things(""), 0.11)) << "a ball of 0.1 m would pass through the plane in a step";
}

TEST(Rebound, TheFastestBallThatLeavesCounts) {
  State before, after;
  before.bodies.resize(2);
  after.bodies.resize(2);
  for (BodyState& body : before.bodies) body.v_WBcm = {0, 0, -1};
  EXPECT_EQ(rebound({before, after}), 0);
  after.bodies[1].v_WBcm = {0, 0, 0.25};
  EXPECT_EQ(rebound({before, after}), 0.25);
  EXPECT_EQ(rebound({before, after, before}), 0.25);
}

}  // namespace
}  // namespace assay
