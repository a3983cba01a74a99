// Every feature of the adapter against the same model written as MJCF and stepped by MuJoCo itself.
#include <cmath>
#include <memory>
#include <random>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include "engines/registry.h"
#include "model/kinematics.h"
#include "model/weld_frames.h"

namespace assay {
namespace {

using Settings = std::map<std::string, std::string>;

std::string text(const Vec3& v) { return fmt::format("{:.17g} {:.17g} {:.17g}", v.x(), v.y(), v.z()); }
std::string text(const Quat& q) { return fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}", q.w(), q.x(), q.y(), q.z()); }

class Random {
 public:
  explicit Random(int seed) : engine_(seed) {}
  double in(double low, double high) { return std::uniform_real_distribution(low, high)(engine_); }
  int below(int count) { return std::uniform_int_distribution(0, count - 1)(engine_); }
  bool coin() { return below(2) == 0; }
  Vec3 vector(double size) { return {in(-size, size), in(-size, size), in(-size, size)}; }
  Vec3 direction() { return vector(1).normalized(); }
  Quat rotation() { return Quat(in(-1, 1), in(-1, 1), in(-1, 1), in(-1, 1)).normalized(); }

 private:
  std::mt19937 engine_;
};

// A model in assay's words and in MJCF's.
struct Twin {
  Model model;
  std::string bodies, rest;  // inside worldbody; after it

