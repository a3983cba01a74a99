// MuJoCo: joint coordinates, soft convex contact. README.md says what is exact and which defaults are overridden.
#include "engines/engine.h"

#include <algorithm>
#include <array>
#include <mutex>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include "base/text.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using Matrix3Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

struct SpecDeleter {
  void operator()(mjSpec* spec) const { mj_deleteSpec(spec); }
};
struct ModelDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
struct DataDeleter {
  void operator()(mjData* data) const { mj_deleteData(data); }
};
using SpecPtr = std::unique_ptr<mjSpec, SpecDeleter>;
using ModelPtr = std::unique_ptr<mjModel, ModelDeleter>;
using DataPtr = std::unique_ptr<mjData, DataDeleter>;

void copy_quat(const Quat& q, mjtNum* out) { std::ranges::copy(std::array{q.w(), q.x(), q.y(), q.z()}, out); }

// Row `id` of one of MuJoCo's arrays of three numbers.
Vec3 triple(const mjtNum* array, int id) { return Eigen::Map<const Vec3>(array + ptrdiff_t{3} * id); }

// ---- messages -------------------------------------------------------------------------------------------------------

std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  for (size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at)) text.replace(at, 1, "; ");
  return text;
}

// MuJoCo's own handler ends the process on an error, prints, and writes a log file. Here errors become exceptions (it
// is built with unwind tables), and warnings are read from mjData, where they are counted.
void on_message(const mjLogMessage* message) {
  if (message->level == mjLOG_ERROR) throw EngineError(fmt::format("MuJoCo: {}", one_line(message->subject)));
}

// ---- settings -------------------------------------------------------------------------------------------------------

std::vector<Setting> declared_settings() {
  std::vector<Setting> settings = {
      {.name = "integrator",
       .default_value = std::string("euler"),
       .unit = "",
       .meaning = "semi-implicit Euler, Runge-Kutta 4, implicit in velocity without or with Coriolis derivatives, or "
                  "the discrete step map that also takes stiffness implicitly",
       .choices = {"euler", "rk4", "implicitfast", "implicit", "discrete"}},
      {.name = "solver",
       .default_value = std::string("newton"),
       .unit = "",
       .meaning = "constraint solver",
       .choices = {"newton", "cg", "pgs"}},
      {.name = "jacobian",
       .default_value = std::string("sparse"),
       .unit = "",
       .meaning = "form of the constraint Jacobian; MuJoCo itself takes dense below 60 DOF and sparse above",
       .choices = {"sparse", "dense"}},
      {.name = "cone",
       .default_value = std::string("pyramidal"),
       .unit = "",
       .meaning = "friction cone: a pyramid inside Coulomb's cone (MuJoCo's default) or the cone itself",
       .choices = {"pyramidal", "elliptic"}},
      {.name = "pd",
       .default_value = std::string("native"),
       .unit = "",
       .meaning =
           "springs and dampers of joints: MuJoCo's own, with what the integrator takes implicitly, or explicit: "
           "a torque from the state at the step's start",
       .choices = {"native", "explicit"}},
      {.name = "iterations",
       .default_value = 100LL,
       .unit = "",
       .meaning = "most iterations of the constraint solver in a step",
       .minimum = 1},
      {.name = "tolerance",
       .default_value = 1e-8,
       .unit = "",
       .meaning = "scaled improvement below which the constraint solver stops",
       .minimum = 0},
      {.name = "ls_iterations",
       .default_value = 50LL,
       .unit = "",
       .meaning = "most iterations of the line search of newton and cg",
       .minimum = 1},
      {.name = "ls_tolerance",
       .default_value = 0.01,
       .unit = "",
       .meaning = "relative tolerance of the line search of newton and cg",
       .minimum = 0},
      {.name = "noslip_iterations",
       .default_value = 0LL,
       .unit = "",
       .meaning = "iterations of the extra solver that takes slip out of friction; 0: off",
       .minimum = 0},
      {.name = "impratio",
       .default_value = 1.0,
       .unit = "",
       .meaning = "ratio of frictional to normal impedance of contacts; larger creeps less; with the pyramid it "
                  "stiffens contacts too",
       .minimum = 1e-6},
      {.name = "warmstart",
       .default_value = true,
       .unit = "",
       .meaning = "start the constraint solver from the last step's accelerations"},
      {.name = "islands",
       .default_value = true,
       .unit = "",
       .meaning = "solve groups of bodies that do not touch each other apart"},
      {.name = "euler_damping",
       .default_value = true,
       .unit = "",
       .meaning = "integrator euler takes the damping of joints implicitly"},
      {.name = "refsafe",
       .default_value = true,
       .unit = "",
       .meaning = "raise time constants of contacts and limits to two timesteps"},
      {.name = "contact_pairs",
       .default_value = std::string("auto"),
       .unit = "",
       .meaning =
           "how contacts are found: by MuJoCo's broad phase where its filter gives exactly the model's pairs, or "
           "from an explicit list of pairs always",
       .choices = {"auto", "explicit"}},
  };
  // MuJoCo's solref and solimp, one number a setting
  for (const std::string kind : {"contact", "limit"}) {
    const std::string of = kind == "contact" ? "of contacts" : "of joint limits";
    settings.insert(settings.end(), {{.name = kind + "_timeconst",
                                      .default_value = 0.02,
                                      .unit = "s",
                                      .meaning = "time constant " + of + " (solref 1)",
                                      .minimum = 1e-6},
                                     {.name = kind + "_dampratio",
                                      .default_value = 1.0,
                                      .unit = "",
                                      .meaning = "damping ratio " + of + " (solref 2)",
                                      .minimum = 1e-6},
                                     {.name = kind + "_impedance_min",
                                      .default_value = 0.9,
                                      .unit = "",
                                      .meaning = "impedance " + of + " at no violation (solimp 1)",
                                      .minimum = 1e-4,
                                      .maximum = 0.9999},
                                     {.name = kind + "_impedance_max",
                                      .default_value = 0.95,
                                      .unit = "",
                                      .meaning = "impedance " + of + " beyond the width (solimp 2)",
                                      .minimum = 1e-4,
                                      .maximum = 0.9999},
                                     {.name = kind + "_impedance_width",
                                      .default_value = 0.001,
                                      .unit = kind == "contact" ? "m" : "rad",
                                      .meaning = "violation over which the impedance " + of + " rises (solimp 3)",
                                      .minimum = 0}});
  }
  return settings;
}

