// Pictures: what is drawn is where the states say, and equal states give equal pixels. Needs OSMesa or EGL.
#include <array>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "load/mjcf.h"
#include "report/render/gl.h"
#include "report/render/renderer.h"

namespace assay {
namespace {

using testing::Lt;

constexpr int kWidth = 320, kHeight = 240;

// A red ball in space.
Scene ball() {
  Scene scene;
  scene.bodies.emplace_back().name = "ball";
  Shape& shape = scene.shapes.emplace_back();
  shape.body = 0;
  shape.radius = 0.5;
  shape.rgba = {1, 0, 0, 1};
  return scene;
}

State ball_at(const Vec3& position) {
  State state;
  state.bodies.emplace_back().p_WBcm = position;
  return state;
}

struct Blob {
  double pixels = 0, x = 0, y = 0;  // count and mean position, from the top left
};

// Pixels that differ from the background by more than anything's smooth edge.
Blob blob(const Picture& picture) {
  Blob blob;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const std::uint8_t* pixel =
          &picture.rgb[3 * (static_cast<size_t>(y) * static_cast<size_t>(picture.width) + static_cast<size_t>(x))];
      if (std::abs(pixel[1] - kBackground) < 40) continue;
      blob.pixels += 1;
      blob.x += x;
      blob.y += y;
    }
  }
  if (blob.pixels > 0) {
    blob.x /= blob.pixels;
    blob.y /= blob.pixels;
  }
  return blob;
}

class RenderTest : public testing::Test {
 protected:
  void SetUp() override {
    try {
      GlContext::make();
    } catch (const SystemError& error) {
      GTEST_SKIP() << error.what();
    }
  }
};

TEST_F(RenderTest, ABallHasItsProjectedSizeAndPlace) {
  const Scene scene = ball();
  // Along y, three metres of sight in the picture's height at the centre.
  const View view{.centre = Vec3::Zero(), .radius = 1.5, .azimuth = 90, .elevation = 0};
  Renderer renderer(scene, view, kWidth, kHeight);
  const State here = ball_at(Vec3::Zero()), right = ball_at({0.5, 0, 0}), up = ball_at({0, 0, 0.5});
  const Blob middle = blob(renderer.draw({{.state = &here, .text = ""}}));
  // A sphere of radius r at distance d covers the disc of radius f tan(asin(r / d)).
  const double half = 20 * std::numbers::pi / 180;
  const double distance = view.radius / std::sin(half), focal = kHeight / 2.0 / std::tan(half);
  const double radius = focal * std::tan(std::asin(0.5 / distance));
  EXPECT_NEAR(middle.pixels, std::numbers::pi * radius * radius, 0.03 * std::numbers::pi * radius * radius);
  EXPECT_NEAR(middle.x, kWidth / 2.0, 1);
  EXPECT_NEAR(middle.y, kHeight / 2.0, 1);
  const double moved = focal * 0.5 / distance;
  EXPECT_NEAR(blob(renderer.draw({{.state = &right, .text = ""}})).x - middle.x, moved, 0.05 * moved + 1);
  EXPECT_NEAR(middle.y - blob(renderer.draw({{.state = &up, .text = ""}})).y, moved, 0.05 * moved + 1);
}

// Each shape of the same silhouette, a square of 0.6 m or a disc, at the same place.
TEST_F(RenderTest, EveryShapeHasItsProjectedSizeAndPlace) {
  const View view{.centre = Vec3::Zero(), .radius = 3, .azimuth = 90, .elevation = 0};
  const State here = ball_at({0.4, 0, 0.2});
  const auto drawn = [&](const Shape& shape) {
    Scene scene = ball();
    scene.shapes[0] = shape;
    scene.shapes[0].rgba = {1, 0, 0, 1};
    scene.shapes[0].body = 0;
    // a box whose frame is at a corner
    scene.hulls = {{}};
    for (int i = 0; i < 8; ++i) scene.hulls[0].emplace_back(0.6 * (i & 1), 0.3 * (i >> 1 & 1), 0.6 * (i >> 2));
    HeightField field;
    field.rows = field.columns = 2;
    field.half_x = 0.3;
    field.half_y = 0.15;
    field.base = 0.2;
    field.heights = {0.4, 0.4, 0.4, 0.4};
    scene.height_fields = {field};
    Renderer renderer(scene, view, kWidth, kHeight);
    return blob(renderer.draw({{.state = &here, .text = ""}}));
  };
  Shape box, hull, field, cylinder, ellipsoid, sphere;
  box.type = ShapeType::kBox;
  box.half_size = {0.3, 0.15, 0.3};
  hull.type = ShapeType::kHull;
  hull.data = 0;
  hull.X_BS.p = {-0.3, -0.15, -0.3};
  field.type = ShapeType::kHeightField;
  field.data = 0;
  field.X_BS.p = {0, 0, -0.1};
  cylinder.type = ShapeType::kCylinder;
  cylinder.radius = cylinder.half_length = 0.3;
  const Blob square = drawn(box);
  EXPECT_GT(square.pixels, 500);
  for (const Shape& shape : {hull, field, cylinder}) {
    const Blob other = drawn(shape);
    EXPECT_NEAR(other.pixels, square.pixels, 0.08 * square.pixels) << static_cast<int>(shape.type);
    EXPECT_NEAR(other.x, square.x, 1.5);
    EXPECT_NEAR(other.y, square.y, 1.5);
  }
  ellipsoid.type = ShapeType::kEllipsoid;
  ellipsoid.half_size = {0.3, 0.1, 0.3};
  sphere.radius = 0.3;
  const Blob disc = drawn(sphere), flat = drawn(ellipsoid);
  EXPECT_NEAR(flat.pixels, disc.pixels, 0.05 * disc.pixels);
  EXPECT_NEAR(flat.x, disc.x, 1);
  EXPECT_LT(disc.pixels, 0.85 * square.pixels);
}

