// The loader's and the kinematics' results against MuJoCo's own, on random trees and on the files of models/: where
// bodies are, how fast they move, their momenta and energy, which shapes may touch and with which friction, and the
// torques of springs and actuators.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <set>
#include <stdexcept>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include "base/errors.h"
#include "controls/control.h"
#include "load/mjcf.h"
#include "model/kinematics.h"

namespace assay {
namespace {

// MuJoCo's own model of a text, unfused, with energy computed.
class Mujoco {
 public:
  explicit Mujoco(const std::string& xml) {
    make([&](char* error, int size) { return mj_parseXMLString(xml.c_str(), nullptr, error, size); });
  }
  // A file needs its place, because what it includes lies beside it.
  struct File {
    std::filesystem::path path;
  };
  explicit Mujoco(const File& file) {
    make([&](char* error, int size) { return mj_parseXML(file.path.c_str(), nullptr, error, size); });
  }
  ~Mujoco() {
    mj_deleteData(d);
    mj_deleteModel(m);
  }
  Mujoco(const Mujoco&) = delete;
  Mujoco& operator=(const Mujoco&) = delete;

  void randomize(std::mt19937& random) const {
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < m->nq; ++i) d->qpos[i] = 2 * uniform(random);
    mj_normalizeQuat(m, d->qpos);
    for (int i = 0; i < m->nv; ++i) d->qvel[i] = 2 * uniform(random);
    for (int i = 0; i < m->nu; ++i) d->ctrl[i] = 2 * uniform(random);
    mj_forward(m, d);
    mj_subtreeVel(m, d);
  }

  mjModel* m = nullptr;
  mjData* d = nullptr;

 private:
  void make(const std::function<mjSpec*(char*, int)>& parse) {
    std::array<char, 1000> error = {};
    mjSpec* spec = parse(error.data(), static_cast<int>(error.size()));
    if (spec == nullptr) throw std::runtime_error(error.data());
    spec->compiler.fusestatic = false;
    m = mj_compile(spec, nullptr);
    if (m == nullptr) throw std::runtime_error(mjs_getError(spec));
    mj_deleteSpec(spec);
    m->opt.enableflags |= mjENBL_ENERGY;
    d = mj_makeData(m);
  }
};

Vec3 vec3(const mjtNum* array, std::ptrdiff_t row = 0) {
  const mjtNum* v = array + 3 * row;
  return {v[0], v[1], v[2]};
}
Quat quat(const mjtNum* array, std::ptrdiff_t row = 0) {
  const mjtNum* q = array + 4 * row;
  return {q[0], q[1], q[2], q[3]};
}

// MuJoCo's joint of a body of the model, which may be one of several in MuJoCo's body, or a part of a free one.
struct Coordinate {
  int joint = -1;
  int first = 0;  // of the joint's
};
Coordinate coordinate(const mjModel* m, const std::string& joint) {
  const int own = mj_name2id(m, mjOBJ_JOINT, joint.c_str());
  if (own >= 0) return {own, m->jnt_type[own] == mjJNT_FREE ? 3 : 0};
  // a slide that stands for a free joint's x, y or z
  return {mj_name2id(m, mjOBJ_JOINT, joint.substr(0, joint.size() - 2).c_str()), joint.back() - 'x'};
}
Coordinate coordinate(const Mujoco& mujoco, const Model& model, const Body& body) {
  const mjModel* m = mujoco.m;
  if (body.joint >= 0) return coordinate(m, model.joints[body.joint].name);
  if (body.ball >= 0) return coordinate(m, model.balls[body.ball].name);
  return {m->body_jntadr[mj_name2id(m, mjOBJ_BODY, body.name.c_str())], 0};
}
int dof(const mjModel* m, const std::string& joint) {
  const Coordinate at = coordinate(m, joint);
  return m->jnt_dofadr[at.joint] + at.first;
}

// MuJoCo's coordinates as the uniform state; free bodies and balls from MuJoCo's own orientations and velocities.
State state_of(const Mujoco& mujoco, const Model& model) {
  const mjModel* m = mujoco.m;
  const mjData* d = mujoco.d;
  State state;
  state.bodies.resize(model.bodies.size());
  state.position.resize(model.joints.size());
  state.velocity.resize(model.joints.size());
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const auto [j, first] = coordinate(mujoco, model, body);
    const mjtNum* q = d->qpos + m->jnt_qposadr[j] + first;
    const mjtNum* v = d->qvel + m->jnt_dofadr[j] + first;
    BodyState& s = state.bodies[i];
    if (body.joint >= 0) {
      state.position[body.joint] = q[0];
      state.velocity[body.joint] = v[0];
    } else if (body.ball >= 0) {
      // the trees have a ball only as the last joint of its body, so MuJoCo's body is this one
      const int b = m->jnt_bodyid[j];
      std::array<mjtNum, 6> velocity = {};
      mj_objectVelocity(m, d, mjOBJ_XBODY, b, velocity.data(), 0);
      s.q_WB = quat(d->xquat, b);
      s.w_WB = vec3(velocity.data());
    } else {
      // not MuJoCo's xipos: the centre of what is fused, which is ours to know
      s.q_WB = quat(q + 3);
      s.p_WBcm = vec3(q) + s.q_WB * body.p_BBcm;
      s.w_WB = s.q_WB * vec3(v + 3);
      s.v_WBcm = vec3(v) + s.w_WB.cross(s.q_WB * body.p_BBcm);
    }
  }
  bodies_from_joints(model, state);
  return state;
}