  std::string mjcf() const {
    return fmt::format(
        "<mujoco><compiler angle='radian' inertiafromgeom='false' autolimits='false'/><worldbody>{}</worldbody>{}"
        "</mujoco>",
        bodies, rest);
  }
};

// Adds hinge or slide number `model.joints.size()` of body `index`; returns its element.
std::string add_joint(Model& model, Random& random, int index, bool slide) {
  Joint joint;
  joint.name = fmt::format("j{}", model.joints.size());
  joint.body = index;
  joint.type = slide ? JointType::kSlide : JointType::kHinge;
  joint.p_BJ = random.vector(0.1);
  joint.axis_B = random.direction();
  joint.reference = random.in(-0.3, 0.3);
  joint.limited = random.coin();
  joint.lower = joint.reference - 0.2;
  joint.upper = joint.reference + 0.3;
  joint.stiffness = random.in(0, 3);
  joint.spring_reference = random.in(-0.2, 0.2);
  joint.damping = random.in(0, 0.3);
  joint.armature = random.in(0, 0.05);
  joint.dry_friction = random.coin() ? random.in(0, 0.4) : 0;
  model.bodies[index].joint = static_cast<int>(model.joints.size());
  model.joints.push_back(joint);
  return fmt::format(
      "<joint name='{}' type='{}' pos='{}' axis='{}' ref='{:.17g}' limited='{}' range='{:.17g} {:.17g}' "
      "stiffness='{:.17g}' springref='{:.17g}' damping='{:.17g}' armature='{:.17g}' frictionloss='{:.17g}'/>",
      joint.name, slide ? "slide" : "hinge", text(joint.p_BJ), text(joint.axis_B), joint.reference,
      joint.limited ? "true" : "false", joint.lower, joint.upper, joint.stiffness, joint.spring_reference,
      joint.damping, joint.armature, joint.dry_friction);
}

std::string add_ball(Model& model, Random& random, int index) {
  BallJoint ball;
  ball.name = fmt::format("ball{}", model.balls.size());
  ball.body = index;
  ball.p_BJ = random.vector(0.1);
  ball.limited = random.coin();
  ball.upper = 0.3;
  ball.stiffness = random.in(0, 2);
  ball.damping = random.in(0, 0.2);
  ball.armature = random.in(0, 0.02);
  ball.dry_friction = random.coin() ? random.in(0, 0.1) : 0;
  model.bodies[index].ball = static_cast<int>(model.balls.size());
  model.balls.push_back(ball);
  return fmt::format(
      "<joint name='{}' type='ball' pos='{}' limited='{}' range='0 {}' stiffness='{:.17g}' damping='{:.17g}' "
      "armature='{:.17g}' frictionloss='{:.17g}'/>",
      ball.name, text(ball.p_BJ), ball.limited ? "true" : "false", ball.upper, ball.stiffness, ball.damping,
      ball.armature, ball.dry_friction);
}

// A tree of `count` MJCF bodies with up to three joints each.
Twin random_tree(int seed, int count) {
  Random random(seed);
  Twin twin;
  Model& model = twin.model;
  std::vector<std::string> open(count), parents(count);  // elements of each MJCF body
  std::vector<int> last(count), above(count, -1);        // its body with mass; its parent
  for (int b = 0; b < count; ++b) {
    const bool free = b == 1;
    above[b] = b < 2 ? -1 : random.below(b);
    const int parent = above[b] < 0 ? kWorld : last[above[b]];
    const Pose X_PB = {random.vector(0.4), random.rotation()};
    const double mass = random.in(0.5, 2);
    const Vec3 p_BBcm = random.vector(0.1);
    const Mat3 R = random.rotation().toRotationMatrix();
    const Mat3 I =
        R * Vec3(random.in(0.01, 0.02), random.in(0.01, 0.02), random.in(0.012, 0.02)).asDiagonal() * R.transpose();
    std::string joints;
    const int joint_count = free ? 1 : 1 + random.below(3);
    const int ball_at = free || random.coin() ? -1 : random.below(joint_count);
    for (int j = 0; j < joint_count; ++j) {
      const int index = static_cast<int>(model.bodies.size());
      Body body;
      body.name = fmt::format("b{}_{}", b, j);
      body.parent = j == 0 ? parent : index - 1;
      if (j == 0) body.X_PB = X_PB;
      body.I_BBcm_B.setZero();
      if (j == joint_count - 1) {
        body.mass = mass;
        body.p_BBcm = p_BBcm;
        body.I_BBcm_B = I;
      }
      model.bodies.push_back(body);
      if (free) {
        joints += "<freejoint align='false'/>";
      } else if (j == ball_at) {
        joints += add_ball(model, random, index);
      } else {
        // MuJoCo has no rotation after a ball joint
        joints += add_joint(model, random, index, random.coin() || (ball_at >= 0 && j > ball_at));
      }
      last[b] = index;
    }
    const PrincipalInertia principal = principal_inertia(I);
    open[b] = fmt::format(
        "<body name='b{}' pos='{}' quat='{}'><inertial mass='{:.17g}' pos='{}' quat='{}' diaginertia='{}'/>{}", last[b],
        text(X_PB.p), text(X_PB.q), mass, text(p_BBcm), text(principal.q_BI), text(principal.diagonal), joints);
  }
  const auto write = [&](const auto& self, int b) -> std::string {
    std::string out = open[b];
    for (int c = 0; c < count; ++c) {
      if (above[c] == b) out += self(self, c);
    }
    return out + "</body>";
  };
  for (int b = 0; b < count; ++b) {
    if (above[b] < 0) twin.bodies += write(write, b);
  }
  model.initial = reference_state(model);
  return twin;
}

// Moves the initial state away from the reference.
void stir(Twin& twin, int seed) {
  Random random(seed);
  State& state = twin.model.initial;
  for (double& position : state.position) position += random.in(-0.3, 0.3);
  for (double& velocity : state.velocity) velocity = random.in(-1, 1);
  std::vector<BallCoordinates> balls(twin.model.balls.size());
  for (BallCoordinates& ball : balls) {
    ball.rotation = Quat(Eigen::AngleAxisd(random.in(0, 0.5), random.direction()));
    ball.velocity = random.vector(2);
  }
  for (size_t i = 0; i < twin.model.bodies.size(); ++i) {
    if (!twin.model.bodies[i].is_free()) continue;
    state.bodies[i].w_WB = random.vector(2);
    state.bodies[i].v_WBcm = random.vector(1);
  }
  bodies_from_joints(twin.model, balls, state);
}

// MuJoCo itself on the MJCF of a twin.
class Direct {
 public:
  Direct(const Twin& twin, int integrator, int disabled) : twin_(twin) {
    char error[1000] = "";
    mjSpec* spec = mj_parseXMLString(twin.mjcf().c_str(), nullptr, error, sizeof error);
    if (spec == nullptr) throw std::runtime_error(fmt::format("{}\n{}", error, twin.mjcf()));
    model_ = mj_compile(spec, nullptr);
    if (model_ == nullptr) throw std::runtime_error(mjs_getError(spec));
    mj_deleteSpec(spec);
    model_->opt.timestep = 1e-3;
    model_->opt.integrator = integrator;
    model_->opt.disableflags |= disabled;
    model_->opt.jacobian = mjJAC_SPARSE;
    data_ = mj_makeData(model_);
    const Model& model = twin.model;
    for (size_t j = 0; j < model.joints.size(); ++j) {
      data_->qpos[qpos(model.joints[j].name)] = model.initial.position[j];
      data_->qvel[dof(model.joints[j].name)] = model.initial.velocity[j];
    }
    for (size_t b = 0; b < model.balls.size(); ++b) {
      const Quat q = ball_rotation(model, model.initial, static_cast<int>(b));
      const Vec3 w = ball_velocity(model, model.initial, static_cast<int>(b));
      mjtNum* out = data_->qpos + qpos(model.balls[b].name);
      out[0] = q.w();
      Eigen::Map<Vec3>(out + 1) = q.vec();
      Eigen::Map<Vec3>(data_->qvel + dof(model.balls[b].name)) = w;
    }
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      if (!model.bodies[i].is_free()) continue;
      const int id = mj_name2id(model_, mjOBJ_BODY, fmt::format("b{}", i).c_str());
      const BodyState& s = model.initial.bodies[i];
      const Vec3 arm = s.q_WB * model.bodies[i].p_BBcm;
      mjtNum* q = data_->qpos + model_->jnt_qposadr[model_->body_jntadr[id]];
      mjtNum* v = data_->qvel + model_->jnt_dofadr[model_->body_jntadr[id]];
      Eigen::Map<Vec3>(q + 0) = s.p_WBcm - arm;
      q[3] = s.q_WB.w();
      Eigen::Map<Vec3>(q + 4) = s.q_WB.vec();
      Eigen::Map<Vec3>(v + 0) = s.v_WBcm - s.w_WB.cross(arm);
      Eigen::Map<Vec3>(v + 3) = s.q_WB.conjugate() * s.w_WB;
    }
  }
  Direct(const Direct&) = delete;
  Direct& operator=(const Direct&) = delete;
  ~Direct() {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }

  void step() { mj_step(model_, data_); }
  void torque(size_t joint, double value) { data_->qfrc_applied[dof(twin_.model.joints[joint].name)] = value; }

  // The largest difference of any position (m) or rotation (rad) of bodies with mass, of joint coordinates and of ball
  // joints' rates (rad/s).
  double distance(const State& state) const {
    mjData* now = mj_copyData(nullptr, model_, data_);
    mj_kinematics(model_, now);
    double most = 0;
    for (size_t i = 0; i < twin_.model.bodies.size(); ++i) {
      if (twin_.model.bodies[i].is_massless()) continue;
      const int id = mj_name2id(model_, mjOBJ_BODY, fmt::format("b{}", i).c_str());
      const Vec3 p = Eigen::Map<const Vec3>(now->xipos + ptrdiff_t{3} * id);
      const mjtNum* q = now->xquat + ptrdiff_t{4} * id;
      most = std::max({most, (p - state.bodies[i].p_WBcm).norm(),
                       Quat(q[0], q[1], q[2], q[3]).angularDistance(state.bodies[i].q_WB)});
    }
    for (size_t j = 0; j < twin_.model.joints.size(); ++j) {
      most = std::max(most, std::abs(now->qpos[qpos(twin_.model.joints[j].name)] - state.position[j]));
    }
    for (size_t b = 0; b < twin_.model.balls.size(); ++b) {
      const Vec3 rate = Eigen::Map<const Vec3>(now->qvel + dof(twin_.model.balls[b].name));
      most = std::max(most, (rate - ball_velocity(twin_.model, state, static_cast<int>(b))).norm());
    }
    mj_deleteData(now);
    return most;
  }
  int constraints() const { return data_->nefc; }
  int contacts() const { return data_->ncon; }

 private:
  int joint(const std::string& name) const { return mj_name2id(model_, mjOBJ_JOINT, name.c_str()); }
  int qpos(const std::string& name) const { return model_->jnt_qposadr[joint(name)]; }
  int dof(const std::string& name) const { return model_->jnt_dofadr[joint(name)]; }