constexpr std::array<std::pair<const char*, mjtIntegrator>, 5> kIntegrators = {{{"euler", mjINT_EULER},
                                                                                {"rk4", mjINT_RK4},
                                                                                {"implicitfast", mjINT_IMPLICITFAST},
                                                                                {"implicit", mjINT_IMPLICIT},
                                                                                {"discrete", mjINT_DISCRETE}}};
constexpr std::array<std::pair<const char*, mjtSolver>, 3> kSolvers = {
    {{"newton", mjSOL_NEWTON}, {"cg", mjSOL_CG}, {"pgs", mjSOL_PGS}}};

constexpr std::array kSolverNames = {"projected Gauss-Seidel", "conjugate gradients", "Newton"};  // by mjtSolver

template <typename Table>
auto choice(const Table& table, const std::string& name) {
  return std::ranges::find(table, name, [](const auto& entry) { return std::string(entry.first); })->second;
}

void set_options(const Settings& s, const Vec3& gravity, mjOption& option) {
  option.timestep = s.timestep;
  Eigen::Map<Vec3>(option.gravity) = gravity;
  option.integrator = choice(kIntegrators, s.get<std::string>("integrator"));
  option.solver = choice(kSolvers, s.get<std::string>("solver"));
  option.jacobian = s.get<std::string>("jacobian") == "dense" ? mjJAC_DENSE : mjJAC_SPARSE;
  option.cone = s.get<std::string>("cone") == "elliptic" ? mjCONE_ELLIPTIC : mjCONE_PYRAMIDAL;
  option.iterations = static_cast<int>(s.get<long long>("iterations"));
  option.tolerance = s.get<double>("tolerance");
  option.ls_iterations = static_cast<int>(s.get<long long>("ls_iterations"));
  option.ls_tolerance = s.get<double>("ls_tolerance");
  option.noslip_iterations = static_cast<int>(s.get<long long>("noslip_iterations"));
  option.impratio = s.get<double>("impratio");

  // without the automatic reset a blow-up stays visible instead of starting again from the reference state
  option.disableflags = mjDSBL_AUTORESET;
  if (!s.get<bool>("warmstart")) option.disableflags |= mjDSBL_WARMSTART;
  if (!s.get<bool>("islands")) option.disableflags |= mjDSBL_ISLAND;
  if (!s.get<bool>("euler_damping")) option.disableflags |= mjDSBL_EULERDAMP;
  if (!s.get<bool>("refsafe")) option.disableflags |= mjDSBL_REFSAFE;
  option.enableflags = 0;
}

