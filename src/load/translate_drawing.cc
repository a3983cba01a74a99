// Meshes that are drawn, and the places of the file's bodies.
#include <map>
#include <set>

#include "load/translator.h"

namespace assay {

void Translator::translate_drawing(Drawing& drawing) {
  for (int b = 0; b < m_->nbody; ++b) drawing.links[name(mjOBJ_BODY, b)] = {body_of_[b], X_MB_[b]};

  // a body's own pictures stand for its collision meshes
  std::set<int> has_picture;
  for (int g = 0; g < m_->ngeom; ++g) {
    if (m_->geom_type[g] == mjGEOM_MESH && !may_collide(g)) has_picture.insert(m_->geom_bodyid[g]);
  }
  std::map<int, int> index_of;  // MuJoCo mesh -> index into Drawing::meshes
  for (int g = 0; g < m_->ngeom; ++g) {
    const int b = m_->geom_bodyid[g];
    if (m_->geom_type[g] != mjGEOM_MESH || (may_collide(g) && has_picture.contains(b))) continue;
    DrawnPart part;
    part.body = body_of_[b];
    part.X_BS = X_MB_[b] * Pose{vec3(m_->geom_pos, g), quat(m_->geom_quat, g)};
    part.rgba = colour_of(g);
    if (part.rgba[3] == 0) continue;  // not seen
    const int mesh = m_->geom_dataid[g];
    const auto [found, fresh] = index_of.try_emplace(mesh, static_cast<int>(drawing.meshes.size()));
    part.mesh = found->second;
    drawing.parts.push_back(part);
    if (!fresh) continue;
    MeshData& data = drawing.meshes.emplace_back();
    for (int v = 0; v < m_->mesh_vertnum[mesh]; ++v) {
      const float* p = row(m_->mesh_vert, 3, m_->mesh_vertadr[mesh] + v);
      data.vertices.emplace_back(p[0], p[1], p[2]);
    }
    for (int f = 0; f < m_->mesh_facenum[mesh]; ++f) {
      const int* corners = row(m_->mesh_face, 3, m_->mesh_faceadr[mesh] + f);
      data.faces.push_back({corners[0], corners[1], corners[2]});
    }
  }
}

}  // namespace assay
