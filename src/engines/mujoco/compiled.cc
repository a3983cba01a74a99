#include "compiled.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "collision.h"
#include "convert.h"
#include "model/kinematics.h"
#include "model/weld_frames.h"
#include "options.h"
#include "release.h"
#include "tree.h"

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

void copy_softness(const Softness& soft, mjtNum* reference, mjtNum* impedance) {
  std::ranges::copy(soft.reference, reference);
  std::ranges::copy(soft.impedance, impedance);
}

std::string actuator_label(size_t actuator) { return fmt::format("actuator{}", actuator); }

std::string joint_label(size_t joint) { return fmt::format("joint{}", joint); }

// The settings that are needed all over.
struct Softnesses {
  explicit Softnesses(const Settings& settings)
      : contact(softness(settings, "contact")),
        limit(softness(settings, "limit")),
        equality(softness(settings, "equality")),
        dry_friction(dry_friction_softness(settings)) {}
  Softness contact, limit, equality, dry_friction;
};

// Builds the spec, and holds its elements by the model's numbers.
class Builder {
 public:
  Builder(const Model& model, const Settings& settings, bool explicit_springs)
      : model_(model),
        soft_(settings),
        compliance_(contact_compliance(settings)),
        explicit_springs_(explicit_springs),
        tree_(share_bodies(model)),
        spec_(mj_makeSpec()),
        world_(mjs_findBody(spec_.get(), "world")),
        bodies_(model.bodies.size(), nullptr),
        joints_(model.bodies.size(), nullptr) {
    spec_->compiler.degree = false;
    spec_->compiler.inertiafromgeom = mjINERTIAFROMGEOM_FALSE;
    spec_->compiler.usethread = false;
    set_options(settings, model.gravity, spec_->option);
    if (!kIslandsTakeCouplings && !model.couplings.empty()) set_islands(false, spec_->option);
    const bool listed = compliance_.is_set() || settings.get<std::string>("contact_pairs") == "explicit";
    const ContactPlan plan = plan_contacts(model, tree_, listed);
    if (!plan.filter_parents) spec_->option.disableflags |= mjDSBL_FILTERPARENT;
    for (size_t i = 0; i < model.bodies.size(); ++i) add_joint(static_cast<int>(i));
    add_shape_data(spec_.get(), model, plan);
    for (size_t i = 0; i < model.shapes.size(); ++i) {
      if (plan.shapes.contains(i)) add_shape(body(model.shapes[i].body), model, i, plan, soft_.contact);
    }
    add_pairs(spec_.get(), model, plan, soft_.contact);
    for (size_t i = 0; i < model.couplings.size(); ++i) add_coupling(i);
    for (const Connect& connect : model.connects) {
      add_hold(mjEQ_CONNECT, connect.body_a, {connect.p_A, Quat::Identity()}, connect.body_b,
               {connect.p_B, Quat::Identity()});
    }
    for (const Weld& weld : model.welds) {
      const WeldFrames frames = weld_frames(model, weld);
      add_hold(mjEQ_WELD, weld.body_a, frames.X_AS, weld.body_b, frames.X_BS);
    }
    for (size_t i = 0; i < model.tendons.size(); ++i) add_tendon(i);
    for (size_t i = 0; has_own_actuators(settings) && i < model.actuators.size(); ++i) add_actuator(i);
  }

  std::shared_ptr<const Compiled> compile() {
    auto compiled = std::make_shared<Compiled>();
    compiled->model = model_;
    compiled->explicit_springs = explicit_springs_;
    compiled->mujoco.reset(mj_compile(spec_.get(), nullptr));
    if (compiled->mujoco == nullptr) throw EngineError(fmt::format("MuJoCo: {}", one_line(mjs_getError(spec_.get()))));
    find_addresses(*compiled);
    set_what_a_spec_cannot_say(*compiled);
    return compiled;
  }

 private:
  mjsBody* body(int index) const { return index == kWorld ? world_ : bodies_[tree_.carrier[index]]; }

  // The joint of body `index`, after the MuJoCo body that it moves where that one is not there yet.
  void add_joint(int index) {
    const Body& own = model_.bodies[index];
    const int carrier = tree_.carrier[index];
    if (bodies_[carrier] == nullptr) bodies_[carrier] = add_body(carrier);
    mjsJoint* joint = mjs_addJoint(bodies_[carrier], nullptr);
    joints_[index] = joint;
    if (own.is_free()) {
      joint->type = mjJNT_FREE;
      joint->align = mjALIGNFREE_FALSE;
    } else if (own.ball >= 0) {
      set_ball(joint, model_.balls[own.ball], tree_.X_BC[index]);
    } else {
      set_name(joint, joint_label(own.joint));
      set_joint(joint, model_.joints[own.joint]);
      if (carrier != index) {
        const Pose X_CB = tree_.X_BC[index].inverse();
        Eigen::Map<Vec3>(joint->pos) = X_CB * model_.joints[own.joint].p_BJ;
        Eigen::Map<Vec3>(joint->axis) = X_CB.q * model_.joints[own.joint].axis_B;
      }
    }
  }