  Twin twin_;
  mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
};

struct Outcome {
  double distance = 0;  // largest of all steps
  int constraints = 0, contacts = 0;
};

Outcome compare(const Twin& twin, int steps, const Settings& settings = {}, int integrator = mjINT_EULER,
                int disabled = 0) {
  ResolvedContender contender = Registry::instance().resolve("mujoco-euler", settings);
  const auto simulation = contender.engine->create(twin.model, twin.model.initial, contender.settings);
  Direct direct(twin, integrator, disabled);
  Outcome outcome;
  State state;
  std::vector<double> torques(twin.model.joints.size(), 0);
  for (int i = 0; i < steps; ++i) {
    for (size_t j = 0; j < torques.size(); ++j) {
      torques[j] = 0.5 * std::sin(0.01 * i + static_cast<double>(j));
      direct.torque(j, torques[j]);
    }
    simulation->step(torques);
    direct.step();
    simulation->read_state(state);
    outcome.distance = std::max(outcome.distance, direct.distance(state));
    outcome.constraints = std::max(outcome.constraints, direct.constraints());
    outcome.contacts = std::max(outcome.contacts, direct.contacts());
  }
  return outcome;
}

class MujocoTrees : public testing::TestWithParam<int> {};

// Joints of all kinds, several in a body, with limits, springs, dampers, armature and dry friction.
TEST_P(MujocoTrees, MoveAsMuJoCosOwn) {
  Twin twin = random_tree(GetParam(), 5);
  stir(twin, GetParam());
  const Outcome euler = compare(twin, 100);
  EXPECT_LT(euler.distance, 1e-9);
  EXPECT_LT(compare(twin, 100, {{"integrator", "rk4"}}, mjINT_RK4).distance, 1e-9);
  EXPECT_LT(compare(twin, 100, {{"integrator", "implicitfast"}}, mjINT_IMPLICITFAST).distance, 1e-9);
  const Settings explicit_pd = {{"pd", "explicit"}};
  EXPECT_LT(compare(twin, 100, explicit_pd, mjINT_EULER, mjDSBL_EULERDAMP).distance, 1e-9);
  EXPECT_GT(euler.constraints, 0) << "no limit, no friction: the test shows less than it says";
}

// Couplings, connects, welds and tendons between joints of a tree.
TEST_P(MujocoTrees, AreConstrainedAsMuJoCosOwn) {
  Twin twin = random_tree(GetParam() + 100, 6);
  Model& model = twin.model;
  ASSERT_GE(model.joints.size(), 4U);
  model.couplings = {{.name = "one", .joint = 1, .terms = {{0, 0.7}}, .offset = 0.1},
                     {.name = "many", .joint = 2, .terms = {{0, -0.4}, {3, 0.9}}, .offset = -0.2}};
  std::string tendons, equality;
  tendons +=
      "<fixed name='many'><joint joint='j2' coef='1'/><joint joint='j0' coef='0.4'/>"
      "<joint joint='j3' coef='-0.9'/></fixed>";
  const auto reference = [&](int joint) { return model.joints[joint].reference; };
  equality += fmt::format("<joint joint1='j1' joint2='j0' polycoef='{:.17g} 0.7 0 0 0'/>",
                          0.1 + 0.7 * reference(0) - reference(1));
  equality += fmt::format("<tendon tendon1='many' polycoef='{:.17g} 0 0 0 0'/>",
                          -0.2 - reference(2) - 0.4 * reference(0) + 0.9 * reference(3));

  model.tendons = {{.name = "spring",
                    .terms = {{0, 1.5}, {3, -0.5}},
                    .stiffness = 20,
                    .rest_lower = -0.05,
                    .rest_upper = 0.02,
                    .damping = 0.4,
                    .limited = true,
                    .lower = -0.1,
                    .upper = 0.15,
                    .dry_friction = 0.3}};
  tendons +=
      "<fixed name='spring' stiffness='20' springlength='-0.05 0.02' damping='0.4' limited='true' "
      "range='-0.1 0.15' frictionloss='0.3'><joint joint='j0' coef='1.5'/><joint joint='j3' coef='-0.5'/></fixed>";

  // the first body with mass to the free one, and the last to the world
  const int last = static_cast<int>(model.bodies.size()) - 1;
  int first = 0, free = 0;
  while (model.bodies[first].is_massless()) ++first;
  while (!model.bodies[free].is_free()) ++free;
  const auto pose = [&](int body) { return body_pose(model.bodies[body], model.initial.bodies[body]); };
  const Vec3 p_A(0.1, -0.2, 0.05);
  model.connects = {{.name = "connect",
                     .body_a = first,
                     .body_b = free,
                     .p_A = p_A,
                     .p_B = pose(free).inverse() * (pose(first) * p_A)}};
  equality += fmt::format("<connect body1='b{}' body2='b{}' anchor='{}'/>", first, free, text(p_A));
  const Pose X_AB = pose(last).inverse();
  model.welds = {{.name = "weld", .body_a = last, .body_b = kWorld, .X_AB = X_AB}};
  const WeldFrames held = weld_frames(model, model.welds[0]);  // MuJoCo's own choice is the world's origin
  equality += fmt::format("<weld body1='b{}' relpose='{} {}' anchor='{}'/>", last, text(held.X_AS.p), text(held.X_AS.q),
                          text(held.X_BS.p));
  twin.rest = fmt::format("<tendon>{}</tendon><equality>{}</equality>", tendons, equality);
  stir(twin, GetParam());
  const Outcome outcome = compare(twin, 50);
  EXPECT_LT(outcome.distance, 1e-8);
  EXPECT_GE(outcome.constraints, 12);
}

INSTANTIATE_TEST_SUITE_P(Random, MujocoTrees, testing::Range(1, 9));

// A massless body with two children, one that ends a connect, and a hinge after a ball joint are bodies of MuJoCo's
// own: the motion is that of the same chain with masses of nothing.
TEST(MujocoFeatures, MasslessBodiesOfTheirOwnAreExact) {
  Twin twin = random_tree(5, 1);
  Model model = twin.model;
  model.joints.clear();
  model.balls.clear();
  model.bodies.clear();
  Random random(3);
  const auto add = [&](int parent, bool massless) {
    Body body;
    body.parent = parent;
    body.X_PB = {random.vector(0.3), random.rotation()};
    body.I_BBcm_B.setZero();
    if (!massless) {
      body.mass = 1;
      body.p_BBcm = random.vector(0.1);
      body.I_BBcm_B = 0.01 * Mat3::Identity();
    }
    model.bodies.push_back(body);
    return static_cast<int>(model.bodies.size()) - 1;
  };
  const int ball = add(kWorld, true);
  const int fork = add(ball, true);
  const int left = add(fork, false), right = add(fork, false);
  add_ball(model, random, ball);
  add_joint(model, random, fork, false);
  add_joint(model, random, left, false);
  add_joint(model, random, right, true);
  model.initial = reference_state(model);
  twin.model = model;
  stir(twin, 4);

  const auto run = [](const Model& of, double share) {
    Model given = of;
    for (Body& body : given.bodies) {
      if (!body.is_massless() || share == 0) continue;
      body.mass = share;
      body.I_BBcm_B = share * Mat3::Identity();
    }
    const ResolvedContender contender = Registry::instance().resolve("mujoco-rk4", {});
    const auto simulation = contender.engine->create(given, given.initial, contender.settings);
    simulation->advance(200);
    State state;
    simulation->read_state(state);
    return state;
  };
  const State exact = run(twin.model, 0);
  const auto difference = [&](double share) {
    return (run(twin.model, share).bodies[left].p_WBcm - exact.bodies[left].p_WBcm).norm();
  };
  EXPECT_LT(difference(1e-8), 1e-6);
  EXPECT_NEAR(difference(1e-5) / difference(1e-6), 10, 0.2) << "the difference is not the masses'";
}

Shape make_shape(ShapeType type, int body) {
  Shape shape;
  shape.name = fmt::format("shape{}", body);
  shape.type = type;
  shape.body = body;
  return shape;
}

Hull wedge() {  // neither its centre nor its principal axes are those of its frame
  Hull hull;
  hull.name = "wedge";
  hull.vertices = {{0.1, 0, 0}, {0.3, 0, 0}, {0.1, 0.2, 0}, {0.1, 0, 0.15}, {0.3, 0, 0.05}, {0.1, 0.2, 0.1}};
  hull.faces = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};
  return hull;
}

