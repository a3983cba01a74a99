// Open Dynamics Engine: bodies in maximal coordinates, joints and contacts as constraints, semi-implicit Euler.
// README.md says what is exact, what is approximated and which defaults are overridden.
#include "engines/engine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <mutex>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <ode/ode.h>

#include "model/kinematics.h"

namespace assay {
namespace {

constexpr int kMaxContacts = 8;  // per pair; spheres and capsules never need more than 2

// ---- the library ----------------------------------------------------------------------------------------------------

// Where the exact solver's failures are counted: ODE reports through functions without context.
thread_local long long lcp_failures = 0;

std::string formatted(const char* text, va_list arguments) {
  std::array<char, 512> buffer{};
  std::vsnprintf(buffer.data(), buffer.size(), text, arguments);
  return buffer.data();
}

// Errors and failed assertions must not return to ODE. It is built with unwind tables, so they can be exceptions.
[[noreturn]] void on_error(int number, const char* text, va_list arguments) {
  throw EngineError("ODE error " + std::to_string(number) + ": " + formatted(text, arguments));
}

// The other messages say that something was replaced, as a singular inertia by the identity.
void on_message(int number, const char* text, va_list arguments) {
  if (number != d_ERR_LCP) on_error(number, text, arguments);
  ++lcp_failures;
}

void initialise_library() {
  static std::once_flag once;
  std::call_once(once, [] {
    dSetErrorHandler(on_error);
    dSetDebugHandler(on_error);
    dSetMessageHandler(on_message);
    if (dInitODE2(0) == 0) throw EngineError("ODE's initialisation (dInitODE2) failed");
    if (dCheckConfiguration("ODE_double_precision") == 0) {
      throw EngineError(std::string("this ODE is not built in double precision: ") + dGetConfiguration());
    }
  });
  if (dAllocateODEDataForThread(dAllocateMaskAll) == 0) throw EngineError("ODE's thread data could not be allocated");
}

// Frees what ODE made, unless an error came out of ODE's inside: then spaces may be locked and lists half-changed, and
// freeing them could fail again. Such objects are kept, within reach, until the process ends.
struct Destroy {
  const bool* failed;
  void operator()(dxWorld* world) const { free_or_keep(world, dWorldDestroy); }
  void operator()(dxSpace* space) const { free_or_keep(space, dSpaceDestroy); }
  void operator()(dxJointGroup* group) const { free_or_keep(group, dJointGroupDestroy); }

