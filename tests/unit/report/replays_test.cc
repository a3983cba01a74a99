#include "report/replays.h"

#include <array>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <zlib.h>

#include "base/errors.h"
#include "model/ellipsoid.h"
#include "results/line_up.h"
#include "results/store/pictures.h"
#include "results/store/scene.h"
#include "results/store/store.h"
#include "results/store/trajectory.h"
#include "temp_folder.h"

namespace assay {
namespace {

using nlohmann::json;
using testing::ElementsAre;

std::string from_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  unsigned bits = 0, have = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<unsigned>(digits.find(c));
    have += 6;
    if (have < 8) continue;
    have -= 8;
    out += static_cast<char>(bits >> have & 0xff);
  }
  return out;
}

std::string inflated(const std::string& packed) {
  std::string out(1 << 22, '\0');
  uLongf size = out.size();
  EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(out.data()), &size,                    // NOLINT(*-reinterpret-cast)
                       reinterpret_cast<const Bytef*>(packed.data()), packed.size()),  // NOLINT(*-reinterpret-cast)
            Z_OK);
  out.resize(size);
  return out;
}

// What the page's decoder does, written a second time: states[frame][body] = x, y, z, qw, qx, qy, qz.
std::vector<std::vector<std::array<double, 7>>> decode(const json& replay, const json& run) {
  const std::string bytes = inflated(from_base64(run.at("data")));
  const size_t frames = run.at("frames"), bodies = replay.at("bodies");
  std::vector<std::vector<std::array<double, 7>>> states(frames, std::vector<std::array<double, 7>>(bodies));
  size_t at = 0;
  for (size_t body = 0; body < bodies; ++body) {
    for (size_t column = 0; column < 7; ++column) {
      long long value = 0, change = 0;
      for (size_t frame = 0; frame < frames; ++frame) {
        unsigned long long zigzag = 0;
        for (unsigned shift = 0;; shift += 7) {
          const auto byte = static_cast<unsigned char>(bytes.at(at++));
          zigzag |= static_cast<unsigned long long>(byte & 0x7f) << shift;
          if (byte < 0x80) break;
        }
        change += (zigzag & 1) != 0 ? -static_cast<long long>(zigzag / 2) - 1 : static_cast<long long>(zigzag / 2);
        value += change;
        const double step = replay.at(column < 3 ? "position_step_m" : "rotation_step");
        states[frame][body].at(column) = static_cast<double>(value) * step;
      }
    }
  }
  EXPECT_EQ(at, bytes.size());
  return states;
}

class ReplaysTest : public TempFolderTest {
 protected:
  // Two tumbling bodies, one of them fast and far away, that drift by `offset`, m.
  static Trajectory tumble(size_t samples, double sample_s, double offset) {
    Trajectory trajectory;
    for (size_t i = 0; i < samples; ++i) {
      State& state = trajectory.states.emplace_back();
      const double t = sample_s * static_cast<double>(i);
      state.time = t;
      for (const double speed : {3.0, -40.0}) {
        BodyState& body = state.bodies.emplace_back();
        body.p_WBcm = {std::sin(speed * t), 100 * t + offset, -9.81 / 2 * t * t};
        body.q_WB = Quat(Eigen::AngleAxisd(speed * t, Vec3(1, 2, 3).normalized()));
        if (i % 2 == 1) body.q_WB.coeffs() = -body.q_WB.coeffs();  // the same rotation
      }
    }
    return trajectory;
  }

  Store make(const std::vector<std::string>& contenders, size_t samples = 101, double sample_s = 0.032) {
    Store store = Store::create(dir_.string(), {"test", "1234"});
    Scene scene;
    scene.bodies.resize(2);
    store.set_systems({{"pair", "{}"}});
    store.set_scenes({{"pair", scene_text(scene)}});
    std::vector<ContenderRow> rows;
    std::vector<RunRow> runs;
    double offset = 0;
    for (const std::string& name : contenders) {
      rows.push_back({name, "engine", "1", name, "", "{}", "{}"});
      runs.push_back({"address-" + name, "pair", name, 0.125});
      write_trajectory(store.trajectories_dir(), runs.back().address, tumble(samples, sample_s, offset));
      offset += 0.25;
    }
    runs.push_back({"never-made", "pair", "failed", 0.125});
    rows.push_back({"failed", "engine", "1", "failed", "", "{}", "{}"});
    store.set_contenders(rows);
    store.set_runs(runs);
    return store;
  }
};