HeightField hills() {
  HeightField field;
  field.name = "hills";
  field.rows = 7;
  field.columns = 5;
  field.half_x = 1.5;
  field.half_y = 2;
  field.base = 0.3;
  Random random(9);
  for (int i = 0; i < 35; ++i) field.heights.push_back(random.in(0.05, 0.25));
  return field;
}

// Free bodies of all shapes, thrown at a plane or a height field and at each other.
Twin heap(bool field, double torsional, double rolling) {
  Twin twin;
  Model& model = twin.model;
  Random random(2);
  const std::vector<std::string> geoms = {
      "type='box' size='0.1 0.15 0.08'", "type='cylinder' size='0.1 0.12'", "type='ellipsoid' size='0.1 0.14 0.07'",
      "type='mesh' mesh='wedge'",        "type='sphere' size='0.1'",        "type='capsule' size='0.06 0.1'"};
  const std::vector<ShapeType> types = {ShapeType::kBox,  ShapeType::kCylinder, ShapeType::kEllipsoid,
                                        ShapeType::kHull, ShapeType::kSphere,   ShapeType::kCapsule};
  const int without_rolling = torsional > 0 ? 4 : 3;
  const int condim = rolling > 0 ? 6 : without_rolling;
  const std::string contact = fmt::format("condim='{}' friction='0.6 {:.17g} {:.17g}'", condim, torsional, rolling);
  for (int i = 0; i < 6; ++i) {
    Body body;
    // on a field side by side, so that the time before roundings grow is enough for all to touch it
    const int row = i / 3;
    const Vec3 start =
        field ? Vec3(0.5 * (i % 3), 0.5 * row, 0.3) : Vec3(0.18 * (i % 2), 0.2 * (i % 3), 0.35 + 0.25 * i);
    body.X_PB = {start, random.rotation()};
    body.mass = 1;
    body.p_BBcm = random.vector(0.05);
    body.I_BBcm_B = Vec3(0.01, 0.012, 0.014).asDiagonal();
    model.bodies.push_back(body);
    Shape shape = make_shape(types[i], i);
    shape.X_BS = {random.vector(0.1), random.rotation()};
    shape.friction = 0.6;
    shape.radius = i == 5 ? 0.06 : 0.1;
    shape.half_length = i == 5 ? 0.1 : 0.12;
    shape.half_size = i == 0 ? Vec3(0.1, 0.15, 0.08) : Vec3(0.1, 0.14, 0.07);
    if (types[i] == ShapeType::kHull) shape.data = 0;
    model.shapes.push_back(shape);
    twin.bodies += fmt::format(
        "<body name='b{}' pos='{}' quat='{}'><freejoint align='false'/><inertial mass='1' pos='{}' "
        "diaginertia='0.01 0.012 0.014'/><geom {} {} pos='{}' quat='{}'/></body>",
        i, text(body.X_PB.p), text(body.X_PB.q), text(body.p_BBcm), geoms[i], contact, text(shape.X_BS.p),
        text(shape.X_BS.q));
  }
  model.hulls = {wedge()};
  std::string vertices;
  for (const Vec3& vertex : model.hulls[0].vertices) vertices += text(vertex) + " ";
  std::string assets = fmt::format("<mesh name='wedge' inertia='convex' vertex='{}'/>", vertices);
  Shape ground = make_shape(field ? ShapeType::kHeightField : ShapeType::kPlane, kWorld);
  ground.friction = 0.6;
  if (field) {
    ground.data = 0;
    ground.X_BS = {{0.1, 0.2, -0.1}, Quat(Eigen::AngleAxisd(0.3, Vec3::UnitZ()))};
    model.height_fields = {hills()};
    const HeightField& own = model.height_fields[0];
    const double low = std::ranges::min(own.heights), range = std::ranges::max(own.heights) - low;
    std::string heights;
    for (int row = own.rows - 1; row >= 0; --row) {  // MJCF's first row is the last one of MuJoCo's data
      for (int column = 0; column < own.columns; ++column) {
        heights += fmt::format("{:.17g} ", (own.heights[row * own.columns + column] - low) / range);
      }
    }
    assets += fmt::format("<hfield name='hills' nrow='7' ncol='5' size='1.5 2 {:.17g} {:.17g}' elevation='{}'/>", range,
                          own.base + low, heights);
    twin.bodies += fmt::format("<geom type='hfield' hfield='hills' {} pos='0.1 0.2 {:.17g}' quat='{}'/>", contact,
                               -0.1 + low, text(ground.X_BS.q));
  } else {
    twin.bodies += fmt::format("<geom type='plane' size='0 0 1' {}/>", contact);
  }
  model.shapes.push_back(ground);
  twin.rest = fmt::format("<asset>{}</asset>", assets);
  for (int a = 0; a < 7; ++a) {
    for (int b = a + 1; b < 7; ++b) {
      model.contacts.push_back(
          {.shape_a = a, .shape_b = b, .friction = 0.6, .torsional = torsional, .rolling = rolling});
    }
  }
  model.initial = reference_state(model);
  return twin;
}