struct Mechanics {
  double kinetic = 0, potential = 0;
  Vec3 p = Vec3::Zero(), L = Vec3::Zero();  // L about the world's origin
};

Mechanics mechanics(const Model& model, const State& state) {
  Mechanics sum;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const BodyState& s = state.bodies[i];
    const Mat3 R = s.q_WB.toRotationMatrix();
    const Mat3 I_W = R * body.I_BBcm_B * R.transpose();
    sum.kinetic += 0.5 * body.mass * s.v_WBcm.squaredNorm() + 0.5 * s.w_WB.dot(I_W * s.w_WB);
    sum.potential -= body.mass * model.gravity.dot(s.p_WBcm);
    sum.p += body.mass * s.v_WBcm;
    sum.L += s.p_WBcm.cross(body.mass * s.v_WBcm) + I_W * s.w_WB;
  }
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const Joint& h = model.joints[j];
    sum.kinetic += 0.5 * h.armature * state.velocity[j] * state.velocity[j];
    sum.potential += 0.5 * h.stiffness * std::pow(state.position[j] - h.spring_reference, 2);
  }
  for (size_t b = 0; b < model.balls.size(); ++b) {
    const BallJoint& ball = model.balls[b];
    const Quat rotation = ball_rotation(model, state, static_cast<int>(b));
    sum.kinetic += 0.5 * ball.armature * ball_velocity(model, state, static_cast<int>(b)).squaredNorm();
    sum.potential += 0.5 * ball.stiffness * rotation_vector(ball.spring_reference.conjugate() * rotation).squaredNorm();
  }
  for (const Tendon& tendon : model.tendons) {
    const double length = sum_of_terms(tendon.terms, state.position);
    const double rest = std::clamp(length, tendon.rest_lower, tendon.rest_upper);
    sum.potential += 0.5 * tendon.stiffness * std::pow(length - rest, 2);
  }
  return sum;
}

bool is_static(const mjModel* m, int body) { return m->body_weldid[body] == 0; }

