// Joints that couplings move together: who leads, where the others are, and where a file starts them.
#include "model/couplings.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "load/mjcf.h"
#include "load/start.h"
#include "model/variant.h"

namespace assay {
namespace {

using ::testing::Contains;
using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

Model model_of(size_t joints, std::vector<Coupling> couplings) {
  Model model;
  model.joints.resize(joints);
  model.couplings = std::move(couplings);
  return model;
}

auto near(double value) { return DoubleNear(value, 1e-12); }

TEST(Couplings, ChainsFollowTheirLeaderInAnyOrder) {
  // 3 follows 2 follows 1 follows 0, written from the end; 4 is free, 5 is held
  const Model model =
      model_of(6, {{"c", 3, {{2, 0.5}}, 0.1}, {"b", 2, {{1, -1}}, 0}, {"a", 1, {{0, 1}}, 0.2}, {"held", 5, {}, 0.7}});
  EXPECT_THAT(leaders(model), ElementsAre(true, false, false, false, false, false));
  std::vector<double> positions = {1, 9, 9, 9, 4, 9};
  follow_leaders(model, positions);
  EXPECT_THAT(positions, ElementsAre(1, near(1.2), near(-1.2), near(-0.5), 4, 0.7));
  std::vector<double> velocities = {1, 9, 9, 9, 4, 9};
  velocities_follow_leaders(model, velocities);
  EXPECT_THAT(velocities, ElementsAre(1, 1, -1, -0.5, 4, 0));
}

// A coupling with a ratio above 1 is solved for the joint that the file calls the leader; both ends must do.
TEST(Couplings, EitherEndLeads) {
  const Model model = model_of(3, {{"a", 0, {{1, 0.5}}, 0.1}, {"b", 2, {{0, -1}}, 0}});
  EXPECT_THAT(leaders(model), ElementsAre(false, true, false));
  std::vector<bool> settled = {true, false, false};
  std::vector<double> positions = {1, 9, 9};
  follow(model, settled, positions);
  EXPECT_THAT(positions, ElementsAre(1, near(1.8), -1));
  EXPECT_THAT(settled, ElementsAre(true, true, true));
}

TEST(Couplings, SumsNeedAllButOne) {
  const Model model = model_of(4, {{"sum", 0, {{1, 1}, {2, -2}}, 0}, {"tail", 3, {{0, 1}}, 0}});
  EXPECT_THAT(leaders(model), ElementsAre(false, true, true, false));
  std::vector<bool> settled = {false, true, false, false};
  std::vector<double> positions = {0, 3, 0, 0};
  follow(model, settled, positions);
  EXPECT_THAT(positions, ElementsAre(0, 3, 0, 0));
  settled = {false, true, true, false};
  positions = {0, 3, 1, 0};
  follow(model, settled, positions);
  EXPECT_THAT(positions, ElementsAre(1, 3, 1, 1));
}

// A finger of four joints; the last mimics the third, which mimics the second by a ratio above 1, which mimics the
// first.
std::string finger(const std::string& range_of_last) {
  std::string text = "<robot name='finger'><link name='l0'/>";
  const char* const mimics[] = {"", "<mimic joint='j1' multiplier='1' offset='0.3'/>",
                                "<mimic joint='j2' multiplier='-2' offset='0.1'/>", "<mimic joint='j3'/>"};
  for (int k = 4; k >= 1; --k) {
    const std::string range = k == 4 ? range_of_last : "lower='-3' upper='3'";
    text += fmt::format(
        "<link name='l{0}'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/>"
        "</inertial></link><joint name='j{0}' type='revolute'><parent link='l{1}'/><child link='l{0}'/>"
        "<origin xyz='1 0 0'/><axis xyz='0 0 1'/><limit {2} effort='1' velocity='1'/>{3}</joint>",
        k, k - 1, range, mimics[k - 1]);
  }
  return text + "</robot>";
}

std::vector<double> by_name(const Model& model, const std::vector<double>& values) {
  std::vector<double> sorted(4);
  for (size_t j = 0; j < 4; ++j) sorted[static_cast<size_t>(model.joints[j].name[1] - '1')] = values[j];
  return sorted;
}

TEST(Couplings, UrdfStartsWhereItsMimicsPutIt) {
  const Model model = load_model_text(finger("lower='-3' upper='3'"), "finger.urdf");
  ASSERT_THAT(model.couplings, SizeIs(3));
  EXPECT_THAT(by_name(model, model.initial.position), ElementsAre(0, near(0.3), near(-0.5), near(-0.5)));
  EXPECT_THAT(model.notes, Not(Contains(HasSubstr("open in the initial state"))));
  // bodies, too: all turn about z, l2 by 0.3
  const auto l2 = std::ranges::find(model.bodies, "l2", &Body::name) - model.bodies.begin();
  EXPECT_NEAR(model.initial.bodies[static_cast<size_t>(l2)].q_WB.angularDistance(Quat::Identity()), 0.3, 1e-12);
}

TEST(Couplings, NamedJointsTakeTheirFollowersAlong) {
  Model model = load_model_text(finger("lower='-3' upper='3'"), "finger.urdf");
  start_from(model, "j1 = 0.2", "pose.txt");
  EXPECT_THAT(by_name(model, model.initial.position), ElementsAre(0.2, near(0.5), near(-0.9), near(-0.9)));
  start_from(model, "j4 = 0.1", "pose.txt");
  EXPECT_THAT(by_name(model, model.initial.position), ElementsAre(near(-0.3), near(0), near(0.1), 0.1));
}

TEST(Couplings, APositionThatOverflowsIsRefused) {
  std::string text = finger("lower='-3' upper='3'");
  text.replace(text.find("multiplier='-2'"), 15, "multiplier='-1e-300'");
  Model model = load_model_text(text, "finger.urdf");
  try {
    start_from(model, "j3 = 1e10", "pose.txt");
    FAIL() << "not refused";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("pose.txt: couplings put joint 'j1' at -inf; give the position of"));
  }
}

TEST(Couplings, WithinLimitsAlongAChain) {
  // the last must be between 0 and 0.1: the first is at -0.25 then, up to -0.3
  const std::string text = finger("lower='0' upper='0.1'");
  const Model model = load_model_text(text, "finger.urdf", {.within_limits = true});
  EXPECT_THAT(by_name(model, model.initial.position), ElementsAre(near(-0.25), near(0.05), near(0), near(0)));
  Model again = model;
  EXPECT_THAT(start_within_limits(again), IsEmpty());
  EXPECT_EQ(again.initial.position, model.initial.position);
}

// A joint that cannot be within its limits follows its leader all the same, and its body with it, however small the
// way.
TEST(Couplings, BodiesStayWithTheJoints) {
  const Model model = load_model_text(
      "<mujoco><compiler angle='radian'/><worldbody><body name='a'><joint name='leads' range='0 1'/><geom "
      "size='1'/></body>"
      "<body name='b'><joint name='follows' range='2 3'/><geom size='1' pos='1 0 0'/></body></worldbody>"
      "<equality><joint joint1='follows' joint2='leads' polycoef='0 1 0 0 0'/></equality>"
      "<keyframe><key qpos='0.5 0.5005'/></keyframe></mujoco>",
      "test", {.within_limits = true});
  EXPECT_THAT(model.initial.position, ElementsAre(0.5, near(0.5)));
  EXPECT_LT((model.initial.bodies[1].p_WBcm - Vec3(std::cos(0.5), std::sin(0.5), 0)).norm(), 1e-12);
}

// Rates of a model's variant satisfy its couplings, whatever their order.
TEST(Couplings, RatesOfTheVariant) {
  Model model = load_model_text(finger("lower='-3' upper='3'"), "finger.urdf");
  std::ranges::reverse(model.couplings);
  const Model swing = variant_of(model, {.start_rates = 1});
  const std::vector<double> rates = by_name(swing, swing.initial.velocity);
  EXPECT_NE(rates[0], 0);
  EXPECT_THAT(rates, ElementsAre(rates[0], near(rates[0]), near(-2 * rates[0]), near(-2 * rates[0])));
}

}  // namespace
}  // namespace assay