 private:
  template <typename T>
  void free_or_keep(T* object, void (*destroy)(T*)) const {
    static auto& kept = *new std::vector<T*>;  // outlives static destructors
    if (*failed) {
      kept.push_back(object);
    } else {
      destroy(object);
    }
  }
};
using World = std::unique_ptr<dxWorld, Destroy>;
using Space = std::unique_ptr<dxSpace, Destroy>;
using Group = std::unique_ptr<dxJointGroup, Destroy>;

std::string number_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

Vec3 vec3(const dReal* v) { return {v[0], v[1], v[2]}; }

std::array<dReal, 4> ode_quaternion(const Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }

// ---- settings -------------------------------------------------------------------------------------------------------

std::vector<Setting> ode_settings() {
  return {
      {"solver",
       "quick",
       "",
       "quick: dWorldQuickStep, iterative (SOR); exact: dWorldStep, Dantzig's method on all rows",
       {"quick", "exact"},
       {},
       {}},
      {"iterations", 50LL, "", "SOR iterations of the quick solver (ODE's own default is 20)", {}, 1.0, 1e6},
      {"over_relaxation", 1.3, "", "SOR over-relaxation of the quick solver", {}, 0.01, 1.99},
      {"reorder_seed",
       0LL,
       "",
       "the quick solver shuffles its rows at random; step n of a run is seeded with this and n, so a run can be "
       "repeated "
       "and continued from any state",
       {},
       0.0,
       4294967295.0},
      {"erp", 0.2, "", "part of a joint's position error that one step corrects", {}, 0.0, 1.0},
      {"cfm",
       1e-10,
       "s/kg",
       "softness (constraint force mixing) of joints; s/(kg m^2) for their rotational rows",
       {},
       0.0,
       1.0},
      {"limit_erp", 0.2, "", "part of a joint limit's violation that one step corrects", {}, 0.0, 1.0},
      {"limit_cfm", 1e-10, "s/(kg m^2)", "softness of joint limits", {}, 0.0, 1.0},
      {"pd",
       "explicit",
       "",
       "springs and dampers of joints: explicit: a torque from the state at the step's start; native: the joint's stop "
       "with the ERP and CFM that make it a spring and damper, which is implicit",
       {"explicit", "native"},
       {},
       {}},
      {"contact_erp", 0.2, "", "part of a contact's depth that one step corrects", {}, 0.0, 1.0},
      {"contact_cfm", 1e-10, "s/kg", "softness of contacts", {}, 0.0, 1.0},
      {"contact_max_correcting_velocity",
       0.0,
       "m/s",
       "cap of the speed that pushes bodies apart; 0: none",
       {},
       0.0,
       1e9},
      {"contact_surface_layer", 0.0, "m", "depth to which shapes may sink before they are pushed apart", {}, 0.0, 1.0},
      {"friction_direction",
       "world",
       "",
       "first direction of a contact's friction pyramid: world: fixed by the normal alone (ODE's way); slip: along the "
       "relative velocity at the step's start, which makes sliding friction the same in every direction",
       {"world", "slip"},
       {},
       {}},
      {"max_contacts",
       4LL,
       "",
       "contact points a pair of shapes may have; capsules never have more than 2",
       {},
       1.0,
       double{kMaxContacts}},
      {"broadphase",
       "sap",
       "",
       "ODE's space: simple (all pairs), hash, or sap (sweep and prune)",
       {"simple", "hash", "sap"},
       {},
       {}},
      {"ignore_lcp_failures", false, "",
       "go on when the exact solver reports that it gave up on a step's constraints, instead of failing the run"},
      {"finite_rotation", false, "",
       "turn bodies by the exact finite rotation of a step instead of a normalised first-order update"},
      {"gyroscopic", true, "", "gyroscopic torque, which ODE computes implicitly; off is wrong for asymmetric bodies"},
  };
}

// The settings as the step loop needs them.
struct Options {
  explicit Options(const Settings& s)
      : exact(s.get<std::string>("solver") == "exact"),
        iterations(static_cast<int>(s.get<long long>("iterations"))),
        over_relaxation(s.get<double>("over_relaxation")),
        seed(static_cast<std::uint32_t>(s.get<long long>("reorder_seed"))),
        erp(s.get<double>("erp")),
        cfm(s.get<double>("cfm")),
        limit_erp(s.get<double>("limit_erp")),
        limit_cfm(s.get<double>("limit_cfm")),
        native_springs(s.get<std::string>("pd") == "native"),
        contact_erp(s.get<double>("contact_erp")),
        contact_cfm(s.get<double>("contact_cfm")),
        max_correcting_velocity(s.get<double>("contact_max_correcting_velocity")),
        surface_layer(s.get<double>("contact_surface_layer")),
        along_slip(s.get<std::string>("friction_direction") == "slip"),
        max_contacts(static_cast<int>(s.get<long long>("max_contacts"))),
        broadphase(s.get<std::string>("broadphase")),
        ignore_lcp_failures(s.get<bool>("ignore_lcp_failures")),
        finite_rotation(s.get<bool>("finite_rotation")),
        gyroscopic(s.get<bool>("gyroscopic")) {}

