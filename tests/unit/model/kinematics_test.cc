#include "model/kinematics.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace assay {
namespace {

using std::numbers::pi;

// A random tree: body 0 is free, every third body after it hangs on the world, the rest on a body before them.
Model random_tree(unsigned seed, int count) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
  const auto rotation = [&] {
    return Quat(uniform(random), uniform(random), uniform(random), uniform(random)).normalized();
  };
  Model model;
  model.bodies.reserve(count);
  for (int i = 0; i < count; ++i) {
    Body body;
    body.parent = i % 3 == 0 ? kWorld : static_cast<int>(random() % i);
    body.X_PB = {vector(), rotation()};
    body.mass = 1 + 0.5 * uniform(random);
    body.p_BBcm = vector();
    if (i > 0) {
      Joint hinge;
      hinge.body = i;
      hinge.p_BJ = vector();
      hinge.axis_B = vector().normalized();
      hinge.reference = 2 * uniform(random);
      body.joint = static_cast<int>(model.joints.size());
      model.joints.push_back(hinge);
    }
    model.bodies.push_back(body);
  }
  return model;
}

State random_state(const Model& model, unsigned seed, double largest_angle) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
  State state;
  state.bodies.resize(model.bodies.size());
  BodyState& free = state.bodies[0];
  free.p_WBcm = vector();
  free.q_WB = Quat(uniform(random), uniform(random), uniform(random), uniform(random)).normalized();
  free.v_WBcm = vector();
  free.w_WB = vector();
  for (size_t j = 0; j < model.joints.size(); ++j) {
    state.position.push_back(largest_angle * uniform(random));
    state.velocity.push_back(3 * uniform(random));
  }
  bodies_from_joints(model, state);
  return state;
}

TEST(Kinematics, JointsToBodiesAndBack) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Model model = random_tree(seed, 8);
    const State state = random_state(model, seed, 20);  // several turns
    State back = state;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> guess(-0.99 * pi, 0.99 * pi);
    for (double& angle : back.position) angle += guess(random);
    back.velocity.clear();
    joints_from_bodies(model, back);
    for (size_t j = 0; j < model.joints.size(); ++j) {
      EXPECT_NEAR(back.position[j], state.position[j], 1e-12);
      EXPECT_NEAR(back.velocity[j], state.velocity[j], 1e-12);
    }
  }
}

TEST(Kinematics, UnwrapsToTheTurnNearestTheGuess) {
  const Model model = random_tree(1, 2);
  State state = random_state(model, 1, 1);
  const double angle = state.position[0];
  state.position[0] = angle + 2 * pi + 3;
  joints_from_bodies(model, state);
  EXPECT_NEAR(state.position[0], angle + 2 * pi, 1e-13);
  state.position[0] = angle - 10 * pi - 3;
  joints_from_bodies(model, state);
  EXPECT_NEAR(state.position[0], angle - 10 * pi, 1e-13);
  // without a guess: the turn nearest the reference
  state.position.clear();
  joints_from_bodies(model, state);
  EXPECT_LE(std::abs(state.position[0] - model.joints[0].reference), pi);
  EXPECT_NEAR(std::remainder(state.position[0] - angle, 2 * pi), 0, 1e-13);
}

TEST(Kinematics, FollowsAMotionOverManyTurns) {
  const Model model = random_tree(2, 5);
  State truth = random_state(model, 2, 1);
  State state = truth;
  for (int step = 0; step < 1000; ++step) {
    for (size_t j = 0; j < truth.position.size(); ++j) truth.position[j] += 0.1 * (static_cast<double>(j) - 1.5);
    bodies_from_joints(model, truth);
    state.bodies = truth.bodies;
    joints_from_bodies(model, state);
  }
  for (size_t j = 0; j < truth.position.size(); ++j) EXPECT_NEAR(state.position[j], truth.position[j], 1e-11);
}

TEST(Kinematics, SignOfTheQuaternionDoesNotMatter) {
  const Model model = random_tree(3, 4);
  const State state = random_state(model, 3, 2);
  State flipped = state;
  for (BodyState& body : flipped.bodies) body.q_WB.coeffs() *= -1;
  joints_from_bodies(model, flipped);
  for (size_t j = 0; j < state.position.size(); ++j) EXPECT_NEAR(flipped.position[j], state.position[j], 1e-13);
}

TEST(Kinematics, VelocitiesAreDerivativesOfPoses) {
  const Model model = random_tree(4, 8);
  const State state = random_state(model, 4, 3);
  const double h = 1e-6;
  const auto moved = [&](double dt) {
    State result = state;
    BodyState& free = result.bodies[0];
    free.p_WBcm += dt * free.v_WBcm;
    free.q_WB = Quat(Eigen::AngleAxisd(dt * free.w_WB.norm(), free.w_WB.normalized())) * free.q_WB;
    for (size_t j = 0; j < result.position.size(); ++j) result.position[j] += dt * result.velocity[j];
    bodies_from_joints(model, result);
    return result;
  };
  const State before = moved(-h), after = moved(h);
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Vec3 v = (after.bodies[i].p_WBcm - before.bodies[i].p_WBcm) / (2 * h);
    const Eigen::AngleAxisd turn(Eigen::Quaterniond(after.bodies[i].q_WB * before.bodies[i].q_WB.conjugate()));
    EXPECT_LT((v - state.bodies[i].v_WBcm).norm(), 1e-8) << i;
    EXPECT_LT((turn.angle() * turn.axis() / (2 * h) - state.bodies[i].w_WB).norm(), 1e-8) << i;
  }
}