  mjsBody* add_body(int carrier) {
    const Pose& X_PC = tree_.X_PC[carrier];
    mjsBody* out = mjs_addBody(body(tree_.parent[carrier]), nullptr);
    set_name(out, body_label(carrier));
    Eigen::Map<Vec3>(out->pos) = X_PC.p;
    copy_quat(X_PC.q, out->quat);
    if (model_.bodies[carrier].is_massless()) {
      // MuJoCo's compiler takes no moving body without mass, its engine does
      out->explicitinertial = true;
      out->mass = 1;
      std::ranges::fill(out->inertia, 1);
      massless_.push_back(out);
    } else {
      set_inertia(out, model_.bodies[carrier]);
    }
    return out;
  }

  void set_joint(mjsJoint* out, const Joint& joint) const {
    out->type = joint.is_slide() ? mjJNT_SLIDE : mjJNT_HINGE;
    Eigen::Map<Vec3>(out->pos) = joint.p_BJ;
    Eigen::Map<Vec3>(out->axis) = joint.axis_B;
    out->ref = joint.reference;
    out->limited = joint.limited ? mjLIMITED_TRUE : mjLIMITED_FALSE;
    out->range[0] = joint.lower;
    out->range[1] = joint.lower < joint.upper ? joint.upper : joint.lower + 1;
    out->margin = 0;
    copy_softness(soft_.limit, out->solref_limit, out->solimp_limit);
    out->springref = joint.spring_reference;
    linear(out->stiffness) = explicit_springs_ ? 0 : joint.stiffness;
    linear(out->damping) = explicit_springs_ ? 0 : joint.damping;
    out->armature = joint.armature;
    out->frictionloss = joint.dry_friction;
    copy_softness(soft_.dry_friction, out->solref_friction, out->solimp_friction);
  }

  void set_ball(mjsJoint* out, const BallJoint& ball, const Pose& X_BC) const {
    out->type = mjJNT_BALL;
    Eigen::Map<Vec3>(out->pos) = X_BC.inverse() * ball.p_BJ;
    out->limited = ball.limited ? mjLIMITED_TRUE : mjLIMITED_FALSE;
    out->range[1] = ball.upper;
    out->margin = 0;
    copy_softness(soft_.limit, out->solref_limit, out->solimp_limit);
    linear(out->stiffness) = explicit_springs_ ? 0 : ball.stiffness;
    linear(out->damping) = explicit_springs_ ? 0 : ball.damping;
    out->armature = ball.armature;
    out->frictionloss = ball.dry_friction;
    copy_softness(soft_.dry_friction, out->solref_friction, out->solimp_friction);
  }

  mjsEquality* add_equality(mjtEq type) {
    mjsEquality* equality = mjs_addEquality(spec_.get(), nullptr);
    equality->type = type;
    copy_softness(soft_.equality, equality->solref, equality->solimp);
    return equality;
  }

  // MuJoCo counts positions in an equality from those at the reference.
  void add_coupling(size_t index) {
    const Coupling& coupling = model_.couplings[index];
    const std::vector<JointTerm>& terms = coupling.terms;
    double offset = coupling.offset - model_.joints[coupling.joint].reference;
    for (const JointTerm& term : terms) offset += term.coefficient * model_.joints[term.joint].reference;
    mjsEquality* equality = add_equality(terms.size() > 1 ? mjEQ_TENDON : mjEQ_JOINT);
    std::ranges::fill(equality->data, 0);
    equality->data[0] = offset;
    if (terms.size() > 1) {
      std::vector<JointTerm> difference = {{coupling.joint, 1}};
      for (const JointTerm& term : terms) difference.push_back({term.joint, -term.coefficient});
      const std::string name = fmt::format("coupling{}", index);
      add_path(difference, name);
      mjs_setString(equality->name1, name.c_str());
    } else {
      mjs_setString(equality->name1, joint_label(coupling.joint).c_str());
      if (!terms.empty()) {
        mjs_setString(equality->name2, joint_label(terms[0].joint).c_str());
        equality->data[1] = terms[0].coefficient;
      }
    }
  }