bool has_explicit_pd(const Settings& s) { return s.get<std::string>("pd") == "explicit"; }

struct Softness {
  std::array<mjtNum, mjNREF> reference;
  std::array<mjtNum, mjNIMP> impedance;
};

Softness softness(const Settings& s, const std::string& kind) {
  const auto number = [&](const char* name) { return s.get<double>(kind + name); };
  Softness result{};
  mj_defaultSolRefImp(result.reference.data(), result.impedance.data());
  result.reference[0] = number("_timeconst");
  result.reference[1] = number("_dampratio");
  result.impedance[0] = number("_impedance_min");
  result.impedance[1] = number("_impedance_max");
  result.impedance[2] = number("_impedance_width");
  return result;
}

// ---- contacts -------------------------------------------------------------------------------------------------------

// How MuJoCo finds exactly the model's contact pairs.
struct ContactPlan {
  std::vector<bool> active;                // per shape: in at least one pair; others do not exist for MuJoCo
  bool broad_phase = false;                // by MuJoCo's filter; else from an explicit list
  bool filter_parents = true;              // MuJoCo's own exclusion of parent and child is on
  std::vector<std::pair<int, int>> apart;  // pairs of bodies that the filter is told to leave out
};

// The broad phase can be used when each two bodies collide with all of their shapes or with none, with the friction
// that MuJoCo's rule gives. It scales with the number of bodies, the list with that of pairs.
ContactPlan plan_contacts(const Model& model, bool explicit_pairs) {
  ContactPlan plan;
  plan.active.assign(model.shapes.size(), false);
  for (const ContactPair& pair : model.contacts) plan.active[pair.shape_a] = plan.active[pair.shape_b] = true;
  if (explicit_pairs || model.contacts.empty()) return plan;

  const int bodies = static_cast<int>(model.bodies.size());
  const auto slot = [](int body) { return static_cast<size_t>(body) + 1; };  // the world first
  std::vector<int> shapes(slot(bodies), 0);
  for (size_t i = 0; i < model.shapes.size(); ++i) {
    if (plan.active[i]) ++shapes[slot(model.shapes[i].body)];
  }
  std::map<std::pair<int, int>, int> wanted;  // pairs of shapes for each two bodies
  for (const ContactPair& pair : model.contacts) {
    const Shape& a = model.shapes[pair.shape_a];
    const Shape& b = model.shapes[pair.shape_b];
    if (pair.friction != std::max(a.friction, b.friction)) return plan;
    ++wanted[std::minmax(a.body, b.body)];
  }
  const auto related = [&](int a, int b) { return a != kWorld && model.bodies[b].parent == a; };
  for (const auto& [pair, count] : wanted) {
    const auto [a, b] = pair;
    if (a == b || count != shapes[slot(a)] * shapes[slot(b)]) return plan;
    if (related(a, b)) plan.filter_parents = false;
  }
  for (int a = kWorld; a < bodies; ++a) {
    for (int b = a + 1; b < bodies; ++b) {
      if (shapes[slot(a)] == 0 || shapes[slot(b)] == 0 || wanted.contains({a, b})) continue;
      if (!(plan.filter_parents && related(a, b))) plan.apart.emplace_back(a, b);
    }
  }
  plan.broad_phase = true;
  return plan;
}

