#include "model/massless.h"

#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "model/kinematics.h"

namespace assay {
namespace {

// A free body, on it an arm whose shoulder has three hinges about oblique axes and whose elbow is a slide and a hinge,
// and a second tree: two slides and a hinge on the world.
class Chains : public ::testing::Test {
 protected:
  Chains() {
    add(kWorld, 3, std::nullopt);
    const int first = add(0, 0, JointType::kHinge);
    const int second = add(first, 0, JointType::kHinge);
    const int upper_arm = add(second, 2, JointType::kHinge);
    const int slider = add(upper_arm, 0, JointType::kSlide);
    add(slider, 1.5, JointType::kHinge);
    const int x = add(kWorld, 0, JointType::kSlide);
    const int y = add(x, 0, JointType::kSlide);
    add(y, 4, JointType::kHinge);
    model_.initial = reference_state(model_);
  }

  double uniform() { return std::uniform_real_distribution<double>(-1, 1)(random_); }
  Vec3 vector() { return {uniform(), uniform(), uniform()}; }

  int add(int parent, double mass, std::optional<JointType> type) {
    const int index = static_cast<int>(model_.bodies.size());
    Body body{.name = "",
              .parent = parent,
              .X_PB = {vector(), Quat(uniform(), uniform(), uniform(), uniform()).normalized()}};
    body.mass = mass;
    body.I_BBcm_B.setZero();
    if (mass > 0) {
      const Mat3 R = Quat(uniform(), uniform(), uniform(), uniform()).normalized().toRotationMatrix();
      body.p_BBcm = 0.2 * vector();
      body.I_BBcm_B = 0.02 * mass * R * Vec3(1, 1.3, 1.6).asDiagonal() * R.transpose();
    }
    if (type.has_value()) {
      body.joint = static_cast<int>(model_.joints.size());
      model_.joints.push_back({.name = "",
                               .body = index,
                               .p_BJ = 0.1 * vector(),
                               .axis_B = vector().normalized(),
                               .reference = 0.3 * uniform(),
                               .type = *type});
    }
    model_.bodies.push_back(body);
    return index;
  }

  State random_state() {
    State state = reference_state(model_);
    BodyState& free = state.bodies[0];
    free.p_WBcm = vector();
    free.q_WB = Quat(uniform(), uniform(), uniform(), uniform()).normalized();
    free.v_WBcm = vector();
    free.w_WB = vector();
    for (double& position : state.position) position += uniform();
    for (double& velocity : state.velocity) velocity = 3 * uniform();
    bodies_from_joints(model_, state);
    return state;
  }

