#include "measures/batch.h"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "base/errors.h"
#include "engines/batch.h"
#include "load/mjcf.h"
#include "measures/measure.h"

namespace assay {
namespace {

Model chain() { return load_model(std::string(ASSAY_MODELS "/planar-chain.xml")); }

TEST(Batch, ItsMeasureNamesWorldsAndDevice) {
  for (const BatchOf& batch : {BatchOf{1, "cpu"}, BatchOf{4096, "cpu"}, BatchOf{256, "cuda:1"}}) {
    const std::string measure = batch_name(batch);
    EXPECT_TRUE(reads(measure, Reads::kWorlds)) << measure;
    EXPECT_TRUE(is_timed(measure)) << measure;
    const BatchOf read = batch_of(measure).value_or(BatchOf{0, ""});
    EXPECT_EQ(read.worlds, batch.worlds);
    EXPECT_EQ(read.device, batch.device);
  }
  for (const char* other : {"raw_speed", "batch", "batch-", "batch-0", "batch--1", "batch-x", "scaling"}) {
    EXPECT_FALSE(batch_of(other)) << other;
  }
}

TEST(Batch, MomentsAreAllMetAndSpreadFromTheFirst) {
  std::set<int> all;
  for (int world = 0; world < kBatchMoments; ++world) all.insert(batch_moment(world));
  EXPECT_EQ(std::ssize(all), kBatchMoments);
  EXPECT_EQ(*all.rbegin(), kBatchMoments - 1);
  for (int world = 0; world < kBatchMoments; ++world)
    EXPECT_EQ(batch_moment(world + kBatchMoments), batch_moment(world));
  for (const int few : {2, 4, 8, 16}) {
    std::set<int> first;
    for (int world = 0; world < few; ++world) first.insert(batch_moment(world));
    int last = -kBatchMoments / few;
    for (const int moment : first) {
      EXPECT_EQ(moment - last, kBatchMoments / few) << few;
      last = moment;
    }
  }
}

TEST(Batch, WorldsStartAtMomentsOfTheRunWithRatesOfTheirOwn) {
  const Model model = chain();
  std::vector<State> run(kBatchMoments, model.initial);
  for (int moment = 0; moment < kBatchMoments; ++moment) run[static_cast<size_t>(moment)].time = 0.5 + moment;
  InitialStates states;
  states.count = 1;
  const std::vector<State> found = batch_states(model, run, states, 100);
  ASSERT_EQ(found.size(), 100U);
  EXPECT_EQ(found.front().velocity, run.front().velocity);
  for (size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].time, 0);
    for (size_t j = 0; j < i; ++j) EXPECT_NE(found[i].velocity, found[j].velocity) << i << " " << j;
  }
  // the same for any number of worlds, so that larger batches hold the smaller ones
  const std::vector<State> fewer = batch_states(model, run, states, 10);
  for (size_t i = 0; i < fewer.size(); ++i) EXPECT_EQ(fewer[i].velocity, found[i].velocity);
}

TEST(Batch, ComparedWorldsAreTheFirstTheLastAndOthers) {
  EXPECT_EQ(compared_worlds(1, 1), (std::vector<int>{0}));
  EXPECT_EQ(compared_worlds(5, 1), (std::vector<int>{0, 1, 2, 3, 4}));
  const std::vector<int> of_many = compared_worlds(4096, 1);
  EXPECT_EQ(std::ssize(of_many), kMostCompared);
  EXPECT_EQ(of_many.front(), 0);
  EXPECT_EQ(of_many.back(), 4095);
  EXPECT_TRUE(std::ranges::is_sorted(of_many));
  EXPECT_NE(of_many, compared_worlds(4096, 2));
}

TEST(Batch, TorquesChangeRatesABit) {
  const Model model = chain();
  const double timestep = 1e-3;
  const std::vector<double> torques = batch_torques(model, 3, timestep, 1);
  ASSERT_EQ(torques.size(), 3 * model.joints.size());
  for (size_t i = 0; i < torques.size(); ++i) {
    const Body& body = model.bodies[static_cast<size_t>(model.joints[i % model.joints.size()].body)];
    EXPECT_NE(torques[i], 0);
    // a link by itself, about its own centre at the least
    const Vec3& axis = model.joints[i % model.joints.size()].axis_B;
    const double arm = axis.cross(Vec3(body.p_BBcm - model.joints[i % model.joints.size()].p_BJ)).norm();
    EXPECT_LE(std::abs(torques[i]) * timestep, 0.1 * (axis.dot(body.I_BBcm_B * axis) + body.mass * arm * arm) * 1.0001);
  }
  EXPECT_NE(torques, batch_torques(model, 3, timestep, 2));
}

TEST(Batch, DistanceIsThatOfTheFarthestBody) {
  const Model model = chain();
  State moved = model.initial;
  EXPECT_EQ(centre_distance(model.initial, moved), 0);
  moved.bodies[2].p_WBcm += Vec3(3e-3, 0, 4e-3);
  moved.bodies[1].p_WBcm += Vec3(0, 1e-3, 0);
  EXPECT_NEAR(centre_distance(model.initial, moved), 5e-3, 1e-12);
}

TEST(Device, WhatIsNoneIsRefused) {
  EXPECT_NO_THROW(require_device("cpu"));
  EXPECT_TRUE(device_facts("cpu").name.empty());
  for (const char* device : {"", "gpu", "cuda", "cuda:", "cuda:x", "cuda:-1", "cuda:999", "CPU"}) {
    try {
      require_device(device);
      FAIL() << device;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("is no device: give cpu, or cuda:0"), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(require_device("cuda:63"), InputError);  // no machine has so many
}

}  // namespace
}  // namespace assay