std::string body_label(int body) { return body == kWorld ? "world" : fmt::format("body{}", body); }
std::string shape_label(size_t shape) { return fmt::format("shape{}", shape); }

// A frictionless contact has no friction rows; MuJoCo would raise a zero coefficient to a small one.
int contact_dimension(double friction) { return friction > 0 ? 3 : 1; }

void add_shape(mjsBody* body, const Shape& shape, size_t index, bool filtered, const Softness& soft) {
  mjsGeom* geom = mjs_addGeom(body, nullptr);
  mjs_setName(geom->element, shape_label(index).c_str());
  Eigen::Map<Vec3>(geom->pos) = shape.X_BS.p;
  copy_quat(shape.X_BS.q, geom->quat);
  switch (shape.type) {
    case ShapeType::kSphere:
      geom->type = mjGEOM_SPHERE;
      geom->size[0] = shape.radius;
      break;
    case ShapeType::kCapsule:
      geom->type = mjGEOM_CAPSULE;
      geom->size[0] = shape.radius;
      geom->size[1] = shape.half_length;
      break;
    case ShapeType::kPlane:
      geom->type = mjGEOM_PLANE;
      geom->size[2] = 1;  // spacing of drawn grid lines; the plane is infinite
      break;
  }
  geom->contype = geom->conaffinity = filtered ? 1 : 0;
  geom->condim = contact_dimension(shape.friction);
  geom->friction[0] = shape.friction;
  std::ranges::copy(soft.reference, geom->solref);
  std::ranges::copy(soft.impedance, geom->solimp);
}

void add_pair(mjSpec* spec, const ContactPair& contact, const Softness& soft) {
  mjsPair* pair = mjs_addPair(spec, nullptr);
  mjs_setString(pair->geomname1, shape_label(contact.shape_a).c_str());
  mjs_setString(pair->geomname2, shape_label(contact.shape_b).c_str());
  pair->condim = contact_dimension(contact.friction);
  pair->friction[0] = pair->friction[1] = contact.friction;
  pair->margin = pair->gap = 0;
  std::ranges::copy(soft.reference, pair->solref);
  std::ranges::copy(soft.impedance, pair->solimp);
}

// ---- the model ------------------------------------------------------------------------------------------------------

// What create() needs again for every timestep and state.
struct Compiled {
  Model model;
  ModelPtr mujoco;
  bool explicit_springs = false;           // MuJoCo has none of the model's, they are torques
  std::vector<int> body_id;                // MuJoCo's ids in the model's order (MuJoCo sorts depth first)
  std::vector<int> hinge_joint;            // per hinge
  std::vector<int> body_qpos, body_dof;    // per body: the free joint's first address, -1 for hinged bodies
  std::vector<int> hinge_qpos, hinge_dof;  // per hinge
};

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