  bool exact;
  int iterations;
  double over_relaxation;
  std::uint32_t seed;
  double erp, cfm, limit_erp, limit_cfm;
  bool native_springs;
  double contact_erp, contact_cfm, max_correcting_velocity, surface_layer;
  bool along_slip;
  int max_contacts;
  std::string broadphase;
  bool ignore_lcp_failures, finite_rotation, gyroscopic;
};

// ---- simulation -----------------------------------------------------------------------------------------------------

// A hinge whose spring and damper are its stops: both at the rest angle, soft by ERP and CFM.
bool is_spring_stop(const Hinge& hinge, const Options& options) { return options.native_springs && hinge.has_spring(); }

// The hinge angle at which ODE's own angle is zero. ODE wraps its angle at +-pi, so limited hinges count from the
// middle of their range: every range below a full turn then works, wherever it lies. Springs count from their rest.
double zero_angle(const Hinge& hinge, const Options& options) {
  if (hinge.limited) return (hinge.lower + hinge.upper) / 2;
  return is_spring_stop(hinge, options) ? hinge.spring_reference : hinge.reference;
}

// Half of what a range leaves of the full turn: a limit passed by more than this is taken for the other one.
double limit_margin(const Hinge& hinge) { return std::numbers::pi - (hinge.upper - hinge.lower) / 2; }
constexpr double kNarrowMargin = 0.1;  // rad

class OdeSimulation final : public Simulation {
 public:
  OdeSimulation(Model model, const State& state, const Settings& settings)
      : options_(settings), timestep_(settings.timestep), start_time_(state.time), model_(std::move(model)) {
    model_.keyframes.clear();
    world_.reset(dWorldCreate());
    set_up_world();
    create_bodies();
    create_hinges();
    if (!model_.contacts.empty()) create_shapes();
    set_state(state);
    has_explicit_springs_ = model_.has_springs() && !options_.native_springs;
    last_angle_ = state.angle;
    // the number of this step counted from time zero, so that a run continued in the middle draws the same seeds
    step_ = std::llround(state.time / timestep_);
    first_step_ = step_;
  }

  void set_torques(std::span<const double> torques) override {
    if (has_explicit_springs_) read_state(scratch_);
    // ODE empties its accumulators after a step, but adds up what is applied between two; a second call replaces the
    // first
    if (torques_set_) {
      for (dxBody* body : bodies_) dBodySetTorque(body, 0, 0, 0);
    }
    torques_set_ = true;
    for (size_t j = 0; j < joints_.size(); ++j) {
      double torque = torques.empty() ? 0.0 : torques[j];
      if (has_explicit_springs_) torque += spring_torque(model_.hinges[j], scratch_.angle[j], scratch_.rate[j]);
      if (torque != 0) dJointAddHingeTorque(joints_[j], torque);
    }
  }

  void advance(int count) override {
    const unsigned long callers_seed = dRandGetSeed();  // one global of the library, which others may use too
    lcp_failures = 0;
    torques_set_ = false;
    try {
      for (int i = 0; i < count; ++i) {
        if (space_) dSpaceCollide(space_.get(), this, &OdeSimulation::on_near);
        int done = 0;
        if (options_.exact) {
          done = dWorldStep(world_.get(), timestep_);
        } else {
          dRandSetSeed(options_.seed + 0x9e3779b9U * static_cast<std::uint32_t>(step_));
          done = dWorldQuickStep(world_.get(), timestep_);
        }
        if (done == 0) throw EngineError("ODE could not allocate the memory of a step");
        if (space_) dJointGroupEmpty(contacts_.get());
        ++step_;
      }
    } catch (...) {
      failed_ = true;
      dRandSetSeed(callers_seed);
      throw;
    }
    dRandSetSeed(callers_seed);
    if (lcp_failures > 0 && !options_.ignore_lcp_failures) {
      throw EngineError("ODE's exact solver gave up on the constraints of " + std::to_string(lcp_failures) + " of " +
                        std::to_string(count) + " steps before t = " + number_text(time()) + " s (LCP internal error)");
    }
  }