  // A connect or weld of a frame of one body to a frame of another.
  void add_hold(mjtEq type, int body_a, const Pose& X_AS, int body_b, const Pose& X_BS) {
    mjsEquality* equality = add_equality(type);
    equality->objtype = mjOBJ_SITE;
    mjs_setString(equality->name1, add_site(body_a, X_AS).c_str());
    mjs_setString(equality->name2, add_site(body_b, X_BS).c_str());
  }

  std::string add_site(int body_index, const Pose& X_BS) {
    std::string name = fmt::format("site{}", sites_++);
    mjsSite* site = mjs_addSite(body(body_index), nullptr);
    set_name(site, name);
    Eigen::Map<Vec3>(site->pos) = X_BS.p;
    copy_quat(X_BS.q, site->quat);
    return name;
  }

  // A fixed tendon, which names each joint once.
  mjsTendon* add_path(const std::vector<JointTerm>& terms, const std::string& name) {
    std::map<int, double> coefficients;
    for (const JointTerm& term : terms) coefficients[term.joint] += term.coefficient;
    mjsTendon* tendon = mjs_addTendon(spec_.get(), nullptr);
    set_name(tendon, name);
    for (const auto& [joint, coefficient] : coefficients) {
      mjs_wrapJoint(tendon, joint_label(joint).c_str(), coefficient);
    }
    return tendon;
  }

  void add_tendon(size_t index) {
    const Tendon& tendon = model_.tendons[index];
    const bool spring = tendon.has_spring() && !explicit_springs_;
    if (tendon.terms.empty() || (!spring && !tendon.limited && tendon.dry_friction == 0)) return;
    const std::string name = fmt::format("tendon{}", index);
    mjsTendon* out = add_path(tendon.terms, name);
    if (spring) {
      linear(out->stiffness) = tendon.stiffness;
      linear(out->damping) = tendon.damping;
      rests_.emplace_back(out, &tendon);
    }
    out->limited = tendon.limited ? mjLIMITED_TRUE : mjLIMITED_FALSE;
    out->range[0] = tendon.lower;
    out->range[1] = tendon.upper;
    out->margin = 0;
    copy_softness(soft_.limit, out->solref_limit, out->solimp_limit);
    out->frictionloss = tendon.dry_friction;
    copy_softness(soft_.dry_friction, out->solref_friction, out->solimp_friction);
  }

  // The law of the force alone: what multiplies its gain, controls with their clamps and activations, is given as ctrl,
  // so that it is the same for every engine and right from any time on.
  void add_actuator(size_t index) {
    const Actuator& actuator = model_.actuators[index];
    mjsActuator* out = mjs_addActuator(spec_.get(), nullptr);
    set_name(out, actuator_label(index));
    const bool single = actuator.terms.size() == 1;
    out->trntype = single ? mjTRN_JOINT : mjTRN_TENDON;
    if (single) {
      mjs_setString(out->target, joint_label(actuator.terms[0].joint).c_str());
      out->gear[0] = actuator.terms[0].coefficient;
    } else {
      const std::string path = fmt::format("transmission{}", index);
      add_path(actuator.terms, path);
      mjs_setString(out->target, path.c_str());
      out->gear[0] = 1;
    }
    out->gaintype = mjGAIN_FIXED;
    out->gainprm[0] = actuator.gain;
    out->biastype = mjBIAS_AFFINE;
    std::ranges::copy(actuator.bias, out->biasprm);
    out->ctrllimited = mjLIMITED_FALSE;
    out->forcelimited = actuator.force_limited ? mjLIMITED_TRUE : mjLIMITED_FALSE;
    out->forcerange[0] = actuator.force_lower;
    // MuJoCo's compiler takes no empty range
    out->forcerange[1] = actuator.force_lower < actuator.force_upper ? actuator.force_upper : actuator.force_lower + 1;
    actuators_.push_back(out);
  }

