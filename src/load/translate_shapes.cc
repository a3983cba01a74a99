// Collision shapes, hulls of meshes, height fields.
#include <algorithm>
#include <cmath>
#include <span>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "load/decomposition.h"
#include "load/mesh_facts.h"
#include "load/translator.h"

namespace assay {
namespace {

const char* geom_type_name(int type) {
  switch (type) {
    case mjGEOM_PLANE:
      return "plane";
    case mjGEOM_HFIELD:
      return "height field";
    case mjGEOM_SPHERE:
      return "sphere";
    case mjGEOM_CAPSULE:
      return "capsule";
    case mjGEOM_ELLIPSOID:
      return "ellipsoid";
    case mjGEOM_CYLINDER:
      return "cylinder";
    case mjGEOM_BOX:
      return "box";
    case mjGEOM_MESH:
      return "mesh";
    case mjGEOM_SDF:
      return "signed distance field";
    default:
      return "shape of unknown type";
  }
}

// Each edge has a face on either side that runs through it the other way, and the faces enclose a volume from outside.
bool closed_and_outward(const Hull& hull) {
  std::vector<std::pair<int, int>> edges;
  for (const auto& face : hull.faces) {
    for (int k = 0; k < 3; ++k) edges.emplace_back(face[k], face[(k + 1) % 3]);
  }
  std::ranges::sort(edges);
  if (std::ranges::adjacent_find(edges) != edges.end()) return false;
  return enclosed_volume(hull.vertices, hull.faces) > 0 && std::ranges::all_of(edges, [&](const auto& e) {
           return std::ranges::binary_search(edges, std::pair(e.second, e.first));
         });
}

}  // namespace

void Translator::translate_shapes() {
  shape_of_.assign(static_cast<size_t>(m_->ngeom), -1);
  parts_.assign(static_cast<size_t>(m_->ngeom), 1);
  std::vector<std::string> drawn;
  for (int g = 0; g < m_->ngeom; ++g) {
    const int type = m_->geom_type[g];
    // hulls of meshes that are only drawn are not computed
    if (!may_collide(g) && (type == mjGEOM_MESH || type == mjGEOM_HFIELD || type == mjGEOM_SDF)) {
      drawn.push_back(fmt::format("{} ({})", label(mjOBJ_GEOM, g), geom_type_name(type)));
      continue;
    }
    add_shape(g, body_of_[m_->geom_bodyid[g]]);
  }
  note_list("visual shapes are left out", drawn);
}

// True by its own bits or by a <pair>; translate_contacts() finds the partners.
bool Translator::may_collide(int g) const {
  if (contacts_disabled()) return false;
  if (m_->geom_contype[g] != 0 || m_->geom_conaffinity[g] != 0) return true;
  for (int p = 0; p < m_->npair; ++p) {
    if (m_->pair_geom1[p] == g || m_->pair_geom2[p] == g) return true;
  }
  return false;
}

void Translator::add_shape(int g, int body) {
  Shape shape;
  const std::string owner = body == kWorld ? "world" : model_.bodies[body].name;
  shape.body = body;
  shape.X_BS = X_MB_[m_->geom_bodyid[g]] * Pose{vec3(m_->geom_pos, g), quat(m_->geom_quat, g)};
  shape.friction = *row(m_->geom_friction, 3, g);
  shape.collides = false;  // until a pair is found
  if (!fill_shape(g, shape)) return;
  shape.name = unique_name(name(mjOBJ_GEOM, g), fmt::format("{}_shape", owner), shape_names_);
  shape.rgba = colour_of(g);
  shape_of_[g] = static_cast<int>(model_.shapes.size());
  model_.shapes.push_back(shape);
  if (shape.type != ShapeType::kHull) return;
  const std::vector<int>& hulls = hulls_of_mesh(g);
  parts_[g] = static_cast<int>(hulls.size());
  const std::string first = shape.name;
  for (size_t k = 1; k < hulls.size(); ++k) {
    shape.data = hulls[k];
    shape.name = unique_name("", fmt::format("{}_{}", first, k + 1), shape_names_);
    inflation_.push_back(0);
    model_.shapes.push_back(shape);
  }
}

// A geom of the default grey takes its material's colour.
std::array<float, 4> Translator::colour_of(int g) const {
  const float* rgba = row(m_->geom_rgba, 4, g);
  const std::array<float, 4> grey = {0.5f, 0.5f, 0.5f, 1.0f};
  if (m_->geom_matid[g] >= 0 && std::ranges::equal(grey, std::span(rgba, 4)))
    rgba = row(m_->mat_rgba, 4, m_->geom_matid[g]);
  return {rgba[0], rgba[1], rgba[2], rgba[3]};
}

// Type and size. False where there is no such shape.
bool Translator::fill_shape(int g, Shape& shape) {
  const mjtNum* size = row(m_->geom_size, 3, g);
  // a margin inflates a geom; sharp edges stay sharp here, where MuJoCo's are rounded
  const double margin = may_collide(g) ? m_->geom_margin[g] : 0;
  double inflation = margin;
  switch (m_->geom_type[g]) {
    case mjGEOM_PLANE:
      shape.type = ShapeType::kPlane;
      shape.X_BS.p += shape.X_BS.q * Vec3(0, 0, margin);
      break;
    case mjGEOM_SPHERE:
      shape.type = ShapeType::kSphere;
      shape.radius = size[0] + margin;
      break;
    case mjGEOM_CAPSULE:
      shape.type = ShapeType::kCapsule;
      shape.radius = size[0] + margin;
      shape.half_length = size[1];
      break;
    case mjGEOM_CYLINDER:
      shape.type = ShapeType::kCylinder;
      shape.radius = size[0] + margin;
      shape.half_length = size[1] + margin;
      break;
    case mjGEOM_BOX:
      shape.type = ShapeType::kBox;
      shape.half_size = vec3(size) + Vec3::Constant(margin);
      break;
    case mjGEOM_ELLIPSOID:
      shape.type = ShapeType::kEllipsoid;
      shape.half_size = vec3(size) + Vec3::Constant(margin);
      break;
    case mjGEOM_MESH:
      inflation = 0;
      shape.type = ShapeType::kHull;
      if (hulls_of_mesh(g).empty()) return false;
      shape.data = hulls_of_mesh(g).front();
      break;
    case mjGEOM_HFIELD:
      shape.type = ShapeType::kHeightField;
      if (shape.body != kWorld) {
        refuse(mjOBJ_GEOM, g, "is a height field on a moving body", "put it into the world");
        return false;
      }
      shape.data = height_field(m_->geom_dataid[g]);
      shape.X_BS.p += shape.X_BS.q * Vec3(0, 0, margin);
      break;
    default:
      unsupported(mjOBJ_GEOM, g, fmt::format("is a {}, which is not supported", geom_type_name(m_->geom_type[g])),
                  R"(replace it, or make it visual with contype="0" conaffinity="0")", "leaves its contacts out");
      return false;
  }
  inflation_.push_back(inflation);
  return true;
}

// The hulls that the geom's mesh stands for: its own, or with --decompose several. None where it has no hull.
const std::vector<int>& Translator::hulls_of_mesh(int g) {
  const int mesh = m_->geom_dataid[g];
  const auto [found, fresh] = hulls_of_.try_emplace(mesh);
  std::vector<int>& indices = found->second;
  if (!fresh) return indices;
  const std::optional<Hull> whole = hull_of(g, mesh);
  if (!whole) return indices;
  for (Hull& hull : load_.decompose ? parts_of(g, mesh, *whole) : std::vector<Hull>{*whole}) {
    indices.push_back(static_cast<int>(model_.hulls.size()));
    model_.hulls.push_back(std::move(hull));
  }
  return indices;
}

// MuJoCo's hull of the mesh, in the frame that its geoms have.
std::optional<Hull> Translator::hull_of(int g, int mesh) {
  const std::string mesh_name = name(mjOBJ_MESH, mesh);
  if (m_->mesh_graphadr[mesh] < 0) {
    unsupported(mjOBJ_GEOM, g, fmt::format("collides, and its mesh '{}' has no convex hull", mesh_name),
                "give the mesh at least four points that are not in a plane", "leaves its contacts out");
    return std::nullopt;
  }
  const int* graph = m_->mesh_graph + m_->mesh_graphadr[mesh];
  const int vertices = graph[0], faces = graph[1];
  const int* vertex_of = graph + 2 + vertices;  // of the hull -> of the mesh
  const int* face_of = vertex_of + vertices + (vertices + 3 * faces);
  Hull hull;
  hull.name = mesh_name;
  std::vector<int> hull_vertex(static_cast<size_t>(m_->mesh_vertnum[mesh]), -1);
  for (int v = 0; v < vertices; ++v) {
    const float* p = row(m_->mesh_vert, 3, m_->mesh_vertadr[mesh] + vertex_of[v]);
    hull_vertex[static_cast<size_t>(vertex_of[v])] = v;
    hull.vertices.emplace_back(p[0], p[1], p[2]);
  }
  for (int f = 0; f < faces; ++f) {
    std::array<int, 3> face = {};
    for (int k = 0; k < 3; ++k) face[k] = hull_vertex.at(static_cast<size_t>(row(face_of, 3, f)[k]));
    hull.faces.push_back(face);
  }
  if (!closed_and_outward(hull)) {
    unsupported(mjOBJ_GEOM, g, fmt::format("has a mesh '{}' whose convex hull degenerates", mesh_name),
                "give the mesh a volume", "leaves its contacts out");
    return std::nullopt;
  }
  return hull;
}

// The parts of a concave mesh, in the same frame; the whole hull where it is nearly as small as they are together.
std::vector<Hull> Translator::parts_of(int g, int mesh, const Hull& whole) {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>> faces;
  for (int v = 0; v < m_->mesh_vertnum[mesh]; ++v) {
    const float* p = row(m_->mesh_vert, 3, m_->mesh_vertadr[mesh] + v);
    vertices.emplace_back(p[0], p[1], p[2]);
  }
  for (int f = 0; f < m_->mesh_facenum[mesh]; ++f) {
    const int* face = row(m_->mesh_face, 3, m_->mesh_faceadr[mesh] + f);
    faces.push_back({face[0], face[1], face[2]});
  }
  std::vector<Hull> parts;
  try {
    parts = decomposed(vertices, faces);
  } catch (const InputError& error) {
    const std::string text = error.what();
    const size_t mend = text.find("; ");
    unsupported(mjOBJ_GEOM, g, fmt::format("has a mesh '{}' that {}", whole.name, text.substr(0, mend)),
                mend == std::string::npos ? "" : text.substr(mend + 2), "keeps its one hull");
    return {whole};
  }
  std::erase_if(parts, [](const Hull& part) { return !closed_and_outward(part); });
  if (parts.size() < 2) return {whole};
  double sum = 0;
  for (size_t k = 0; k < parts.size(); ++k) {
    parts[k].name = fmt::format("{}_{}", whole.name, k + 1);
    sum += enclosed_volume(parts[k].vertices, parts[k].faces);
  }
  decomposed_.push_back(fmt::format("mesh '{}' is {} hulls with {:.0f} % of its one hull's volume", whole.name,
                                    parts.size(), 100 * sum / enclosed_volume(whole.vertices, whole.faces)));
  return parts;
}

int Translator::height_field(int h) {
  if (const auto found = height_field_of_.find(h); found != height_field_of_.end()) return found->second;
  const mjtNum* size = row(m_->hfield_size, 4, h);
  HeightField field;
  field.name = name(mjOBJ_HFIELD, h);
  field.rows = m_->hfield_nrow[h];
  field.columns = m_->hfield_ncol[h];
  field.half_x = size[0];
  field.half_y = size[1];
  field.base = size[3];
  const std::span data(m_->hfield_data + m_->hfield_adr[h], static_cast<size_t>(field.rows) * field.columns);
  for (const float height : data) field.heights.push_back(height * size[2]);
  model_.height_fields.push_back(std::move(field));
  return height_field_of_[h] = static_cast<int>(model_.height_fields.size()) - 1;
}

}  // namespace assay
