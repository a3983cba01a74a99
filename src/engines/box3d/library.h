// Box3D's handles, and vectors from and to it.
#pragma once

#include <memory>

#include <box3d/box3d.h>
#include <box3d/collision.h>

#include "model/geometry.h"

namespace assay::box3d {

// One world. Box3D keeps all worlds of a process in one array, of at most 128.
class World {
 public:
  // Throws EngineError when there is no room for another.
  explicit World(const b3WorldDef& definition);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  b3WorldId id() const { return id_; }

 private:
  b3WorldId id_;
};

struct DestroyHull {
  void operator()(b3HullData* hull) const { b3DestroyHull(hull); }
};
using HullHandle = std::unique_ptr<b3HullData, DestroyHull>;

struct DestroyMesh {
  void operator()(b3MeshData* mesh) const { b3DestroyMesh(mesh); }
};
using MeshHandle = std::unique_ptr<b3MeshData, DestroyMesh>;

inline float real(double x) { return static_cast<float>(x); }

inline b3Vec3 b3_vector(const Vec3& v) { return {real(v.x()), real(v.y()), real(v.z())}; }
inline b3Pos b3_position(const Vec3& p) {
  using Number = decltype(b3Pos::x);
  return {static_cast<Number>(p.x()), static_cast<Number>(p.y()), static_cast<Number>(p.z())};
}
// Of length 1 in single precision, too.
inline b3Quat b3_rotation(const Quat& q) { return b3NormalizeQuat({b3_vector(q.vec()), real(q.w())}); }
inline b3Transform b3_transform(const Pose& X) { return {b3_vector(X.p), b3_rotation(X.q)}; }

template <typename Triple>  // b3Vec3 or b3Pos
Vec3 vec3(const Triple& v) {
  return {v.x, v.y, v.z};
}
inline Quat quat(const b3Quat& q) { return {q.s, q.v.x, q.v.y, q.v.z}; }

}  // namespace assay::box3d
