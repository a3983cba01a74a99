// Actuators on hinges, slides and fixed tendons, and the sines that assay adds to their controls.
#include <algorithm>
#include <cmath>
#include <span>

#include <fmt/format.h>

#include "base/text.h"
#include "load/translator.h"

namespace assay {
namespace {

constexpr const char* kNoForce = "leaves it out, so that it exerts no force";

const char* dynamics_name(int type) {
  switch (type) {
    case mjDYN_MUSCLE:
      return "a muscle's activation";
    case mjDYN_DCMOTOR:
      return "a motor's circuit";
    case mjDYN_PID:
      return "a PID controller";
    default:
      return "dynamics of its own";
  }
}

const char* transmission_name(int type) {
  switch (type) {
    case mjTRN_SLIDERCRANK:
      return "a slider-crank";
    case mjTRN_SITE:
      return "a site";
    case mjTRN_BODY:
      return "a body (adhesion)";
    default:
      return "an orientation";
  }
}

// The least and largest force that an actuator can exert, where it is bounded.
std::optional<std::pair<double, double>> force_bounds(const Actuator& actuator) {
  if (actuator.force_limited) return std::pair{actuator.force_lower, actuator.force_upper};
  const bool follows = !actuator.has_activation() && actuator.sine.amplitude == 0;
  if (!actuator.control_limited || actuator.has_feedback() || !follows) return std::nullopt;
  return std::minmax({actuator.gain * actuator.control_lower + actuator.bias[0],
                      actuator.gain * actuator.control_upper + actuator.bias[0]});
}

}  // namespace

void Translator::translate_actuators() {
  for (int i = 0; i < m_->nactuator; ++i) {
    if (disabled(mjDSBL_ACTUATION) || actuator_group_disabled(i)) {
      note(fmt::format("{} is disabled and left out", label(mjOBJ_ACTUATOR, i)));
      continue;
    }
    Actuator actuator;
    if (!acts_on(i, actuator) || !has_supported_law(i, actuator)) continue;
    actuator.name = name(mjOBJ_ACTUATOR, i);
    if (actuator.name.empty()) actuator.name = fmt::format("actuator{}", i + 1);
    const int control = m_->actuator_ctrladr[i];
    actuator.control_limited = m_->actuator_ctrllimited[control] && !disabled(mjDSBL_CLAMPCTRL);
    if (actuator.control_limited) {
      actuator.control_lower = *row(m_->actuator_ctrlrange, 2, control);
      actuator.control_upper = row(m_->actuator_ctrlrange, 2, control)[1];
    }
    actuator.force_limited = m_->actuator_forcelimited[i];
    if (actuator.force_limited) {
      actuator.force_lower = *row(m_->actuator_forcerange, 2, i);
      actuator.force_upper = row(m_->actuator_forcerange, 2, i)[1];
    }
    if (actuator.has_activation()) {
      actuator.activation_limited = m_->actuator_actlimited[i];
      if (actuator.activation_limited) {
        actuator.activation_lower = *row(m_->actuator_actrange, 2, i);
        actuator.activation_upper = row(m_->actuator_actrange, 2, i)[1];
      }
    }
    fold_inertia_and_damping(i, actuator);
    actuator_of_.push_back(i);
    model_.actuators.push_back(std::move(actuator));
  }
  fold_force_limits();
}

bool Translator::actuator_group_disabled(int i) const {
  const int group = m_->actuator_group[i];
  return group >= 0 && group < 31 && (m_->opt.disableactuator & (1 << group)) != 0;
}

// Fills the terms; false where the actuator acts on something else than hinges and slides.
bool Translator::acts_on(int i, Actuator& actuator) {
  const int transmission = m_->actuator_trntype[i];
  const int target = *row(m_->actuator_trnid, 2, i);
  const double gear = *row(m_->actuator_gear, 6, m_->actuator_outadr[i]);
  if (transmission == mjTRN_JOINT || transmission == mjTRN_JOINTINPARENT) {
    const int body = body_of_joint_[target];
    if (body < 0) return false;  // the joint is left out with a message
    if (model_.bodies[body].joint < 0) {
      unsupported(mjOBJ_ACTUATOR, i,
                  fmt::format("acts on {}, and only actuators on hinge joints, slide joints and fixed tendons are "
                              "supported",
                              label(mjOBJ_JOINT, target)),
                  "replace the joint by hinges or remove the actuator", kNoForce);
      return false;
    }
    actuator.terms = {{.joint = model_.bodies[body].joint, .coefficient = gear}};
    return true;
  }
  if (transmission == mjTRN_TENDON) {
    if (m_->tendon_type[target] != mjTENDON_FIXED) {
      unsupported(mjOBJ_ACTUATOR, i,
                  fmt::format("pulls on the spatial {}, which is not supported", label(mjOBJ_TENDON, target)),
                  "remove it", kNoForce);
      return false;
    }
    std::optional<std::vector<JointTerm>> terms = tendon_terms(target);
    if (!terms) return false;  // the tendon is left out with a message
    actuator.terms = std::move(*terms);
    for (JointTerm& term : actuator.terms) term.coefficient *= gear;
    return true;
  }
  unsupported(mjOBJ_ACTUATOR, i,
              fmt::format("acts on {}, and only actuators on hinge joints, slide joints and fixed tendons are "
                          "supported",
                          transmission_name(transmission)),
              "remove it", kNoForce);
  return false;
}

// Fills gain and bias; false where the force is no affine function of control, length and speed.
bool Translator::has_supported_law(int i, Actuator& actuator) {
  const mjtNum* gain = row(m_->actuator_gainprm, mjNGAIN, i);
  const mjtNum* bias = row(m_->actuator_biasprm, mjNBIAS, i);
  const int dynamics = m_->actuator_dyntype[i], gain_type = m_->actuator_gaintype[i],
            bias_type = m_->actuator_biastype[i];
  const bool fixed_gain = gain_type == mjGAIN_FIXED || (gain_type == mjGAIN_AFFINE && gain[1] == 0 && gain[2] == 0);
  const bool affine_bias = bias_type == mjBIAS_NONE || bias_type == mjBIAS_AFFINE;
  if (m_->actuator_plugin[i] >= 0 || !fixed_gain || !affine_bias || m_->actuator_ctrlnum[i] != 1) {
    const bool muscle = gain_type == mjGAIN_MUSCLE || bias_type == mjBIAS_MUSCLE;
    unsupported(mjOBJ_ACTUATOR, i,
                muscle ? "is a muscle, which is not supported"
                       : "has a force that is no affine function of control, length and velocity",
                "replace it by a motor, position, velocity or general actuator with a fixed gain", kNoForce);
    return false;
  }
  if (dynamics == mjDYN_FILTER || dynamics == mjDYN_FILTEREXACT) {
    actuator.time_constant = *row(m_->actuator_dynprm, mjNDYN, i);
    // MuJoCo takes none, or one below its smallest number, as no filter
    if (actuator.time_constant > mjMINVAL) actuator.activation = ActivationType::kFilter;
  } else if (dynamics == mjDYN_INTEGRATOR) {
    actuator.activation = ActivationType::kIntegrator;
  } else if (dynamics != mjDYN_NONE) {
    unsupported(mjOBJ_ACTUATOR, i, fmt::format("has {}, which is not supported", dynamics_name(dynamics)),
                "remove dyntype", kNoForce);
    return false;
  }
  if (m_->actuator_delay[i] != 0 || *row(m_->actuator_history, 2, i) != 0) {
    unsupported(mjOBJ_ACTUATOR, i, "has a delay, which is not supported", "remove it",
                "lets its force follow the control at once");
  }
  actuator.gain = gain[0];
  if (bias_type == mjBIAS_AFFINE) actuator.bias = {bias[0], bias[1], bias[2]};
  return true;
}

// An actuator's own armature and damping act on its joint, seen through the gear.
void Translator::fold_inertia_and_damping(int i, const Actuator& actuator) {
  const double armature = m_->actuator_armature[i];
  const double damping = disabled(mjDSBL_DAMPER) ? 0 : m_->actuator_damping[i];
  if (!disabled(mjDSBL_DAMPER) && !all_zero(row(m_->actuator_dampingpoly, mjNPOLY, i), mjNPOLY)) {
    unsupported(mjOBJ_ACTUATOR, i, "has nonlinear damping, which is not supported", "give damping one number",
                "keeps its linear part");
  }
  if (armature == 0 && damping == 0) return;
  if (m_->actuator_trntype[i] == mjTRN_TENDON) {
    unsupported(mjOBJ_ACTUATOR, i, "has armature or damping of its own on a tendon, which is not supported",
                "give them to the joints instead", "leaves both out");
    return;
  }
  const JointTerm& term = actuator.terms.front();
  Joint& joint = model_.joints[term.joint];
  joint.armature += term.coefficient * term.coefficient * armature;
  joint.damping += term.coefficient * term.coefficient * damping;
}

// actuatorfrcrange of a joint or a tendon (in URDF: effort) clamps the force of all its actuators together. Without
// any it has no effect.
void Translator::fold_force_limits() {
  for (int j = 0; j < m_->njnt; ++j) {
    if (!m_->jnt_actfrclimited[j] || body_of_joint_[j] < 0) continue;
    const int joint = model_.bodies[body_of_joint_[j]].joint;
    std::vector<std::pair<size_t, double>> acting;
    for (size_t i = 0; joint >= 0 && i < model_.actuators.size(); ++i) {
      const auto term = std::ranges::find(model_.actuators[i].terms, joint, &JointTerm::joint);
      if (term != model_.actuators[i].terms.end()) acting.emplace_back(i, term->coefficient);
    }
    fold_force_limit(mjOBJ_JOINT, j, row(m_->jnt_actfrcrange, 2, j), acting);
  }
  for (int t = 0; t < m_->ntendon; ++t) {
    if (!m_->tendon_actfrclimited[t]) continue;
    std::vector<std::pair<size_t, double>> acting;
    for (size_t i = 0; i < model_.actuators.size(); ++i) {
      const int actuator = actuator_of_[i];
      if (m_->actuator_trntype[actuator] != mjTRN_TENDON || *row(m_->actuator_trnid, 2, actuator) != t) continue;
      acting.emplace_back(i, *row(m_->actuator_gear, 6, m_->actuator_outadr[actuator]));
    }
    fold_force_limit(mjOBJ_TENDON, t, row(m_->tendon_actfrcrange, 2, t), acting);
  }
}

// `acting`: model actuators and what their force is multiplied by where it is clamped to `range`.
void Translator::fold_force_limit(mjtObj type, int id, const mjtNum* range,
                                  const std::vector<std::pair<size_t, double>>& acting) {
  if (acting.empty()) return;
  // one actuator that acts only there: a clamp of its force
  Actuator& single = model_.actuators[acting.front().first];
  if (acting.size() == 1 && (type == mjOBJ_TENDON || single.terms.size() == 1)) {
    const double gear = acting.front().second;
    if (gear == 0) return;
    double lower = range[0] / gear, upper = range[1] / gear;
    if (lower > upper) std::swap(lower, upper);
    // two clamps in a row equal one clamp to the first range clamped by the second
    if (single.force_limited) {
      lower = std::clamp(single.force_lower, lower, upper);
      upper = std::max(lower, std::min(single.force_upper, upper));
    }
    single.force_limited = true;
    single.force_lower = lower;
    single.force_upper = upper;
    return;
  }
  // several: the clamp never acts where their own limits keep the sum inside
  double least = 0, largest = 0;
  bool bounded = true;
  for (const auto& [i, coefficient] : acting) {
    const auto bounds = force_bounds(model_.actuators[i]);
    bounded = bounded && bounds.has_value();
    if (!bounds) continue;
    least += std::min(coefficient * bounds->first, coefficient * bounds->second);
    largest += std::max(coefficient * bounds->first, coefficient * bounds->second);
  }
  if (bounded && least >= range[0] && largest <= range[1]) return;
  unsupported(type, id, "limits the sum of several actuators' forces (actuatorfrcrange), which is not supported",
              "give each actuator a forcerange", "does not limit the sum");
}

// <numeric name="assay:sine:ACTUATOR" data="amplitude frequency phase"/>
void Translator::translate_sines() {
  constexpr std::string_view kOurs = "assay:", kSine = "assay:sine:";
  for (int n = 0; n < m_->nnumeric; ++n) {
    const std::string own = name(mjOBJ_NUMERIC, n);
    if (!own.starts_with(kOurs)) continue;
    if (!own.starts_with(kSine)) {
      refuse(mjOBJ_NUMERIC, n, "is not known to assay",
             "the only known name is assay:sine:ACTUATOR, correct or remove it");
      continue;
    }
    const std::string target = own.substr(kSine.size());
    const int actuator = mj_name2id(m_, mjOBJ_ACTUATOR, target.c_str());
    if (actuator < 0) {
      refuse(mjOBJ_NUMERIC, n, fmt::format("names the unknown actuator '{}'", target), "correct its name");
      continue;
    }
    const std::span<const mjtNum> data(m_->numeric_data + m_->numeric_adr[n], static_cast<size_t>(m_->numeric_size[n]));
    if (data.size() != 3 || !std::ranges::all_of(data, [](mjtNum value) { return std::isfinite(value); }) ||
        data[1] < 0) {
      refuse(mjOBJ_NUMERIC, n, "has other data than it needs",
             "give it three numbers: amplitude, frequency in Hz (not negative), phase in rad");
      continue;
    }
    const auto used = std::ranges::find(actuator_of_, actuator);
    if (used == actuator_of_.end()) continue;  // left out with a message
    Actuator& driven = model_.actuators[static_cast<size_t>(used - actuator_of_.begin())];
    if (driven.has_activation() && (driven.control_limited || driven.activation_limited)) {
      refuse(mjOBJ_NUMERIC, n,
             fmt::format("drives {}, whose activation follows a limited control", label(mjOBJ_ACTUATOR, actuator)),
             "remove its ctrlrange and actrange, or its dyntype");
      continue;
    }
    driven.sine = {data[0], data[1], data[2]};
  }
}

}  // namespace assay
