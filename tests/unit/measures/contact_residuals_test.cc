// Residuals of contact forces: none for what Coulomb's law allows, known for what it does not.
#include "measures/contact_residuals.h"

#include <stdexcept>

#include <gtest/gtest.h>

#include "load/mjcf.h"

namespace assay {
namespace {

// A ball of 0.1 m on the ground, friction 0.5.
class ContactResidualsTest : public ::testing::Test {
 protected:
  ContactResidualsTest()
      : model_(load_model_text(R"(<mujoco model="ball"><worldbody>
          <geom name="floor" type="plane" size="0 0 1" friction="0.5"/>
          <body name="ball" pos="0 0 0.1"><freejoint/><geom type="sphere" size="0.1" mass="2" friction="0.5"/></body>
        </worldbody></mujoco>)",
                               "ball")) {}

  static ContactResiduals there(const std::optional<ContactResiduals>& found) {
    return found ? *found : throw std::runtime_error("no contact has a force");
  }
  static void expect(const std::optional<ContactResiduals>& found, double signorini, double cone, double dissipation) {
    const ContactResiduals residuals = there(found);
    EXPECT_NEAR(residuals.signorini, signorini, 1e-12);
    EXPECT_NEAR(residuals.cone.value_or(-1), cone, 1e-12);
    EXPECT_NEAR(residuals.dissipation.value_or(-1), dissipation, 1e-12);
  }

  // The ball moves at `v` and turns at `w` after a step in which the ground gave it `impulse`.
  std::optional<ContactResiduals> of(const Vec3& v, const Vec3& w, const Vec3& impulse) const {
    State after = model_.initial;
    after.bodies[0].v_WBcm = v;
    after.bodies[0].w_WB = w;
    return of_gap(0, after, impulse);
  }

  std::optional<ContactResiduals> of_gap(double gap, const State& after, const Vec3& impulse) const {
    ContactSums sums(model_, kTimestep, /*with_friction=*/true);
    sums.add(model_.initial, after, {{0, 1, Vec3(0, 0, 0), Vec3::UnitZ(), gap, impulse}});
    return sums.residuals();
  }

  static constexpr double kTimestep = 1e-3;

  const Model model_;
};

TEST_F(ContactResidualsTest, NoneForRestSlipAndRolling) {
  expect(of({0, 0, 0}, {0, 0, 0}, {0.3, 0, 1}), 0, 0, 0);      // sticks, friction within the cone
  expect(of({2, 0, 0}, {0, 0, 0}, {-0.5, 0, 1}), 0, 0, 0);     // slides, friction at the cone against the slip
  expect(of({2, 0, 0}, {0, 20, 0}, {-0.1, 0.2, 1}), 0, 0, 0);  // rolls: the point that touches does not move
  expect(of({0, 0, 0}, {0, 0, 7}, {0, 0, 1}), 0, 0, 0);        // spins about the normal
  EXPECT_FALSE(of({1, 0, 3}, {0, 0, 0}, {0, 0, 0})) << "no force, whatever the speed: Signorini's condition holds";
}

TEST_F(ContactResidualsTest, EachLawThatIsBroken) {
  expect(of({0, 0, 0.2}, {0, 0, 0}, {0, 0, 1}), 0.2, 0, 0);   // is pushed while it leaves
  expect(of({0, 0, -0.2}, {0, 0, 0}, {0, 0, 3}), 0.2, 0, 0);  // sinks in although it is pushed
  expect(of({0, 0, 0}, {0, 0, 0}, {0.5, 0.5, 1}), 0, std::sqrt(0.5) - 0.5,
         0);                                                 // the corner of a pyramid around the cone
  expect(of({2, 0, 0}, {0, 0, 0}, {0, -0.5, 1}), 0, 0, 2);   // friction across the slip does no work
  expect(of({2, 0, 0}, {0, 0, 0}, {-0.25, 0, 1}), 0, 0, 1);  // half of the friction that slip has
  expect(of({0, 0, 0}, {0, 0, 0}, {0, 0, -1}), 0, 0.5, 0);   // a pull
}

TEST_F(ContactResidualsTest, ContactsCountByTheirImpulses) {
  State after = model_.initial;
  after.bodies[0].v_WBcm = {0, 0, 0.4};
  ContactSums sums(model_, kTimestep, true);
  sums.add(model_.initial, after, {{0, 1, Vec3::Zero(), Vec3::UnitZ(), 0, {0, 0, 1}}});
  sums.add(model_.initial, model_.initial, {{0, 1, Vec3::Zero(), Vec3::UnitZ(), 0, {0, 0, 3}}});
  expect(sums.residuals(), 0.1, 0, 0);
  // the other way round it is the same contact
  ContactSums turned(model_, kTimestep, true);
  turned.add(model_.initial, after, {{1, 0, Vec3::Zero(), -Vec3::UnitZ(), 0, {0, 0, -1}}});
  expect(turned.residuals(), 0.4, 0, 0);
}

TEST_F(ContactResidualsTest, WhatIsApartMayCloseItsGapAndNoMore) {
  State after = model_.initial;
  after.bodies[0].v_WBcm = {0, 0, -0.3};
  expect(of_gap(0.3 * kTimestep, after, {0, 0, 1}), 0, 0, 0);
  expect(of_gap(0.1 * kTimestep, after, {0, 0, 1}), 0.2, 0, 0);
  after.bodies[0].v_WBcm = {0, 0, 0};
  expect(of_gap(0.1 * kTimestep, after, {0, 0, 1}), 0.1, 0, 0);  // is pushed before it touches
  EXPECT_EQ(there(of_gap(0.1 * kTimestep, after, {0, 0, 1})).depth, 0);
}

TEST_F(ContactResidualsTest, SoftContactAtRestHasADepthAndNoSpeed) {
  const auto found = of_gap(-0.01, model_.initial, {0, 0, 1});
  expect(found, 0, 0, 0);
  EXPECT_NEAR(there(found).depth, 0.01, 1e-15);
}

TEST_F(ContactResidualsTest, WithoutFrictionForcesOnlyTheNormalIsJudged) {
  State after = model_.initial;
  after.bodies[0].v_WBcm = {2, 0, 0.5};
  ContactSums sums(model_, kTimestep, /*with_friction=*/false);
  sums.add(model_.initial, after, {{0, 1, Vec3::Zero(), Vec3::UnitZ(), 0, {0, 0, 1}}});
  const auto found = sums.residuals();
  ASSERT_TRUE(found);
  EXPECT_NEAR(there(found).signorini, 0.5, 1e-15);
  EXPECT_FALSE(there(found).cone);
  EXPECT_FALSE(there(found).dissipation);
}

}  // namespace
}  // namespace assay