TEST(MujocoFeatures, ShapesTouchAsMuJoCosOwn) {
  for (const bool field : {false, true}) {
    for (const auto& [torsional, rolling] : {std::pair{0.0, 0.0}, {0.02, 0.0}, {0.02, 0.003}}) {
      SCOPED_TRACE(fmt::format("{}, torsional {}, rolling {}", field ? "height field" : "plane", torsional, rolling));
      const Twin twin = heap(field, torsional, rolling);
      const Outcome outcome = compare(twin, field ? 250 : 400);
      EXPECT_LT(outcome.distance, 1e-5);  // contacts amplify rounding
      EXPECT_GE(outcome.contacts, 6);
    }
  }
}

// What the capabilities and the README say of soft constraints, for a load that accelerates the free joint by `load`.
class MujocoSoftness : public testing::TestWithParam<double> {
 protected:
  static Model hinged() {
    Model model;
    model.gravity.setZero();
    Body body;
    body.mass = 1;
    body.I_BBcm_B = 0.5 * Mat3::Identity();
    body.joint = 0;
    model.bodies = {body};
    model.joints.resize(1);
    model.joints[0].axis_B = Vec3::UnitZ();
    return model;
  }
  static State run(Model model, double torque) {
    model.initial = reference_state(model);
    const ResolvedContender contender = Registry::instance().resolve("mujoco-euler", {});
    const auto simulation = contender.engine->create(model, model.initial, contender.settings);
    const std::vector<double> torques(model.joints.size(), torque);
    for (int i = 0; i < 2000; ++i) simulation->step(torques);
    State state;
    simulation->read_state(state);
    return state;
  }
};

