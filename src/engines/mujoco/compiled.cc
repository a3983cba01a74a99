#include "compiled.h"

#include <algorithm>

#include <fmt/format.h>

#include "collision.h"
#include "convert.h"
#include "model/kinematics.h"
#include "options.h"

namespace assay::mujoco {
namespace {

// Principal moments that MuJoCo takes: it refuses A + B < C, which the last digit of a flat body's moments may say.
Vec3 realizable(Vec3 moments) {
  Eigen::Index largest = 0;
  moments.maxCoeff(&largest);
  const double others = moments[(largest + 1) % 3] + moments[(largest + 2) % 3];
  if (moments[largest] > others && moments[largest] < others * (1 + 1e-14)) moments[largest] = others;
  return moments;
}

void set_inertia(mjsBody* out, const Body& body) {
  const PrincipalInertia principal = principal_inertia(body.I_BBcm_B);
  out->explicitinertial = true;
  out->mass = body.mass;
  Eigen::Map<Vec3>(out->ipos) = body.p_BBcm;
  copy_quat(principal.q_BI, out->iquat);
  Eigen::Map<Vec3>(out->inertia) = realizable(principal.diagonal);
}

void set_hinge(mjsJoint* joint, const Joint& hinge, const Softness& soft, bool explicit_springs) {
  joint->type = mjJNT_HINGE;
  Eigen::Map<Vec3>(joint->pos) = hinge.p_BJ;
  Eigen::Map<Vec3>(joint->axis) = hinge.axis_B;
  joint->ref = hinge.reference;
  joint->limited = hinge.limited ? mjLIMITED_TRUE : mjLIMITED_FALSE;
  joint->range[0] = hinge.lower;
  joint->range[1] = hinge.upper;
  joint->margin = 0;
  std::ranges::copy(soft.reference, joint->solref_limit);
  std::ranges::copy(soft.impedance, joint->solimp_limit);
  joint->springref = hinge.spring_reference;
  joint->stiffness[0] = explicit_springs ? 0 : hinge.stiffness;
  joint->damping[0] = explicit_springs ? 0 : hinge.damping;
  joint->armature = hinge.armature;
}

}  // namespace

std::shared_ptr<const Compiled> compile(const Model& model, const Settings& settings) {
  const SpecPtr spec(mj_makeSpec());
  spec->compiler.degree = false;
  spec->compiler.inertiafromgeom = mjINERTIAFROMGEOM_FALSE;
  spec->compiler.usethread = false;
  set_options(settings, model.gravity, spec->option);

  const ContactPlan plan = plan_contacts(model, settings.get<std::string>("contact_pairs") == "explicit");
  if (!plan.filter_parents) spec->option.disableflags |= mjDSBL_FILTERPARENT;
  const bool explicit_springs = has_explicit_pd(settings) && model.has_springs();
  const Softness contact = softness(settings, "contact");
  const Softness limit = softness(settings, "limit");

  mjsBody* world = mjs_findBody(spec.get(), "world");
  std::vector<mjsBody*> bodies;
  std::vector<mjsJoint*> joints;
  bodies.reserve(model.bodies.size());
  joints.reserve(model.bodies.size());
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    mjsBody* out = mjs_addBody(body.parent == kWorld ? world : bodies[body.parent], nullptr);
    mjs_setName(out->element, body_label(static_cast<int>(i)).c_str());
    Eigen::Map<Vec3>(out->pos) = body.X_PB.p;
    copy_quat(body.X_PB.q, out->quat);
    set_inertia(out, body);
    mjsJoint* joint = mjs_addJoint(out, nullptr);
    if (body.is_free()) {
      joint->type = mjJNT_FREE;
      joint->align = mjALIGNFREE_FALSE;
    } else {
      set_hinge(joint, model.joints[body.joint], limit, explicit_springs);
    }
    bodies.push_back(out);
    joints.push_back(joint);
  }
  for (size_t i = 0; i < model.shapes.size(); ++i) {
    const Shape& shape = model.shapes[i];
    if (plan.shapes.contains(i)) {
      add_shape(shape.body == kWorld ? world : bodies[shape.body], shape, i, plan.broad_phase, contact);
    }
  }
  add_pairs(spec.get(), model, plan, contact);

  auto compiled = std::make_shared<Compiled>();
  compiled->model = model;
  compiled->explicit_springs = explicit_springs;
  compiled->mujoco.reset(mj_compile(spec.get(), nullptr));
  if (compiled->mujoco == nullptr) throw EngineError(fmt::format("MuJoCo: {}", one_line(mjs_getError(spec.get()))));

  const mjModel& m = *compiled->mujoco;
  compiled->body_qpos.assign(model.bodies.size(), -1);
  compiled->body_dof.assign(model.bodies.size(), -1);
  compiled->hinge_joint.resize(model.joints.size());
  compiled->hinge_qpos.resize(model.joints.size());
  compiled->hinge_dof.resize(model.joints.size());
  compiled->body_id.reserve(bodies.size());
  for (size_t i = 0; i < bodies.size(); ++i) {
    compiled->body_id.push_back(mjs_getId(bodies[i]->element));
    const int joint = mjs_getId(joints[i]->element);
    const int hinge = model.bodies[i].joint;
    if (hinge < 0) {
      compiled->body_qpos[i] = m.jnt_qposadr[joint];
      compiled->body_dof[i] = m.jnt_dofadr[joint];
    } else {
      compiled->hinge_joint[hinge] = joint;
      compiled->hinge_qpos[hinge] = m.jnt_qposadr[joint];
      compiled->hinge_dof[hinge] = m.jnt_dofadr[joint];
    }
  }
  return compiled;
}

}  // namespace assay::mujoco
