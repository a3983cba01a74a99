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
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include "controls/control.h"
#include "model/kinematics.h"
#include "model/mjcf.h"

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

// MuJoCo's coordinates as the uniform state; free bodies from MuJoCo's own centre of mass and velocity.
State state_of(const Mujoco& mujoco, const Model& model) {
  const mjModel* m = mujoco.m;
  const mjData* d = mujoco.d;
  State state;
  state.bodies.resize(model.bodies.size());
  state.position.resize(model.joints.size());
  state.velocity.resize(model.joints.size());
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const int b = mj_name2id(m, mjOBJ_BODY, body.name.c_str());
    const int j = m->body_jntadr[b];
    const mjtNum* q = d->qpos + m->jnt_qposadr[j];
    const mjtNum* v = d->qvel + m->jnt_dofadr[j];
    if (!body.is_free()) {
      state.position[body.joint] = q[0];
      state.velocity[body.joint] = v[0];
    } else {
      // not MuJoCo's xipos: the centre of what is fused, which is ours to know
      BodyState& s = state.bodies[i];
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
    const int b = mj_name2id(m, mjOBJ_BODY, body.name.c_str());
    const Pose X_WB = body_pose(body, state.bodies[i]);
    EXPECT_LT((X_WB.p - vec3(d->xpos, b)).norm(), 1e-12);
    EXPECT_LT(X_WB.q.angularDistance(quat(d->xquat, b)), 1e-7);  // sqrt of rounding
    std::array<mjtNum, 6> velocity = {};                         // angular, linear at the frame's origin, world axes
    mj_objectVelocity(m, d, mjOBJ_XBODY, b, velocity.data(), 0);
    EXPECT_LT((state.bodies[i].w_WB - vec3(velocity.data())).norm(), 1e-11);
    const Vec3 v_WBo = state.bodies[i].v_WBcm - state.bodies[i].w_WB.cross(state.bodies[i].p_WBcm - X_WB.p);
    EXPECT_LT((v_WBo - vec3(velocity.data() + 3)).norm(), 1e-11);
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

  // what the joints' springs and the actuators do
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const int joint = mj_name2id(m, mjOBJ_JOINT, model.joints[j].name.c_str());
    EXPECT_NEAR(spring_torque(model.joints[j], state.position[j], state.velocity[j]),
                d->qfrc_passive[m->jnt_dofadr[joint]], 1e-11);
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
      const int joint = mj_name2id(m, mjOBJ_JOINT, model.joints[j].name.c_str());
      EXPECT_NEAR(torques[j], d->qfrc_actuator[m->jnt_dofadr[joint]], 1e-11) << model.joints[j].name;
    }
  }
}

using Pairs = std::map<std::pair<std::string, std::string>, double>;  // geoms' names in order -> friction

Pairs touching(const Mujoco& mujoco) {
  const mjModel* m = mujoco.m;
  Pairs pairs;
  for (int i = 0; i < mujoco.d->ncon; ++i) {
    const mjContact& contact = mujoco.d->contact[i];
    const auto [g1, g2] = contact.geom;
    if (m->body_weldid[m->geom_bodyid[g1]] == m->body_weldid[m->geom_bodyid[g2]]) continue;  // cannot move apart
    const std::string a = mj_id2name(m, mjOBJ_GEOM, g1), b = mj_id2name(m, mjOBJ_GEOM, g2);
    pairs[std::minmax(a, b)] = contact.dim == 1 ? 0 : contact.friction[0];
  }
  return pairs;
}

Pairs declared(const Model& model) {
  Pairs pairs;
  for (const ContactPair& pair : model.contacts) {
    const std::string &a = model.shapes[pair.shape_a].name, &b = model.shapes[pair.shape_b].name;
    pairs[std::minmax(a, b)] = pair.friction;
  }
  return pairs;
}

// Random trees of named bodies: free, hinged, jointless; springs, references, actuators; shapes so large that any two
// that may touch do.
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
      text += fmt::format("<pair geom1='{}' geom2='{}' condim='{}' friction='{} {}'/>", a, b, chance(0.3) ? 1 : 3,
                          friction, friction);
    }
    text += "</contact>";
    if (!hinges_.empty()) text += "<actuator>" + actuators() + "</actuator>";
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

  std::string geom(const std::string& type, const std::string& size) {
    geoms_.push_back(fmt::format("geom{}", geoms_.size()));
    const int contype = chance(0.7) ? 1 : static_cast<int>(number(0, 8));
    const int conaffinity = chance(0.7) ? 1 : static_cast<int>(number(0, 8));
    const std::string place = type == "plane" ? "" : fmt::format("pos='{}' quat='{}'", vector(3, 0.3), vector(4, 1));
    return fmt::format(
        "<geom name='{}' type='{}' size='{}' {} contype='{}' conaffinity='{}' condim='{}' priority='{}' friction='{}' "
        "mass='{}'/>",
        geoms_.back(), type, size, place, contype, conaffinity, chance(0.2) ? 1 : 3, chance(0.2) ? 1 : 0,
        number(0.1, 2), number(0.5, 2));
  }

  std::string body(int depth) {
    const std::string name = fmt::format("body{}", bodies_.size() + 1);
    bodies_.push_back(name);
    std::string text = fmt::format("<body name='{}' pos='{}' quat='{}'>", name, vector(3, 0.5), vector(4, 1));
    const double kind = number(0, 1);
    if (depth == 0 && kind < 0.4) {
      text += "<freejoint/>";
    } else if (kind < 0.8) {
      hinges_.push_back(fmt::format("hinge{}", hinges_.size()));
      text += fmt::format(
          "<joint name='{}' pos='{}' axis='{}' ref='{}' springref='{}' stiffness='{}' damping='{}' armature='{}'/>",
          hinges_.back(), vector(3, 0.3), vector(3, 1), number(-1, 1), number(-1, 1), chance(0.5) ? number(0, 5) : 0,
          chance(0.5) ? number(0, 5) : 0, chance(0.5) ? number(0, 1) : 0);
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

  std::string actuators() {
    std::string text;
    for (int i = 0; i < 6; ++i) {
      const std::string common =
          fmt::format("name='actuator{}' joint='{}' gear='{}' {} {}", i, pick(hinges_), number(-3, 3),
                      chance(0.5) ? "ctrlrange='-0.5 1'" : "", chance(0.5) ? "forcerange='-0.7 0.4'" : "");
      switch (i % 3) {
        case 0:
          text += fmt::format("<motor {}/>", common);
          break;
        case 1:
          text += fmt::format("<position {} kp='{}' kv='{}'/>", common, number(0.1, 3), number(0, 2));
          break;
        default:
          text += fmt::format("<general {} gainprm='{}'/>", common, number(-3, 3));
      }
    }
    return text;
  }

  std::mt19937 random_;
  std::vector<std::string> bodies_, hinges_, geoms_;
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

}  // namespace
}  // namespace assay
