// The whole interface between assay and a physics engine: create a simulation in a given state, step it, read its state
// (section II of the paper). What an engine is and what it cannot do exactly is data beside it: Capabilities, Setting.
//
// An adapter is a shared library that defines one class derived from Engine and names it in ASSAY_ENGINE_PLUGIN. It
// links assay::model and its engine, nothing else of assay. docs/extending.md walks through
// src/engines/skeleton.
#pragma once

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "base/errors.h"
#include "model/features.h"
#include "model/model.h"
#include "model/state.h"

namespace assay {

// ---- settings -------------------------------------------------------------------------------------------------------

using SettingValue = std::variant<bool, long long, double, std::string>;

// What a setting decides where engines have it in common, whatever each calls it. Campaigns vary it under one name
// (setting_role_text).
enum class SettingRole {
  kNone,
  kIterations,        // most iterations of the constraint solver in a step
  kTolerance,         // at which the constraint solver stops before them
  kContactSoftness,   // how contacts give way, in the engine's own measure: a time constant, an ERP, a frequency
  kContactStiffness,  // of a contact point along its normal, N/m; 0: the engine's own contacts
  kContactDamping,    // of the same, N s/m
  kContactRebound,    // what an impact gives back, in the engine's own measure: a coefficient, a damping ratio
};

// One knob of an engine as its user may set it. The default is the adapter's choice for a fair comparison, which need
// not be the engine's own; the meaning says so where they differ.
struct Setting {
  std::string name;                                  // lower_snake_case, as in `--set name=value`
  SettingValue default_value;                        // its alternative is the setting's type
  std::string unit;                                  // "" for none
  std::string meaning;                               // one line
  std::vector<std::string> choices = {};             // for text: the values allowed
  std::optional<double> minimum = {}, maximum = {};  // for numbers: inclusive
  SettingRole role = SettingRole::kNone;
  // Values of other settings, as in `--set`, without which this one does nothing.
  std::map<std::string, std::string> only_with = {};
};

// Values for one simulation. Always complete: every declared setting has a value.
struct Settings {
  double timestep = 1e-3;  // s
  std::map<std::string, SettingValue> values;

  // The value of a declared setting. A name or type that was not declared is a bug of the adapter: std::out_of_range or
  // std::bad_variant_access.
  template <typename T>
  const T& get(const std::string& name) const {
    return std::get<T>(values.at(name));
  }
};

// ---- capabilities ---------------------------------------------------------------------------------------------------

enum class Precision { kSingle, kDouble };

// kJoint: hinges hold exactly, the state is joint angles. kMaximal: six coordinates a body, joints are constraints.
enum class Coordinates { kJoint, kMaximal };

// How a joint's own spring and damper act.
enum class SpringKind {
  kNone,      // the engine has no way and the adapter adds none: models with springs are refused
  kExplicit,  // torque -k (q - q0) - b q' computed by the adapter from the state at the step's start
  kNative,    // the engine's own spring-damper; `spring_note` says of which kind (implicit, impulse, ...)
};

// A departure from the model's physics that was shown to be the engine's own. `test` names the conformance test that
// would fail; it then counts as a declared deviation as long as its figure stays within `bound` (in that test's own
// unit).
struct Deviation {
  std::string test;
  double bound = 0;
  std::string reason;  // one sentence, ends in the report's fairness table
  // Timesteps between which it shows, s, both included; a test that tries others has to pass there.
  double finest = 0;
  double coarsest = std::numeric_limits<double>::infinity();
};

// What an adapter does with one thing of a model.
enum class Fidelity { kExact, kApproximated, kRefused };

// How a contender carries over one feature of models (model/features.h).
struct FeatureSupport {
  Feature feature = Feature::kSlide;
  Fidelity fidelity = Fidelity::kExact;
  std::string
      how;  // approximated: what is done instead, with its measured bound; refused: why, and what the user can do
};

// What Simulation::read_contacts() gives of each contact point: nothing, the impulse along the normal, or friction too.
enum class ContactForces { kNone, kNormal, kAll };

// What a contender can do and how. Everything here is printed in the fairness table, so texts are short and say facts.
struct Capabilities {
  Precision precision = Precision::kDouble;
  Coordinates coordinates = Coordinates::kMaximal;
  std::string integrator;        // "semi-implicit Euler", "Runge-Kutta 4"
  int order = 1;                 // order of convergence on smooth systems
  std::string joint_solver;      // "none (joint coordinates)", "sequential impulse, 50 iterations"
  std::string contact_solver;    // "" when contact is not supported
  std::string contact_model;     // "rigid, ERP 0.2", "soft, solref 0.02 1"
  std::string friction_cone;     // "pyramid, 4 sides", "elliptic", "box"
  std::string friction_combine;  // how the model's pair coefficient is reached
  bool contact = false;
  bool joint_limits = false;
  bool torques = true;  // joint torques can be applied
  // The adapter gives Model::actuators to the engine as the engine's own, and set_torques() adds to them. False: the
  // caller computes their forces and passes them as torques.
  bool actuators = false;
  bool armature = false;  // exact joint armature; models with armature are refused without it
  SpringKind springs = SpringKind::kNone;
  std::string spring_note;
  bool gyroscopic = true;      // includes the gyroscopic torque w x (I w)
  std::string iterations;      // "50", "at most 100, tolerance 1e-8"; "" for a direct or no solver
  std::string sleep;           // "none (the engine has none)", "off"
  std::string speed_limits;    // "none", "200 m/s, 100 rad/s"
  std::string hidden_damping;  // "" when there is none
  std::string other;           // velocity quantisation, ... "" when there is nothing
  ContactForces contact_forces = ContactForces::kNone;
  std::string contact_forces_note;  // where they come from and what they leave out, or why there are none
  int threads = 1;
  // s; at shorter timesteps the engine loses slow motions, so that no fine-step run is made there; 0: no such timestep.
  double finest_timestep = 0;
  std::vector<Deviation> deviations;
  std::vector<FeatureSupport> features;  // a feature that is not listed is refused: "ENGINE has no slide joints"