  std::mt19937 random_{7};  // NOLINT(bugprone-random-generator-seed): the same every time
  Model model_;
};

// What the bodies' motion amounts to, about the world's origin.
struct Totals {
  double mass = 0, energy = 0;
  Vec3 moment = Vec3::Zero(), momentum = Vec3::Zero(), angular_momentum = Vec3::Zero();
  Mat3 inertia = Mat3::Zero();
};

Totals totals(const Model& model, const State& state) {
  Totals sum;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const BodyState& s = state.bodies[i];
    const Mat3 R = s.q_WB.toRotationMatrix();
    const Mat3 I = R * body.I_BBcm_B * R.transpose();
    sum.mass += body.mass;
    sum.moment += body.mass * s.p_WBcm;
    sum.momentum += body.mass * s.v_WBcm;
    sum.angular_momentum += body.mass * s.p_WBcm.cross(s.v_WBcm) + I * s.w_WB;
    sum.energy += body.mass * s.v_WBcm.squaredNorm() / 2 + s.w_WB.dot(I * s.w_WB) / 2;
    sum.inertia += I + body.mass * (s.p_WBcm.squaredNorm() * Mat3::Identity() - s.p_WBcm * s.p_WBcm.transpose());
  }
  return sum;
}

TEST_F(Chains, EveryBodyGetsMassAndTheCompositeIsExactAtTheReference) {
  const Lent lent = lend_mass(model_, 0.03);
  ASSERT_TRUE(lent.any);
  EXPECT_EQ(lent.lender, (std::vector<int>{-1, 3, 3, -1, 5, -1, 8, 8, -1}));
  EXPECT_DOUBLE_EQ(lent.model.bodies[1].mass, 0.06);
  EXPECT_DOUBLE_EQ(lent.model.bodies[3].mass, 1.88);
  for (const Body& body : lent.model.bodies) EXPECT_GT(body.mass, 0);

  State state = reference_state(model_);
  const Totals original = totals(model_, state);
  lent.to_copy(state);
  const Totals copy = totals(lent.model, state);
  EXPECT_NEAR(copy.mass, original.mass, 1e-14);
  EXPECT_LT((copy.moment - original.moment).norm(), 1e-13);
  EXPECT_LT((copy.inertia - original.inertia).norm(), 1e-13);
  // the copy's own reference is the same configuration
  const State own = reference_state(lent.model);
  for (size_t i = 0; i < own.bodies.size(); ++i) {
    EXPECT_LT((own.bodies[i].p_WBcm - state.bodies[i].p_WBcm).norm(), 1e-14);
    EXPECT_LT((lent.model.initial.bodies[i].p_WBcm - state.bodies[i].p_WBcm).norm(), 1e-14);
  }
}

TEST_F(Chains, ErrorsElsewhereAreOfTheOrderOfTheShare) {
  double errors[2] = {};
  for (const int k : {0, 1}) {
    const double share = k == 0 ? 0.02 : 0.01;
    const Lent lent = lend_mass(model_, share);
    random_.seed(3);
    for (int sample = 0; sample < 20; ++sample) {
      State state = random_state();
      const Totals original = totals(model_, state);
      lent.to_copy(state);
      const Totals copy = totals(lent.model, state);
      errors[k] = std::max(errors[k], std::abs(copy.energy - original.energy) / original.energy);
      EXPECT_LT((copy.moment - original.moment).norm(), 3 * share * original.moment.norm() + 10 * share);
      EXPECT_LT((copy.momentum - original.momentum).norm(), 10 * share * std::sqrt(original.mass * original.energy));
    }
  }
  EXPECT_LT(errors[0], 0.1);
  EXPECT_NEAR(errors[0] / errors[1], 2, 1e-9);  // linear in the share
  EXPECT_GT(errors[1], 1e-3);
}

TEST_F(Chains, StatesRoundTrip) {
  const Lent lent = lend_mass(model_);
  for (int sample = 0; sample < 20; ++sample) {
    const State state = random_state();
    State copy = state;
    lent.to_copy(copy);
    // the copy's own kinematics says the same
    State placed = copy;
    bodies_from_joints(lent.model, placed);
    State solved = copy;
    joints_from_bodies(lent.model, solved);
    for (size_t i = 0; i < copy.bodies.size(); ++i) {
      EXPECT_LT((placed.bodies[i].p_WBcm - copy.bodies[i].p_WBcm).norm(), 1e-13) << i;
      EXPECT_LT((placed.bodies[i].v_WBcm - copy.bodies[i].v_WBcm).norm(), 1e-13) << i;
    }
    for (size_t j = 0; j < state.position.size(); ++j) {
      EXPECT_NEAR(solved.position[j], state.position[j], 1e-12);
      EXPECT_NEAR(solved.velocity[j], state.velocity[j], 1e-12);
    }
    State back = copy;
    lent.to_original(back);
    for (size_t i = 0; i < back.bodies.size(); ++i) {
      EXPECT_LT((back.bodies[i].p_WBcm - state.bodies[i].p_WBcm).norm(), 1e-14) << i;
      EXPECT_LT((back.bodies[i].v_WBcm - state.bodies[i].v_WBcm).norm(), 1e-14) << i;
    }
  }
}

TEST_F(Chains, AModelWithoutMasslessBodiesStaysAsItIs) {
  Model model;
  model.bodies.push_back({.name = "", .X_PB = {}, .mass = 2, .p_BBcm = {0.1, 0.2, 0.3}});
  model.hash = "h";
  const Lent lent = lend_mass(model);
  EXPECT_FALSE(lent.any);
  EXPECT_EQ(lent.model.hash, "h");
  EXPECT_EQ(lent.model.bodies[0].mass, 2);
  State state = reference_state(model);
  lent.to_copy(state);
  EXPECT_EQ(state.bodies[0].p_WBcm, reference_state(model).bodies[0].p_WBcm);
}

TEST_F(Chains, ALinkThatBranchesBorrowsFromTheHeaviestAndNobodyLendsMoreThanHalf) {
  Model model;
  const auto add = [&](int parent, double mass) {
    Body body{.name = "", .parent = parent, .joint = static_cast<int>(model.joints.size()), .X_PB = {}, .mass = mass};
    body.I_BBcm_B = mass * Mat3::Identity();
    model.joints.push_back({.name = "", .body = static_cast<int>(model.bodies.size())});
    model.bodies.push_back(body);
  };
  add(kWorld, 0);
  add(0, 1);
  add(0, 5);
  add(0, 2);
  EXPECT_EQ(lend_mass(model).lender, (std::vector<int>{2, -1, -1, -1}));

  Model chain;
  std::swap(chain, model);
  model = {};
  for (int i = 0; i < 10; ++i) add(i - 1, 0);
  add(9, 1);
  const Lent lent = lend_mass(model, 0.1);
  EXPECT_DOUBLE_EQ(lent.model.bodies[0].mass, 0.05);
  EXPECT_DOUBLE_EQ(lent.model.bodies[10].mass, 0.5);
}

// Armature of the borrower's hinge hides borrowed inertia: more of it changes what turns about the hinge by the same
// share.
TEST(LentInertia, GrowsWithTheArmatureThatHidesIt) {
  constexpr double kDiscShare = 0.01, kDiscInertia = 0.02, kDiscArmature = 0.08;
  for (const double armature : {0.0, kDiscArmature, 1e6}) {
    Model model;
    for (int i = 0; i < 2; ++i) {
      Body& body = model.bodies.emplace_back();
      body.parent = i - 1;
      body.joint = i;
      Joint& joint = model.joints.emplace_back();
      joint.body = i;
      joint.axis_B = Vec3::UnitZ();
      body.mass = i;
      body.I_BBcm_B = kDiscInertia * i * Mat3::Identity();
    }
    model.joints[0].armature = armature;
    model.initial = reference_state(model);
    const Lent lent = lend_mass(model, kDiscShare);
    const double part = std::min(kLargestLentShare, kDiscShare * (1 + armature / kDiscInertia));
    EXPECT_NEAR(lent.model.bodies[0].mass, kDiscShare, 1e-15) << armature;
    EXPECT_NEAR(lent.model.bodies[0].I_BBcm_B(2, 2), part * kDiscInertia, 1e-15) << armature;
    EXPECT_NEAR(lent.model.bodies[1].I_BBcm_B(2, 2), (1 - part) * kDiscInertia, 1e-15) << armature;
    EXPECT_NEAR(lent.model.bodies[1].I_BBcm_B(2, 2) / lent.inertia_kept[1], kDiscInertia, 1e-15) << armature;
    const double turned = kDiscInertia + armature;
    if (part < kLargestLentShare) {
      EXPECT_NEAR(part * kDiscInertia / turned, kDiscShare, 1e-12) << "of what turns about the hinge";
    }
  }
}

}  // namespace
}  // namespace assay