  void find_addresses(Compiled& compiled) const {
    const mjModel& m = *compiled.mujoco;
    compiled.body_id.assign(model_.bodies.size(), -1);
    compiled.body_qpos.assign(model_.bodies.size(), -1);
    compiled.body_dof.assign(model_.bodies.size(), -1);
    compiled.joint_id.resize(model_.joints.size());
    compiled.joint_qpos.resize(model_.joints.size());
    compiled.joint_dof.resize(model_.joints.size());
    compiled.balls.resize(model_.balls.size());
    for (size_t i = 0; i < model_.bodies.size(); ++i) {
      const Body& body = model_.bodies[i];
      if (!body.is_massless()) compiled.body_id[i] = mjs_getId(bodies_[i]->element);
      const int joint = mjs_getId(joints_[i]->element);
      const int qpos = m.jnt_qposadr[joint], dof = m.jnt_dofadr[joint];
      if (body.is_free()) {
        compiled.body_qpos[i] = qpos;
        compiled.body_dof[i] = dof;
      } else if (body.ball >= 0) {
        compiled.balls[body.ball] = {.qpos = qpos, .dof = dof, .q_BC = tree_.X_BC[i].q};
      } else {
        compiled.joint_id[body.joint] = joint;
        compiled.joint_qpos[body.joint] = qpos;
        compiled.joint_dof[body.joint] = dof;
      }
    }
    for (const mjsActuator* actuator : actuators_) {
      compiled.actuator_control.push_back(control_of(m, mjs_getId(actuator->element)));
    }
    compiled.shape_of_geom.assign(static_cast<size_t>(m.ngeom), -1);
    for (size_t s = 0; s < model_.shapes.size(); ++s) {
      const int geom = mj_name2id(&m, mjOBJ_GEOM, shape_label(s).c_str());
      if (geom >= 0) compiled.shape_of_geom[geom] = static_cast<int>(s);
    }
  }

  void set_what_a_spec_cannot_say(const Compiled& compiled) const {
    mjModel& m = *compiled.mujoco;
    if (!massless_.empty()) {
      for (const mjsBody* body : massless_) {
        const ptrdiff_t id = mjs_getId(body->element);
        m.body_mass[id] = 0;
        std::fill_n(m.body_inertia + 3 * id, 3, 0);
      }
      const DataPtr data(mj_makeData(&m));
      mj_setConst(&m, data.get());
    }
    for (size_t j = 0; j < model_.joints.size(); ++j) {
      const Joint& joint = model_.joints[j];
      if (joint.limited) m.jnt_range[ptrdiff_t{2} * compiled.joint_id[j] + 1] = joint.upper;  // may be the lower one
    }
    for (size_t i = 0; i < actuators_.size(); ++i) {
      const Actuator& actuator = model_.actuators[i];
      if (actuator.force_limited) {
        m.actuator_forcerange[ptrdiff_t{2} * mjs_getId(actuators_[i]->element) + 1] = actuator.force_upper;
      }
    }
    for (size_t b = 0; b < model_.balls.size(); ++b) {
      const BallAddress& address = compiled.balls[b];
      copy_quat(address.q_BC.conjugate() * model_.balls[b].spring_reference * address.q_BC,
                m.qpos_spring + address.qpos);
    }
    for (int p = 0; compliance_.is_set() && p < m.npair; ++p) {
      const auto inverse_mass = [&](int geom) { return m.body_invweight0[ptrdiff_t{2} * m.geom_bodyid[geom]]; };
      make_compliant(compliance_, inverse_mass(m.pair_geom1[p]) + inverse_mass(m.pair_geom2[p]),
                     m.pair_solref + ptrdiff_t{mjNREF} * p, m.pair_solimp + ptrdiff_t{mjNIMP} * p,
                     m.pair_solreffriction + ptrdiff_t{mjNREF} * p);
    }
    for (const auto& [tendon, own] : rests_) {  // a spec takes -1, -1 for the length at the reference
      mjtNum* rest = m.tendon_lengthspring + ptrdiff_t{2} * mjs_getId(tendon->element);
      rest[0] = own->rest_lower;
      rest[1] = own->rest_upper;
    }
  }

  const Model& model_;
  Softnesses soft_;
  ContactCompliance compliance_;
  bool explicit_springs_;
  Tree tree_;
  SpecPtr spec_;
  mjsBody* world_;
  std::vector<mjsBody*> bodies_;   // of carriers
  std::vector<mjsJoint*> joints_;  // by body
  std::vector<mjsActuator*> actuators_;
  std::vector<mjsBody*> massless_;  // carriers without mass
  std::vector<std::pair<const mjsTendon*, const Tendon*>> rests_;
  int sites_ = 0;
};

bool has_springs(const Model& model) {
  return model.has_springs() || std::ranges::any_of(model.balls, &BallJoint::has_spring) ||
         std::ranges::any_of(model.tendons, &Tendon::has_spring);
}

}  // namespace

std::shared_ptr<const Compiled> compile(const Model& model, const Settings& settings) {
  return Builder(model, settings, has_explicit_pd(settings) && has_springs(model)).compile();
}

}  // namespace assay::mujoco
