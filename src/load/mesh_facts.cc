#include "load/mesh_facts.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <numeric>
#include <set>

#include "base/text.h"
#include "load/spec_text.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

std::uintmax_t size_of(const std::string& file) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  return error ? 0 : size;
}

// What MuJoCo compiled of a mesh of an MJCF file.
MeshFacts compiled_mesh(const mjSpec* spec, const mjModel* m, int id, const std::string& folder) {
  MeshFacts facts;
  std::vector<Vec3> vertices;
  const float* p = m->mesh_vert + 3 * static_cast<std::ptrdiff_t>(m->mesh_vertadr[id]);
  for (int v = 0; v < m->mesh_vertnum[id]; ++v, p += 3) vertices.emplace_back(p[0], p[1], p[2]);
  std::vector<std::array<int, 3>> faces;
  const int* f = m->mesh_face + 3 * static_cast<std::ptrdiff_t>(m->mesh_faceadr[id]);
  for (int i = 0; i < m->mesh_facenum[id]; ++i, f += 3) faces.push_back({f[0], f[1], f[2]});
  facts.triangles = faces.size();
  facts.open_edges = open_edges(vertices, faces);
  facts.volume = enclosed_volume(vertices, faces);
  for (mjsElement* e = mjs_firstElement(spec, mjOBJ_MESH); e != nullptr; e = mjs_nextElement(spec, e)) {
    if (mjs_getId(e) != id) continue;
    const mjsMesh* mesh = mjs_asMesh(e);
    facts.line = spec_line(mesh->info);
    if (facts.line > 0) facts.in = spec_origin(spec, e);
    const fs::path file = spec_mesh_path(spec, mesh, folder);
    if (file.empty()) break;
    facts.file = file.lexically_normal();
    facts.bytes = size_of(facts.file);
  }
  return facts;
}

// The mesh of a hull; parts of a decomposed mesh have its name and a number.
std::string mesh_name(const std::string& hull, const mjModel* compiled) {
  const size_t number = hull.rfind('_');
  const bool own = number == std::string::npos || mj_name2id(compiled, mjOBJ_MESH, hull.c_str()) >= 0;
  return own ? hull : hull.substr(0, number);
}

}  // namespace

size_t open_edges(const std::vector<Vec3>& vertices, const std::vector<std::array<int, 3>>& faces) {
  // equal positions get the number of the first of them
  std::vector<int> order(vertices.size());
  std::iota(order.begin(), order.end(), 0);
  const auto before = [&](int a, int b) {
    return std::lexicographical_compare(vertices[a].data(), vertices[a].data() + 3, vertices[b].data(),
                                        vertices[b].data() + 3);
  };
  std::ranges::sort(order, before);
  std::vector<int> number(vertices.size());
  for (size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && vertices[order[i]] == vertices[order[i - 1]];
    number[order[i]] = same ? number[order[i - 1]] : order[i];
  }
  std::vector<std::uint64_t> edges;
  edges.reserve(3 * faces.size());
  for (const auto& face : faces) {
    for (size_t k = 0; k < 3; ++k) {
      const auto a = static_cast<std::uint64_t>(number[face[k]]);
      const auto b = static_cast<std::uint64_t>(number[face[(k + 1) % 3]]);
      edges.push_back(std::min(a, b) << 32U | std::max(a, b));
    }
  }
  std::ranges::sort(edges);
  size_t open = 0;
  for (auto first = edges.begin(); first != edges.end();) {
    const auto next = std::upper_bound(first, edges.end(), *first);
    if (next - first != 2) ++open;
    first = next;
  }
  return open;
}

double enclosed_volume(const std::vector<Vec3>& vertices, const std::vector<std::array<int, 3>>& faces) {
  if (vertices.empty()) return 0;
  const Vec3& origin = vertices.front();
  double volume = 0;
  for (const auto& [a, b, c] : faces) {
    volume += (vertices[a] - origin).dot((vertices[b] - origin).cross(vertices[c] - origin)) / 6;
  }
  return volume;
}

std::vector<MeshFacts> mesh_facts(const Model& model, const mjSpec* spec, const mjModel* compiled,
                                  const std::string& folder, const UrdfDocument& urdf) {
  std::vector<MeshFacts> all;
  std::set<std::string> known;
  for (const Hull& hull : model.hulls) {
    const std::string name = mesh_name(hull.name, compiled);
    if (!known.insert(name).second) continue;
    MeshFacts facts;
    if (const auto found = urdf.meshes.find(name); found != urdf.meshes.end()) {
      const MeshData& data = found->second.data;
      facts.file = found->second.path;
      facts.bytes = size_of(facts.file);
      facts.triangles = data.faces.size();
      facts.open_edges = data.open_edges;
      facts.volume = enclosed_volume(data.vertices, data.faces);
    } else if (const int id = mj_name2id(compiled, mjOBJ_MESH, name.c_str()); id >= 0) {
      facts = compiled_mesh(spec, compiled, id, folder);
    } else {
      continue;
    }
    facts.name = name;
    all.push_back(std::move(facts));
  }
  return all;
}

}  // namespace assay
