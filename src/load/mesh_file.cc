#include "load/mesh_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <Eigen/Eigenvalues>
#include <assimp/DefaultIOSystem.h>
#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#include <tinyxml2.h>

#include "base/errors.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

struct PositionHash {
  size_t operator()(const std::array<float, 3>& p) const {
    std::uint64_t hash = 1469598103934665603U;
    for (float value : p) {
      value += 0.0F;  // -0 equals 0
      std::uint32_t bits = 0;
      std::memcpy(&bits, &value, sizeof bits);
      hash = (hash ^ bits) * 1099511628211U;
    }
    return hash ^ (hash >> 29U);
  }
};

// Collects triangles; their corners become indices of distinct vertices.
class Builder {
 public:
  void triangle(const std::array<std::array<float, 3>, 3>& corners) {
    std::array<int, 3> face{};
    for (size_t k = 0; k < 3; ++k) face[k] = index(corners[k]);
    mesh_.faces.push_back(face);
  }
  MeshData take() {
    std::vector<std::pair<int, int>> edges;
    edges.reserve(3 * mesh_.faces.size());
    for (const auto& face : mesh_.faces) {
      for (size_t k = 0; k < 3; ++k) edges.emplace_back(std::minmax(face[k], face[(k + 1) % 3]));
    }
    std::ranges::sort(edges);
    for (auto edge = edges.begin(); edge != edges.end();) {
      const auto next = std::find_if(edge, edges.end(), [&](const auto& other) { return other != *edge; });
      if (next - edge != 2) ++mesh_.open_edges;
      edge = next;
    }
    return std::move(mesh_);
  }

 private:
  int index(const std::array<float, 3>& p) {
    if (!std::ranges::all_of(p, [](float value) { return std::isfinite(value); })) {
      throw InputError("has a vertex that is not a finite number; export it again");
    }
    const auto [found, fresh] = numbers_.try_emplace(p, static_cast<int>(mesh_.vertices.size()));
    if (fresh) mesh_.vertices.emplace_back(p[0], p[1], p[2]);
    return found->second;
  }

  MeshData mesh_;
  std::unordered_map<std::array<float, 3>, int, PositionHash> numbers_;
};

// assimp's readers of other formats are many and old, and what is not read cannot harm.
constexpr std::array<std::string_view, 5> kEndings = {".stl", ".obj", ".dae", ".glb", ".msh"};
constexpr std::uintmax_t kMostBytes = std::uintmax_t{256} << 20;

// Only the mesh itself: what it names (materials, pictures) could lie anywhere and is not needed.
class OneFile final : public Assimp::DefaultIOSystem {
 public:
  explicit OneFile(std::string path) : path_(std::move(path)) {}
  bool Exists(const char* file) const override { return path_ == file && DefaultIOSystem::Exists(file); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    return path_ == file ? DefaultIOSystem::Open(file, mode) : nullptr;
  }

 private:
  std::string path_;
};

void require_size(size_t triangles) {
  if (triangles == 0) throw InputError("has no triangles; export it again or remove it");
  if (triangles > kMostTriangles) {
    throw InputError(
        fmt::format("has {} triangles, and at most {} are read; simplify it, because only its convex hull "
                    "collides",
                    triangles, kMostTriangles));
  }
}

// A binary STL file: 80 bytes, the number of triangles, 50 bytes for each. Empty when the size says otherwise.
std::optional<MeshData> read_binary_stl(const std::string& path) {
  constexpr std::uintmax_t kHead = 84, kTriangle = 50;
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error || size < kHead) return std::nullopt;
  std::ifstream file(path, std::ios::binary);
  std::array<char, kHead> head{};
  file.read(head.data(), head.size());
  std::uint32_t count = 0;
  std::memcpy(&count, head.data() + 80, sizeof count);
  if (!file || kHead + kTriangle * count != size) return std::nullopt;
  require_size(count);
  std::vector<char> bytes(kTriangle * count);
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file) return std::nullopt;
  Builder builder;
  for (size_t t = 0; t < count; ++t) {
    std::array<std::array<float, 3>, 3> corners{};
    std::memcpy(corners.data(), bytes.data() + t * kTriangle + 12, sizeof corners);
    builder.triangle(corners);
  }
  return builder.take();
}