  const FeatureSupport* support(Feature feature) const {
    const auto found = std::ranges::find(features, feature, &FeatureSupport::feature);
    return found == features.end() ? nullptr : &*found;
  }
};

// Where an engine's code comes from and how it was compiled.
struct BuildFacts {
  std::string version;   // the engine's own
  std::string source;    // "pip mujoco-core 4.0.1 (prebuilt)", "Debian libode-dev 0.16.2", ...
  std::string compiler;  // "g++ 12.2.0", "unknown (prebuilt)"
  std::string flags;
};

// What an adapter does with one thing of a model.
struct Limitation {
  Fidelity fidelity = Fidelity::kExact;
  std::string element;  // "joint 'knee' armature"
  std::string how;      // what is done instead, or what the user can do
};

// A ready-made choice of settings under a name of its own: what campaigns and tables list.
struct Contender {
  std::string name;                         // "mujoco-rk4"
  std::string summary;                      // one line
  std::map<std::string, SettingValue> set;  // only what differs from the defaults
};

// What the engine itself says it holds, read back through its API: proof that set-up arrived. World frame, SI.
struct EngineBody {
  double mass = 0;                   // kg
  Vec3 p_WBcm = Vec3::Zero();        // m
  Mat3 I_BBcm_W = Mat3::Identity();  // kg m^2, about the centre of mass, world axes
};
struct EngineJoint {
  Vec3 p_WJ = Vec3::Zero();  // a point on the axis, m; of a slide any point of the child
  Vec3 axis_W = Vec3::UnitZ();
  bool limited = false;
  double lower = 0, upper = 0;  // rad or m, in the model's convention
};
struct EngineView {
  std::vector<EngineBody> bodies;   // in the model's order; a massless body has mass 0 and is not compared further
  std::vector<EngineJoint> joints;  // hinges and slides, in the model's order
  Vec3 gravity = Vec3::Zero();
};

// One contact point of the last step as the engine's solver left it. World frame, SI.
struct ContactForce {
  int shape_a = 0, shape_b = 0;   // indices into Model::shapes, a < b
  Vec3 p_W = Vec3::Zero();        // m, where the force acts, with the bodies where the step began
  Vec3 n_W = Vec3::UnitZ();       // unit normal, from shape a to shape b
  double gap = 0;                 // m, between the surfaces when the step began; negative: they overlap
  Vec3 impulse_W = Vec3::Zero();  // N s over the step, on shape b's body; its opposite acts on shape a's. Along the
                                  // normal alone with ContactForces::kNormal
};

// ---- the three functions --------------------------------------------------------------------------------------------

// One running instance. Not thread-safe; instances are independent of each other.
class Simulation {
 public:
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;
  virtual ~Simulation() = default;