void compare_motion(const Mujoco& mujoco, const Model& model) {
  const mjModel* m = mujoco.m;
  const mjData* d = mujoco.d;
  const State state = state_of(mujoco, model);
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    SCOPED_TRACE(body.name);
    if (body.joint >= 0) {
      // also those of massless bodies, which MuJoCo has no frames of
      const int j = coordinate(mujoco, model, body).joint;
      const JointFrames frames = joint_frames(model, state, body.joint);
      if (m->jnt_type[j] != mjJNT_FREE) {
        EXPECT_LT((frames.p_WJ_parent - vec3(d->xanchor, j)).norm(), 1e-11);
        EXPECT_LT((frames.axis_W_parent - vec3(d->xaxis, j)).norm(), 1e-12);
      }
    }
    if (body.is_massless()) continue;
    const int b = mj_name2id(m, mjOBJ_BODY, body.name.c_str());
    const Pose X_WB = body_pose(body, state.bodies[i]);
    EXPECT_LT((X_WB.p - vec3(d->xpos, b)).norm(), 1e-11);
    EXPECT_LT(X_WB.q.angularDistance(quat(d->xquat, b)), 1e-7);  // sqrt of rounding
    std::array<mjtNum, 6> velocity = {};                         // angular, linear at the frame's origin, world axes
    mj_objectVelocity(m, d, mjOBJ_XBODY, b, velocity.data(), 0);
    EXPECT_LT((state.bodies[i].w_WB - vec3(velocity.data())).norm(), 1e-10);
    const Vec3 v_WBo = state.bodies[i].v_WBcm - state.bodies[i].w_WB.cross(state.bodies[i].p_WBcm - X_WB.p);
    EXPECT_LT((v_WBo - vec3(velocity.data() + 3)).norm(), 1e-10);
  }

  // sums over everything that moves, as MuJoCo has it
  Mechanics theirs;
  theirs.kinetic = d->energy[1];
  theirs.potential = d->energy[0];
  double moving_mass = 0;
  for (int b = 1; b < m->nbody; ++b) {
    if (is_static(m, b)) {
      theirs.potential += m->body_mass[b] * vec3(m->opt.gravity).dot(vec3(d->xipos, b));
      continue;
    }
    moving_mass += m->body_mass[b];
    if (!is_static(m, m->body_parentid[b])) continue;
    const Vec3 p = m->body_subtreemass[b] * vec3(d->subtree_linvel, b);
    theirs.p += p;
    theirs.L += vec3(d->subtree_angmom, b) + vec3(d->subtree_com, b).cross(p);
  }
  const Mechanics ours = mechanics(model, state);
  EXPECT_NEAR(model.total_mass(), moving_mass, 1e-12 * moving_mass);
  EXPECT_NEAR(ours.kinetic, theirs.kinetic, 1e-12 * theirs.kinetic);
  EXPECT_NEAR(ours.potential, theirs.potential, 1e-11 * (1 + std::abs(theirs.potential)));
  EXPECT_LT((ours.p - theirs.p).norm(), 1e-11 * (1 + theirs.p.norm()));
  EXPECT_LT((ours.L - theirs.L).norm(), 1e-11 * (1 + theirs.L.norm()));

  // what the springs of joints and tendons and the actuators do
  std::vector<double> passive(model.joints.size());
  for (size_t j = 0; j < model.joints.size(); ++j) {
    passive[j] = spring_torque(model.joints[j], state.position[j], state.velocity[j]);
  }
  for (const Tendon& tendon : model.tendons) {
    const double tension =
        tendon_tension(tendon, sum_of_terms(tendon.terms, state.position), sum_of_terms(tendon.terms, state.velocity));
    for (const JointTerm& term : tendon.terms) passive[term.joint] += term.coefficient * tension;
  }
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const int at = dof(m, model.joints[j].name);
    EXPECT_NEAR(passive[j], d->qfrc_passive[at], 1e-10);
    EXPECT_EQ(model.joints[j].dry_friction, m->dof_frictionloss[at]);
  }
  for (size_t b = 0; b < model.balls.size(); ++b) {
    const BallJoint& ball = model.balls[b];
    const int index = static_cast<int>(b);
    const int at = dof(m, ball.name);
    const Vec3 torque =
        ball_spring_torque(ball, ball_rotation(model, state, index), ball_velocity(model, state, index));
    EXPECT_LT((torque - vec3(d->qfrc_passive + at)).norm(), 1e-10);
    EXPECT_EQ(ball.dry_friction, m->dof_frictionloss[at]);
  }
  if (!model.actuators.empty()) {
    std::vector<double> torques(model.joints.size());
    std::vector<double> control;
    control.reserve(model.actuators.size());
    for (const Actuator& a : model.actuators) {
      control.push_back(d->ctrl[m->actuator_ctrladr[mj_name2id(m, mjOBJ_ACTUATOR, a.name.c_str())]]);
    }
    // MuJoCo knows nothing of the sines that assay adds to a control
    Model without_sines = model;
    for (Actuator& a : without_sines.actuators) a.sine = {};
    actuator_control(without_sines, control)->torques(state, torques);
    for (size_t j = 0; j < model.joints.size(); ++j) {
      EXPECT_NEAR(torques[j], d->qfrc_actuator[dof(m, model.joints[j].name)], 1e-10) << model.joints[j].name;
    }
  }
}

// geoms' names in order -> Coulomb, torsional and rolling friction
using Pairs = std::map<std::pair<std::string, std::string>, std::array<double, 3>>;

Pairs touching(const Mujoco& mujoco) {
  const mjModel* m = mujoco.m;
  Pairs pairs;
  for (int i = 0; i < mujoco.d->ncon; ++i) {
    const mjContact& contact = mujoco.d->contact[i];
    const auto [g1, g2] = contact.geom;
    if (m->body_weldid[m->geom_bodyid[g1]] == m->body_weldid[m->geom_bodyid[g2]]) continue;  // cannot move apart
    const std::string a = mj_id2name(m, mjOBJ_GEOM, g1), b = mj_id2name(m, mjOBJ_GEOM, g2);
    pairs[std::minmax(a, b)] = {contact.dim == 1 ? 0 : contact.friction[0], contact.dim < 4 ? 0 : contact.friction[2],
                                contact.dim < 6 ? 0 : contact.friction[3]};
  }
  return pairs;
}

Pairs declared(const Model& model) {
  Pairs pairs;
  for (const ContactPair& pair : model.contacts) {
    const std::string &a = model.shapes[pair.shape_a].name, &b = model.shapes[pair.shape_b].name;
    pairs[std::minmax(a, b)] = {pair.friction, pair.torsional, pair.rolling};
  }
  return pairs;
}

// Random trees of named bodies: free (plain or with springs), jointless, or with one to three hinges, slides and balls;
// springs, references, dry friction, fixed tendons, actuators, a keyframe; shapes so large that any two that may touch
// do.
class RandomTree {
 public:
  explicit RandomTree(unsigned seed) : random_(seed) {}

