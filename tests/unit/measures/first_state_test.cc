#include "measures/first_state.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "model/kinematics.h"

namespace assay {
namespace {

Body slab() {
  Body body;
  body.name = "slab";
  body.mass = 2;
  body.p_BBcm = {0.01, -0.02, 0.005};
  body.I_BBcm_B = Vec3(0.01, 0.02, 0.025).asDiagonal();
  return body;
}

// Poses of the body's frame in free flight from `start`.
FlightSamples flight(const Body& body, const BodyState& start, const Vec3& gravity, int count, double dt,
                     double noise) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  FlightSamples samples;
  for (int i = 0; i < count; ++i) {
    const double t = i * dt;
    Quat q = start.q_WB;
    Vec3 w = start.w_WB;
    turn_freely(body.I_BBcm_B, t, q, w);
    const Vec3 centre = start.p_WBcm + t * start.v_WBcm + 0.5 * t * t * gravity;
    const auto draw = [&] { return Vec3(noise * Vec3(normal(random), normal(random), normal(random))); };
    const Vec3 turn = draw();
    samples.times.push_back(t);
    samples.p_WB.push_back(centre - q * body.p_BBcm + draw());
    samples.q_WB.push_back((Quat(1, turn.x() / 2, turn.y() / 2, turn.z() / 2) * q).normalized());
  }
  return samples;
}

BodyState tumbling() {
  BodyState start;
  start.p_WBcm = {0.1, 0.2, 1};
  start.q_WB = Quat(0.8, 0.2, -0.4, 0.4).normalized();
  start.v_WBcm = {1, -0.5, 2};
  start.w_WB = {3, -8, 5};
  return start;
}

TEST(FirstState, FreeRotationKeepsMomentumAndEnergy) {
  const Mat3 I = slab().I_BBcm_B;
  Quat q = tumbling().q_WB;
  Vec3 w = tumbling().w_WB;
  const auto momentum = [&] { return Vec3(q * (I * (q.conjugate() * w))); };
  const auto energy = [&] { return (q.conjugate() * w).dot(I * (q.conjugate() * w)); };
  const Vec3 momentum_before = momentum();
  const double energy_before = energy();
  turn_freely(I, 1, q, w);
  EXPECT_LT((momentum() - momentum_before).norm(), 1e-6 * momentum_before.norm());
  EXPECT_NEAR(energy(), energy_before, 1e-6 * energy_before);
}

TEST(FirstState, FlightIsFoundFromPoses) {
  const Body body = slab();
  const Vec3 gravity(0, 0.1, -9.7);
  const BodyState start = tumbling();
  const FirstFlight first = first_flight(flight(body, start, gravity, 20, 1.0 / 148, 0), body, gravity);
  EXPECT_LT((first.state.p_WBcm - start.p_WBcm).norm(), 1e-9);
  EXPECT_LT((first.state.v_WBcm - start.v_WBcm).norm(), 1e-8);
  EXPECT_LT(first.state.q_WB.angularDistance(start.q_WB), 1e-6);
  EXPECT_LT((first.state.w_WB - start.w_WB).norm(), 1e-4);
}

TEST(FirstState, DeviationsOfTheStateAreThoseOfItsErrors) {
  const Body body = slab();
  const Vec3 gravity(0, 0, -9.81);
  const BodyState start = tumbling();
  const double noise = 1e-4;
  const FirstFlight first = first_flight(flight(body, start, gravity, 20, 1.0 / 148, noise), body, gravity);
  EXPECT_NEAR(first.position_sd, noise, 0.4 * noise);
  EXPECT_LT((first.state.v_WBcm - start.v_WBcm).norm(), 5 * first.v_sd);
  EXPECT_LT((first.state.w_WB - start.w_WB).norm(), 5 * first.w_sd);
  EXPECT_GT(first.v_sd, 0);
}

TEST(FirstState, FlightEndsAtTheImpact) {
  const Body body = slab();
  const Vec3 gravity(0, 0, -9.81);
  FlightSamples samples = flight(body, tumbling(), gravity, 40, 1.0 / 148, 5e-5);
  for (size_t i = 25; i < samples.times.size(); ++i) {  // thrown back upwards
    samples.p_WB[i].z() += 1.5 * (samples.times[i] - samples.times[24]);
  }
  EXPECT_EQ(flight_length(flight(body, tumbling(), gravity, 40, 1.0 / 148, 5e-5), body, 6), 40u);
  const size_t length = flight_length(samples, body, 6);
  EXPECT_GE(length, 24u);
  EXPECT_LE(length, 26u);
}

TEST(FirstState, CoordinateIsThatOfACubic) {
  std::vector<double> times, positions;
  for (int i = -5; i <= 5; ++i) {
    const double t = 0.002 * i;
    times.push_back(t);
    positions.push_back(0.3 + (1.5 * t) - (4 * t * t) + (90 * t * t * t));
  }
  const FirstCoordinate first = first_coordinate(times, positions);
  EXPECT_NEAR(first.position, 0.3, 1e-12);
  EXPECT_NEAR(first.velocity, 1.5, 1e-9);
  EXPECT_LT(first.velocity_sd, 1e-6);
}

}  // namespace
}  // namespace assay
