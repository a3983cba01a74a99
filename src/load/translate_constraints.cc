// Equality constraints and fixed tendons.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/text.h"
#include "load/translator.h"

namespace assay {
namespace {

const char* equality_type_name(int type) {
  switch (type) {
    case mjEQ_CONNECT:
      return "connect";
    case mjEQ_WELD:
      return "weld";
    case mjEQ_JOINT:
      return "joint (in URDF: mimic)";
    case mjEQ_TENDON:
      return "tendon";
    default:
      return "flex";
  }
}

constexpr const char* kLeavesOut = "leaves it out";

// Adds terms of the same joint.
void add_terms(std::vector<JointTerm>& sum, const std::vector<JointTerm>& terms, double factor) {
  for (const JointTerm& term : terms) {
    const auto found = std::ranges::find(sum, term.joint, &JointTerm::joint);
    if (found == sum.end()) {
      sum.push_back({.joint = term.joint, .coefficient = factor * term.coefficient});
    } else {
      found->coefficient += factor * term.coefficient;
    }
  }
}

}  // namespace

// ---- tendons --------------------------------------------------------------------------------------------------------

std::optional<std::vector<JointTerm>> Translator::tendon_terms(int tendon) const {
  std::vector<JointTerm> terms;
  for (int w = m_->tendon_adr[tendon]; w < m_->tendon_adr[tendon] + m_->tendon_num[tendon]; ++w) {
    const int body = body_of_joint_[m_->wrap_objid[w]];
    if (body < 0 || model_.bodies[body].joint < 0) return std::nullopt;
    add_terms(terms, {{.joint = model_.bodies[body].joint, .coefficient = m_->wrap_prm[w]}}, 1);
  }
  return terms;
}

void Translator::translate_tendons() {
  for (int t = 0; t < m_->ntendon; ++t) {
    if (m_->tendon_type[t] != mjTENDON_FIXED) {
      unsupported(mjOBJ_TENDON, t, "is a spatial tendon, which is not supported",
                  "remove it, or put springs and actuators on the joints",
                  "leaves it out with the actuators that pull on it");
      continue;
    }
    const std::optional<std::vector<JointTerm>> terms = tendon_terms(t);
    if (!terms) {
      unsupported(mjOBJ_TENDON, t, "joins joints that do not move", "remove it", kLeavesOut);
      continue;
    }
    const bool springs = !disabled(mjDSBL_SPRING), dampers = !disabled(mjDSBL_DAMPER);
    if (dampers && !all_zero(row(m_->tendon_dampingpoly, mjNPOLY, t), mjNPOLY)) {
      unsupported(mjOBJ_TENDON, t, "has nonlinear damping, which is not supported", "give damping one number",
                  "keeps its linear part");
    }
    if (springs && !all_zero(row(m_->tendon_stiffnesspoly, mjNPOLY, t), mjNPOLY)) {
      unsupported(mjOBJ_TENDON, t, "has a nonlinear spring, which is not supported", "give stiffness one number",
                  "keeps its linear part");
    }
    if (springs && m_->tendon_springyield[t] != 0) {
      unsupported(mjOBJ_TENDON, t, "has a spring that yields, which is not supported", "remove springyield",
                  "lets the spring stay elastic");
    }
    if (m_->tendon_armature[t] != 0) {
      unsupported(mjOBJ_TENDON, t, "has armature, which is not supported", "give it to the joints instead",
                  "leaves its armature out");
    }
    Tendon tendon;
    tendon.name = name(mjOBJ_TENDON, t);
    if (tendon.name.empty()) tendon.name = fmt::format("tendon{}", t + 1);
    tendon.terms = *terms;
    if (springs) tendon.stiffness = m_->tendon_stiffness[t];
    if (tendon.stiffness != 0) {
      tendon.rest_lower = *row(m_->tendon_lengthspring, 2, t);
      tendon.rest_upper = row(m_->tendon_lengthspring, 2, t)[1];
    }
    if (dampers) tendon.damping = m_->tendon_damping[t];
    tendon.limited = m_->tendon_limited[t] && !disabled(mjDSBL_LIMIT) && !disabled(mjDSBL_CONSTRAINT);
    if (tendon.limited) {
      std::tie(tendon.lower, tendon.upper) =
          narrowed(mjOBJ_TENDON, t, row(m_->tendon_range, 2, t), m_->tendon_margin[t]);
      if (has_own_softness(row(m_->tendon_solref_lim, mjNREF, t), row(m_->tendon_solimp_lim, mjNIMP, t))) {
        soften(label(mjOBJ_TENDON, t));
      }
    }
    if (has_dry_friction()) tendon.dry_friction = m_->tendon_frictionloss[t];
    if (tendon.dry_friction != 0 &&
        has_own_softness(row(m_->tendon_solref_fri, mjNREF, t), row(m_->tendon_solimp_fri, mjNIMP, t))) {
      soften(label(mjOBJ_TENDON, t));
    }
    // one that only transmits an actuator's force is part of the actuator
    if (tendon.has_spring() || tendon.limited || tendon.dry_friction != 0) model_.tendons.push_back(std::move(tendon));
  }
}

// ---- equality -------------------------------------------------------------------------------------------------------

std::string Translator::equality_name(int e) {
  // URDF gives a mimic no name, and each joint has at most one
  const bool mimic = base_is_link_ && m_->eq_type[e] == mjEQ_JOINT;
  const std::string joint = mimic ? name(mjOBJ_JOINT, m_->eq_obj1id[e]) : "";
  return unique_name(name(mjOBJ_EQUALITY, e), joint.empty() ? fmt::format("equality{}", e + 1) : joint,
                     equality_names_);
}

void Translator::translate_equalities() {
  for (int e = 0; e < m_->neq; ++e) {
    if (disabled(mjDSBL_EQUALITY) || disabled(mjDSBL_CONSTRAINT) || !m_->eq_active0[e]) {
      note(fmt::format("{} is inactive and left out", label(mjOBJ_EQUALITY, e)));
      continue;
    }
    if (has_own_softness(row(m_->eq_solref, mjNREF, e), row(m_->eq_solimp, mjNIMP, e))) {
      soften(label(mjOBJ_EQUALITY, e));
    }
    switch (m_->eq_type[e]) {
      case mjEQ_JOINT:
        translate_joint_equality(e);
        break;
      case mjEQ_TENDON:
        translate_tendon_equality(e);
        break;
      case mjEQ_CONNECT:
      case mjEQ_WELD:
        translate_body_equality(e);
        break;
      default:
        unsupported(mjOBJ_EQUALITY, e, fmt::format("of type {} is not supported", equality_type_name(m_->eq_type[e])),
                    "remove it or give it active=\"false\"", kLeavesOut);
    }
  }
}

// position1 - reference1 = polynomial of (position2 - reference2)
void Translator::translate_joint_equality(int e) {
  const mjtNum* polynomial = row(m_->eq_data, mjNEQDATA, e);
  const int first = m_->eq_obj1id[e], second = m_->eq_obj2id[e];
  if (!all_zero(polynomial + 2, 3)) {
    unsupported(mjOBJ_EQUALITY, e, "couples two joints by a polynomial of higher degree, which is not supported",
                "give polycoef two numbers or remove it", "leaves it out, so that the joints move independently");
    return;
  }
  std::vector<JointTerm> zero_sum;
  double sum = polynomial[0];
  for (const auto& [joint, factor] : {std::pair{first, 1.0}, std::pair{second, -polynomial[1]}}) {
    if (joint < 0 || factor == 0) continue;
    const int body = body_of_joint_[joint];
    if (body < 0 || model_.bodies[body].joint < 0) {
      unsupported(mjOBJ_EQUALITY, e, fmt::format("couples {}, which does not move", label(mjOBJ_JOINT, joint)),
                  "remove it", kLeavesOut);
      return;
    }
    add_terms(zero_sum, {{.joint = model_.bodies[body].joint, .coefficient = 1}}, factor);
    sum += factor * m_->qpos0[m_->jnt_qposadr[joint]];
  }
  couple(e, zero_sum, sum);
}

// length1 - length1 at the reference = polynomial of the same for tendon 2
void Translator::translate_tendon_equality(int e) {
  const mjtNum* polynomial = row(m_->eq_data, mjNEQDATA, e);
  if (!all_zero(polynomial + 2, 3)) {
    unsupported(mjOBJ_EQUALITY, e, "couples two tendons by a polynomial of higher degree, which is not supported",
                "give polycoef two numbers or remove it", kLeavesOut);
    return;
  }
  std::vector<JointTerm> zero_sum;
  double sum = polynomial[0];
  for (const auto& [tendon, factor] : {std::pair{m_->eq_obj1id[e], 1.0}, std::pair{m_->eq_obj2id[e], -polynomial[1]}}) {
    if (tendon < 0 || factor == 0) continue;
    const bool fixed = m_->tendon_type[tendon] == mjTENDON_FIXED;
    const std::optional<std::vector<JointTerm>> terms = fixed ? tendon_terms(tendon) : std::nullopt;
    if (!terms) {
      unsupported(mjOBJ_EQUALITY, e, fmt::format("acts on {}, which is not supported", label(mjOBJ_TENDON, tendon)),
                  "remove it or give it active=\"false\"", kLeavesOut);
      return;
    }
    add_terms(zero_sum, *terms, factor);
    sum += factor * m_->tendon_length0[tendon];
  }
  couple(e, zero_sum, sum);
}

// The sum of the terms is held at `sum`: solved for the joint with the largest share, the first of equals.
void Translator::couple(int e, const std::vector<JointTerm>& zero_sum, double sum) {
  const auto share = [](const JointTerm& term) { return std::abs(term.coefficient); };
  const auto solved = std::ranges::max_element(zero_sum, {}, share);
  if (solved == zero_sum.end() || solved->coefficient == 0) {
    unsupported(mjOBJ_EQUALITY, e, "holds nothing: its coefficients cancel", "remove it", kLeavesOut);
    return;
  }
  Coupling coupling;
  coupling.name = equality_name(e);
  coupling.joint = solved->joint;
  coupling.offset = sum / solved->coefficient;
  for (const JointTerm& term : zero_sum) {
    if (term.joint == solved->joint || term.coefficient == 0) continue;
    coupling.terms.push_back({.joint = term.joint, .coefficient = -term.coefficient / solved->coefficient});
  }
  model_.couplings.push_back(std::move(coupling));
}

// connect and weld of two bodies or of two sites
void Translator::translate_body_equality(int e) {
  const bool weld = m_->eq_type[e] == mjEQ_WELD;
  const bool sites = m_->eq_objtype[e] == mjOBJ_SITE;
  const mjtNum* data = row(m_->eq_data, mjNEQDATA, e);
  std::array<int, 2> mujoco_body = {m_->eq_obj1id[e], m_->eq_obj2id[e]};
  std::array<Pose, 2> X_BC;  // the frames that are held together, in MuJoCo's bodies
  if (sites) {
    for (int k = 0; k < 2; ++k) {
      const int site = mujoco_body[k];
      X_BC[k] = {vec3(m_->site_pos, site), quat(m_->site_quat, site)};
      mujoco_body[k] = m_->site_bodyid[site];
    }
  } else if (weld) {
    X_BC[0] = {vec3(data + 3), quat(data + 6)};
    X_BC[1] = {vec3(data), Quat::Identity()};
  } else {
    X_BC[0].p = vec3(data);
    X_BC[1].p = vec3(data + 3);
  }
  std::array<int, 2> body = {};
  for (int k = 0; k < 2; ++k) {
    body[k] = body_of_[mujoco_body[k]];
    X_BC[k] = X_MB_[mujoco_body[k]] * X_BC[k];
  }
  if (body[0] == body[1]) {
    note(fmt::format("{} holds parts of one body together and is left out", label(mjOBJ_EQUALITY, e)));
    return;
  }
  const int a = body[0] == kWorld ? 1 : 0, b = 1 - a;
  // scales the turn's part of the constraint: without it only the points are held together
  const double torque_scale = weld ? data[10] : 1;
  if (torque_scale == 0) {
    note(fmt::format(
        "{} has torquescale=\"0\", so that it holds points and no orientation: it is written, exactly, as a "
        "connect",
        label(mjOBJ_EQUALITY, e)));
  } else if (torque_scale != 1) {
    unsupported(mjOBJ_EQUALITY, e,
                fmt::format("has torquescale=\"{}\", which is not supported", shortest(torque_scale)),
                "remove torquescale to hold the orientation rigidly, or make it 0 to leave it free",
                "holds the orientation rigidly");
  }
  if (weld && torque_scale != 0) {
    model_.welds.push_back(
        {.name = equality_name(e), .body_a = body[a], .body_b = body[b], .X_AB = X_BC[a] * X_BC[b].inverse()});
  } else {
    model_.connects.push_back(
        {.name = equality_name(e), .body_a = body[a], .body_b = body[b], .p_A = X_BC[a].p, .p_B = X_BC[b].p});
  }
}

}  // namespace assay