  std::string xml() {
    // every other tree keeps MuJoCo's exclusion of parent and child
    const char* filter = chance(0.5) ? "enable" : "disable";
    std::string text =
        fmt::format("<mujoco><compiler angle='radian'/><option><flag filterparent='{}'/></option><worldbody>", filter);
    text += geom("plane", "5 5 1");
    text += geom("sphere", "6");
    for (int i = 0; i < 3; ++i) text += body(0);
    text += "</worldbody><contact>";
    for (int i = 0; i < 2; ++i) {
      const std::string a = pick(bodies_), b = pick(bodies_);
      if (a != b) text += fmt::format("<exclude body1='{}' body2='{}'/>", a, b);
    }
    std::set<std::pair<std::string, std::string>> named;
    for (int i = 0; i < 3; ++i) {
      const std::string a = pick(geoms_), b = pick(geoms_);
      if (a == b || !named.insert(std::minmax(a, b)).second) continue;
      const double friction = number(0, 2);
      const double rolling = number(0.1, 1);
      text += fmt::format("<pair geom1='{}' geom2='{}' condim='{}' friction='{} {} {} {} {}'/>", a, b, condim(),
                          friction, friction, number(0.1, 1), rolling, rolling);
    }
    text += "</contact>";
    if (!joints_.empty()) {
      text += "<tendon>" + tendons() + "</tendon><actuator>" + actuators() + "</actuator>";
    }
    return text + "</mujoco>";
  }