  // Input of the following step: one number per hinge (Nm, about its axis on the child, its opposite on the parent) and
  // slide (N, along its axis). Acts for exactly one step. A joint's explicit spring (SpringKind::kExplicit) is added
  // here, so this has to be called before every step of a model that has such springs or torques; other models may skip
  // it.
  virtual void set_torques(std::span<const double> torques) = 0;

  // `count` calls of the engine's own step function and nothing else: what the clock measures. Throws EngineError when
  // the engine reports failure.
  virtual void advance(int count) = 0;

  // The uniform state now, time included. `out` is resized; its vectors are reused between calls. Angles are unwrapped
  // relative to the previous read, which a maximal-coordinate adapter gets by passing its own last angles to
  // joints_from_bodies().
  virtual void read_state(State& out) const = 0;

  // Set-up as the engine holds it now.
  virtual EngineView view() const = 0;

  // Called before the first step: contacts are kept for read_contacts(). The motion stays the same, bit by bit; steps
  // may take longer, so nothing that is timed asks for it. False where the engine does not give them
  // (Capabilities::contact_forces).
  virtual bool keep_contacts() { return false; }

  // The contact points of the last step with the impulses of its solver, in the engine's order; those that moved a body
  // only to take it out of another one do not count. Empty before the first step and without keep_contacts().
  virtual void read_contacts(std::vector<ContactForce>& out) const { out.clear(); }

  // Step function of the paper's interface.
  void step(std::span<const double> torques) {
    set_torques(torques);
    advance(1);
  }

 protected:
  Simulation() = default;
};

class Engine {
 public:
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;
  virtual ~Engine() = default;

  virtual std::string name() const = 0;  // "bullet-f64": the plugin's name
  virtual BuildFacts build() const = 0;
  virtual std::vector<Setting> settings() const = 0;
  virtual std::vector<Contender> contenders() const = 0;
  virtual Capabilities capabilities(const Settings& settings) const = 0;

  // Everything of the model that is not carried over exactly; empty when all is exact. One kRefused makes create()
  // throw. Begins with what Capabilities::features say about the model (adapter.h: feature_limitations).
  virtual std::vector<Limitation> check(const Model& model, const Settings& settings) const = 0;

  // A simulation of `model` that starts in `state`, which may be any state (mid-run, with time != 0). Throws
  // UnsupportedError for what check() refuses, EngineError when the engine fails.
  virtual std::unique_ptr<Simulation> create(const Model& model, const State& state,
                                             const Settings& settings) const = 0;

  // Throws UnsupportedError for the first thing of `model` that check() refuses: how create() begins.
  void require_supported(const Model& model, const Settings& settings) const {
    for (const Limitation& limitation : check(model, settings)) {
      if (limitation.fidelity == Fidelity::kRefused) {
        throw UnsupportedError(name() + ": " + limitation.element + ": " + limitation.how);
      }
    }
  }

 protected:
  Engine() = default;
};

// ---- plugins --------------------------------------------------------------------------------------------------------

// Raised with every change of this header or of model.h and state.h; a plugin of another version is refused by name.
inline constexpr int kPluginVersion = 10;

struct PluginEntry {
  int version;
  Engine* (*make)();  // owned by the caller, lives as long as the process
};

}  // namespace assay

// Puts the plugin's entry point into its shared library. Use once, at global scope:
// ASSAY_ENGINE_PLUGIN(my::BulletEngine)
#define ASSAY_ENGINE_PLUGIN(EngineClass)                                                       \
  extern "C" __attribute__((visibility("default"))) assay::PluginEntry assay_engine_plugin() { \
    return {assay::kPluginVersion, []() -> assay::Engine* { return new EngineClass(); }};      \
  }