void set_hinge(mjsJoint* joint, const Hinge& hinge, const Softness& soft, bool explicit_springs) {
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
      set_hinge(joint, model.hinges[body.hinge], limit, explicit_springs);
    }
    bodies.push_back(out);
    joints.push_back(joint);
  }
  for (size_t i = 0; i < model.shapes.size(); ++i) {
    const Shape& shape = model.shapes[i];
    if (plan.active[i]) {
      add_shape(shape.body == kWorld ? world : bodies[shape.body], shape, i, plan.broad_phase, contact);
    }
  }
  if (plan.broad_phase) {
    for (const auto& [a, b] : plan.apart) {
      const mjsExclude* exclude = mjs_addExclude(spec.get());
      mjs_setString(exclude->bodyname1, body_label(a).c_str());
      mjs_setString(exclude->bodyname2, body_label(b).c_str());
    }
  } else {
    for (const ContactPair& pair : model.contacts) add_pair(spec.get(), pair, contact);
  }

  auto compiled = std::make_shared<Compiled>();
  compiled->model = model;
  compiled->explicit_springs = explicit_springs;
  compiled->mujoco.reset(mj_compile(spec.get(), nullptr));
  if (compiled->mujoco == nullptr) throw EngineError(fmt::format("MuJoCo: {}", one_line(mjs_getError(spec.get()))));

  const mjModel& m = *compiled->mujoco;
  compiled->body_qpos.assign(model.bodies.size(), -1);
  compiled->body_dof.assign(model.bodies.size(), -1);
  compiled->hinge_joint.resize(model.hinges.size());
  compiled->hinge_qpos.resize(model.hinges.size());
  compiled->hinge_dof.resize(model.hinges.size());
  compiled->body_id.reserve(bodies.size());
  for (size_t i = 0; i < bodies.size(); ++i) {
    compiled->body_id.push_back(mjs_getId(bodies[i]->element));
    const int joint = mjs_getId(joints[i]->element);
    const int hinge = model.bodies[i].hinge;
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

// ---- simulation -----------------------------------------------------------------------------------------------------

class MujocoSimulation final : public Simulation {
 public:
  MujocoSimulation(std::shared_ptr<const Compiled> compiled, const State& state, double timestep)
      : compiled_(std::move(compiled)),
        model_(mj_copyModel(nullptr, compiled_->mujoco.get())),
        start_time_(state.time) {
    model_->opt.timestep = timestep;
    data_.reset(mj_makeData(model_.get()));
    if (data_ == nullptr) throw EngineError("MuJoCo: no memory for the simulation's data");
    set_state(state);
  }

  void set_torques(std::span<const double> torques) override {
    const std::vector<int>& dof = compiled_->hinge_dof;
    mjtNum* applied = data_->qfrc_applied;
    for (size_t j = 0; j < torques.size(); ++j) applied[dof[j]] = torques[j];
    if (compiled_->explicit_springs) add_springs(torques);
    torques_set_ = torques_fresh_ = true;
  }

  void advance(int count) override {
    if (count <= 0) return;
    if (torques_set_ && !torques_fresh_) clear_torques();
    torques_fresh_ = false;
    mj_step(model_.get(), data_.get());
    if (count > 1) {
      if (torques_set_) clear_torques();
      for (int i = 1; i < count; ++i) mj_step(model_.get(), data_.get());
    }
    steps_ += count;
    check_warnings();
  }

  void read_state(State& out) const override {
    const Model& model = compiled_->model;
    out.time = time();
    out.bodies.resize(model.bodies.size());
    out.angle.resize(model.hinges.size());
    out.rate.resize(model.hinges.size());
    for (size_t j = 0; j < model.hinges.size(); ++j) {
      out.angle[j] = data_->qpos[compiled_->hinge_qpos[j]];
      out.rate[j] = data_->qvel[compiled_->hinge_dof[j]];
    }
    // a free joint's coordinates: origin and rotation of the body frame; its velocity: the origin's in the world, the
    // angular one in the body
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      const Body& body = model.bodies[i];
      if (!body.is_free()) continue;
      const mjtNum* qpos = data_->qpos + compiled_->body_qpos[i];
      const mjtNum* qvel = data_->qvel + compiled_->body_dof[i];
      BodyState& s = out.bodies[i];
      s.q_WB = Quat(qpos[3], qpos[4], qpos[5], qpos[6]);
      s.w_WB = s.q_WB * Vec3(qvel[3], qvel[4], qvel[5]);
      const Vec3 p_BoBcm_W = s.q_WB * body.p_BBcm;
      s.p_WBcm = Vec3(qpos[0], qpos[1], qpos[2]) + p_BoBcm_W;
      s.v_WBcm = Vec3(qvel[0], qvel[1], qvel[2]) + s.w_WB.cross(p_BoBcm_W);
    }
    bodies_from_joints(model, out);
  }

  EngineView view() const override {
    // poses in mjData belong to the start of the last step: compute those of now without touching the run
    const mjModel& m = *model_;
    const DataPtr now(mj_makeData(&m));
    std::copy_n(data_->qpos, m.nq, now->qpos);
    mj_kinematics(&m, now.get());

    EngineView view;
    view.gravity = Eigen::Map<const Vec3>(m.opt.gravity);
    view.bodies.reserve(compiled_->body_id.size());
    for (const int id : compiled_->body_id) {
      const Mat3 R_WI = Eigen::Map<const Matrix3Rows>(now->ximat + ptrdiff_t{9} * id);
      view.bodies.push_back({.mass = m.body_mass[id],
                             .p_WBcm = triple(now->xipos, id),
                             .I_BBcm_W = R_WI * triple(m.body_inertia, id).asDiagonal() * R_WI.transpose()});
    }
    view.hinges.reserve(compiled_->hinge_joint.size());
    for (const int id : compiled_->hinge_joint) {
      view.hinges.push_back({.p_WJ = triple(now->xanchor, id),
                             .axis_W = triple(now->xaxis, id),
                             .limited = m.jnt_limited[id] != 0,
                             .lower = m.jnt_range[ptrdiff_t{2} * id],
                             .upper = m.jnt_range[ptrdiff_t{2} * id + 1]});
    }
    return view;
  }

 private:
  void set_state(const State& state) {
    const Model& model = compiled_->model;
    State given = state;
    if (given.angle.size() != model.hinges.size() || given.rate.size() != model.hinges.size()) {
      joints_from_bodies(model, given);
    }
    for (size_t j = 0; j < model.hinges.size(); ++j) {
      data_->qpos[compiled_->hinge_qpos[j]] = given.angle[j];
      data_->qvel[compiled_->hinge_dof[j]] = given.rate[j];
    }
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      const Body& body = model.bodies[i];
      if (!body.is_free()) continue;
      const BodyState& s = given.bodies[i];
      const Vec3 p_BoBcm_W = s.q_WB * body.p_BBcm;
      mjtNum* qpos = data_->qpos + compiled_->body_qpos[i];
      mjtNum* qvel = data_->qvel + compiled_->body_dof[i];
      Eigen::Map<Vec3>(qpos + 0) = s.p_WBcm - p_BoBcm_W;
      copy_quat(s.q_WB, qpos + 3);
      Eigen::Map<Vec3>(qvel + 0) = s.v_WBcm - s.w_WB.cross(p_BoBcm_W);
      Eigen::Map<Vec3>(qvel + 3) = s.q_WB.conjugate() * s.w_WB;
    }
    data_->time = state.time;
  }

  void add_springs(std::span<const double> torques) {
    const std::vector<Hinge>& hinges = compiled_->model.hinges;
    for (size_t j = 0; j < hinges.size(); ++j) {
      const int dof = compiled_->hinge_dof[j];
      const double angle = data_->qpos[compiled_->hinge_qpos[j]];
      data_->qfrc_applied[dof] =
          (j < torques.size() ? torques[j] : 0.0) + spring_torque(hinges[j], angle, data_->qvel[dof]);
    }
  }

  double time() const { return start_time_ + static_cast<double>(steps_) * model_->opt.timestep; }

  void clear_torques() {
    std::fill_n(data_->qfrc_applied, model_->nv, 0.0);
    torques_set_ = false;
  }

  // MuJoCo goes on after any of these; each means that its result is not one of the model any more.
  static constexpr std::array kFailures = {std::pair{mjWARN_BADQACC, "an acceleration is not a number or above 1e10"},
                                           std::pair{mjWARN_BADQVEL, "a velocity is not a number or above 1e10"},
                                           std::pair{mjWARN_BADQPOS, "a position is not a number or above 1e10"},
                                           std::pair{mjWARN_INERTIA, "the inertia matrix is singular"},
                                           std::pair{mjWARN_CONTACTFULL, "too many contacts for its memory"},
                                           std::pair{mjWARN_CNSTRFULL, "too many constraints for its memory"}};

  void check_warnings() const {
    int count = 0;
    for (const auto& failure : kFailures) count |= data_->warning[failure.first].number;
    if (count != 0) throw_failure();  // apart, for this is inside what the clock measures
  }

  [[noreturn, gnu::cold, gnu::noinline]] void throw_failure() const {
    const auto failure = std::ranges::find_if(
        kFailures, [&](mjtWarning warning) { return data_->warning[warning].number > 0; },
        &std::pair<mjtWarning, const char*>::first);
    throw EngineError(fmt::format("MuJoCo: {} (noticed at {} s)", failure->second, shortest(time())));
  }

  std::shared_ptr<const Compiled> compiled_;
  ModelPtr model_;
  DataPtr data_;
  double start_time_;
  long long steps_ = 0;
  bool torques_set_ = false;    // qfrc_applied is not zero
  bool torques_fresh_ = false;  // ... and no step has used it yet
};