 private:
  double number(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  bool chance(double p) { return number(0, 1) < p; }
  std::string pick(const std::vector<std::string>& from) {
    return from[std::uniform_int_distribution<size_t>(0, from.size() - 1)(random_)];
  }
  std::string vector(int count, double scale) {
    std::string text;
    for (int i = 0; i < count; ++i) text += fmt::format("{} ", number(-scale, scale));
    return text;
  }

  int condim() {
    const double kind = number(0, 1);
    if (kind < 0.2) return 1;
    if (kind < 0.6) return 3;
    return kind < 0.8 ? 4 : 6;
  }

  std::string geom(const std::string& type, const std::string& size) {
    geoms_.push_back(fmt::format("geom{}", geoms_.size()));
    const int contype = chance(0.7) ? 1 : static_cast<int>(number(0, 8));
    const int conaffinity = chance(0.7) ? 1 : static_cast<int>(number(0, 8));
    const std::string place = type == "plane" ? "" : fmt::format("pos='{}' quat='{}'", vector(3, 0.3), vector(4, 1));
    return fmt::format(
        "<geom name='{}' type='{}' size='{}' {} contype='{}' conaffinity='{}' condim='{}' priority='{}' "
        "friction='{} {} {}' mass='{}'/>",
        geoms_.back(), type, size, place, contype, conaffinity, condim(), chance(0.2) ? 1 : 0, number(0.1, 2),
        number(0.1, 1), number(0.1, 1), number(0.5, 2));
  }

  std::string body(int depth) {
    const std::string name = fmt::format("body{}", bodies_.size() + 1);
    bodies_.push_back(name);
    std::string text = fmt::format("<body name='{}' pos='{}' quat='{}'>", name, vector(3, 0.5), vector(4, 1));
    const double kind = number(0, 1);
    if (depth == 0 && kind < 0.4) {
      text += chance(0.5) ? "<freejoint/>" : fmt::format("<joint name='free{}' type='free' {}/>", name, passive());
    } else if (kind < 0.8) {
      const int joints = 1 + (chance(0.4) ? 1 : 0) + (chance(0.2) ? 1 : 0);
      for (int k = 0; k < joints; ++k) text += joint(k == joints - 1);
    }
    text += chance(0.5) ? geom("sphere", "6") : geom("capsule", "6 0.5");
    if (chance(0.5)) text += geom("sphere", "5");
    if (chance(0.3)) {
      text += fmt::format("<inertial pos='{}' quat='{}' mass='{}' diaginertia='{} {} {}'/>", vector(3, 0.4),
                          vector(4, 1), number(0.5, 2), number(1, 1.4), number(1, 1.4), number(1, 1.4));
    }
    const int children = depth >= 3 ? 0 : static_cast<int>(number(0, 2.5));
    for (int i = 0; i < children; ++i) text += body(depth + 1);
    return text + "</body>";
  }

  std::string passive() {
    return fmt::format("stiffness='{}' damping='{}' armature='{}' frictionloss='{}'", chance(0.5) ? number(0, 5) : 0,
                       chance(0.5) ? number(0, 5) : 0, chance(0.5) ? number(0, 1) : 0, chance(0.3) ? number(0, 1) : 0);
  }

  // MuJoCo wants a ball to be the last that turns.
  std::string joint(bool last) {
    const std::string place = vector(3, 0.3);
    const std::string common = fmt::format("pos='{}' {}", place, passive());
    if (last && chance(0.25)) return fmt::format("<joint name='ball{}' type='ball' {}/>", balls_++, common);
    joints_.push_back(fmt::format("joint{}", joints_.size()));
    return fmt::format("<joint name='{}' type='{}' axis='{}' ref='{}' springref='{}' {}/>", joints_.back(),
                       chance(0.35) ? "slide" : "hinge", vector(3, 1), number(-1, 1), number(-1, 1), common);
  }

  std::string tendons() {
    std::string text;
    for (int i = 0; i < 2; ++i) {
      text +=
          fmt::format("<fixed name='tendon{}' stiffness='{}' damping='{}' springlength='{} {}'>", i,
                      chance(0.7) ? number(0, 5) : 0, chance(0.5) ? number(0, 5) : 0, number(0, 0.5), number(0.5, 1));
      std::set<std::string> used;
      for (int k = 0; k < 3; ++k) {
        const std::string name = pick(joints_);
        if (used.insert(name).second) text += fmt::format("<joint joint='{}' coef='{}'/>", name, number(-2, 2));
      }
      text += "</fixed>";
    }
    return text;
  }

  std::string actuators() {
    std::string text;
    for (int i = 0; i < 10; ++i) {
      const std::string on =
          chance(0.3) ? fmt::format("tendon='tendon{}'", i % 2) : fmt::format("joint='{}'", pick(joints_));
      const std::string common =
          fmt::format("name='actuator{}' {} gear='{}' {} {}", i, on, number(-3, 3),
                      chance(0.5) ? "ctrlrange='-0.5 1'" : "", chance(0.5) ? "forcerange='-0.7 0.4'" : "");
      switch (i % 5) {
        case 0:
          text += fmt::format("<motor {}/>", common);
          break;
        case 1:
          text += fmt::format("<position {} kp='{}' kv='{}'/>", common, number(0.1, 3), number(0, 2));
          break;
        case 2:
          text += fmt::format("<velocity {} kv='{}'/>", common, number(0.1, 3));
          break;
        case 3:
          text += fmt::format("<general {} gainprm='{}' biastype='affine' biasprm='{}'/>", common, number(-3, 3),
                              vector(3, 2));
          break;
        default:
          text += fmt::format("<general {} gainprm='{}'/>", common, number(-3, 3));
      }
    }
    return text;
  }

  std::mt19937 random_;
  std::vector<std::string> bodies_, joints_, geoms_;
  int balls_ = 0;
};

class AgainstMujoco : public testing::TestWithParam<unsigned> {};

TEST_P(AgainstMujoco, RandomTreeMovesAndTouchesAlike) {
  const std::string xml = RandomTree(GetParam()).xml();
  SCOPED_TRACE(xml);
  const Mujoco mujoco(xml);
  if (mujoco.m->nv == 0) GTEST_SKIP() << "nothing moves in this tree";
  const Model model = load_model_text(xml, "tree");
  EXPECT_EQ(model.dof(), mujoco.m->nv);
  std::mt19937 random(GetParam());
  for (int i = 0; i < 3; ++i) {
    mujoco.randomize(random);
    compare_motion(mujoco, model);
    EXPECT_EQ(declared(model), touching(mujoco));
  }
}

TEST_P(AgainstMujoco, KeyframesAreItsStates) {
  RandomTree tree(GetParam());
  std::string xml = tree.xml();
  const Mujoco mujoco(xml);
  if (mujoco.m->nv == 0) GTEST_SKIP() << "nothing moves in this tree";
  std::mt19937 random(GetParam());
  mujoco.randomize(random);
  const auto numbers = [](const mjtNum* values, int count) {
    std::string text;
    for (int i = 0; i < count; ++i) text += fmt::format("{} ", values[i]);
    return text;
  };
  xml.insert(xml.rfind("</mujoco>"),
             fmt::format("<keyframe><key name='first'/><key name='second' qpos='{}' qvel='{}'/></keyframe>",
                         numbers(mujoco.d->qpos, mujoco.m->nq), numbers(mujoco.d->qvel, mujoco.m->nv)));
  const State theirs = state_of(mujoco, load_model_text(xml, "tree"));
  for (const char* keyframe : {"second", "1"}) {
    const State ours = load_model_text(xml, "tree", {.keyframe = keyframe}).initial;
    for (size_t i = 0; i < ours.bodies.size(); ++i) {
      EXPECT_LT((ours.bodies[i].p_WBcm - theirs.bodies[i].p_WBcm).norm(), 1e-11);
      EXPECT_LT(ours.bodies[i].q_WB.angularDistance(theirs.bodies[i].q_WB), 1e-7);
      EXPECT_LT((ours.bodies[i].v_WBcm - theirs.bodies[i].v_WBcm).norm(), 1e-10);
      EXPECT_LT((ours.bodies[i].w_WB - theirs.bodies[i].w_WB).norm(), 1e-10);
    }
  }
  EXPECT_THROW(load_model_text(xml, "tree", {.keyframe = "third"}), InputError);
  EXPECT_THROW(load_model_text(xml, "tree", {.keyframe = "2"}), InputError);
}

INSTANTIATE_TEST_SUITE_P(Seeds, AgainstMujoco, testing::Range(1U, 41U));

TEST(AgainstMujoco, FilesOfModelsMoveAlike) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(ASSAY_MODELS)) {
    if (entry.path().extension() != ".xml") continue;
    SCOPED_TRACE(entry.path());
    ++files;
    const Model model = load_model(entry.path());
    const Mujoco mujoco(Mujoco::File{entry.path()});
    std::mt19937 random(1);  // NOLINT(bugprone-random-generator-seed): the same every time
    mujoco.randomize(random);
    compare_motion(mujoco, model);
    // every keyframe is MuJoCo's
    for (size_t k = 0; k < model.keyframes.size(); ++k) {
      mj_resetDataKeyframe(mujoco.m, mujoco.d, static_cast<int>(k));
      mj_forward(mujoco.m, mujoco.d);
      const State theirs = state_of(mujoco, model);
      for (size_t i = 0; i < model.bodies.size(); ++i) {
        EXPECT_LT((theirs.bodies[i].p_WBcm - model.keyframes[k].state.bodies[i].p_WBcm).norm(), 1e-14);
        EXPECT_LT((theirs.bodies[i].v_WBcm - model.keyframes[k].state.bodies[i].v_WBcm).norm(), 1e-14);
      }
    }
  }
  EXPECT_GE(files, 4);
}

