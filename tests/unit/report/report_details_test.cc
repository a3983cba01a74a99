#include <filesystem>
#include <fstream>
#include <numeric>
#include <sstream>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <png.h>

#include "base/errors.h"
#include "report/canvas.h"
#include "report/details.h"
#include "report/figures.h"
#include "report/thumbnail.h"
#include "results/looks.h"
#include "results/store/scene.h"
#include "results/store/trajectory.h"

namespace assay {
namespace {

using nlohmann::json;
using testing::IsEmpty;
using testing::SizeIs;

TEST(Samples, FewAreKeptAndWhatNobodyLooksAtIsNot) {
  const json data = sample_data({{"piece_error_m", {1e-3, 2e-3, 1.23456789e-3}}, {"steal", {0.1}}, {"run_time_s", {}}});
  ASSERT_THAT(data, SizeIs(1));
  EXPECT_EQ(data[0]["name"], "piece_error_m");
  EXPECT_EQ(data[0]["count"], 3);
  EXPECT_EQ(data[0]["values"], json({1e-3, 2e-3, 1.2346e-3}));
}

TEST(Samples, ManyBecomeAHistogramWhoseTailIsCounted) {
  std::vector<double> times;
  times.reserve(1001);
  for (int i = 0; i < 1000; ++i) times.push_back(10 + 0.001 * i);
  times.push_back(500);  // an interrupt
  const json data = sample_data({{"step_time_us", times}});
  ASSERT_THAT(data, SizeIs(1));
  const auto bins = data[0]["bins"].get<std::vector<int>>();
  EXPECT_EQ(data[0]["from"], 10);
  EXPECT_LT(data[0]["to"].get<double>(), 11) << "one step must not squeeze all others into one bin";
  EXPECT_GE(data[0]["above"], 1);
  EXPECT_EQ(std::accumulate(bins.begin(), bins.end(), 0) + data[0]["above"].get<int>(), 1001);
  EXPECT_LT(std::ranges::max(bins), 2 * 1000 / static_cast<int>(bins.size())) << "even samples, even bins";
}

TEST(Samples, EqualOnesAreOneBin) {
  const json data = sample_data({{"step_time_us", std::vector<double>(100, 3.0)}});
  const auto bins = data[0]["bins"].get<std::vector<int>>();
  EXPECT_EQ(bins.front(), 100);
  EXPECT_EQ(data[0]["above"], 0);
}

class DetailsTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    dir_ = testing::TempDir() + "assay-details-" + info->name() + "-" + std::to_string(getpid());
    std::filesystem::remove_all(dir_);
  }
  void TearDown() override { std::filesystem::remove_all(dir_); }

  Store make() const { return Store::create(dir_, {"test", "1"}); }

  static Cell cell(const std::string& contender, const std::string& measure, double timestep_ms) {
    Cell made;
    made.key = contender + measure + std::to_string(timestep_ms);
    made.system = "chain";
    made.contender = contender;
    made.measure = measure;
    made.timestep_ms = timestep_ms;
    return made;
  }

  std::string dir_;
};

TEST_F(DetailsTest, PicturesAreInTheWorldFrame) {
  Store store = make();
  store.set_systems({{"chain", "{}"}});
  Scene scene;
  scene.bodies = {
      {"link", kWorld, Vec3::Zero(), Vec3::Zero(), {Vec3(1, 0, 2), Quat(std::sqrt(0.5), 0, std::sqrt(0.5), 0)}}};
  scene.shapes.resize(3);
  Shape &capsule = scene.shapes[0], &sphere = scene.shapes[1], &plane = scene.shapes[2];
  capsule.type = ShapeType::kCapsule;
  capsule.body = 0;
  capsule.radius = 0.1;
  capsule.half_length = 0.5;
  capsule.rgba = {1, 0.5F, 0, 1};
  sphere.X_BS.p = {0, 3, 0};
  sphere.radius = 0.2;
  sphere.rgba = plane.rgba = {0, 0, 0, 1};
  plane.type = ShapeType::kPlane;
  plane.X_BS.p = {0, 0, -1};
  store.set_scenes({{"chain", scene_text(scene)}});
  const json pictures = picture_data(Results(store));
  ASSERT_THAT(pictures, SizeIs(1));
  EXPECT_EQ(pictures[0]["ground"], -1);
  EXPECT_TRUE(pictures[0]["end"].is_null());
  const json& shapes = pictures[0]["start"];
  ASSERT_THAT(shapes, SizeIs(2));
  // a quarter turn about y takes the capsule's axis from z to x
  EXPECT_EQ(shapes[0]["a"], json({0.5, 0, 2}));
  EXPECT_EQ(shapes[0]["b"], json({1.5, 0, 2}));
  EXPECT_EQ(shapes[0]["c"], "#ff8000");
  EXPECT_EQ(shapes[1]["a"], shapes[1]["b"]);
  EXPECT_TRUE(pictures[0]["image"].is_null()) << "capsules and spheres are drawn as they are";
}