  void read_state(State& out) const override {
    out.time = time();
    out.bodies.resize(bodies_.size());
    for (size_t i = 0; i < bodies_.size(); ++i) {
      BodyState& body = out.bodies[i];
      const dReal* q = dBodyGetQuaternion(bodies_[i]);
      body.p_WBcm = vec3(dBodyGetPosition(bodies_[i]));
      body.q_WB = Quat(q[0], q[1], q[2], q[3]);
      body.v_WBcm = vec3(dBodyGetLinearVel(bodies_[i]));
      body.w_WB = vec3(dBodyGetAngularVel(bodies_[i]));
    }
    out.angle = last_angle_;
    joints_from_bodies(model_, out);
    last_angle_ = out.angle;
  }

  EngineView view() const override {
    EngineView view;
    view.bodies.reserve(bodies_.size());
    for (dxBody* body : bodies_) {
      dMass mass;
      dBodyGetMass(body, &mass);
      Mat3 I_B, R_WB;
      const dReal* R = dBodyGetRotation(body);
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
          I_B(row, column) = mass.I[4 * row + column];
          R_WB(row, column) = R[4 * row + column];
        }
      }
      view.bodies.push_back({mass.mass, vec3(dBodyGetPosition(body)), R_WB * I_B * R_WB.transpose()});
    }
    view.hinges.reserve(joints_.size());
    for (size_t j = 0; j < joints_.size(); ++j) {
      dVector3 anchor, axis;
      dJointGetHingeAnchor(joints_[j], anchor);
      dJointGetHingeAxis(joints_[j], axis);
      const double zero = zero_angle(model_.hinges[j], options_);
      const double lower = dJointGetHingeParam(joints_[j], dParamLoStop);
      const double upper = dJointGetHingeParam(joints_[j], dParamHiStop);
      EngineHinge hinge{vec3(anchor), vec3(axis), lower < upper && (lower > -dInfinity || upper < dInfinity)};
      if (hinge.limited) {
        hinge.lower = zero + lower;
        hinge.upper = zero + upper;
      }
      view.hinges.push_back(hinge);
    }
    dVector3 gravity;
    dWorldGetGravity(world_.get(), gravity);
    view.gravity = vec3(gravity);
    return view;
  }

 private:
  void set_up_world() {
    dxWorld* world = world_.get();
    dWorldSetGravity(world, model_.gravity.x(), model_.gravity.y(), model_.gravity.z());
    dWorldSetERP(world, options_.erp);
    dWorldSetCFM(world, options_.cfm);
    dWorldSetQuickStepNumIterations(world, options_.iterations);
    dWorldSetQuickStepW(world, options_.over_relaxation);
    const double max_velocity = options_.max_correcting_velocity;
    dWorldSetContactMaxCorrectingVel(world, max_velocity > 0 ? max_velocity : dInfinity);
    dWorldSetContactSurfaceLayer(world, options_.surface_layer);
    dWorldSetAutoDisableFlag(world, 0);
    dWorldSetDamping(world, 0, 0);
    dWorldSetMaxAngularSpeed(world, dInfinity);
    dWorldSetStepIslandsProcessingMaxThreadCount(world, 1);
  }

