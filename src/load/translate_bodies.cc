// Bodies and joints: what has no joint is fused into its parent, several joints in a body become a chain.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <Eigen/QR>
#include <fmt/format.h>

#include "base/text.h"
#include "load/translator.h"
#include "model/kinematics.h"

namespace assay {
namespace {

// These bodies, each the next one's parent, where the first one's parent is at rest.
Model alone_on_the_world(const Model& model, const std::vector<int>& chain) {
  Model alone;
  for (const int b : chain) {
    const int own = static_cast<int>(alone.bodies.size());
    Body body = model.bodies[static_cast<size_t>(b)];
    body.parent = own - 1;
    static_assert(kWorld == -1);
    if (body.joint >= 0) {
      alone.joints.push_back(model.joints[static_cast<size_t>(body.joint)]);
      alone.joints.back().body = own;
      body.joint = static_cast<int>(alone.joints.size()) - 1;
    }
    if (body.ball >= 0) {
      alone.balls.push_back(model.balls[static_cast<size_t>(body.ball)]);
      alone.balls.back().body = own;
      body.ball = static_cast<int>(alone.balls.size()) - 1;
    }
    alone.bodies.push_back(std::move(body));
  }
  return alone;
}

constexpr const char* kWithoutMargin = "takes the range without the margin";

// Mass, centre and inertia of rigidly joined parts, all in one body's axes.
struct MassPart {
  double mass = 0;
  Vec3 p = Vec3::Zero();
  Mat3 I = Mat3::Zero();  // about the part's own centre
};

MassPart joined(const std::vector<MassPart>& parts) {
  if (parts.size() == 1) return parts.front();  // no rounding where nothing is fused
  MassPart sum;
  for (const MassPart& part : parts) {
    sum.mass += part.mass;
    sum.p += part.mass * part.p;
  }
  if (sum.mass > 0) sum.p /= sum.mass;
  for (const MassPart& part : parts) {
    const Vec3 d = part.p - sum.p;
    sum.I += part.I + part.mass * (d.squaredNorm() * Mat3::Identity() - d * d.transpose());
  }
  return sum;
}

}  // namespace

// A mocap body stands where the initial state puts it, until a program moves it.
Pose Translator::pose_in_parent(int b) const {
  const std::optional<int> keyframe = initial_keyframe();
  return is_mocap(b) && keyframe ? mocap_pose(b, *keyframe) : Pose{vec3(m_->body_pos, b), quat(m_->body_quat, b)};
}

Pose Translator::mocap_pose(int b, int keyframe) const {
  const int row = keyframe * m_->nmocap + m_->body_mocapid[b];
  return {vec3(m_->key_mpos, row), quat(m_->key_mquat, row).normalized()};
}

void Translator::note_mocap_bodies() {
  std::vector<std::string> bodies, elsewhere;
  for (int b = 1; b < m_->nbody; ++b) {
    if (!is_mocap(b)) continue;
    bodies.push_back(label(mjOBJ_BODY, b));
    const Pose here = pose_in_parent(b);
    for (int k = 0; k < m_->nkey; ++k) {
      const Pose there = mocap_pose(b, k);
      constexpr double kSame = 1e-9;  // m or rad
      if ((here.p - there.p).norm() > kSame || here.q.angularDistance(there.q) > kSame) {
        elsewhere.push_back(fmt::format("{} in {}", bodies.back(), label(mjOBJ_KEY, k)));
      }
    }
  }
  note_list("mocap bodies stand still where they start, as in MuJoCo while no program moves them", bodies);
  note_list("keyframes that put mocap bodies elsewhere start with them where the initial state has them", elsewhere);
}

void Translator::translate_bodies() {
  const auto count = static_cast<size_t>(m_->nbody);
  frozen_.assign(count, false);
  body_of_.assign(count, kWorld);
  X_MB_.assign(count, Pose{});
  body_of_joint_.assign(static_cast<size_t>(m_->njnt), -1);
  freeze_points_of_flexes();
  freeze_weightless_leaves();

  std::vector<std::vector<MassPart>> parts;
  std::vector<std::string> fused;
  for (int b = 1; b < m_->nbody; ++b) {
    const int parent = m_->body_parentid[b];
    const Pose X_MpB = X_MB_[parent] * pose_in_parent(b);
    if (m_->body_jntnum[b] == 0 || frozen_[b]) {
      body_of_[b] = body_of_[parent];
      X_MB_[b] = X_MpB;
      const int host = body_of_[b];
      fused.push_back(fmt::format("{} into {}", label(mjOBJ_BODY, b),
                                  host == kWorld ? "the world" : fmt::format("'{}'", model_.bodies[host].name)));
    } else {
      add_moving_body(b, X_MpB);
      parts.resize(model_.bodies.size());
    }
    const int host = body_of_[b];
    if (const auto own = inertia_.find(name(mjOBJ_BODY, b)); host != kWorld && own != inertia_.end()) {
      const Mat3 R = X_MB_[b].q.toRotationMatrix();
      parts[host].push_back({own->second.mass, X_MB_[b] * own->second.p, R * own->second.I * R.transpose()});
    } else if (host != kWorld && m_->body_mass[b] > 0 && !massless_.contains(name(mjOBJ_BODY, b))) {
      const Pose X_MI = X_MB_[b] * Pose{vec3(m_->body_ipos, b), quat(m_->body_iquat, b)};
      const Mat3 R = X_MI.q.toRotationMatrix();
      parts[host].push_back({m_->body_mass[b], X_MI.p, R * vec3(m_->body_inertia, b).asDiagonal() * R.transpose()});
    }
  }
  if (model_.bodies.empty()) {
    if (m_->nbody == 1) {
      refuse("it has no bodies, and nothing in it can move",
             "name a file with bodies: some files get theirs from a program, which has to write them out first");
    } else {
      // in MJCF the option frees a body without moving parts only where it is the only one
      const bool can_float = base_is_link_ || std::count(m_->body_parentid + 1, m_->body_parentid + m_->nbody, 0) == 1;
      std::string mend = "give at least one body a <freejoint/> or a <joint/>";
      if (base_floats_) {
        mend =
            fmt::format("give its links an <inertial>{}: what has no mass cannot move freely",
                        base_is_link_ && m_->ngeom > 0
                            ? ", or the robot <mujoco><compiler inertiafromgeom=\"auto\"/></mujoco>, which takes the "
                              "mass of its collision shapes"
                            : "");
      } else if (can_float) {
        mend += ", or free it with --floating-base";
      }
      refuse("nothing in it can move", mend);
    }
    return;
  }
  note_list("bodies without a joint are fused, exactly", fused);

  for (size_t i = 0; i < model_.bodies.size(); ++i) {
    Body& body = model_.bodies[i];
    const MassPart whole = parts[i].empty() ? MassPart{} : joined(parts[i]);
    body.mass = whole.mass;
    body.p_BBcm = whole.p;
    body.I_BBcm_B = (whole.I + whole.I.transpose()) / 2;
  }
  require_mass();
  require_sound_chains();
}

void Translator::freeze_points_of_flexes() {
  const auto freeze = [this](int body) {
    if (body >= 0) frozen_[static_cast<size_t>(body)] = true;  // a point between nodes has none
  };
  for (int f = 0; f < m_->nflex; ++f) {
    for (int v = 0; v < m_->flex_vertnum[f]; ++v) freeze(m_->flex_vertbodyid[m_->flex_vertadr[f] + v]);
    for (int n = 0; n < m_->flex_nodenum[f]; ++n) freeze(m_->flex_nodebodyid[m_->flex_nodeadr[f] + n]);
  }
}

void Translator::freeze_weightless_leaves() {
  std::vector<bool> heavy(static_cast<size_t>(m_->nbody), false);  // has mass, or carries a body with mass
  for (int b = m_->nbody - 1; b > 0; --b) {
    if (m_->body_mass[b] > 0 && !massless_.contains(name(mjOBJ_BODY, b))) heavy[b] = true;
    if (heavy[b]) {
      heavy[m_->body_parentid[b]] = true;
    } else if (m_->body_jntnum[b] > 0 && !frozen_[b]) {
      unsupported(mjOBJ_BODY, b, "moves and has no mass, nor does anything on it",
                  "give it an <inertial> or a geom of positive size and density", "fixes it to its parent");
      frozen_[b] = true;
    }
  }
}

void Translator::add_moving_body(int b, const Pose& X_MpB) {
  const int joints = m_->body_jntnum[b];
  if (const int j = m_->body_jntadr[b]; m_->jnt_type[j] == mjJNT_FREE && !is_plain_free(j)) {
    add_sprung_free_body(b, j, X_MpB);
    return;
  }
  const std::string body_name = unique_name(name(mjOBJ_BODY, b), fmt::format("body{}", b), body_names_);
  int parent = body_of_[m_->body_parentid[b]];
  for (int k = 0; k < joints; ++k) {
    const int j = m_->body_jntadr[b] + k;
    examine_joint(j);
    Body body;
    body.parent = parent;
    if (k == 0) body.X_PB = X_MpB;
    if (k == joints - 1) {
      body.name = body_name;
    } else {
      const std::string joint = name(mjOBJ_JOINT, j);
      body.name =
          unique_name("", fmt::format("{}_{}", body_name, joint.empty() ? std::to_string(k + 1) : joint), body_names_);
    }
    add_joint(j, body);
    parent = add_body(std::move(body), b, j, k == joints - 1 ? body_of_[m_->body_parentid[b]] : kWorld);
  }
  body_of_[b] = parent;
}

int Translator::add_body(Body body, int b, int j, int weld_parent, int coordinate) {
  const int index = static_cast<int>(model_.bodies.size());
  model_.bodies.push_back(std::move(body));
  weld_parent_.push_back(weld_parent);
  joint_of_.push_back(j);
  coordinate_of_.push_back(coordinate);
  mujoco_body_.push_back(b);
  body_of_joint_[j] = index;
  return index;
}

// Whether a free joint has no spring, damper, armature and dry friction.
bool Translator::is_plain_free(int j) const {
  BallJoint all;  // the six coordinates have the same values
  translate_passive(j, all);
  return !all.has_spring() && all.armature == 0 && all.dry_friction == 0;
}

// The Model's free bodies have no springs and the like. MuJoCo's coordinates of a free joint are the frame's position
// in the world and its turn in the body's axes, so three slides along the world's axes and a ball are the same joint,
// exactly. At the reference the frame has the world's axes.
void Translator::add_sprung_free_body(int b, int j, const Pose& X_WB) {
  examine_joint(j);
  has_sprung_free_ = true;
  const std::string body_name = unique_name(name(mjOBJ_BODY, b), fmt::format("body{}", b), body_names_);
  const std::string own = name(mjOBJ_JOINT, j);
  const std::string joint_name = own.empty() ? unique_name("", body_name, joint_names_) : own;
  int parent = kWorld;
  for (int k = 0; k < 3; ++k) {
    const std::string suffix = fmt::format("_{}", "xyz"[k]);
    Joint slide;
    slide.name = unique_name("", joint_name + suffix, joint_names_);
    slide.type = JointType::kSlide;
    slide.body = static_cast<int>(model_.bodies.size());
    slide.axis_B = Vec3::Unit(k);
    slide.reference = X_WB.p[k];
    translate_passive(j, slide);
    if (slide.stiffness != 0) slide.spring_reference = m_->qpos_spring[m_->jnt_qposadr[j] + k];
    Body body;
    body.name = unique_name("", body_name + suffix, body_names_);
    body.parent = parent;
    if (k == 0) body.X_PB.p = X_WB.p;
    body.joint = static_cast<int>(model_.joints.size());
    model_.joints.push_back(std::move(slide));
    parent = add_body(std::move(body), b, j, kWorld, k);
  }
  BallJoint ball;
  ball.name = joint_name;
  ball.body = static_cast<int>(model_.bodies.size());
  translate_passive(j, ball);
  if (ball.stiffness != 0) ball.spring_reference = quat(m_->qpos_spring + m_->jnt_qposadr[j] + 3);
  Body body;
  body.name = body_name;
  body.parent = parent;
  body.ball = static_cast<int>(model_.balls.size());
  model_.balls.push_back(std::move(ball));
  body_of_[b] = add_body(std::move(body), b, j, kWorld, 3);
  note(
      fmt::format("{} has springs, damping, armature or dry friction: it is written, exactly, as three slides and a "
                  "ball joint",
                  label(mjOBJ_JOINT, j)));
}

template <typename AnyJoint>
void Translator::translate_passive(int j, AnyJoint& joint) const {
  const int dof = m_->jnt_dofadr[j];
  if (!disabled(mjDSBL_SPRING)) joint.stiffness = m_->jnt_stiffness[j];
  if (!disabled(mjDSBL_DAMPER)) joint.damping = m_->dof_damping[dof];
  joint.armature = m_->dof_armature[dof];
  if (has_dry_friction()) joint.dry_friction = m_->dof_frictionloss[dof];
}

// `body` becomes the next body; its joint gets the body's name where the file gives it none.
void Translator::add_joint(int j, Body& body) {
  const int index = static_cast<int>(model_.bodies.size());
  const auto joint_name = [&] {
    const std::string owner = name(mjOBJ_BODY, m_->jnt_bodyid[j]);
    return unique_name(name(mjOBJ_JOINT, j), owner.empty() ? body.name : owner, joint_names_);
  };
  if (m_->jnt_type[j] == mjJNT_BALL) {
    BallJoint ball;
    ball.name = joint_name();
    ball.body = index;
    translate_ball(j, ball);
    body.ball = static_cast<int>(model_.balls.size());
    model_.balls.push_back(std::move(ball));
  } else if (m_->jnt_type[j] != mjJNT_FREE) {
    Joint joint;
    joint.name = joint_name();
    joint.body = index;
    translate_scalar(j, joint);
    if (joint.limited) {
      std::tie(joint.lower, joint.upper) = narrowed(mjOBJ_JOINT, j, row(m_->jnt_range, 2, j), m_->jnt_margin[j]);
    }
    body.joint = static_cast<int>(model_.joints.size());
    model_.joints.push_back(std::move(joint));
  }
}

void Translator::translate_scalar(int j, Joint& joint) const {
  const int q = m_->jnt_qposadr[j];
  joint.type = m_->jnt_type[j] == mjJNT_SLIDE ? JointType::kSlide : JointType::kHinge;
  joint.p_BJ = vec3(m_->jnt_pos, j);
  joint.axis_B = vec3(m_->jnt_axis, j).normalized();
  joint.reference = m_->qpos0[q];
  joint.limited = limited(j);
  translate_passive(j, joint);
  if (joint.stiffness != 0) joint.spring_reference = m_->qpos_spring[q];
}

void Translator::translate_ball(int j, BallJoint& ball) {
  ball.p_BJ = vec3(m_->jnt_pos, j);
  ball.limited = limited(j);
  if (ball.limited) {
    const mjtNum* range = row(m_->jnt_range, 2, j);
    ball.upper = std::max(range[0], range[1]) - m_->jnt_margin[j];
    if (ball.upper < 0) {
      unsupported(mjOBJ_JOINT, j, "has a limit margin that is larger than its range", "remove margin", kWithoutMargin);
      ball.upper = std::max(range[0], range[1]);
    }
  }
  translate_passive(j, ball);
  if (ball.stiffness != 0) ball.spring_reference = quat(m_->qpos_spring + m_->jnt_qposadr[j]);
}

std::pair<double, double> Translator::narrowed(mjtObj type, int id, const mjtNum* range, double margin) {
  const double lower = range[0] + margin, upper = range[1] - margin;
  if (margin != 0 && lower > upper) {
    std::string unit;  // none for tendons, whose lengths mix both
    if (type == mjOBJ_JOINT) unit = m_->jnt_type[id] == mjJNT_SLIDE ? " m" : " rad";
    unsupported(type, id,
                fmt::format("has a limit margin of {}{}, more than half of its range", shortest(margin), unit),
                "remove the margin or widen the range", kWithoutMargin);
    return {range[0], range[1]};
  }
  return {lower, upper};
}

// Properties that the Model's joints do not have.
void Translator::examine_joint(int j) {
  const bool springs = !disabled(mjDSBL_SPRING), dampers = !disabled(mjDSBL_DAMPER);
  const int dof = m_->jnt_dofadr[j];
  if (dampers && !all_zero(row(m_->dof_dampingpoly, mjNPOLY, dof), mjNPOLY)) {
    unsupported(mjOBJ_JOINT, j, "has nonlinear damping, which is not supported", "give damping one number",
                "keeps its linear part");
  }
  if (springs && !all_zero(row(m_->jnt_stiffnesspoly, mjNPOLY, j), mjNPOLY)) {
    unsupported(mjOBJ_JOINT, j, "has a nonlinear spring, which is not supported", "give stiffness one number",
                "keeps its linear part");
  }
  if (springs && m_->jnt_springyield[j] != 0) {
    unsupported(mjOBJ_JOINT, j, "has a spring that yields, which is not supported", "remove springyield",
                "lets the spring stay elastic");
  }
  if (const mjtNum* range = row(m_->jnt_range, 2, j); !m_->jnt_limited[j] && range[0] > range[1]) {
    swapped_.push_back(label(mjOBJ_JOINT, j));
  }
  const bool soft_limit =
      limited(j) && has_own_softness(row(m_->jnt_solref, mjNREF, j), row(m_->jnt_solimp, mjNIMP, j));
  const bool soft_friction = has_dry_friction() && m_->dof_frictionloss[dof] != 0 &&
                             has_own_softness(row(m_->dof_solref, mjNREF, dof), row(m_->dof_solimp, mjNIMP, dof));
  if (soft_limit || soft_friction) soften(label(mjOBJ_JOINT, j));
}

// ---- what engines rely on ------------------------------------------------------------------------------------------

// A body has a positive mass and inertia, or it only composes joints and leads to exactly one other.
void Translator::require_mass() {
  std::vector<int> children(model_.bodies.size(), 0);
  for (const Body& body : model_.bodies) {
    if (body.parent != kWorld) ++children[body.parent];
  }
  for (size_t i = 0; i < model_.bodies.size(); ++i) {
    Body& body = model_.bodies[i];
    const int b = mujoco_body_[i];
    const bool finite = std::isfinite(body.mass) && body.I_BBcm_B.allFinite() && body.p_BBcm.allFinite();
    if (finite && body.mass == 0) {
      body.p_BBcm.setZero();
      body.I_BBcm_B.setZero();
      if (body.is_free()) {
        refuse(mjOBJ_BODY, b, "is free and has no mass of its own", "give it an <inertial>");
      } else if (children[i] != 1) {
        refuse(mjOBJ_BODY, b, fmt::format("has no mass and carries {} bodies by joints, where one can be", children[i]),
               "give it an <inertial>");
      }
      continue;
    }
    if (!finite || body.mass < 0 || principal_inertia(body.I_BBcm_B).diagonal.minCoeff() <= 0) {
      refuse(fmt::format("body '{}' has mass {} kg and needs a positive, finite mass and inertia", body.name,
                         shortest(body.mass)),
             "give it an <inertial> or a geom of positive size and density");
    }
  }
}

void Translator::require_sound_chains() {
  for (size_t i = 0; i < model_.bodies.size(); ++i) {
    if (model_.bodies[i].is_massless()) continue;
    std::vector<int> chain = {static_cast<int>(i)};
    while (true) {
      const int parent = model_.bodies[chain.front()].parent;
      if (parent == kWorld || !model_.bodies[parent].is_massless()) break;
      chain.insert(chain.begin(), parent);
    }
    if (chain.size() < 2 || model_.bodies[chain.front()].is_free() || !chain_is_singular(chain)) continue;
    refuse(mjOBJ_BODY, mujoco_body_[i],
           fmt::format("has {} joints in a row without mass between them, and not all of them move it independently",
                       chain.size()),
           "remove one of the joints, or put mass between them");
  }
}

// Whether the joints of the chain move its last body dependently in the reference configuration and in random ones.
bool Translator::chain_is_singular(const std::vector<int>& chain) const {
  constexpr int kSamples = 4;
  constexpr double kRelative = 1e-7;
  std::mt19937 random(1);  // NOLINT(bugprone-random-generator-seed): the same every time
  std::uniform_real_distribution<double> angle(-1, 1);
  const Model alone = alone_on_the_world(model_, chain);
  State state = reference_state(alone);
  for (int sample = 0; sample < kSamples; ++sample) {
    bodies_from_joints(alone, state);
    const Vec3 p = state.bodies.back().p_WBcm;
    std::vector<Eigen::Matrix<double, 6, 1>> columns;
    for (size_t b = 0; b < alone.bodies.size(); ++b) {
      const Body& body = alone.bodies[b];
      const Pose X_WB = body_pose(body, state.bodies[b]);
      if (body.ball >= 0) {
        const Vec3 arm = p - X_WB * alone.balls[static_cast<size_t>(body.ball)].p_BJ;
        for (int k = 0; k < 3; ++k) columns.emplace_back() << Vec3::Unit(k).cross(arm), Vec3::Unit(k);
        continue;
      }
      const Joint& joint = alone.joints[static_cast<size_t>(body.joint)];
      const Vec3 axis = X_WB.q * joint.axis_B;
      if (joint.is_slide()) {
        columns.emplace_back() << axis, Vec3::Zero();
      } else {
        columns.emplace_back() << axis.cross(p - X_WB * joint.p_BJ), axis;
      }
    }
    Eigen::MatrixXd jacobian(6, columns.size());
    for (size_t c = 0; c < columns.size(); ++c) jacobian.col(static_cast<Eigen::Index>(c)) = columns[c];
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(jacobian);
    qr.setThreshold(kRelative);
    if (qr.rank() == jacobian.cols()) return false;
    for (double& position : state.position) position += angle(random);
  }
  return true;
}

}  // namespace assay