// MuJoCo's own binary format: the numbers of vertices, normals, texture coordinates and faces, then each of them.
std::optional<MeshData> read_msh(const std::string& path) {
  if (fs::path(path).extension() != ".msh") return std::nullopt;
  std::ifstream file(path, std::ios::binary);
  std::array<std::int32_t, 4> counts{};
  const auto read = [&](void* data, std::uintmax_t bytes) {
    file.read(static_cast<char*>(data), static_cast<std::streamsize>(bytes));
    return static_cast<bool>(file);
  };
  const std::string kBroken =
      "is no MuJoCo mesh: its size does not match its numbers of vertices and faces; export it again";
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error || !read(counts.data(), sizeof counts) || std::ranges::any_of(counts, [](auto n) { return n < 0; })) {
    throw InputError(kBroken);
  }
  const auto vertices = static_cast<std::uintmax_t>(counts[0]), faces = static_cast<std::uintmax_t>(counts[3]);
  const auto between = 12 * static_cast<std::uintmax_t>(counts[1]) + 8 * static_cast<std::uintmax_t>(counts[2]);
  if (size != sizeof counts + 12 * vertices + between + 12 * faces) throw InputError(kBroken);
  require_size(faces);
  std::vector<std::array<float, 3>> points(vertices);
  std::vector<std::array<std::int32_t, 3>> triangles(faces);
  bool whole = read(points.data(), 12 * vertices);
  file.seekg(static_cast<std::streamoff>(between), std::ios::cur);
  whole = whole && read(triangles.data(), 12 * faces);
  if (!whole) throw InputError(kBroken);
  Builder builder;
  for (const auto& triangle : triangles) {
    std::array<std::array<float, 3>, 3> corners{};
    for (size_t k = 0; k < 3; ++k) {
      if (triangle[k] < 0 || triangle[k] >= counts[0])
        throw InputError("has a face with an unknown vertex; export it again");
      corners[k] = points[static_cast<size_t>(triangle[k])];
    }
    builder.triangle(corners);
  }
  return builder.take();
}

// Binary glTF: a head of magic, version and length, then parts of a length each. assimp takes the memory that a part
// asks for before it looks whether the file has as much, and reads behind the end of one that it has not, or of a file
// with another head.
void require_whole_glb(const std::string& path, bool named_glb) {
  constexpr std::uintmax_t kHead = 12, kPartHead = 8;
  std::ifstream file(path, std::ios::binary);
  std::array<char, 4> magic{};
  std::array<std::uint32_t, 2> head{};  // version and length
  file.read(magic.data(), magic.size());
  const bool is_glb = file && std::string_view(magic.data(), magic.size()) == "glTF";
  if (!is_glb && named_glb) throw InputError("is no binary glTF; export it again");
  if (!is_glb) return;
  file.read(reinterpret_cast<char*>(head.data()), sizeof head);
  if (!file || head[0] < 1 || head[0] > 2) throw InputError("is no glTF of version 1 or 2; export it again");
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  const auto need = [&](std::uintmax_t bytes, const char* what) {
    if (bytes <= size) return;
    throw InputError(
        fmt::format("is damaged: {} ends at byte {}, and the file has {}; export it again", what, bytes, size));
  };
  need(head[1], "its content");
  if (head[0] == 1) {  // one part of text, then what is left
    std::uint32_t text = 0;
    file.read(reinterpret_cast<char*>(&text), sizeof text);
    need(kHead + kPartHead + text, "its text");
    return;
  }
  for (std::uintmax_t at = kHead; at + kPartHead <= size;) {
    std::array<std::uint32_t, 2> part{};  // length and type
    file.seekg(static_cast<std::streamoff>(at));
    file.read(reinterpret_cast<char*>(part.data()), sizeof part);
    if (!file) break;
    at += kPartHead + part[0];
    need(at, "a part of it");
  }
}

// The indices of a COLLADA file, of which assimp reads the same one without end where it is no number.
class Indices final : public tinyxml2::XMLVisitor {
 public:
  bool VisitEnter(const tinyxml2::XMLElement& element, const tinyxml2::XMLAttribute* /*first*/) override {
    constexpr std::array<std::string_view, 4> kNames = {"p", "h", "v", "vcount"};
    if (std::ranges::find(kNames, std::string_view(element.Name())) == kNames.end()) return true;
    for (const auto* child = element.FirstChild(); child != nullptr; child = child->NextSibling()) {
      const tinyxml2::XMLText* text = child->ToText();
      const std::string_view numbers = text == nullptr ? std::string_view() : text->Value();
      const size_t at = numbers.find_first_not_of("0123456789-+ \t\r\n");
      if (at == std::string_view::npos) continue;
      throw InputError(fmt::format("has an index that is no whole number in <{}> (line {}); export it again",
                                   element.Name(), child->GetLineNum()));
    }
    return true;
  }
};