  // ODE's body frame: origin in the centre of mass, axes of the MJCF frame, so the full inertia tensor goes in as it
  // is.
  void create_bodies() {
    bodies_.reserve(model_.bodies.size());
    for (const Body& body : model_.bodies) {
      const Mat3& I = body.I_BBcm_B;
      dMass mass;
      dMassSetParameters(&mass, body.mass, 0, 0, 0, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
      dxBody* created = dBodyCreate(world_.get());
      dBodySetMass(created, &mass);
      dBodySetFiniteRotationMode(created, options_.finite_rotation ? 1 : 0);
      dBodySetGyroscopicMode(created, options_.gyroscopic ? 1 : 0);
      bodies_.push_back(created);
    }
  }

  // Attaching stores relative frames, so all hinges are made where ODE's angles shall be zero.
  void create_hinges() {
    State zero = reference_state(model_);
    for (size_t j = 0; j < model_.hinges.size(); ++j) zero.angle[j] = zero_angle(model_.hinges[j], options_);
    bodies_from_joints(model_, zero);
    set_state(zero);

    joints_.reserve(model_.hinges.size());
    for (size_t j = 0; j < model_.hinges.size(); ++j) {
      const Hinge& hinge = model_.hinges[j];
      const HingeFrames frames = hinge_frames(model_, zero, static_cast<int>(j));
      const Vec3& p = frames.p_WJ_child;
      const Vec3& axis = frames.axis_W_child;
      dxJoint* joint = dJointCreateHinge(world_.get(), nullptr);
      dJointAttach(joint, bodies_[hinge.body], ode_body(model_.bodies[hinge.body].parent));  // child first: angle grows
      dJointSetHingeAnchor(joint, p.x(), p.y(), p.z());                                      // with its rotation
      dJointSetHingeAxis(joint, axis.x(), axis.y(), axis.z());
      if (hinge.limited) {
        const double half_range = (hinge.upper - hinge.lower) / 2;
        dJointSetHingeParam(joint, dParamLoStop, -half_range);
        dJointSetHingeParam(joint, dParamHiStop, half_range);
        dJointSetHingeParam(joint, dParamStopERP, options_.limit_erp);
        dJointSetHingeParam(joint, dParamStopCFM, options_.limit_cfm);
        dJointSetHingeParam(joint, dParamBounce, 0);
      } else if (is_spring_stop(hinge, options_)) {
        make_spring_stop(joint, hinge);
      }
      joints_.push_back(joint);
    }
  }

  // Both stops at the rest angle, where ODE's angle is zero. A row v + CFM f = -(ERP / h) angle then is the torque
  // f = -k (angle + h v) - b v of the angle and rate at the step's end.
  void make_spring_stop(dxJoint* joint, const Hinge& hinge) const {
    const double yielding = timestep_ * hinge.stiffness + hinge.damping;
    dJointSetHingeParam(joint, dParamLoStop, 0);
    dJointSetHingeParam(joint, dParamHiStop, 0);
    dJointSetHingeParam(joint, dParamStopERP, timestep_ * hinge.stiffness / yielding);
    dJointSetHingeParam(joint, dParamStopCFM, 1 / yielding);
    dJointSetHingeParam(joint, dParamBounce, 0);
  }

  // Only shapes that are in a contact pair get a geom.
  void create_shapes() {
    if (options_.broadphase == "simple") {
      space_.reset(dSimpleSpaceCreate(nullptr));
    } else if (options_.broadphase == "hash") {
      space_.reset(dHashSpaceCreate(nullptr));
    } else {
      space_.reset(dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ));
    }
    contacts_.reset(dJointGroupCreate(0));

    const size_t count = model_.shapes.size();
    tags_.resize(count);
    pair_friction_.assign(count * count, kNoContact);
    std::vector<bool> used(count, false);
    for (const ContactPair& pair : model_.contacts) {
      const std::uint16_t friction = friction_index(pair.friction);
      pair_friction_[(pair.shape_a * count) + pair.shape_b] = friction;
      pair_friction_[(pair.shape_b * count) + pair.shape_a] = friction;
      used[pair.shape_a] = used[pair.shape_b] = true;
    }
    for (size_t s = 0; s < count; ++s) {
      if (used[s]) create_shape(s);
    }

    for (dContact& contact : points_) {
      contact = {};
      contact.surface.mode = dContactApprox1 | dContactSoftERP | dContactSoftCFM;
      if (options_.along_slip) contact.surface.mode |= dContactFDir1;
      contact.surface.soft_erp = options_.contact_erp;
      contact.surface.soft_cfm = options_.contact_cfm;
    }
  }

