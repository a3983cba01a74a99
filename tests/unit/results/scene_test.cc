// The stored scene: every shape comes back, scenes of earlier versions are read, large hulls and fields are thinned.
#include "results/store/scene.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using nlohmann::json;
using testing::SizeIs;

Hull pyramid() {
  Hull hull;
  hull.vertices = {{0, 0, 0}, {0.4, 0, 0}, {0, 0.3, 0}, {0, 0, 0.123456}};
  hull.faces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  return hull;
}

HeightField field(int rows, int columns) {
  HeightField made;
  made.rows = rows;
  made.columns = columns;
  made.half_x = 2;
  made.half_y = 1;
  made.base = 0.1;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) made.heights.push_back(0.01 * row + 0.02 * column);
  }
  return made;
}

Model model_of_all() {
  Model model;
  model.bodies.resize(2);
  model.bodies[0].ball = 0;
  model.balls.resize(1);
  model.balls[0].p_BJ = {0.1, 0.2, 0.3};
  model.bodies[1].parent = 0;
  model.bodies[1].joint = 0;
  model.joints.resize(1);
  model.joints[0].name = "rail";
  model.joints[0].body = 1;
  model.joints[0].type = JointType::kSlide;
  model.joints[0].p_BJ = {0, 0, 0.5};
  const auto add = [&model](ShapeType type, int body) -> Shape& {
    Shape& shape = model.shapes.emplace_back();
    shape.type = type;
    shape.body = body;
    return shape;
  };
  add(ShapeType::kBox, 0).half_size = {0.1, 0.2, 0.3};
  Shape& cylinder = add(ShapeType::kCylinder, 1);
  cylinder.radius = 0.1;
  cylinder.half_length = 0.4;
  add(ShapeType::kEllipsoid, 1).half_size = {0.3, 0.2, 0.1};
  add(ShapeType::kHull, 0).data = 0;
  add(ShapeType::kHull, 1).data = 0;
  add(ShapeType::kHeightField, kWorld).data = 0;
  add(ShapeType::kPlane, kWorld);
  model.hulls = {pyramid()};
  model.height_fields = {field(3, 4)};
  model.initial = reference_state(model);
  return model;
}

TEST(Scene, KeepsEveryShape) {
  const Scene scene = scene_of(model_of_all());
  EXPECT_EQ(scene.bodies[0].anchor_B, Vec3(0.1, 0.2, 0.3));
  EXPECT_EQ(scene.bodies[1].anchor_B, Vec3(0, 0, 0.5));
  EXPECT_THAT(scene.joints, testing::ElementsAre("rail"));
  const Scene back = parse_scene(scene_text(scene));
  ASSERT_EQ(back.shapes.size(), scene.shapes.size());
  for (size_t i = 0; i < scene.shapes.size(); ++i) {
    EXPECT_EQ(back.shapes[i].type, scene.shapes[i].type);
    EXPECT_EQ(back.shapes[i].half_size, scene.shapes[i].half_size);
    EXPECT_EQ(back.shapes[i].data, scene.shapes[i].data);
  }
  ASSERT_THAT(back.hulls, SizeIs(1));  // once, for two shapes
  for (size_t i = 0; i < 4; ++i) EXPECT_LT((back.hulls[0][i] - scene.hulls[0][i]).norm(), 1e-4);
  ASSERT_THAT(back.height_fields, SizeIs(1));
  EXPECT_EQ(back.height_fields[0].columns, 4);
  for (size_t i = 0; i < 12; ++i) {
    EXPECT_NEAR(back.height_fields[0].heights[i], scene.height_fields[0].heights[i], 1e-4);
  }
}

TEST(Scene, NamesNeedNotBeUtf8) {
  Model model = model_of_all();
  model.bodies[0].name = "caf\xe9";
  EXPECT_EQ(parse_scene(scene_text(scene_of(model))).bodies[0].name, "caf\ufffd");
}

TEST(Scene, ASmallHullKeepsItsShape) {
  Model model = model_of_all();
  for (Vec3& corner : model.hulls[0].vertices) corner *= 1e-3;
  const Scene scene = scene_of(model), back = parse_scene(scene_text(scene));
  EXPECT_NEAR(back.hulls[0][3].z(), 0.123456e-3, 1e-6);
}

TEST(Scene, OfEarlierVersionsIsRead) {
  json text = json::parse(scene_text(scene_of(model_of_all())));
  text.erase("hulls");
  text.erase("height_fields");
  text["shapes"] = {text["shapes"].back()};
  EXPECT_EQ(parse_scene(text.dump()).shapes[0].type, ShapeType::kPlane);
}

TEST(Scene, RefusesDataThatIsNotThere) {
  json text = json::parse(scene_text(scene_of(model_of_all())));
  text["shapes"][3]["data"] = 7;
  EXPECT_THROW(parse_scene(text.dump()), InputError);
  text = json::parse(scene_text(scene_of(model_of_all())));
  text["height_fields"][0]["h"] = {1, 2};
  EXPECT_THROW(parse_scene(text.dump()), InputError);
}

TEST(Scene, ThinsLargeHullsAndFields) {
  Model model = model_of_all();
  Hull& ball = model.hulls[0];
  ball.vertices.clear();
  for (int i = 0; i < 2000; ++i) {
    const double z = 2 * (i + 0.5) / 2000 - 1, turn = 2.4 * i, r = std::sqrt(1 - z * z);
    ball.vertices.emplace_back(r * std::cos(turn), r * std::sin(turn), 0.1 * z);
  }
  model.height_fields[0] = field(300, 30);
  const Scene scene = scene_of(model);
  EXPECT_LE(scene.hulls[0].size(), 100U);
  EXPECT_GE(scene.hulls[0].size(), 80U);
  Vec3 high = Vec3::Zero();
  for (const Vec3& corner : scene.hulls[0]) high = high.cwiseMax(corner);
  EXPECT_GT(high.x(), 0.95);
  EXPECT_GT(high.z(), 0.095);
  const HeightField& thin = scene.height_fields[0];
  EXPECT_LT(thin.rows, 100);
  EXPECT_EQ(thin.columns, 30);
  ASSERT_EQ(thin.heights.size(), static_cast<size_t>(thin.rows) * 30);
  EXPECT_NEAR(thin.heights.back(), 0.01 * 299 + 0.02 * 29, 1e-12);
  EXPECT_NEAR(thin.heights[30], 0.01 * 299 / (thin.rows - 1), 1e-12);  // linear between samples
}

TEST(Scene, RodsStandForShapes) {
  const Scene scene = scene_of(model_of_all());
  const Rod cylinder = rod_of(scene.shapes[1], data_of(scene, scene.shapes[1]));
  EXPECT_NEAR(cylinder.b.z() + cylinder.radius, 0.4, 1e-12);
  EXPECT_NEAR(largest_reach(scene.shapes[0], data_of(scene, scene.shapes[0])), Vec3(0.1, 0.2, 0.3).norm(), 1e-12);
  EXPECT_NEAR(largest_reach(scene.shapes[3], data_of(scene, scene.shapes[3])), 0.4, 1e-12);
}

}  // namespace
}  // namespace assay