void require_whole_indices(const std::string& path) {
  tinyxml2::XMLDocument document;
  // What is no XML assimp refuses by itself.
  if (document.LoadFile(path.c_str()) != tinyxml2::XML_SUCCESS) return;
  Indices indices;
  document.Accept(&indices);
}

// Without a name all of it, else what has that name.
void add_node(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent, const std::string& part,
              Builder& builder) {
  const aiMatrix4x4 X = parent * node.mTransformation;
  for (unsigned int m = 0; m < node.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[node.mMeshes[m]];
    if (!part.empty() && part != mesh.mName.C_Str() && part != node.mName.C_Str()) continue;
    for (unsigned int f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      std::array<std::array<float, 3>, 3> corners{};
      for (unsigned int k = 0; k < 3; ++k) {
        const aiVector3D p = X * mesh.mVertices[face.mIndices[k]];
        corners[k] = {p.x, p.y, p.z};
      }
      builder.triangle(corners);
    }
  }
  for (unsigned int c = 0; c < node.mNumChildren; ++c) add_node(scene, *node.mChildren[c], X, part, builder);
}

}  // namespace

double MeshData::flatness() const {
  if (vertices.size() < 4) return 0;
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : vertices) mean += p / static_cast<double>(vertices.size());
  Mat3 spread = Mat3::Zero();
  for (const Vec3& p : vertices) spread += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(spread);
  Vec3 extent = Vec3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    double lowest = 0, highest = 0;
    for (const Vec3& p : vertices) {
      const double x = (p - mean).dot(solver.eigenvectors().col(axis));
      lowest = std::min(lowest, x);
      highest = std::max(highest, x);
    }
    extent[axis] = highest - lowest;
  }
  return extent.maxCoeff() > 0 ? extent.minCoeff() / extent.maxCoeff() : 0;
}

MeshData read_mesh(const std::string& path, const std::string& part) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) throw InputError("is not there; correct its name");
  const std::uintmax_t size = fs::file_size(path, error);
  if (size == 0) throw InputError("is an empty file; export it again or remove it");
  if (size > kMostBytes) {
    throw InputError(fmt::format("has {} MiB, and at most {} are read; simplify it", size >> 20, kMostBytes >> 20));
  }
  std::string ending = fs::path(path).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (std::ranges::find(kEndings, ending) == kEndings.end()) {
    throw InputError(
        fmt::format("is of the format '{}', and .stl, .obj, .dae, .glb and .msh are read; export it as one "
                    "of these",
                    ending));
  }
  if (auto mesh = read_binary_stl(path); mesh && part.empty()) return std::move(*mesh);
  if (auto mesh = read_msh(path); mesh && part.empty()) return std::move(*mesh);
  require_whole_glb(path, ending == ".glb");
  if (ending == ".dae") require_whole_indices(path);

  Assimp::Importer importer;
  importer.SetIOHandler(new OneFile(path));  // the importer deletes it
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_USE_COLLADA_NAMES, !part.empty());  // not its ids
  const aiScene* scene = importer.ReadFile(path, aiProcess_Triangulate);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    std::string why = importer.GetErrorString();
    std::ranges::replace(why, '\n', ' ');
    if (why == "std::bad_alloc") why = "its reader asks for more memory than it may have";
    throw InputError(fmt::format("cannot be read ({}); export it again", why));
  }
  size_t triangles = 0;
  for (unsigned int m = 0; m < scene->mNumMeshes; ++m) triangles += scene->mMeshes[m]->mNumFaces;
  require_size(triangles);
  Builder builder;
  add_node(*scene, *scene->mRootNode, aiMatrix4x4(), part, builder);
  MeshData mesh = builder.take();
  if (!part.empty() && mesh.faces.empty()) {
    throw InputError(fmt::format("has no part '{}' with triangles; correct the name", part));
  }
  require_size(mesh.faces.size());
  return mesh;
}

}  // namespace assay