// ---- constraints ----------------------------------------------------------------------------------------------------

// Largest violation of MuJoCo's equality constraints.
double open_by(const Mujoco& mujoco) {
  double largest = 0;
  for (int i = 0; i < mujoco.d->nefc; ++i) {
    if (mujoco.d->efc_type[i] == mjCNSTR_EQUALITY) largest = std::max(largest, std::abs(mujoco.d->efc_pos[i]));
  }
  return largest;
}

TEST(AgainstMujoco, CouplingsHoldWhatItHolds) {
  const std::string xml =
      "<mujoco><worldbody>"
      "<body><joint name='a' ref='0.3'/><geom size='0.1'/>"
      "<body pos='1 0 0'><joint name='b' type='slide' ref='-0.2'/><geom size='0.1'/>"
      "<body pos='1 0 0'><joint name='c' ref='0.1'/><geom size='0.1'/>"
      "<body pos='1 0 0'><joint name='d'/><geom size='0.1'/></body></body></body></body></worldbody>"
      "<tendon><fixed name='s'><joint joint='a' coef='2'/><joint joint='b' coef='-1'/></fixed>"
      "<fixed name='t'><joint joint='b' coef='0.5'/><joint joint='c' coef='3'/></fixed></tendon>"
      "<equality>{}</equality></mujoco>";
  for (const char* equality : {"<joint joint1='a' joint2='b' polycoef='0.1 1.7'/>", "<joint joint1='a'/>",
                               "<joint joint1='d' joint2='c' polycoef='0 -1'/>", "<joint joint1='b' polycoef='0.4 1'/>",
                               "<tendon tendon1='s' tendon2='t' polycoef='0.2 0.6'/>", "<tendon tendon1='t'/>"}) {
    SCOPED_TRACE(equality);
    const std::string text = fmt::format(fmt::runtime(xml), equality);
    const Mujoco mujoco(text);
    const Model model = load_model_text(text, "coupled");
    ASSERT_EQ(model.couplings.size(), 1U);
    const Coupling& coupling = model.couplings[0];
    std::mt19937 random(3);  // NOLINT(bugprone-random-generator-seed): the same every time
    for (int i = 0; i < 3; ++i) {
      mujoco.randomize(random);
      EXPECT_GT(open_by(mujoco), 1e-3);
      const State state = state_of(mujoco, model);
      const int joint = mj_name2id(mujoco.m, mjOBJ_JOINT, model.joints[coupling.joint].name.c_str());
      mujoco.d->qpos[mujoco.m->jnt_qposadr[joint]] = coupling.offset + sum_of_terms(coupling.terms, state.position);
      mj_forward(mujoco.m, mujoco.d);
      EXPECT_LT(open_by(mujoco), 1e-12);
    }
  }
}

// A constant control's activation: MuJoCo's exact filter and its integrator step it without an error.
TEST(AgainstMujoco, ActivationsFollowAsItsDo) {
  const std::string xml =
      "<mujoco><option timestep='0.01' gravity='0 0 0'/><worldbody><body><joint name='j' damping='1'/><geom "
      "size='0.1'/>"
      "</body></worldbody><actuator><position name='filter' joint='j' kp='2' kv='0.1' timeconst='0.3' ctrlrange='-1 "
      "1'/>"
      "<intvelocity name='integrator' joint='j' kp='1' actrange='-0.5 0.5'/>"
      "<general name='limited' joint='j' dyntype='filterexact' dynprm='0.1' actlimited='true' actrange='0 0.4'/>"
      "</actuator><keyframe><key act='0.2 -0.1 0.3' ctrl='5 0.7 1'/></keyframe></mujoco>";
  const Mujoco mujoco(xml);
  const Model model = load_model_text(xml, "test");
  mj_resetDataKeyframe(mujoco.m, mujoco.d, 0);
  const std::unique_ptr<Control> control = actuator_control(model);
  std::vector<double> torque(1);
  for (int i = 0; i < 200; ++i) {
    mj_forward(mujoco.m, mujoco.d);
    for (size_t a = 0; a < 3; ++a) {
      EXPECT_NEAR(actuator_input(model.actuators[a], model.control0[a], mujoco.d->time), mujoco.d->act[a], 1e-12);
    }
    State state = state_of(mujoco, model);
    state.time = mujoco.d->time;
    control->torques(state, torque);
    EXPECT_NEAR(torque[0], mujoco.d->qfrc_actuator[0], 1e-12);
    mj_step(mujoco.m, mujoco.d);
  }
}