  std::uint16_t friction_index(double friction) {
    const auto found = std::ranges::find(frictions_, friction);
    if (found != frictions_.end()) return static_cast<std::uint16_t>(found - frictions_.begin());
    if (frictions_.size() == kNoContact) throw EngineError("more than 65535 different friction coefficients");
    frictions_.push_back(friction);
    return static_cast<std::uint16_t>(frictions_.size() - 1);
  }

  void create_shape(size_t index) {
    const Shape& shape = model_.shapes[index];
    dxSpace* space = space_.get();
    dxGeom* geom = nullptr;
    switch (shape.type) {
      case ShapeType::kSphere:
        geom = dCreateSphere(space, shape.radius);
        break;
      case ShapeType::kCapsule:
        geom = dCreateCapsule(space, shape.radius, 2 * shape.half_length);
        break;
      case ShapeType::kPlane: {
        const Vec3 normal = shape.X_BS.q * Vec3::UnitZ();
        geom = dCreatePlane(space, normal.x(), normal.y(), normal.z(), normal.dot(shape.X_BS.p));
        break;
      }
    }
    dGeomSetData(geom, &tags_[index]);
    if (shape.type == ShapeType::kPlane) return;

    const std::array<dReal, 4> q = ode_quaternion(shape.X_BS.q);
    if (shape.body == kWorld) {
      dGeomSetPosition(geom, shape.X_BS.p.x(), shape.X_BS.p.y(), shape.X_BS.p.z());
      dGeomSetQuaternion(geom, q.data());
      return;
    }
    const Vec3 p_BcmS = shape.X_BS.p - model_.bodies[shape.body].p_BBcm;
    dGeomSetBody(geom, bodies_[shape.body]);
    // an offset costs at every step, so only shapes that have one get it
    if (p_BcmS.isZero(0) && shape.X_BS.q.isApprox(Quat::Identity(), 0)) return;
    dGeomSetOffsetPosition(geom, p_BcmS.x(), p_BcmS.y(), p_BcmS.z());
    dGeomSetOffsetQuaternion(geom, q.data());
  }

  void set_state(const State& state) {
    for (size_t i = 0; i < bodies_.size(); ++i) {
      const BodyState& body = state.bodies[i];
      const std::array<dReal, 4> q = ode_quaternion(body.q_WB);
      dBodySetPosition(bodies_[i], body.p_WBcm.x(), body.p_WBcm.y(), body.p_WBcm.z());
      dBodySetQuaternion(bodies_[i], q.data());
      dBodySetLinearVel(bodies_[i], body.v_WBcm.x(), body.v_WBcm.y(), body.v_WBcm.z());
      dBodySetAngularVel(bodies_[i], body.w_WB.x(), body.w_WB.y(), body.w_WB.z());
    }
  }

  double time() const { return start_time_ + static_cast<double>(step_ - first_step_) * timestep_; }

  dxBody* ode_body(int body) const { return body == kWorld ? nullptr : bodies_[body]; }

  // The space found two shapes near each other: if they may touch, their contact points become joints of this step.
  static void on_near(void* data, dxGeom* a, dxGeom* b) { static_cast<OdeSimulation*>(data)->collide(a, b); }

  void collide(dxGeom* a, dxGeom* b) {
    const std::uint16_t friction = pair_friction_[(shape_index(a) * tags_.size()) + shape_index(b)];
    if (friction == kNoContact) return;
    const int count = dCollide(a, b, options_.max_contacts, &points_[0].geom, sizeof(dContact));
    if (count == 0) return;
    dxBody* body_a = dGeomGetBody(a);
    dxBody* body_b = dGeomGetBody(b);
    for (int i = 0; i < count; ++i) {
      points_[i].surface.mu = frictions_[friction];
      if (options_.along_slip) set_slip_direction(points_[i], body_a, body_b);
      dJointAttach(dJointCreateContact(world_.get(), contacts_.get(), &points_[i]), body_a, body_b);
    }
  }