// Alpha of the picture's pixels.
std::vector<std::uint8_t> alpha_of(const std::string& png) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_memory(&image, png.data(), png.size()), 0);
  image.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(image)), alpha;
  EXPECT_NE(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr), 0);
  for (size_t i = 3; i < pixels.size(); i += 4) alpha.push_back(pixels[i]);
  return alpha;
}

TEST(Thumbnail, ShowsWhatTheRobotIsMadeOf) {
  Scene scene;
  scene.bodies = {{"link", kWorld, Vec3::Zero(), Vec3::Zero(), {}}};
  scene.shapes.resize(1);
  scene.shapes[0].body = 0;
  scene.shapes[0].type = ShapeType::kBox;
  scene.shapes[0].half_size = {1, 1, 1};
  const auto share = [&](const Pictures& pictures) {
    const std::vector<std::uint8_t> alpha = alpha_of(thumbnail_png(scene, {Pose()}, pictures, 0));
    return static_cast<double>(std::accumulate(alpha.begin(), alpha.end(), 0)) /
           (255.0 * static_cast<double>(alpha.size()));
  };
  // 300 x 220 pixels; 97 % of the height are 2 (cos 15 + sin 15 degrees) m, the cube's width 2 m
  const double height = 0.97, width = 0.97 * 220 / 300 / (std::cos(0.2618) + std::sin(0.2618));
  EXPECT_NEAR(share({}), height * width, 0.01);
  // a triangle in place of the box, half of its rectangle
  Pictures pictures;
  pictures.meshes = {{{{0, -1, 0}, {0, 1, 0}, {0, 1, 1}}, {{0, 1, 2}}}};
  pictures.parts = {{.mesh = 0, .body = 0, .X_BS = {}}};
  const double tall = std::cos(0.2618);  // m, of a width of 2 m
  EXPECT_NEAR(share(pictures), 0.5 * 0.97 * (0.97 * 300 / 220 * tall / 2), 0.01);
  // what stands far from it does not make it small
  scene.shapes.push_back(scene.shapes[0]);
  scene.shapes[1].body = kWorld;
  scene.shapes[1].X_BS.p = {0, 50, 0};
  EXPECT_NEAR(share({}), height * width, 0.01);
}

TEST(Thumbnail, NothingToDrawIsNoPicture) { EXPECT_EQ(thumbnail_png({}, {}, {}, 0), ""); }

TEST_F(DetailsTest, AgreementHasAnEntryPerPair) {
  Store store = make();
  store.set_systems({{"chain", "{}"}});
  store.set_contenders(
      {{"a", "x", "", "a", "", "{}", "{}"}, {"b", "x", "", "b", "", "{}", "{}"}, {"c", "x", "", "c", "", "{}", "{}"}});
  std::vector<double> times, near, far;
  for (int i = 0; i < 64; ++i) {
    times.push_back(i);
    near.push_back(1e-6 * i);
    far.push_back(0.1 * i);
  }
  const auto put = [&](const std::string& name, const std::string& first, const std::vector<double>& to_first,
                       const std::string& second, const std::vector<double>& to_second) {
    store.put_cell(cell(name, "agreement", 0.25), {{"time_s", times},
                                                   {"distance_m " + first, to_first},
                                                   {"distance_m " + second, to_second},
                                                   {"parting_time_s " + first, {to_first.back()}},
                                                   {"parting_time_s " + second, {to_second.back()}}});
  };
  put("a", "b", near, "c", far);
  put("b", "a", near, "c", far);
  put("c", "a", far, "b", far);
  const json data = agreement_data(Results(store));
  ASSERT_THAT(data, SizeIs(1));
  EXPECT_EQ(data[0]["contenders"], json({"a", "b", "c"}));
  ASSERT_THAT(data[0]["distance_m"], SizeIs(3));
  EXPECT_EQ(data[0]["time_s"].front(), 0);
  EXPECT_EQ(data[0]["time_s"].back(), 63) << "the run's end is kept";
  EXPECT_LE(data[0]["time_s"].size(), 33U);
  EXPECT_EQ(data[0]["distance_m"][0].back(), 6.3e-5);
  EXPECT_EQ(data[0]["distance_m"][1].back(), 6.3);
  EXPECT_EQ(data[0]["distance_m"][0].size(), data[0]["time_s"].size());
  EXPECT_EQ(data[0]["parting_s"], json({6.3e-5, 6.3, 6.3}));
}