// ---- engine ---------------------------------------------------------------------------------------------------------

class MujocoEngine final : public Engine {
 public:
  std::string name() const override { return ASSAY_ENGINE_NAME; }

  BuildFacts build() const override {
    return {.version = mj_versionString(),
            .source = ASSAY_BUILD_SOURCE,
            .compiler = ASSAY_BUILD_COMPILER,
            .flags = ASSAY_BUILD_FLAGS};
  }

  std::vector<Setting> settings() const override { return declared_settings(); }

  std::vector<Contender> contenders() const override {
    using Set = std::map<std::string, std::string>;
    const auto contender = [](const char* name, const char* summary, const Set& set) {
      return Contender{.name = name, .summary = summary, .set = {set.begin(), set.end()}};
    };
    return {
        contender("mujoco-euler", "semi-implicit Euler, Newton solver, sparse", {}),
        contender("mujoco-rk4", "Runge-Kutta 4, Newton solver, sparse", {{"integrator", "rk4"}}),
        contender("mujoco-implicitfast", "implicit in velocity without Coriolis derivatives, Newton solver, sparse",
                  {{"integrator", "implicitfast"}}),
        contender("mujoco-implicit", "implicit in velocity, Newton solver, sparse", {{"integrator", "implicit"}}),
        contender("mujoco-euler-dense", "semi-implicit Euler, Newton solver, dense", {{"jacobian", "dense"}}),
        contender("mujoco-euler-pgs", "semi-implicit Euler, projected Gauss-Seidel, sparse", {{"solver", "pgs"}}),
        contender("mujoco-euler-pgs-dense", "semi-implicit Euler, projected Gauss-Seidel, dense",
                  {{"solver", "pgs"}, {"jacobian", "dense"}}),
        contender("mujoco-euler-cg", "semi-implicit Euler, conjugate gradients, sparse", {{"solver", "cg"}}),
        contender("mujoco-euler-cg-dense", "semi-implicit Euler, conjugate gradients, dense",
                  {{"solver", "cg"}, {"jacobian", "dense"}}),
        contender("mujoco-euler-elliptic", "semi-implicit Euler, Newton solver, sparse, elliptic friction cone",
                  {{"cone", "elliptic"}}),
        contender("mujoco-euler-explicit-pd",
                  "semi-implicit Euler, Newton solver, sparse, explicit springs and dampers", {{"pd", "explicit"}}),
        contender("mujoco-rk4-explicit-pd", "Runge-Kutta 4, Newton solver, sparse, explicit springs and dampers",
                  {{"integrator", "rk4"}, {"pd", "explicit"}}),
    };
  }