  size_t shape_index(dxGeom* geom) const { return static_cast<const char*>(dGeomGetData(geom)) - tags_.data(); }

  static void set_slip_direction(dContact& contact, dxBody* a, dxBody* b) {
    const dReal* p = contact.geom.pos;
    dVector3 v_a = {}, v_b = {};
    if (a != nullptr) dBodyGetPointVel(a, p[0], p[1], p[2], v_a);
    if (b != nullptr) dBodyGetPointVel(b, p[0], p[1], p[2], v_b);
    const Vec3 normal = vec3(contact.geom.normal);
    Vec3 slip = vec3(v_a) - vec3(v_b);
    slip -= slip.dot(normal) * normal;
    // without slip any direction will do
    const Vec3 direction = slip.norm() > 1e-12 ? slip.normalized() : normal.unitOrthogonal();
    for (int k = 0; k < 3; ++k) contact.fdir1[k] = direction[k];
  }

  static constexpr std::uint16_t kNoContact = 0xffff;

  Options options_;
  double timestep_, start_time_;
  long long step_ = 0, first_step_ = 0;
  Model model_;  // our own copy: the caller's need not live on
  bool failed_ = false;
  World world_{nullptr, {&failed_}};
  Space space_{nullptr, {&failed_}};  // null when nothing can touch
  Group contacts_{nullptr, {&failed_}};
  std::vector<dxBody*> bodies_;               // owned by the world
  std::vector<dxJoint*> joints_;              // owned by the world
  std::vector<double> frictions_;             // the different coefficients
  std::vector<std::uint16_t> pair_friction_;  // shapes x shapes, into frictions_; small, so that it stays in the cache
  std::vector<char> tags_;                    // a geom's data is the address of its shape's tag
  std::array<dContact, kMaxContacts> points_{};
  bool has_explicit_springs_ = false;
  bool torques_set_ = false;  // since the last step
  State scratch_;
  mutable std::vector<double> last_angle_;  // what the next read unwraps against
};

// ---- engine ---------------------------------------------------------------------------------------------------------

Limitation spring_limitation(const Hinge& hinge, const Options& options) {
  const std::string element = "joint '" + hinge.name + "' stiffness and damping";
  if (!options.native_springs) {
    return {Fidelity::kApproximated, element,
            "explicit torque from the state at the step's start; --set pd=native is implicit"};
  }
  if (hinge.limited) {
    return {Fidelity::kRefused, element,
            "a hinge has one pair of stops, for its limits or for its spring: set pd=explicit or remove the range"};
  }
  return {Fidelity::kApproximated, element,
          "a spring knows its angle within half a turn from its rest; beyond, it pulls the other way"};
}

class OdeEngine final : public Engine {
 public:
  std::string name() const override { return ASSAY_ENGINE_NAME; }

  BuildFacts build() const override {
    return {ASSAY_BUILD_VERSION, ASSAY_BUILD_SOURCE, ASSAY_BUILD_COMPILER,
            std::string(ASSAY_BUILD_FLAGS) + "; configuration " + dGetConfiguration()};
  }

  std::vector<Setting> settings() const override { return ode_settings(); }

  std::vector<Contender> contenders() const override {
    return {
        {"ode-quick", "ODE, iterative solver (dWorldQuickStep), 50 iterations", {}},
        {"ode-quick20", "ODE, iterative solver (dWorldQuickStep), 20 iterations", {{"iterations", 20LL}}},
        {"ode-quick200", "ODE, iterative solver (dWorldQuickStep), 200 iterations", {{"iterations", 200LL}}},
        {"ode-quick-native-pd",
         "ODE, iterative solver (dWorldQuickStep), 50 iterations, springs and dampers by ERP and CFM",
         {{"pd", "native"}}},
        {"ode-step", "ODE, exact solver (dWorldStep)", {{"solver", "exact"}}},
        {"ode-step-native-pd",
         "ODE, exact solver (dWorldStep), springs and dampers by ERP and CFM",
         {{"solver", "exact"}, {"pd", "native"}}},
    };
  }