TEST(Kinematics, ReferenceStateHasThePosesOfTheModel) {
  const Model model = random_tree(5, 8);
  const State state = reference_state(model);
  EXPECT_EQ(state.time, 0);
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const Pose X_WP = body.parent == kWorld ? Pose{} : body_pose(model.bodies[body.parent], state.bodies[body.parent]);
    const Pose X_WB = body_pose(body, state.bodies[i]);
    EXPECT_LT((X_WB.p - (X_WP * body.X_PB).p).norm(), 1e-14);
    EXPECT_LT((X_WB.q.toRotationMatrix() - (X_WP * body.X_PB).q.toRotationMatrix()).norm(), 1e-14);
    EXPECT_EQ(state.bodies[i].v_WBcm, Vec3::Zero());
  }
  for (size_t j = 0; j < model.joints.size(); ++j) EXPECT_EQ(state.position[j], model.joints[j].reference);
}

TEST(Kinematics, HingesHold) {
  const Model model = random_tree(6, 8);
  State state = random_state(model, 6, 3);
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const JointFrames frames = joint_frames(model, state, static_cast<int>(j));
    EXPECT_LT((frames.p_WJ_parent - frames.p_WJ_child).norm(), 1e-14);
    EXPECT_LT((frames.axis_W_parent - frames.axis_W_child).norm(), 1e-14);
    EXPECT_NEAR(frames.axis_W_child.norm(), 1, 1e-14);
  }
  // pulled apart by a known amount: the child's side follows, the parent's stays
  const int last = static_cast<int>(model.joints.size()) - 1;
  const JointFrames before = joint_frames(model, state, last);
  const Vec3 pull(0.1, -0.2, 0.3);
  state.bodies.back().p_WBcm += pull;
  const JointFrames after = joint_frames(model, state, last);
  EXPECT_LT((after.p_WJ_child - before.p_WJ_child - pull).norm(), 1e-14);
  EXPECT_EQ(after.p_WJ_parent, before.p_WJ_parent);
}

TEST(Kinematics, SpringTorque) {
  Joint hinge;
  hinge.stiffness = 3;
  hinge.spring_reference = 0.5;
  hinge.damping = 2;
  EXPECT_DOUBLE_EQ(spring_torque(hinge, 1.5, 0.25), -3.5);
  EXPECT_EQ(spring_torque(hinge, 0.5, 0), 0);
}

TEST(Kinematics, CapsuleInertiaIsTheIntegralOverDisks) {
  const double mass = 1.7, r = 0.3, h = 0.4;
  const int slices = 200000;
  double volume = 0, axial = 0, transverse = 0;
  for (int i = 0; i < slices; ++i) {
    const double z = (h + r) * ((2.0 * i + 1) / slices - 1);
    const double beyond = std::max(0.0, std::abs(z) - h);
    const double radius2 = r * r - beyond * beyond;
    volume += radius2;
    axial += radius2 * radius2 / 2;
    transverse += radius2 * (radius2 / 4 + z * z);
  }
  const Vec3 inertia = capsule_inertia(mass, r, h);
  EXPECT_NEAR(inertia.z(), mass * axial / volume, 1e-10);
  EXPECT_NEAR(inertia.x(), mass * transverse / volume, 1e-10);
  EXPECT_EQ(inertia.x(), inertia.y());
  // no cylinder: a ball
  EXPECT_LT((capsule_inertia(2, 0.5, 0) - Vec3::Constant(0.4 * 2 * 0.25)).norm(), 1e-15);
}

TEST(Kinematics, PrincipalInertia) {
  std::mt19937 random(7);  // NOLINT(bugprone-random-generator-seed): the same every time
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < 100; ++i) {
    const Quat q = Quat(uniform(random), uniform(random), uniform(random), uniform(random)).normalized();
    const Mat3 R = q.toRotationMatrix();
    const Vec3 diagonal(1 + 0.3 * uniform(random), 1.5 + 0.3 * uniform(random), 1.2 + 0.3 * uniform(random));
    const Mat3 I = R * diagonal.asDiagonal() * R.transpose();
    const PrincipalInertia principal = principal_inertia(I);
    const Mat3 axes = principal.q_BI.toRotationMatrix();
    EXPECT_LT((axes * principal.diagonal.asDiagonal() * axes.transpose() - I).norm(), 1e-14);
    EXPECT_NEAR(principal.q_BI.norm(), 1, 1e-15);
  }
  // a diagonal matrix stays as it is, in its order
  const PrincipalInertia same = principal_inertia(Vec3(3, 1, 2).asDiagonal().toDenseMatrix());
  EXPECT_EQ(same.diagonal, Vec3(3, 1, 2));
  EXPECT_EQ(same.q_BI.w(), 1);
}

TEST(Geometry, PosesCompose) {
  const Pose X_WA{{1, 2, 3}, Quat(Eigen::AngleAxisd(pi / 2, Vec3::UnitZ()))};
  const Pose X_AB{{1, 0, 0}, Quat(Eigen::AngleAxisd(pi / 2, Vec3::UnitX()))};
  EXPECT_LT((X_WA * X_AB * Vec3(0, 1, 0) - Vec3(1, 3, 4)).norm(), 1e-15);
  EXPECT_LT((X_WA * (X_AB * Vec3(0, 1, 0)) - Vec3(1, 3, 4)).norm(), 1e-15);
  EXPECT_LT((X_WA.inverse() * Vec3(1, 3, 3) - Vec3(1, 0, 0)).norm(), 1e-15);
}

}  // namespace
}  // namespace assay