  Capabilities capabilities(const Settings& settings) const override {
    const auto integrator = settings.get<std::string>("integrator");
    const auto solver = settings.get<std::string>("solver");
    Capabilities c;
    c.precision = Precision::kDouble;
    c.coordinates = Coordinates::kJoint;
    c.order = 1;
    c.springs = SpringKind::kNative;
    c.spring_note = "stiffness explicit, damping implicit in velocity";
    if (integrator == "euler") {
      c.integrator = "semi-implicit Euler";
      if (!settings.get<bool>("euler_damping")) c.spring_note = "stiffness and damping explicit";
    } else if (integrator == "rk4") {
      c.integrator = "Runge-Kutta 4";
      c.order = 4;
      c.spring_note = "evaluated in each of the four stages";
    } else if (integrator == "implicitfast") {
      c.integrator = "implicit in velocity, without Coriolis derivatives";
    } else if (integrator == "implicit") {
      c.integrator = "implicit in velocity";
    } else {
      c.integrator = "discrete step map";
      c.spring_note = "stiffness and damping implicit";
    }
    if (has_explicit_pd(settings)) {
      c.springs = SpringKind::kExplicit;
      c.spring_note = "torque from the state at the step's start, held for the step";
    }
    c.joint_solver = "none (joint coordinates)";
    c.contact_solver = fmt::format("{}, at most {} iterations, tolerance {}, {} Jacobian",
                                   kSolverNames.at(choice(kSolvers, solver)), settings.get<long long>("iterations"),
                                   shortest(settings.get<double>("tolerance")), settings.get<std::string>("jacobian"));
    c.contact_model = fmt::format("soft: time constant {} s{}, damping ratio {}, impedance {} to {} over {} m",
                                  shortest(settings.get<double>("contact_timeconst")),
                                  settings.get<bool>("refsafe") ? " (at least 2 timesteps)" : "",
                                  shortest(settings.get<double>("contact_dampratio")),
                                  shortest(settings.get<double>("contact_impedance_min")),
                                  shortest(settings.get<double>("contact_impedance_max")),
                                  shortest(settings.get<double>("contact_impedance_width")));
    c.friction_cone = settings.get<std::string>("cone") == "elliptic" ? "elliptic" : "pyramid inside the cone, 4 sides";
    c.friction_combine = "larger of two, as the model's pairs; explicit pairs where they differ";
    c.contact = true;
    c.joint_limits = true;
    c.other = fmt::format("joint limits are soft: time constant {} s, damping ratio {}",
                          shortest(settings.get<double>("limit_timeconst")),
                          shortest(settings.get<double>("limit_dampratio")));
    c.armature = true;
    c.gyroscopic = true;
    c.iterations = fmt::format("at most {}, tolerance {}", settings.get<long long>("iterations"),
                               shortest(settings.get<double>("tolerance")));
    if (const auto extra = settings.get<long long>("noslip_iterations"); extra > 0) {
      c.iterations += fmt::format("; without slip: at most {}", extra);
    }
    c.sleep = "off";
    c.speed_limits = "none";
    return c;
  }

  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    std::vector<Limitation> limitations;
    if (!model.contacts.empty()) {
      limitations.push_back({.fidelity = Fidelity::kApproximated,
                             .element = "contacts",
                             .how = "soft constraints: bodies sink in a little and friction creeps"});
      if (settings.get<std::string>("cone") == "pyramidal") {
        limitations.push_back({.fidelity = Fidelity::kApproximated,
                               .element = "friction",
                               .how =
                                   "a four-sided pyramid inside Coulomb's cone: up to 29 % less friction between its "
                                   "axes; --set cone=elliptic is exact"});
      }
    }
    for (const Hinge& hinge : model.hinges) {
      if (hinge.has_spring() && has_explicit_pd(settings)) {
        limitations.push_back(
            {.fidelity = Fidelity::kApproximated,
             .element = fmt::format("joint '{}' stiffness and damping", hinge.name),
             .how = "explicit torque from the state at the step's start; --set pd=native is MuJoCo's own"});
      }
      if (hinge.limited) {
        limitations.push_back({.fidelity = Fidelity::kApproximated,
                               .element = fmt::format("limit of joint '{}'", hinge.name),
                               .how = "soft constraint: the limit gives way a little under load"});
      }
    }
    return limitations;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    mju_setLogHandler(on_message);
    return std::make_unique<MujocoSimulation>(compiled(model, settings), state, settings.timestep);
  }

 private:
  // The last model compiled: campaigns create hundreds of simulations that differ in state and timestep alone.
  std::shared_ptr<const Compiled> compiled(const Model& model, const Settings& settings) const {
    std::pair key{model_hash(model), settings.values};
    const std::scoped_lock lock(mutex_);
    if (cached_ == nullptr || key != key_) {
      cached_ = compile(model, settings);
      key_ = std::move(key);
    }
    return cached_;
  }

  mutable std::mutex mutex_;
  mutable std::pair<std::string, std::map<std::string, SettingValue>> key_;
  mutable std::shared_ptr<const Compiled> cached_;
};

}  // namespace
}  // namespace assay

ASSAY_ENGINE_PLUGIN(assay::MujocoEngine)