// A ball of many triangles.
Pictures ball_pictures(int subdivisions) {
  const Hull ball = ellipsoid_hull(Vec3::Constant(0.2), subdivisions);
  Pictures pictures;
  pictures.meshes.push_back({ball.vertices, ball.faces});
  pictures.parts.push_back({0, 1, {Vec3(1, 2, 3), Quat(0, 1, 0, 0)}, {0.25f, 0.5f, 1, 1}});
  return pictures;
}

// Two systems of one robot hold its meshes once, and those that would need too much room lose triangles, not their
// shape.
TEST_F(ReplaysTest, PicturesArePackedOnceAndFit) {
  Store store = make({"x"});
  const Pictures pictures = ball_pictures(4);
  EXPECT_EQ(pictures.triangles(), 20U * 256);
  json scene = json::parse(store.scenes().front().json);
  scene["pictures"] = pictures_json(pictures);
  store.set_systems({{"pair", "{}"}, {"again", "{}"}});
  store.set_scenes({{"pair", scene.dump()}, {"again", scene.dump()}});
  std::vector<RunRow> runs = store.runs();
  runs.push_back({"address-x", "again", "x", 0.125});
  store.set_runs(runs);

  for (const size_t room : {size_t{1'000'000}, size_t{8'000}}) {
    ReplayOptions options;
    options.most_picture_bytes = room;
    const json replays = replays_data(store, options);
    ASSERT_EQ(replays.size(), 2);
    EXPECT_FALSE(replays[0].at("scene").contains("pictures"));
    EXPECT_EQ(replays[1].at("pictures"), json({{"like", 0}}));
    const std::string data = replays[0].at("pictures").at("data");
    EXPECT_LT(data.size(), room * 5 / 4);
    const Pictures back = parse_pictures(json::parse(inflated(from_base64(data))));
    ASSERT_EQ(back.parts.size(), 1);
    EXPECT_EQ(back.parts[0].body, 1);
    EXPECT_LT((back.parts[0].X_BS.p - Vec3(1, 2, 3)).norm(), 1e-12);
    if (room == 1'000'000) {
      EXPECT_EQ(back.triangles(), pictures.triangles());
    } else {
      EXPECT_LT(back.triangles(), pictures.triangles() / 4);
    }
    for (const Vec3& p : back.meshes.at(0).vertices) EXPECT_NEAR(p.norm(), 0.2, 1e-3);
  }
}

TEST(PicturesTest, DamagedOnesAreRefused) {
  const json sound = pictures_json(ball_pictures(1));
  EXPECT_EQ(parse_pictures(sound).meshes.at(0).faces.size(), 80);
  json text = sound;
  text["meshes"][0]["f"][2] = 42;  // an icosahedron divided once has that many points
  EXPECT_THROW(parse_pictures(text), InputError);
  text = sound;
  text["parts"][0]["mesh"] = 1;
  EXPECT_THROW(parse_pictures(text), InputError);
  text = sound;
  text.erase("parts");
  EXPECT_THROW(parse_pictures(text), InputError);
}

TEST(PicturesTest, SmallMeshesStayAsTheyAre) {
  Pictures pictures = ball_pictures(4);
  const Hull small = ellipsoid_hull(Vec3::Constant(0.1), 0);
  pictures.meshes.push_back({small.vertices, small.faces});
  simplify(pictures, 1000);
  EXPECT_LE(pictures.triangles(), 1100U);
  EXPECT_GE(pictures.meshes[0].faces.size(), 500U);
  EXPECT_EQ(pictures.meshes[1].faces, small.faces);
}

TEST_F(ReplaysTest, UnpackedStatesAreTheStoredOnesWithinTheStatedError) {
  const Store store = make({"x", "mujoco-euler"});
  const json replays = replays_data(store);
  ASSERT_EQ(replays.size(), 1);
  const json& replay = replays[0];
  EXPECT_EQ(replay.at("system"), "pair");
  EXPECT_DOUBLE_EQ(replay.at("frame_ms").get<double>(), 32);
  EXPECT_EQ(replay.at("frames"), 101);
  ASSERT_EQ(replay.at("runs").size(), 2) << "of the one that failed there is nothing";
  EXPECT_EQ(replay.at("runs")[0].at("contender"), "mujoco-euler") << "the line-up's first comes first";
  double position_error = 0, rotation_error = 0;
  for (const json& run : replay.at("runs")) {
    const bool second = run.at("contender") == "mujoco-euler";
    const Trajectory stored = tumble(101, 0.032, second ? 0.25 : 0);
    const auto states = decode(replay, run);
    for (size_t i = 0; i < states.size(); ++i) {
      for (size_t body = 0; body < 2; ++body) {
        const auto& s = states[i][body];
        const BodyState& truth = stored.states[i].bodies[body];
        position_error = std::max(position_error, (Vec3(s[0], s[1], s[2]) - truth.p_WBcm).norm());
        const Quat q = Quat(s[3], s[4], s[5], s[6]).normalized();
        rotation_error = std::max(rotation_error, q.angularDistance(truth.q_WB));
      }
    }
  }
  EXPECT_NEAR(position_error, replay.at("position_error_m").get<double>(), 1e-9);
  EXPECT_NEAR(rotation_error, replay.at("rotation_error_rad").get<double>(), 1e-6);
  EXPECT_LT(position_error, 1e-5);
  EXPECT_LT(rotation_error, 2e-4);
  EXPECT_GT(position_error, 1e-7) << "it is quantised";
  for (const json& distance : replay.at("runs")[1].at("distance_m")) EXPECT_DOUBLE_EQ(distance.get<double>(), 0.25);
  EXPECT_EQ(replay.at("runs")[1].at("distance_m").size(), 101);
}

TEST_F(ReplaysTest, FramesAreNoMoreThanAScreenShows) {
  const Store store = make({"x"}, 401, 0.004);
  const json replay = replays_data(store)[0];
  EXPECT_DOUBLE_EQ(replay.at("frame_ms").get<double>(), 16);
  EXPECT_EQ(replay.at("frames"), 101);
  EXPECT_NEAR(decode(replay, replay.at("runs")[0])[100][0][1], 160, 1e-5);
}

TEST_F(ReplaysTest, RunsOfOtherTimestepsFollowTheReferences) {
  Store store = make({"mujoco-euler", "mujoco-rk4"});
  std::vector<RunRow> rows = store.runs();
  rows.push_back({"short", "pair", "mujoco-euler", 4});
  store.set_runs(rows);
  write_trajectory(store.trajectories_dir(), "short", tumble(11, 0.032, 0.5));
  const json replay = replays_data(store)[0];
  ASSERT_EQ(replay.at("runs").size(), 3);
  const json& last = replay.at("runs")[2];
  EXPECT_EQ(last.at("contender"), "mujoco-euler");
  EXPECT_EQ(last.at("timestep_ms"), 4);
  EXPECT_EQ(last.at("frames"), 11) << "it ended early";
  EXPECT_EQ(last.at("distance_m").size(), 11);
  EXPECT_EQ(replay.at("frames"), 101);
  EXPECT_NEAR(decode(replay, last)[10][0][1], 32.5, 1e-5);
  const size_t references = replay.at("runs")[0].at("data").get<std::string>().size() +
                            replay.at("runs")[1].at("data").get<std::string>().size();
  const json part = replays_data(store, {.most_bytes = references})[0];
  EXPECT_EQ(part.at("runs").size(), 2);
  EXPECT_EQ(part.at("left_out"), json({"mujoco-euler at 4 ms"}));
}

TEST_F(ReplaysTest, WhatHasNoRoomIsNamed) {
  const Store store = make({"x", "y", "z"});
  const json whole = replays_data(store)[0];
  const size_t one = whole.at("runs")[0].at("data").get<std::string>().size();
  const json part = replays_data(store, {.most_bytes = 2 * one + one / 2})[0];
  EXPECT_EQ(part.at("runs").size(), 2);
  EXPECT_EQ(part.at("left_out"), json({"z"}));
  EXPECT_EQ(replays_data(store, {.most_contenders = 1})[0].at("runs").size(), 1);
  EXPECT_EQ(replays_data(store), replays_data(store));
}

TEST(LineUp, ThePapersContendersComeFirst) {
  const std::vector<std::string> present = {"ode-step", "mine", "havok", "mujoco-rk4", "mujoco-euler"};
  EXPECT_THAT(line_up(present, 12), ElementsAre("mujoco-euler", "mujoco-rk4", "havok", "ode-step", "mine"));
  EXPECT_THAT(line_up(present, 2), ElementsAre("mujoco-euler", "mujoco-rk4"));
}

}  // namespace
}  // namespace assay
