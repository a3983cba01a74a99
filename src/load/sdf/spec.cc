// The document that was read, as MuJoCo's spec.
#include <array>
#include <cmath>
#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "load/sdf.h"

namespace assay {
namespace {

void place(double* pos, double* quat, const Pose& X) {
  const std::array<double, 4> q = {X.q.w(), X.q.x(), X.q.y(), X.q.z()};
  for (int k = 0; k < 3; ++k) pos[k] = X.p[k];
  for (size_t k = 0; k < 4; ++k) quat[k] = q[k];
}

void set_line(mjString* info, int line) {
  if (line > 0) mjs_setString(info, fmt::format("line {}", line).c_str());
}

void add_sdf_joint(mjsBody* body, const SdfJoint& from) {
  using Type = SdfJoint::Type;
  if (from.type == Type::kFree) {
    set_line(mjs_addFreeJoint(body)->info, from.line);
    return;
  }
  mjsJoint* joint = mjs_addJoint(body, nullptr);
  mjs_setName(joint->element, from.name.c_str());
  set_line(joint->info, from.line);
  joint->type = from.type == Type::kBall ? mjJNT_BALL : from.type == Type::kSlide ? mjJNT_SLIDE : mjJNT_HINGE;
  for (int k = 0; k < 3; ++k) joint->pos[k] = from.p_BJ[k];
  for (int k = 0; k < 3; ++k) joint->axis[k] = from.axis_B[k];
  joint->limited = from.limited ? mjLIMITED_TRUE : mjLIMITED_FALSE;
  joint->range[0] = from.lower;
  joint->range[1] = from.upper;
  joint->stiffness[0] = from.stiffness;
  joint->springref = from.spring_reference;
  joint->damping[0] = from.damping;
  joint->frictionloss = from.dry_friction;
  const bool bounded = std::isfinite(from.effort) && from.effort > 0;
  joint->actfrclimited = bounded ? mjLIMITED_TRUE : mjLIMITED_FALSE;
  joint->actfrcrange[0] = bounded ? -from.effort : 0;
  joint->actfrcrange[1] = bounded ? from.effort : 0;
}

void add_sdf_shape(mjsBody* body, const SdfShape& from) {
  mjsGeom* geom = mjs_addGeom(body, nullptr);
  mjs_setName(geom->element, from.name.c_str());
  set_line(geom->info, from.line);
  place(geom->pos, geom->quat, from.X_BS);
  geom->contype = geom->conaffinity = from.bits;
  geom->friction[0] = from.friction;
  if (!from.mesh.empty()) {
    geom->type = mjGEOM_MESH;
    mjs_setString(geom->meshname, from.mesh.c_str());
  } else if (from.type == "box" || from.type == "ellipsoid") {
    geom->type = from.type == "box" ? mjGEOM_BOX : mjGEOM_ELLIPSOID;
    for (int k = 0; k < 3; ++k) geom->size[k] = from.type == "box" ? from.size[k] / 2 : from.size[k];
  } else if (from.type == "plane") {
    geom->type = mjGEOM_PLANE;
    geom->size[0] = geom->size[1] = 0;  // infinite
    geom->size[2] = 1;
  } else {
    geom->type = from.type == "sphere" ? mjGEOM_SPHERE : from.type == "capsule" ? mjGEOM_CAPSULE : mjGEOM_CYLINDER;
    geom->size[0] = from.size[0];
    geom->size[1] = from.size[1] / 2;
  }
}

}  // namespace

SpecPtr sdf_spec(const SdfDocument& document) {
  std::set<std::string> taken;  // names of equalities and sites
  const auto unique = [&taken](const std::string& name) {
    std::string result = name;
    for (int i = 2; !taken.insert(result).second; ++i) result = fmt::format("{}_{}", name, i);
    return result;
  };
  SpecPtr owner(mj_makeSpec());
  mjSpec* spec = owner.get();
  mjs_setString(spec->modelname, document.name.c_str());
  spec->compiler.degree = false;
  spec->compiler.autolimits = true;
  for (int k = 0; k < 3; ++k) spec->option.gravity[k] = document.gravity[k];
  for (const auto& [name, mesh] : document.parts.meshes) {
    mjs_setName(mjs_addMesh(spec, nullptr)->element, name.c_str());  // give_vertices() does the rest
  }
  std::vector<mjsBody*> bodies;
  mjsBody* world = mjs_findBody(spec, "world");
  for (const SdfBody& from : document.bodies) {
    mjsBody* body = mjs_addBody(from.parent < 0 ? world : bodies[static_cast<size_t>(from.parent)], nullptr);
    bodies.push_back(body);
    mjs_setName(body->element, from.name.c_str());
    set_line(body->info, from.line);
    place(body->pos, body->quat, from.X_PB);
    if (document.parts.inertia.contains(from.name) || document.parts.massless.contains(from.name)) {
      body->explicitinertial = true;
      body->mass = 1;
      for (int k = 0; k < 3; ++k) body->inertia[k] = 1;
    }
    for (const SdfJoint& joint : from.joints) add_sdf_joint(body, joint);
    for (const SdfShape& shape : from.shapes) add_sdf_shape(body, shape);
  }
  for (const SdfCoupling& from : document.couplings) {
    mjsEquality* equality = mjs_addEquality(spec, nullptr);
    mjs_setName(equality->element, unique(from.name).c_str());
    set_line(equality->info, from.line);
    equality->type = mjEQ_JOINT;
    mjs_setString(equality->name1, from.follower.c_str());
    mjs_setString(equality->name2, from.leader.c_str());
    for (double& value : equality->data) value = 0;
    equality->data[0] = from.offset;
    equality->data[1] = from.multiplier;
  }
  for (const SdfLoop& from : document.loops) {
    // a site of each body, so that the place does not depend on the pose in which MuJoCo compiles
    std::array<std::string, 2> names;
    for (size_t k = 0; k < 2; ++k) {
      const int b = k == 0 ? from.body_a : from.body_b;
      mjsSite* site = mjs_addSite(b < 0 ? world : bodies[static_cast<size_t>(b)], nullptr);
      names[k] = unique(fmt::format("{}:{}", from.name, k == 0 ? "a" : "b"));
      mjs_setName(site->element, names[k].c_str());
      place(site->pos, site->quat, k == 0 ? from.X_AJ : from.X_BJ);
    }
    mjsEquality* equality = mjs_addEquality(spec, nullptr);
    mjs_setName(equality->element, unique(from.name).c_str());
    set_line(equality->info, from.line);
    equality->type = from.weld ? mjEQ_WELD : mjEQ_CONNECT;
    equality->objtype = mjOBJ_SITE;
    mjs_setString(equality->name1, names[0].c_str());
    mjs_setString(equality->name2, names[1].c_str());
  }
  for (const auto& [a, b] : document.apart) {
    mjsExclude* exclude = mjs_addExclude(spec);
    mjs_setString(exclude->bodyname1, a.c_str());
    mjs_setString(exclude->bodyname2, b.c_str());
  }
  return owner;
}

}  // namespace assay