TEST_F(RenderTest, EqualStatesGiveEqualPixelsAndOthersDoNot) {
  const Model model = load_model(ASSAY_MODELS "/planar-chain.xml");
  const Scene scene = scene_of(model);
  State moved = model.initial;
  moved.bodies.back().p_WBcm.z() += 0.05;
  const std::vector<State> states = {model.initial};
  Renderer renderer(scene, view_of(scene, {&states}), kWidth, kHeight);
  const Picture first = renderer.draw({{.state = &model.initial, .text = ""}});
  EXPECT_NE(renderer.draw({{.state = &moved, .text = ""}}).rgb, first.rgb);
  EXPECT_EQ(renderer.draw({{.state = &model.initial, .text = ""}}).rgb, first.rgb);
}

TEST_F(RenderTest, PanelsLieInAGrid) {
  const Scene scene = ball();
  Renderer renderer(scene, {.radius = 1}, kWidth, kHeight);
  const State here = ball_at(Vec3::Zero());
  const Panel full{.state = &here, .text = ""}, empty{};
  const Blob left = blob(renderer.draw({full, empty}, 2)), right = blob(renderer.draw({empty, full}, 2));
  EXPECT_NEAR(left.x, kWidth / 4.0, 2);
  EXPECT_NEAR(right.x, kWidth * 3 / 4.0, 2);
  EXPECT_NEAR(left.pixels, right.pixels, 0.03 * left.pixels);
  EXPECT_EQ(blob(renderer.draw({empty, empty}, 2)).pixels, 0);
  const Blob below = blob(renderer.draw({empty, empty, full, empty}, 2));
  EXPECT_NEAR(below.x, kWidth / 4.0, 2);
  EXPECT_NEAR(below.y, kHeight * 3 / 4.0, 2);
}

TEST_F(RenderTest, TextIsDrawnOverAPanel) {
  const Scene scene = ball();
  Renderer renderer(scene, {.radius = 1}, kWidth, kHeight);
  const Panel empty{}, text{.state = nullptr, .text = "mujoco-euler\n1/64 ms"};
  const Blob written = blob(renderer.draw({text}));
  EXPECT_GT(written.pixels, 500);
  EXPECT_THAT(written.x, Lt(kWidth / 2.0));
  EXPECT_THAT(written.y, Lt(kHeight / 2.0));
  const Blob caption = blob(renderer.draw({empty}, 1, "1.00 s"));
  EXPECT_GT(caption.y, kHeight / 2.0);
}

TEST(View, TheMedianRunDecides) {
  const Scene scene = ball();
  const std::vector<State> near = {ball_at({-1, 0, 0}), ball_at({1, 0, 0})}, far = {ball_at({0, 0, 1e6})};
  const View view = view_of(scene, {&near, &far, &near});
  EXPECT_LT(view.centre.norm(), 1e-9);
  // a box of 3 x 1 x 1 m
  EXPECT_NEAR(view.radius, std::sqrt(11.0) / 2, 1e-9);
}

TEST(View, AFlatMotionIsSeenFromItsThinSide) {
  const Scene scene = ball();
  const std::vector<State> flat = {ball_at({-3, -3, 0}), ball_at({3, 3, 0})};
  EXPECT_LT(view_of(scene, {&flat}).elevation, -45);
  const std::vector<State> upright = {ball_at({-3, 0, -3}), ball_at({3, 0, 3})};
  EXPECT_NEAR(view_of(scene, {&upright}).azimuth, 90, 30);
}

TEST(Grid, PanelsHaveTheMostRoom) {
  EXPECT_EQ(grid_columns(1, 1920, 1080), 1);
  EXPECT_EQ(grid_columns(2, 1920, 1080), 2);
  EXPECT_EQ(grid_columns(12, 1920, 1080), 4);
  EXPECT_EQ(grid_columns(2, 1080, 1920), 1);
}

// A body without shapes that stays where it is.
TEST(RenderView, OfAPoint) {
  Scene scene = ball();
  scene.shapes.clear();
  const std::vector<State> still(2, ball_at({1, 2, 3}));
  const View view = view_of(scene, {&still});
  EXPECT_GT(view.radius, 0);
  EXPECT_EQ(view.centre, Vec3(1, 2, 3));
}

}  // namespace
}  // namespace assay
