// Mesh files of one solid in every format: the same triangles, the same hull; and files that are wrong.
#include "load/mesh_file.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "load/mjcf.h"
#include "temp_folder.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

// An L, 0.4 x 0.3 x 0.2 m, whose corner is cut out: not convex, and alike in no two directions.
struct Solid {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>> faces;
  double volume = (0.4 * 0.3 - 0.3 * 0.2) * 0.2;
  double hull_volume = (0.4 * 0.3 - 0.3 * 0.2 / 2) * 0.2;
};
Solid solid() {
  const std::array<std::array<double, 2>, 6> outline = {
      {{0, 0}, {0.4, 0}, {0.4, 0.1}, {0.1, 0.1}, {0.1, 0.3}, {0, 0.3}}};
  Solid s;
  for (const double z : {0.0, 0.2}) {
    for (const auto& p : outline) s.vertices.emplace_back(p[0], p[1], z);
  }
  for (const auto& [a, b, c] : {std::array{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}) {
    s.faces.push_back({c, b, a});              // bottom
    s.faces.push_back({a + 6, b + 6, c + 6});  // top
  }
  for (int k = 0; k < 6; ++k) {
    const int next = (k + 1) % 6;
    s.faces.push_back({k, next, next + 6});
    s.faces.push_back({k, next + 6, k + 6});
  }
  return s;
}

double volume(const std::vector<Vec3>& vertices, const std::vector<std::array<int, 3>>& faces) {
  double sum = 0;
  for (const auto& [a, b, c] : faces) sum += vertices[a].dot(vertices[b].cross(vertices[c])) / 6;
  return sum;
}

template <typename T>
void put(std::string& bytes, T value) {
  std::array<char, sizeof value> raw;
  std::memcpy(raw.data(), &value, sizeof value);
  bytes.append(raw.data(), raw.size());
}

std::string binary_stl(const Solid& s) {
  std::string bytes(80, '\0');
  put(bytes, static_cast<std::uint32_t>(s.faces.size()));
  for (const auto& face : s.faces) {
    bytes.append(12, '\0');
    for (const int k : face) {
      for (const double x : s.vertices[k]) put(bytes, static_cast<float>(x));
    }
    bytes.append(2, '\0');
  }
  return bytes;
}

std::string text_stl(const Solid& s) {
  std::string text = "solid l\n";
  for (const auto& face : s.faces) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const int k : face) {
      text += fmt::format("vertex {} {} {}\n", s.vertices[k].x(), s.vertices[k].y(), s.vertices[k].z());
    }
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid l\n";
}

std::string obj(const Solid& s) {
  std::string text;
  for (const Vec3& p : s.vertices) text += fmt::format("v {} {} {}\n", p.x(), p.y(), p.z());
  for (const auto& [a, b, c] : s.faces) text += fmt::format("f {} {} {}\n", a + 1, b + 1, c + 1);
  return text;
}

std::string msh(const Solid& s) {
  std::string bytes;
  for (const size_t count : {s.vertices.size(), size_t{2}, size_t{1}, s.faces.size()}) {
    put(bytes, static_cast<std::int32_t>(count));
  }
  for (const Vec3& p : s.vertices) {
    for (const double x : p) put(bytes, static_cast<float>(x));
  }
  for (int i = 0; i < 8; ++i) put(bytes, 0.5F);  // two normals and a texture coordinate
  for (const auto& face : s.faces) {
    for (const int k : face) put(bytes, static_cast<std::int32_t>(k));
  }
  return bytes;
}

// glTF in one file: a JSON of its structure, then the numbers. `node` is what else its node has.
std::string glb(const Solid& s, const std::string& node = "") {
  std::string numbers;
  for (const Vec3& p : s.vertices) {
    for (const double x : p) put(numbers, static_cast<float>(x));
  }
  const size_t points = numbers.size();
  for (const auto& face : s.faces) {
    for (const int k : face) put(numbers, static_cast<std::uint32_t>(k));
  }
  std::string json = fmt::format(
      R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0{}}}],)"
      R"("meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],"accessors":[)"
      R"({{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3","min":[0,0,0],"max":[0.4,0.3,0.2]}},)"
      R"({{"bufferView":1,"componentType":5125,"count":{},"type":"SCALAR"}}],"bufferViews":[)"
      R"({{"buffer":0,"byteLength":{}}},{{"buffer":0,"byteOffset":{},"byteLength":{}}}],"buffers":[{{"byteLength":{}}}]}})",
      node, s.vertices.size(), 3 * s.faces.size(), points, points, numbers.size() - points, numbers.size());
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string bytes = "glTF";
  for (const size_t number : {size_t{2}, 28 + json.size() + numbers.size(), json.size()}) {
    put(bytes, static_cast<std::uint32_t>(number));
  }
  bytes += "JSON" + json;
  put(bytes, static_cast<std::uint32_t>(numbers.size()));
  return bytes + std::string("BIN\0", 4) + numbers;
}