std::string text_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST_F(DetailsTest, NothingMeasuredIsNoFigure) {
  Store store = make();
  EXPECT_THAT(write_figures(store, dir_ + "/figures"), IsEmpty());
  EXPECT_FALSE(std::filesystem::exists(dir_ + "/figures"));
}

TEST_F(DetailsTest, EqualResultsGiveEqualFigures) {
  Store store = make();
  store.set_systems({{"planar-chain", R"({"dof": 5})"}});
  store.set_contenders({{"mujoco-euler", "mujoco", "", "mujoco-euler", "", "{}", "{}"}});
  for (const double step : {0.25, 1.0, 4.0}) {
    Cell speed = cell("mujoco-euler", "raw_speed", step), drift = cell("mujoco-euler", "drift", step);
    speed.system = drift.system = "planar-chain";
    speed.values = {{"raw_speed", "kHz", 1000, 990, 1010},
                    {"realtime_factor", "1", 1000 * step, 990 * step, 1010 * step}};
    drift.values = {{"energy_drift", "J", 1e-3 * step, {}, {}}};
    store.put_cell(speed);
    store.put_cell(drift);
  }
  const auto first = write_figures(store, dir_ + "/one"), second = write_figures(store, dir_ + "/two");
  ASSERT_THAT(first, SizeIs(4)) << "figures 3 and 4, each in two formats; no grasp and no sizes";
  for (size_t i = 0; i < first.size(); ++i) {
    EXPECT_GT(text_of(first[i]).size(), 1000U);
    EXPECT_EQ(text_of(first[i]), text_of(second[i])) << first[i];
  }
  // a stranger's results could have the folder lead anywhere
  std::filesystem::create_directories(dir_ + "/elsewhere");
  std::filesystem::create_directory_symlink(dir_ + "/elsewhere", dir_ + "/link");
  EXPECT_THROW(write_figures(store, dir_ + "/link"), InputError);
  EXPECT_TRUE(std::filesystem::is_empty(dir_ + "/elsewhere"));
}

// A heap of red balls of which two roll away.
TEST_F(DetailsTest, FigureFiveShowsWhereTheLargestSystemEndedIfThatIsKept) {
  Store store = make();
  constexpr size_t kBalls = 40;
  Scene scene;
  Trajectory end;
  end.states.resize(1);
  for (size_t i = 0; i < kBalls; ++i) {
    const size_t row = i / 7, column = i % 7;
    const double x = 0.3 * static_cast<double>(column), y = 0.3 * static_cast<double>(row);
    SceneBody& body = scene.bodies.emplace_back();
    body.name = "ball" + std::to_string(i);
    body.X_WB.p = Vec3(x, y, 1);
    Shape& shape = scene.shapes.emplace_back();
    shape.body = static_cast<int>(i);
    shape.radius = 0.1;
    shape.rgba = {1, 0, 0, 1};
    BodyState& state = end.states[0].bodies.emplace_back();
    state.p_WBcm = i < 2 ? Vec3(100 * (i + 1.0), 0, 0.1) : Vec3(x, y, 0.1);
  }
  store.set_systems({{"balls-40", R"({"bodies": 40, "family": "balls", "contacts": true})"}});
  store.set_scenes({{"balls-40", scene_text(scene)}});
  store.set_contenders({{"mujoco-euler", "mujoco", "", "mujoco-euler", "", "{}", "{}"}});
  Cell time = cell("mujoco-euler", "scaling", 10);
  time.system = "balls-40";
  time.values = {{"run_time", "s", 1, 0.9, 1.1}};
  store.put_cell(time);
  const auto red_shapes = [&](const std::string& folder) {
    const auto files = write_figures(store, dir_ + folder);
    EXPECT_THAT(files, SizeIs(2));
    const std::string svg = text_of(files.at(0)), red = "stroke:rgb(100%,0%,0%)";
    size_t count = 0;
    for (size_t at = svg.find(red); at != std::string::npos; at = svg.find(red, at + 1)) ++count;
    return count;
  };
  EXPECT_EQ(red_shapes("/start"), kBalls);
  write_trajectory(store.trajectories_dir(), "end", end);
  store.set_runs({{"end", "balls-40", "mujoco-euler", 10}});
  const size_t both = red_shapes("/both");
  EXPECT_GE(both, 2 * kBalls - 2);
  EXPECT_LE(both, 2 * kBalls);
}

}  // namespace
}  // namespace assay