TEST(AgainstMujoco, ConnectAndWeldHoldWhatItHolds) {
  // bodies inside others without joints, so that what is held lies in fused bodies
  const std::string xml =
      "<mujoco><worldbody><site name='anchor' pos='0.3 0.2 0.1' euler='5 6 7'/>"
      "<body name='wall' pos='1 1 1' euler='10 20 30'/>"
      "<body name='a' pos='0.5 0 0' euler='40 10 20'><freejoint/><geom size='0.1'/>"
      "<body name='tip' pos='0.1 0.2 0.3' euler='30 40 50'><geom size='0.1'/><site name='s' pos='0 0.1 0' euler='1 2 "
      "3'/>"
      "</body></body>"
      "<body name='b' pos='0 2 0' euler='11 12 13'><freejoint/><geom size='0.1'/>"
      "<body name='hand' pos='-0.1 0.2 0' euler='3 4 50'><geom size='0.1'/><site name='t' pos='0.4 0 0'/></body></body>"
      "</worldbody><equality>{}</equality></mujoco>";
  const auto pose = [](const Model& model, int body) {
    return body == kWorld ? Pose{} : body_pose(model.bodies[body], model.initial.bodies[body]);
  };
  for (const char* equality :
       {"<weld body1='tip' body2='hand' relpose='0.1 0.2 0.3 0.5 0.5 -0.5 0.5' anchor='0.3 0 0.1'/>",
        "<weld body1='tip' body2='hand' relpose='0.1 0.2 0.3 0.5 0.5 -0.5 0.5' anchor='0.3 0 0.1' torquescale='0'/>",
        "<weld site1='s' site2='t' torquescale='0'/>", "<weld body1='tip' body2='hand'/>", "<weld body1='a'/>",
        "<weld body1='wall' body2='hand'/>", "<weld site1='s' site2='t'/>", "<weld site1='anchor' site2='t'/>",
        "<connect body1='tip' body2='hand' anchor='0.1 0.2 0.3'/>", "<connect body1='hand' anchor='0.1 0.2 0.3'/>",
        "<connect site1='s' site2='t'/>", "<connect site1='anchor' site2='s'/>"}) {
    SCOPED_TRACE(equality);
    const std::string text = fmt::format(fmt::runtime(xml), equality);
    const Mujoco mujoco(text);
    const Model model = load_model_text(text, "held");
    ASSERT_EQ(model.welds.size() + model.connects.size(), 1U);
    // move the free body that the constraint names first to where it holds
    const bool weld = !model.welds.empty();
    const int a = weld ? model.welds[0].body_a : model.connects[0].body_a;
    const Pose X_WB = pose(model, weld ? model.welds[0].body_b : model.connects[0].body_b);
    ASSERT_NE(a, kWorld);
    Pose X_WA = pose(model, a);
    if (weld) {
      X_WA = X_WB * model.welds[0].X_AB.inverse();
    } else {
      X_WA.p += X_WB * model.connects[0].p_B - X_WA * model.connects[0].p_A;
    }
    mj_resetData(mujoco.m, mujoco.d);
    const int joint = coordinate(mujoco, model, model.bodies[a]).joint;
    mjtNum* q = mujoco.d->qpos + mujoco.m->jnt_qposadr[joint];
    std::copy_n(X_WA.p.data(), 3, q);
    const Quat& o = X_WA.q;
    const std::array<double, 4> turn = {o.w(), o.x(), o.y(), o.z()};
    std::ranges::copy(turn, q + 3);
    mj_forward(mujoco.m, mujoco.d);
    EXPECT_LT(open_by(mujoco), 1e-12);
    q[0] += 0.1;
    mj_forward(mujoco.m, mujoco.d);
    EXPECT_GT(open_by(mujoco), 0.01);
  }
}

// ---- margins --------------------------------------------------------------------------------------------------------