  Capabilities capabilities(const Settings& settings) const override {
    const Options options(settings);
    Capabilities c;
    c.precision = Precision::kDouble;
    c.coordinates = Coordinates::kMaximal;
    c.integrator = "semi-implicit Euler";
    c.order = 1;
    c.joint_solver = options.exact
                         ? "direct: Dantzig LCP over all rows"
                         : "projected SOR, " + std::to_string(options.iterations) + " iterations, no warm start";
    c.contact = true;
    c.contact_solver = c.joint_solver + ", with the joints";
    c.contact_model = "rigid, ERP " + number_text(options.contact_erp) + ", CFM " + number_text(options.contact_cfm);
    c.friction_cone = options.along_slip ? "pyramid, 4 sides, first direction along the slip"
                                         : "pyramid, 4 sides, directions fixed by the normal";
    c.friction_combine = "the pair's own coefficient, set for each contact point";
    c.joint_limits = true;
    c.springs = SpringKind::kExplicit;
    c.spring_note = "torque from the state at the step's start, held for the step";
    if (options.native_springs) {
      c.springs = SpringKind::kNative;
      c.spring_note = "implicit: stops at the rest angle with ERP = hK / (hK + B), CFM = 1 / (hK + B)";
    }
    c.gyroscopic = options.gyroscopic;
    if (!options.exact) c.iterations = std::to_string(options.iterations);
    c.sleep = "off";
    c.speed_limits = "none";
    c.hidden_damping = "";
    if (options.gyroscopic)
      c.other = "the gyroscopic torque is implicit: it takes energy out, at first order in the step";
    if (!options.exact) {
      if (!c.other.empty()) c.other += "; ";
      c.other += "constraint rows are reordered at random, seeded by the step's number";
    }
    return c;
  }

  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    const Options options(settings);
    std::vector<Limitation> limitations;
    for (const Hinge& hinge : model.hinges) {
      if (hinge.has_spring()) limitations.push_back(spring_limitation(hinge, options));
      if (hinge.armature != 0) {
        limitations.push_back(
            {Fidelity::kRefused, "joint '" + hinge.name + "' armature",
             "ODE has no rotor inertia in a hinge; remove the armature or use an engine with joint coordinates"});
      }
      if (!hinge.limited) continue;
      const double margin = limit_margin(hinge);
      if (margin <= 0) {
        limitations.push_back(
            {Fidelity::kRefused, "joint '" + hinge.name + "' range",
             "ODE's stops know the angle within one turn only; narrow the range below 2 pi or remove it"});
      } else if (margin < kNarrowMargin) {
        limitations.push_back({Fidelity::kApproximated, "joint '" + hinge.name + "' range",
                               "ODE's stops know the angle within one turn only; a limit that is passed by more than " +
                                   number_text(margin) + " rad is taken for the other one"});
      }
    }
    const bool friction =
        std::ranges::any_of(model.contacts, [](const ContactPair& pair) { return pair.friction > 0; });
    if (friction) {
      limitations.push_back(
          {Fidelity::kApproximated, "friction of contact pairs",
           options.along_slip
               ? "a four-sided pyramid whose first direction is the slip's at the step's start"
               : "a four-sided pyramid along directions fixed by the contact normal: exact along them, up to "
                 "1.41 times the coefficient between them"});
    }
    return limitations;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    initialise_library();
    return std::make_unique<OdeSimulation>(model, state, settings);
  }
};

}  // namespace
}  // namespace assay

ASSAY_ENGINE_PLUGIN(assay::OdeEngine)