// In units of `unit` metres; `node` is a transformation of the node that has the geometry.
std::string dae(const Solid& s, double unit, const std::string& up, const std::string& node = "") {
  std::string numbers, indices;
  for (const Vec3& p : s.vertices) {
    numbers += fmt::format("{:.9g} {:.9g} {:.9g} ", p.x() / unit, p.y() / unit, p.z() / unit);
  }
  for (const auto& [a, b, c] : s.faces) indices += fmt::format("{} {} {} ", a, b, c);
  return fmt::format(R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="u" meter="{}"/><up_axis>{}</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="{}">{}</float_array><technique_common>
<accessor source="#a" count="{}" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="{}"><input semantic="VERTEX" source="#v" offset="0"/><p>{}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n">{}<instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)",
                     unit, up, 3 * s.vertices.size(), numbers, s.vertices.size(), s.faces.size(), indices, node);
}

class MeshFile : public TempFolderTest {
 protected:
  std::string write(const std::string& name, const std::string& bytes) {
    fs::create_directories(dir_);
    std::ofstream(dir_ / name, std::ios::binary) << bytes;
    return dir_ / name;
  }
  std::string refusal(const std::string& name, const std::string& bytes) {
    try {
      read_mesh(write(name, bytes));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  // A link that turns, with the mesh as its collision shape.
  Model robot(const std::string& name, const std::string& attributes = "", const LoadOptions& options = {}) {
    const std::string text = fmt::format(
        R"(<robot name="r"><link name="base"/><link name="tip"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"
ixy="0" ixz="0" iyz="0"/></inertial><visual><geometry><mesh filename="package://nowhere/pretty.dae"/></geometry></visual>
<collision><geometry><mesh filename="{}"{}/></geometry></collision></link>
<joint name="j" type="continuous"><parent link="base"/><child link="tip"/></joint></robot>)",
        name, attributes);
    return load_model(write("robot.urdf", text), options);
  }
};

TEST_F(MeshFile, EveryFormatIsTheSameSolid) {
  const Solid l = solid();
  write("l.stl", binary_stl(l));
  write("l_text.stl", text_stl(l));
  write("l.obj", obj(l));
  write("l.msh", msh(l));
  write("metres.dae", dae(l, 1, "Z_UP"));
  write("inches.dae", dae(l, 0.0254, "Z_UP"));
  write("y_up.dae", dae(l, 1, "Y_UP"));  // the up axis does not turn it, as in ROS
  write("l.glb", glb(l));
  const Model first = robot("l.stl");
  ASSERT_EQ(first.hulls.size(), 1U);
  for (const char* name : {"l.stl", "l_text.stl", "l.obj", "l.msh", "metres.dae", "inches.dae", "y_up.dae", "l.glb"}) {
    SCOPED_TRACE(name);
    const MeshData mesh = read_mesh(dir_ / name);
    EXPECT_EQ(mesh.vertices.size(), 12U);
    EXPECT_EQ(mesh.faces.size(), l.faces.size());
    EXPECT_EQ(mesh.open_edges, 0U);
    EXPECT_NEAR(volume(mesh.vertices, mesh.faces), l.volume, 1e-8);
    const Model model = robot(name);
    ASSERT_EQ(model.hulls.size(), 1U);
    const Hull& hull = model.hulls[0];
    EXPECT_EQ(hull.vertices.size(), 10U);  // the inner corner is inside of the hull
    EXPECT_NEAR(volume(hull.vertices, hull.faces), l.hull_volume, 1e-8);
    // the hull lies where the mesh lies: each of its corners is one of the solid's
    const Shape& shape = model.shapes.at(0);
    for (const Vec3& p : hull.vertices) {
      const Vec3 p_B = shape.X_BS * p;
      EXPECT_TRUE(std::ranges::any_of(l.vertices, [&](const Vec3& v) { return (v - p_B).norm() < 1e-6; })) << p_B;
    }
  }
}

TEST_F(MeshFile, NodesOfColladaAndGltf) {
  const Solid l = solid();
  write("moved.dae", dae(l, 1, "Z_UP", "<translate>1 2 3</translate><scale>2 1 1</scale>"));
  write("moved.glb", glb(l, R"(,"translation":[1,2,3],"scale":[2,1,1])"));
  for (const char* name : {"moved.dae", "moved.glb"}) {
    SCOPED_TRACE(name);
    const MeshData mesh = read_mesh(dir_ / name);
    EXPECT_NEAR(volume(mesh.vertices, mesh.faces), 2 * l.volume, 1e-7);
    EXPECT_TRUE(std::ranges::any_of(mesh.vertices, [](const Vec3& p) { return (p - Vec3(1.8, 2, 3)).norm() < 1e-6; }));
  }
}

TEST_F(MeshFile, ScaleMayMirror) {
  const Solid l = solid();
  write("l.stl", binary_stl(l));
  for (const auto& [scale, factor] :
       {std::pair(Vec3(1, 2, 1), 2.0), std::pair(Vec3(-1, 1, 1), 1.0), std::pair(Vec3(-1, -1, -0.5), 0.5)}) {
    const Model model = robot("l.stl", fmt::format(" scale=\"{} {} {}\"", scale.x(), scale.y(), scale.z()));
    const Hull& hull = model.hulls.at(0);
    EXPECT_NEAR(volume(hull.vertices, hull.faces), factor * l.hull_volume, 1e-8);
    for (const Vec3& p : hull.vertices) {
      const Vec3 p_B = model.shapes.at(0).X_BS * p;
      EXPECT_TRUE(
          std::ranges::any_of(l.vertices, [&](const Vec3& v) { return (v.cwiseProduct(scale) - p_B).norm() < 1e-6; }));
    }
  }
}

TEST_F(MeshFile, MeshesThatAreWrong) {
  Solid open = solid();
  open.faces.pop_back();
  EXPECT_EQ(read_mesh(write("open.stl", binary_stl(open))).open_edges, 3U);
  EXPECT_THAT(robot("open.stl").hulls, testing::SizeIs(1));

  EXPECT_THAT(refusal("e.stl", ""), HasSubstr("empty file"));
  EXPECT_THAT(refusal("b.obj", "v 0 0 nan\n"), HasSubstr("export it again"));
  EXPECT_THAT(refusal("b.dae", "<COLLADA"), HasSubstr("cannot be read"));
  std::string index = dae(solid(), 1, "Z_UP");
  index.insert(index.find("<p>") + 4, "(");
  EXPECT_THAT(refusal("b.dae", index), HasSubstr("an index that is no whole number in <p> (line 9)"));
  EXPECT_THAT(refusal("b.glb", glb(solid()).substr(0, 200)), HasSubstr("its content ends at byte"));
  // lengths that the library would take memory for
  const auto with = [](std::uint32_t version, std::uint32_t length) {
    std::string bytes = glb(solid());
    std::memcpy(bytes.data() + 4, &version, sizeof version);
    std::memcpy(bytes.data() + 12, &length, sizeof length);
    return bytes;
  };
  EXPECT_THAT(refusal("b.glb", with(2, 0x7d0001cc)), HasSubstr("a part of it ends at byte 2097152480"));
  EXPECT_THAT(refusal("b.glb", with(1, 0x7d0001cc)), HasSubstr("its text ends at byte 2097152480"));
  EXPECT_THAT(refusal("b.glb", with(3, 4)), HasSubstr("version 1 or 2"));
  EXPECT_THAT(refusal("b.glb", "glT#F"), HasSubstr("no binary glTF"));
  EXPECT_THAT(refusal("short.msh", msh(solid()).substr(0, 100)), HasSubstr("does not match"));
  Solid wrong = solid();
  wrong.faces[3][1] = 99;
  EXPECT_THAT(refusal("wrong.msh", msh(wrong)), HasSubstr("unknown vertex"));
  std::string nan = binary_stl(solid());
  const float value = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(nan.data() + 84 + 12, &value, sizeof value);
  EXPECT_THAT(refusal("nan.stl", nan), HasSubstr("not a finite number"));
  // a header that promises a million triangles and one more, in a file of that size, of which only the head is there
  std::string head(80, '\0');
  put(head, static_cast<std::uint32_t>(kMostTriangles + 1));
  fs::resize_file(write("huge.stl", head), 84 + 50 * (kMostTriangles + 1));
  EXPECT_THROW(read_mesh(dir_ / "huge.stl"), InputError);

  Solid flat = solid();
  for (Vec3& p : flat.vertices) p.z() = 0;
  write("flat.stl", binary_stl(flat));
  try {
    robot("flat.stl");
    ADD_FAILURE() << "a flat mesh has no hull";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("flat.stl"), HasSubstr("line 3"), HasSubstr("thin box")));
  }
}

}  // namespace
}  // namespace assay