TEST_P(MujocoSoftness, IsAsDeclared) {
  const double load = GetParam(), torque = 0.5 * load;
  Model dry = hinged();
  dry.joints[0].dry_friction = 10 * torque;
  EXPECT_NEAR(run(dry, torque).velocity[0], 1.06e-3 * load, 0.05e-3 * load);
  Model held = hinged();
  held.couplings = {{.name = "held", .joint = 0, .terms = {}, .offset = 0}};
  const double way = run(held, torque).position[0];
  EXPECT_LT(way, 4.5e-5 * load);
  EXPECT_GT(way, 1.5e-5 * load);
  Model limited = hinged();
  limited.joints[0].limited = true;
  limited.joints[0].lower = -1;
  EXPECT_NEAR(run(limited, torque).position[0], way, 1e-3 * way);
  for (const bool weld : {false, true}) {
    Model hung;
    hung.gravity = {0, 0, -load};
    hung.bodies = hinged().bodies;
    hung.bodies[0].joint = -1;
    if (weld) hung.welds.emplace_back().name = "weld";
    if (!weld) hung.connects.emplace_back().name = "connect";
    const double sunk = -run(hung, 0).bodies[0].p_WBcm.z();
    EXPECT_LT(sunk, 4.5e-5 * load) << weld;
    EXPECT_GT(sunk, 1.5e-5 * load) << weld;
  }
}

INSTANTIATE_TEST_SUITE_P(Loads, MujocoSoftness, testing::Values(1.0, 10.0, 100.0));

TEST(MujocoFeatures, TorsionalAndRollingFrictionComeFromTheFilterAndFromTheList) {
  Twin twin = heap(false, 0.02, 0.003);
  const ResolvedContender by_filter = Registry::instance().resolve("mujoco-euler", {});
  const ResolvedContender by_list = Registry::instance().resolve("mujoco-euler", {{"contact_pairs", "explicit"}});
  std::vector<State> states;
  for (const ResolvedContender& contender : {by_filter, by_list}) {
    const auto simulation = contender.engine->create(twin.model, twin.model.initial, contender.settings);
    simulation->advance(500);
    simulation->read_state(states.emplace_back());
  }
  for (size_t i = 0; i < twin.model.bodies.size(); ++i) {
    EXPECT_EQ(states[0].bodies[i].p_WBcm, states[1].bodies[i].p_WBcm);
  }
}

}  // namespace
}  // namespace assay