// MuJoCo's contacts act where distance < margin: the inflated shapes touch at the same place.
TEST(AgainstMujoco, MarginsInflateShapes) {
  const std::string xml =
      "<mujoco><worldbody><geom name='floor' type='plane' size='1 1 1' margin='0.02' euler='10 20 0'/>"
      "<body name='a' pos='0.1 0.2 0.3'><freejoint/><geom name='ball' size='0.35' margin='0.03'/></body>"
      "<body name='b' pos='0.3 0.2 0.9'><freejoint/><geom name='other' size='0.25' margin='0.05'/></body></worldbody>"
      "</mujoco>";
  const Mujoco mujoco(xml);
  const Model model = load_model_text(xml, "margins");
  mj_forward(mujoco.m, mujoco.d);
  int compared = 0;
  for (const ContactPair& pair : model.contacts) {
    const Shape &a = model.shapes[pair.shape_a], &b = model.shapes[pair.shape_b];
    const auto pose = [&](const Shape& shape) {
      return shape.body == kWorld ? shape.X_BS
                                  : body_pose(model.bodies[shape.body], model.initial.bodies[shape.body]) * shape.X_BS;
    };
    const Pose X_WA = pose(a), X_WB = pose(b);
    const double ours = a.type == ShapeType::kPlane ? (X_WA.q * Vec3(0, 0, 1)).dot(X_WB.p - X_WA.p) - b.radius
                                                    : (X_WA.p - X_WB.p).norm() - a.radius - b.radius;
    for (int i = 0; i < mujoco.d->ncon; ++i) {
      const mjContact& contact = mujoco.d->contact[i];
      const std::set<std::string> theirs = {mj_id2name(mujoco.m, mjOBJ_GEOM, contact.geom[0]),
                                            mj_id2name(mujoco.m, mjOBJ_GEOM, contact.geom[1])};
      if (theirs != std::set<std::string>{a.name, b.name}) continue;
      EXPECT_NEAR(ours, contact.dist - contact.includemargin, 1e-12);
      ++compared;
    }
  }
  EXPECT_EQ(compared, 2);
}

// ---- hulls ----------------------------------------------------------------------------------------------------------

TEST(AgainstMujoco, HullsHoldEveryVertexAndItsVolume) {
  std::mt19937 random(5);  // NOLINT(bugprone-random-generator-seed): the same every time
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto cloud = [&](int count) {
    std::string text;
    for (int i = 0; i < 3 * count; ++i) text += fmt::format("{} ", uniform(random));
    return text;
  };
  const std::string cube = "0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1 0.5 0.5 0.5 0.5 0.5 0 0.5 0 0.5";
  for (const std::string& points : {cube, cloud(8), cloud(40), cloud(400)}) {
    const std::string xml = fmt::format(
        "<mujoco><asset><mesh name='m' vertex='{}' scale='0.5 1 2' inertia='convex'/></asset><worldbody>"
        "<geom type='plane' size='1 1 1'/><body name='b' pos='1 2 3'><freejoint/>"
        "<geom name='g' type='mesh' mesh='m' pos='0.1 0.2 0.3' euler='10 20 30' density='1'/>"
        "<geom type='mesh' mesh='m' mass='0'/></body></worldbody></mujoco>",
        points);
    const Mujoco mujoco(xml);
    const Model model = load_model_text(xml, "hull");
    ASSERT_EQ(model.hulls.size(), 1U);  // one for both geoms
    ASSERT_EQ(model.shapes.size(), 3U);
    const Hull& hull = model.hulls[0];
    double volume = 0;
    std::vector<bool> used(hull.vertices.size(), false);
    for (const auto& face : hull.faces) {
      const Vec3 &a = hull.vertices[face[0]], &b = hull.vertices[face[1]], &c = hull.vertices[face[2]];
      volume += a.dot(b.cross(c)) / 6;
      for (const int v : face) used[v] = true;
      const Vec3 normal = (b - a).cross(c - a).normalized();
      for (int v = 0; v < mujoco.m->mesh_vertnum[0]; ++v) {
        const float* p = mujoco.m->mesh_vert + 3 * static_cast<std::ptrdiff_t>(v);
        EXPECT_LT(normal.dot(Vec3(p[0], p[1], p[2]) - a), 1e-5);
      }
    }
    EXPECT_THAT(used, testing::Each(true));
    EXPECT_NEAR(volume, model.total_mass(), 1e-5 * volume);
    // the hull lies where MuJoCo's geom does
    mj_forward(mujoco.m, mujoco.d);
    const int g = mj_name2id(mujoco.m, mjOBJ_GEOM, "g");
    const Shape& shape = model.shapes[1];
    const Pose X_WS = body_pose(model.bodies[0], model.initial.bodies[0]) * shape.X_BS;
    EXPECT_LT((X_WS.p - vec3(mujoco.d->geom_xpos, g)).norm(), 1e-12);
    EXPECT_LT((X_WS.q.toRotationMatrix() - Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(
                                               mujoco.d->geom_xmat + 9 * static_cast<std::ptrdiff_t>(g)))
                  .norm(),
              1e-12);
  }
}

}  // namespace
}  // namespace assay
