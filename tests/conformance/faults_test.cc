// Mistakes that adapters make, put into a real engine one at a time: each has to fail the tests that are named with it.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <ostream>
#include <string_view>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "conformance/conformance.h"
#include "faulty_engine.h"
#include "model/kinematics.h"

namespace assay {
namespace {

// The contender that carries the faults: it passes the whole suite, joint limits, springs, armature and contact
// included, but for what its soft contacts are declared to do.
constexpr const char* kSound = "mujoco-euler";
// It has torsional and rolling friction only approximately, and with its pyramids of friction no stiffness of contacts
// and less friction between their axes; this one has all of them.
constexpr const char* kSoundInSpin = "bullet-mb";

// It takes velocity gains implicitly, which the Euler method does not.
constexpr const char* kSoundInServos = "mujoco-implicitfast";

// MuJoCo has no coefficient of restitution.
constexpr const char* kSoundInImpacts = "ode-quick";

bool about_spin(const std::string& test) {
  return test == "torsional-friction" || test == "rolling-friction" || test == "rolling-slows" ||
         test == "contact-compliance" || test == "friction-directions";
}

const char* carrier_of(const std::string& test) {
  if (test == "restitution") return kSoundInImpacts;
  if (test == "actuator-laws") return kSoundInServos;
  return about_spin(test) ? kSoundInSpin : kSound;
}

struct Case {
  Fault fault;
  std::vector<std::string> caught_by;
};

std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.fault.name; }

void every_free_body(const Model& model, State& state, const std::function<void(const Body&, BodyState&)>& edit) {
  for (size_t i = 0; i < model.bodies.size(); ++i) edit(model.bodies[i], state.bodies[i]);
}

void every_hinge(Model& model, const std::function<void(Joint&)>& edit) { std::ranges::for_each(model.joints, edit); }

std::vector<Case> set_up_faults() {
  return {
      {{.name = "one mass 1 % too large", .model = [](Model& m) { m.bodies.back().mass *= 1.01; }},
       {"readback", "planar-chain", "spatial-chain", "oblique-trees"}},
      {{.name = "one mass 0.01 % too large", .model = [](Model& m) { m.bodies.back().mass *= 1.0001; }},
       {"readback", "planar-chain", "oblique-trees"}},
      {{.name = "inertia of a box instead of a capsule",
        .model =
            [](Model& m) {
              for (Body& b : m.bodies) b.I_BBcm_B *= 0.01417 / 0.01194;
            }},
       {"readback", "planar-chain", "spatial-chain", "pendulum-period", "torque-for-one-step"}},
      {{.name = "products of inertia dropped",
        .model =
            [](Model& m) {
              for (Body& b : m.bodies) b.I_BBcm_B = Mat3(b.I_BBcm_B.diagonal().asDiagonal());
            }},
       {"readback", "oblique-trees", "torque-free-top"}},
      {{.name = "principal axes turned the wrong way",
        .model =
            [](Model& m) {
              for (Body& b : m.bodies) {
                const PrincipalInertia p = principal_inertia(b.I_BBcm_B);
                const Mat3 R = p.q_BI.toRotationMatrix();
                b.I_BBcm_B = R.transpose() * p.diagonal.asDiagonal() * R;
              }
            }},
       {"readback", "oblique-trees", "torque-free-top"}},
      {{.name = "centre of mass 1 mm off",
        .model =
            [](Model& m) {
              for (Body& b : m.bodies) b.p_BBcm.x() += 1e-3;
            }},
       {"readback", "state-round-trip", "planar-chain", "spatial-chain"}},
      {{.name = "anchor 1 mm off", .model = [](Model& m) { every_hinge(m, [](Joint& h) { h.p_BJ.z() += 1e-3; }); }},
       {"readback", "state-round-trip", "planar-chain", "spatial-chain"}},
      {{.name = "axis 1 mrad off",
        .model =
            [](Model& m) { every_hinge(m, [](Joint& h) { h.axis_B = (h.axis_B + Vec3(0, 0, 1e-3)).normalized(); }); }},
       {"readback", "state-round-trip", "planar-chain"}},
      {{.name = "axis the other way round",
        .model = [](Model& m) { every_hinge(m, [](Joint& h) { h.axis_B = -h.axis_B; }); }},
       {"readback", "state-round-trip"}},
      {{.name = "reference angle ignored",
        .model = [](Model& m) { every_hinge(m, [](Joint& h) { h.reference = 0; }); }},
       {"state-round-trip", "oblique-trees"}},
      {{.name = "gravity always downwards", .model = [](Model& m) { m.gravity = {0, 0, -9.81}; }},
       {"readback", "gravity-direction"}},
      {{.name = "gravity 9.80665", .model = [](Model& m) { m.gravity *= 9.80665 / 9.81; }},
       {"readback", "free-fall", "planar-chain", "pendulum-period"}},
      {{.name = "limits ignored", .model = [](Model& m) { every_hinge(m, [](Joint& h) { h.limited = false; }); }},
       {"readback", "joint-limit"}},
      {{.name = "limits count from the reference",
        .model =
            [](Model& m) {
              every_hinge(m, [](Joint& h) {
                h.lower += h.reference;
                h.upper += h.reference;
              });
            }},
       {"readback", "joint-limit"}},
      {{.name = "limits within one turn",
        .model =
            [](Model& m) {
              every_hinge(m, [](Joint& h) {
                h.lower = std::max(h.lower, -std::numbers::pi);
                h.upper = std::min(h.upper, std::numbers::pi);
              });
            }},
       {"wide-range"}},
      {{.name = "armature ignored", .model = [](Model& m) { every_hinge(m, [](Joint& h) { h.armature = 0; }); }},
       {"armature", "armature-impact"}},
      {{.name = "spring pulls to 0",
        .model = [](Model& m) { every_hinge(m, [](Joint& h) { h.spring_reference = 0; }); }},
       {"spring-damper"}},
      {{.name = "damper ignored", .model = [](Model& m) { every_hinge(m, [](Joint& h) { h.damping = 0; }); }},
       {"spring-damper"}},
      {{.name = "hidden joint damping 0.01",
        .model = [](Model& m) { every_hinge(m, [](Joint& h) { h.damping += 0.01; }); }},
       {"planar-chain", "spatial-chain", "oblique-trees", "pendulum-period", "constant-torque", "fast-motion"}},
      {{.name = "hidden joint damping 0.00001",
        .model = [](Model& m) { every_hinge(m, [](Joint& h) { h.damping += 1e-5; }); }},
       {"constant-torque", "fast-motion"}},
      {{.name = "timestep 0.1 % too long", .timestep_factor = 1.001}, {"batches", "free-fall", "planar-chain"}},
  };
}

std::vector<Case> contact_faults() {
  return {
      {{.name = "compliant contacts that carry 3 % more",
        .model =
            [](Model& m) {
              for (Body& b : m.bodies) b.mass *= 1.03;
            }},
       {"contact-compliance"}},
      {{.name = "impacts that give 3 % more back",
        .step =
            [](const State& before, State& after, double) {
              for (size_t b = 0; b < after.bodies.size(); ++b) {
                if (before.bodies[b].v_WBcm.dot(after.bodies[b].v_WBcm) < 0) after.bodies[b].v_WBcm *= 1.03;
              }
            }},
       {"restitution"}},
      {{.name = "compliant contacts that swing 1 % too fast", .timestep_factor = 1.01}, {"contact-compliance"}},
      {{.name = "friction doubled",
        .model =
            [](Model& m) {
              for (ContactPair& c : m.contacts) c.friction *= 2;
            }},
       {"sliding-capsule", "sphere-rolls", "friction-per-pair"}},
      {{.name = "friction of shapes multiplied",
        .model =
            [](Model& m) {
              for (ContactPair& c : m.contacts) {
                c.friction = m.shapes[c.shape_a].friction * m.shapes[c.shape_b].friction;
              }
            }},
       {"sliding-capsule", "sphere-rolls", "friction-per-pair"}},
      {{.name = "the larger of the shapes' frictions",
        .model =
            [](Model& m) {
              for (ContactPair& c : m.contacts) {
                c.friction = std::max(m.shapes[c.shape_a].friction, m.shapes[c.shape_b].friction);
              }
            }},
       {"friction-per-pair"}},
      {{.name = "contact margin of 5 mm",
        .model =
            [](Model& m) {
              for (Shape& s : m.shapes) s.radius += 5e-3;
            }},
       {"resting-height"}},
      {{.name = "shapes sink 5 mm",
        .model =
            [](Model& m) {
              for (Shape& s : m.shapes) s.radius -= 5e-3;
            }},
       {"resting-height", "bodies-collide"}},
      {{.name = "capsules along x",
        .model =
            [](Model& m) {
              for (Shape& s : m.shapes) {
                if (s.type == ShapeType::kCapsule) s.X_BS.q = s.X_BS.q * Quat(std::sqrt(0.5), 0, std::sqrt(0.5), 0);
              }
            }},
       {"resting-height", "bodies-collide"}},
      {{.name = "everything collides with everything",
        .model =
            [](Model& m) {
              m.contacts.clear();
              const int count = static_cast<int>(m.shapes.size());
              for (int a = 0; a < count; ++a) {
                for (int b = a + 1; b < count; ++b) m.contacts.push_back({a, b, 1});
              }
            }},
       {"excluded-pairs"}},
      {{.name = "nothing collides", .model = [](Model& m) { m.contacts.clear(); }},
       {"resting-height", "sliding-capsule", "sphere-rolls", "friction-per-pair", "bodies-collide", "excluded-pairs"}},
  };
}

std::vector<Case> state_faults() {
  return {
      {{.name = "orientation of the principal axes",
        .read =
            [](const Model& m, State& s) {
              every_free_body(m, s, [](const Body& body, BodyState& b) {
                b.q_WB = b.q_WB * principal_inertia(body.I_BBcm_B).q_BI;
              });
            }},
       {"state-round-trip", "torque-free-top"}},
      {{.name = "angular velocity in body axes",
        .read =
            [](const Model& m, State& s) {
              every_free_body(m, s, [](const Body&, BodyState& b) { b.w_WB = b.q_WB.conjugate() * b.w_WB; });
            }},
       {"state-round-trip", "torque-free-top"}},
      {{.name = "velocity of the body's origin",
        .read =
            [](const Model& m, State& s) {
              every_free_body(m, s,
                              [](const Body& body, BodyState& b) { b.v_WBcm -= b.w_WB.cross(b.q_WB * body.p_BBcm); });
            }},
       {"state-round-trip"}},
      {{.name = "position of the body's origin",
        .read =
            [](const Model& m, State& s) {
              every_free_body(m, s, [](const Body& body, BodyState& b) { b.p_WBcm -= b.q_WB * body.p_BBcm; });
            }},
       {"state-round-trip", "planar-chain"}},
      {{.name = "angles wrapped",
        .read =
            [](const Model&, State& s) {
              for (double& angle : s.position) angle = std::remainder(angle, 2 * std::numbers::pi);
            }},
       {"state-round-trip", "constant-torque"}},
      {{.name = "single precision inside",
        .read =
            [](const Model& m, State& s) {
              every_free_body(m, s,
                              [](const Body&, BodyState& b) { b.p_WBcm = b.p_WBcm.cast<float>().cast<double>(); });
            }},
       {"state-round-trip"}},
      {{.name = "state of one step ago", .stale = true}, {"free-fall", "torque-for-one-step"}},
      {{.name = "time starts at 0", .start = [](const Model&, State& s) { s.time = 0; }},
       {"state-round-trip", "batches", "restart"}},
      {{.name = "starts at rest",
        .start =
            [](const Model& m, State& s) {
              std::ranges::fill(s.velocity, 0.0);
              every_free_body(m, s, [](const Body&, BodyState& b) { b.v_WBcm.setZero(), b.w_WB.setZero(); });
            }},
       {"state-round-trip", "restart", "free-fall"}},
      {{.name = "other instances leak in", .leaks_instances = true}, {"independence"}},
      {{.name = "the process's history leaks in", .leaks_history = true}, {"determinism", "independence", "batches"}},
  };
}

std::vector<Case> motion_faults() {
  return {
      {{.name = "torque the other way round",
        .torques =
            [](std::vector<double>& t) {
              for (double& x : t) x = -x;
            }},
       {"torque-for-one-step", "constant-torque", "torque-reaction"}},
      {{.name = "torque 0.1 % too weak",
        .torques =
            [](std::vector<double>& t) {
              for (double& x : t) x *= 0.999;
            }},
       {"torque-for-one-step", "constant-torque", "torque-reaction"}},
      {{.name = "torque goes on", .repeats_torques = true}, {"torque-for-one-step"}},
      {{.name = "no gyroscopic torque",
        .step =
            [](const State& before, State& after, double) {
              for (size_t i = 0; i < after.bodies.size(); ++i) after.bodies[i].w_WB = before.bodies[i].w_WB;
            }},
       {"torque-free-top"}},
      {{.name = "body damping 0.01",
        .step =
            [](const State&, State& after, double h) {
              for (BodyState& b : after.bodies) {
                b.v_WBcm *= 1 - 0.01 * h;
                b.w_WB *= 1 - 0.01 * h;
              }
            }},
       {"free-fall", "torque-free-top", "fast-motion"}},
      {{.name = "spin limited to 47 rad/s",
        .step =
            [](const State&, State& after, double) {
              for (BodyState& b : after.bodies) {
                if (b.w_WB.norm() > 47) b.w_WB *= 47 / b.w_WB.norm();
              }
            }},
       {"fast-motion"}},
      {{.name = "advance(n) does n - 1", .loses_steps = true}, {"batches", "free-fall"}},
      {{.name = "order 4 declared for order 1", .capabilities = [](Capabilities& c) { c.order = 4; }},
       {"free-fall", "planar-chain", "spatial-chain", "torque-free-top"}},
  };
}

void every_ball(Model& model, const std::function<void(BallJoint&)>& edit) { std::ranges::for_each(model.balls, edit); }

std::vector<Case> joint_faults() {
  return {
      {{.name = "slide along the opposite axis",
        .model =
            [](Model& m) {
              every_hinge(m, [](Joint& j) {
                if (j.is_slide()) j.axis_B = -j.axis_B;
              });
            }},
       {"slide-force", "slide-limit", "tree-readback", "tree-round-trip", "planar-root", "random-massless-trees"}},
      {{.name = "slide's spring pulls to 0",
        .model = [](Model& m) { every_hinge(m, [](Joint& j) { j.spring_reference = 0; }); }},
       {"slide-spring"}},
      {{.name = "slide's armature ignored",
        .model = [](Model& m) { every_hinge(m, [](Joint& j) { j.armature = 0; }); }},
       {"slide-armature"}},
      {{.name = "limits of slides ignored",
        .model = [](Model& m) { every_hinge(m, [](Joint& j) { j.limited = false; }); }},
       {"slide-limit", "tree-readback"}},
      {{.name = "joints in a row lend 1 % of the mass",
        .model =
            [](Model& m) {
              for (Body& b : m.bodies) b.mass *= 1.01;
            }},
       {"massless-joints", "tree-readback", "random-trees", "random-massless-trees"}},
      {{.name = "hidden damping 0.001 in joints",
        .model = [](Model& m) { every_hinge(m, [](Joint& j) { j.damping += 1e-3; }); }},
       {"massless-joints", "planar-root", "random-trees"}},
      {{.name = "anchor of ball joints 1 mm off",
        .model = [](Model& m) { every_ball(m, [](BallJoint& b) { b.p_BJ.z() += 1e-3; }); }},
       {"conical-pendulum", "ball-armature"}},
      {{.name = "spring of ball joints without reference",
        .model = [](Model& m) { every_ball(m, [](BallJoint& b) { b.spring_reference = Quat::Identity(); }); }},
       {"ball-spring"}},
      {{.name = "damper of ball joints 2 % too strong",
        .model = [](Model& m) { every_ball(m, [](BallJoint& b) { b.damping *= 1.02; }); }},
       {"ball-spring"}},
      {{.name = "armature of ball joints 1 % too large",
        .model = [](Model& m) { every_ball(m, [](BallJoint& b) { b.armature *= 1.01; }); }},
       {"ball-armature"}},
      {{.name = "limit of ball joints ignored",
        .model = [](Model& m) { every_ball(m, [](BallJoint& b) { b.limited = false; }); }},
       {"ball-limit"}},
      {{.name = "dry friction 5 % too strong",
        .model =
            [](Model& m) {
              every_hinge(m, [](Joint& j) { j.dry_friction *= 1.05; });
              every_ball(m, [](BallJoint& b) { b.dry_friction *= 1.05; });
              for (Tendon& t : m.tendons) t.dry_friction *= 1.05;
            }},
       {"dry-friction", "ball-dry-friction", "tendon-dry-friction"}},
      {{.name = "slides and ball joints declared away",
        .capabilities =
            [](Capabilities& c) {
              std::erase_if(c.features, [](const FeatureSupport& f) {
                return f.feature == Feature::kSlide || f.feature == Feature::kBall;
              });
            }},
       {"declared-features"}},
  };
}

std::vector<Case> constraint_faults() {
  return {
      {{.name = "coupling's ratio 3 % off",
        .model =
            [](Model& m) {
              for (Coupling& c : m.couplings) {
                for (JointTerm& t : c.terms) t.coefficient *= 1.03;
              }
            }},
       {"coupling", "coupling-of-many"}},
      {{.name = "couplings ignored", .model = [](Model& m) { m.couplings.clear(); }},
       {"coupling", "coupling-of-many", "coupling-distances"}},
      {{.name = "connects ignored", .model = [](Model& m) { m.connects.clear(); }}, {"connect", "connect-distances"}},
      {{.name = "welds ignored", .model = [](Model& m) { m.welds.clear(); }}, {"weld", "weld-distances"}},
      {{.name = "welds that name the world first turned round",
        .model =
            [](Model& m) {
              for (Weld& w : m.welds) {
                if (w.body_a == kWorld) w.X_AB = w.X_AB.inverse();
              }
            }},
       {"weld-distances"}},
      {{.name = "connects to far points ignored",
        .model = [](Model& m) { std::erase_if(m.connects, [](const Connect& c) { return c.p_A.norm() > 5; }); }},
       {"connect-distances"}},
      {{.name = "limits of all joints ignored",
        .model =
            [](Model& m) {
              for (Joint& j : m.joints) j.limited = false;
              for (BallJoint& b : m.balls) b.limited = false;
            }},
       {"limits-under-load"}},
      {{.name = "tendon's spring at another length",
        .model =
            [](Model& m) {
              for (Tendon& t : m.tendons) t.rest_lower = t.rest_upper = 0;
            }},
       {"tendon-spring"}},
      {{.name = "limits of tendons ignored",
        .model =
            [](Model& m) {
              for (Tendon& t : m.tendons) t.limited = false;
            }},
       {"tendon-limit"}},
  };
}

std::vector<Case> shape_faults() {
  const auto every_pair = [](Model& m, const std::function<void(ContactPair&)>& edit) {
    std::ranges::for_each(m.contacts, edit);
  };
  return {
      {{.name = "friction of shapes 1.5 times as large",
        .model = [every_pair](Model& m) { every_pair(m, [](ContactPair& c) { c.friction *= 1.5; }); }},
       {"box-slides", "hull-slides"}},
      {{.name = "no friction of shapes",
        .model = [every_pair](Model& m) { every_pair(m, [](ContactPair& c) { c.friction = 0; }); }},
       {"box-slides", "hull-slides", "cylinder-rolls", "ellipsoid-rocks", "height-field"}},
      {{.name = "shapes 5 mm too large",
        .model =
            [](Model& m) {
              for (Shape& s : m.shapes) {
                s.half_size.array() += 5e-3;
                s.radius += 5e-3;
              }
            }},
       {"resting-shapes", "height-field"}},
      {{.name = "boxes and hulls a quarter wider",
        .model =
            [](Model& m) {
              for (Shape& s : m.shapes) s.half_size.x() *= 1.25;
              for (Hull& hull : m.hulls) {
                for (Vec3& v : hull.vertices) v.x() *= 1.25;
              }
            }},
       {"box-tips", "hull-tips"}},
      {{.name = "torsional and rolling friction 10 % too strong",
        .model =
            [every_pair](Model& m) {
              every_pair(m, [](ContactPair& c) {
                c.torsional *= 1.1;
                c.rolling *= 1.1;
              });
            }},
       {"torsional-friction", "rolling-friction", "rolling-slows"}},
      {{.name = "height fields are left out",
        .model =
            [](Model& m) {
              std::erase_if(m.contacts,
                            [&m](const ContactPair& c) { return m.shapes[c.shape_a].type == ShapeType::kHeightField; });
            }},
       {"height-field", "height-field-edges"}},
  };
}

// Of an engine's own actuators.
std::vector<Case> actuator_faults() {
  const auto every_actuator = [](const std::function<void(Actuator&)>& edit) {
    return [edit](Model& m) { std::ranges::for_each(m.actuators, edit); };
  };
  return {
      {{.name = "actuators ignored", .model = [](Model& m) { m.actuators.clear(); }},
       {"actuator-laws", "velocity-gain"}},
      {{.name = "velocity gains ignored", .model = every_actuator([](Actuator& a) { a.bias[2] = 0; })},
       {"actuator-laws", "velocity-gain"}},
      {{.name = "velocity gains of other joints' actuators",
        .model =
            [](Model& m) {
              for (Actuator& a : m.actuators) {
                for (JointTerm& t : a.terms) t.joint = 1 - t.joint;
              }
            }},
       {"actuator-laws", "velocity-gain"}},
      {{.name = "gear not squared in the feedback", .model = every_actuator([](Actuator& a) {
                                                      if (a.terms.size() == 1) a.bias[1] /= a.terms[0].coefficient;
                                                    })},
       {"actuator-laws"}},
      {{.name = "control's clamp ignored", .model = every_actuator([](Actuator& a) { a.control_limited = false; })},
       {"actuator-laws"}},
      {{.name = "force's clamp ignored", .model = every_actuator([](Actuator& a) { a.force_limited = false; })},
       {"actuator-laws"}},
      {{.name = "sines ignored", .model = every_actuator([](Actuator& a) { a.sine.amplitude = 0; })},
       {"actuator-laws"}},
      {{.name = "activations begin at 0", .model = every_actuator([](Actuator& a) { a.activation_start = 0; })},
       {"actuator-laws"}},
      {{.name = "activations 5 % slower", .model = every_actuator([](Actuator& a) { a.time_constant *= 1.05; })},
       {"actuator-laws"}},
      {{.name = "a transmission to two joints pulls one",
        .model = every_actuator([](Actuator& a) { a.terms.resize(1); })},
       {"actuator-laws"}},
  };
}

std::vector<Case> wide_faults() {
  return {
      {{.name = "no gyroscopic torque of light bodies",
        .step =
            [](const State& before, State& after, double) {
              // the first of spinning-bodies is one of 1 g and 1 mm
              after.bodies.front().w_WB = before.bodies.front().w_WB;
            }},
       {"spinning-bodies"}},
      {{.name = "inertia of light bodies raised to a least value",
        .model =
            [](Model& m) {
              for (Body& b : m.bodies) {
                if (b.I_BBcm_B.trace() < 1e-9) b.I_BBcm_B += 1e-11 * Mat3::Identity();
              }
            }},
       {"spinning-bodies"}},
      {{.name = "joints damped by 0.1 % of the spring-dampers' own",
        .model =
            [](Model& m) {
              for (Joint& j : m.joints) j.damping *= 1.001;
            }},
       {"wide-trees"}},
      {{.name = "limits reached 1 rad early",
        .model =
            [](Model& m) {
              for (Joint& j : m.joints) {
                j.lower += 1.5;
                j.upper -= 1.3;
              }
            }},
       {"wide-trees"}},
      {{.name = "a start beyond a limit moves the limit",
        .model =
            [](Model& m) {
              for (Joint& j : m.joints) {
                j.lower -= 0.1;
                j.upper += 0.1;
              }
            }},
       {"beyond-limit"}},
      {{.name = "friction 12 % too strong away from the origin",
        .model =
            [](Model& m) {
              for (ContactPair& c : m.contacts) {
                const int body = std::max(m.shapes[c.shape_a].body, m.shapes[c.shape_b].body);
                if (m.initial.bodies[body].p_WBcm.norm() > 3) c.friction *= 1.12;
              }
            }},
       {"far-from-origin"}},
      {{.name = "half the friction of links that touch in several points",
        .model =
            [](Model& m) {
              for (ContactPair& c : m.contacts) {
                const Shape& shape = m.shapes[std::max(c.shape_a, c.shape_b)];
                const bool jointed = std::ranges::any_of(m.joints, [&](const Joint& j) {
                  return j.body == shape.body || m.bodies[j.body].parent == shape.body;
                });
                if (jointed && shape.type != ShapeType::kSphere) c.friction /= 2;
              }
            }},
       {"friction-of-links"}},
      {{.name = "half the friction of balls behind slides",
        .model =
            [](Model& m) {
              for (ContactPair& c : m.contacts) {
                const Body& body = m.bodies[std::max(m.shapes[c.shape_a].body, m.shapes[c.shape_b].body)];
                if (body.joint >= 0 && m.joints[body.joint].is_slide()) c.friction /= 2;
              }
            }},
       {"friction-of-links"}},
      {{.name = "friction holds on steeper slopes between x and y",
        .model =
            [](Model& m) {
              const bool between = std::abs(m.gravity.x()) > 1 && std::abs(m.gravity.y()) > 1;
              for (ContactPair& c : m.contacts) c.friction *= between ? 1.41 : 1;
            }},
       {"friction-directions"}},
      {{.name = "friction a tenth too strong 500 m from the origin",
        .model =
            [](Model& m) {
              for (ContactPair& c : m.contacts) {
                const int body = std::max(m.shapes[c.shape_a].body, m.shapes[c.shape_b].body);
                if (m.initial.bodies[body].p_WBcm.norm() > 500) c.friction *= 1.1;
              }
            }},
       {"distances"}},
      {{.name = "bodies bounce by a fifth",
        .step =
            [](const State& before, State& after, double) {
              for (size_t i = 0; i < after.bodies.size(); ++i) {
                const double down = before.bodies[i].v_WBcm.z();
                if (down < -1 && after.bodies[i].v_WBcm.z() > down / 2) after.bodies[i].v_WBcm.z() = -0.2 * down;
              }
            }},
       {"inelastic-impact"}},
      {{.name = "contact forces a twentieth too small", .contact_factor = 0.95}, {"contact-forces", "forces-of-boxes"}},
      {{.name = "friction a quarter too strong",
        .model =
            [](Model& m) {
              for (ContactPair& c : m.contacts) c.friction *= 1.25;
            }},
       {"stick-and-slip", "far-from-origin"}},
      {{.name = "nothing holds heavy bodies",
        .model =
            [](Model& m) {
              std::erase_if(m.contacts, [&m](const ContactPair& c) {
                const Body& body = m.bodies[std::max(m.shapes[c.shape_a].body, m.shapes[c.shape_b].body)];
                return body.mass > 5;
              });
              m.contacts.resize(m.contacts.size() / 2);
            }},
       {"stack-10"}},
      {{.name = "contacts of one body in two ignored",
        .model =
            [](Model& m) {
              std::erase_if(m.contacts, [&m](const ContactPair& c) { return m.shapes[c.shape_a].body % 2 == 0; });
              m.contacts.resize(m.contacts.size() / 2);
            }},
       {"stack-10", "stack-1000"}},
  };
}

// Of bodies whose turn in an edit's steps is at most `least`, rad, the turn is taken back.
void drop_turns(const State& before, State& after, double least) {
  for (size_t i = 0; i < after.bodies.size(); ++i) {
    const Quat turned = after.bodies[i].q_WB * before.bodies[i].q_WB.conjugate();
    if (2 * turned.vec().norm() <= least) after.bodies[i].q_WB = before.bodies[i].q_WB;
  }
  for (size_t j = 0; j < after.position.size(); ++j) {
    if (std::abs(after.position[j] - before.position[j]) <= least) after.position[j] = before.position[j];
  }
}

std::vector<Case> rest_faults() {
  return {
      {{.name = "bodies gain a tenth of their speed every ten steps",
        .step =
            [](const State&, State& after, double) {
              for (BodyState& b : after.bodies) {
                b.v_WBcm.head<2>() *= 1.1;
                b.w_WB *= 1.1;
              }
            }},
       {"bodies-at-rest", "cylinders-at-rest", "bodies-on-field", "cylinders-on-field"}},
      {{.name = "a level ground that slopes by a thousandth", .model = [](Model& m) { m.gravity.x() += 0.00981; }},
       {"bodies-at-rest", "cylinders-at-rest"}},
      {{.name = "a level ground that slopes by an eighth", .model = [](Model& m) { m.gravity.x() += 9.81 / 8; }},
       {"stacks-at-rest"}},
      {{.name = "turns of at most a microradian a step dropped",
        .step = [](const State& before, State& after, double) { drop_turns(before, after, 1e-5); }},
       {"slow-rotations", "near-equilibrium"}},
      {{.name = "bodies slower than a centimetre and ten milliradians a second stop",
        .step =
            [](const State&, State& after, double) {
              for (BodyState& b : after.bodies) {
                if (b.w_WB.norm() < 0.011) b.v_WBcm.setZero(), b.w_WB.setZero();
              }
              for (double& rate : after.velocity) {
                if (std::abs(rate) < 0.011) rate = 0;
              }
            }},
       {"slow-rotations", "near-equilibrium"}},
  };
}

class Faults : public testing::TestWithParam<Case> {};

TEST_P(Faults, AreCaught) {
  const auto names = Registry::instance().contender_names();
  const std::string& first = GetParam().caught_by.front();
  const std::string carrier = carrier_of(first);
  if (std::ranges::find(names, carrier) == names.end()) GTEST_SKIP() << carrier << " is not built";
  const ResolvedContender sound = Registry::instance().resolve(carrier);
  const FaultyEngine engine(sound, GetParam().fault);
  for (const ConformanceResult& result : run_conformance(engine.contender(), {.tests = GetParam().caught_by})) {
    EXPECT_EQ(result.status, ConformanceStatus::kFail)
        << GetParam().fault.name << " passed " << result.test << ": " << result.figure << " " << result.unit
        << ", tolerance " << result.tolerance << " (" << result.note << ")";
    EXPECT_TRUE(std::isfinite(result.figure));
  }
}

std::string case_name(const testing::TestParamInfo<Case>& info) {
  std::string name = info.param.fault.name;
  std::ranges::replace_if(name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(SetUp, Faults, testing::ValuesIn(set_up_faults()), case_name);
INSTANTIATE_TEST_SUITE_P(Contact, Faults, testing::ValuesIn(contact_faults()), case_name);
INSTANTIATE_TEST_SUITE_P(States, Faults, testing::ValuesIn(state_faults()), case_name);
INSTANTIATE_TEST_SUITE_P(Joints, Faults, testing::ValuesIn(joint_faults()), case_name);
INSTANTIATE_TEST_SUITE_P(Constraints, Faults, testing::ValuesIn(constraint_faults()), case_name);
INSTANTIATE_TEST_SUITE_P(Shapes, Faults, testing::ValuesIn(shape_faults()), case_name);
INSTANTIATE_TEST_SUITE_P(Actuators, Faults, testing::ValuesIn(actuator_faults()), case_name);
INSTANTIATE_TEST_SUITE_P(Wide, Faults, testing::ValuesIn(wide_faults()), case_name);
INSTANTIATE_TEST_SUITE_P(Rest, Faults, testing::ValuesIn(rest_faults()), case_name);
INSTANTIATE_TEST_SUITE_P(Motion, Faults, testing::ValuesIn(motion_faults()), case_name);

// A suite that nothing passes would catch every fault.
TEST(Suite, TheWrapperAloneIsSound) {
  const auto names = Registry::instance().contender_names();
  if (std::ranges::find(names, kSound) == names.end()) GTEST_SKIP() << kSound << " is not built";
  const ResolvedContender sound = Registry::instance().resolve(kSound);
  const FaultyEngine engine(sound, {.name = "none"});
  for (const ConformanceResult& result : run_conformance(engine.contender())) {
    if (about_spin(result.test) || result.test == "restitution") continue;
    constexpr std::array<std::string_view, 8> kSoft = {"inelastic-impact",   "bodies-on-field",   "cylinders-on-field",
                                                       "stack-1000",         "limits-under-load", "coupling-distances",
                                                       "height-field-edges", "velocity-gain"};
    const bool soft = std::ranges::find(kSoft, result.test) != kSoft.end();
    EXPECT_EQ(result.status, soft ? ConformanceStatus::kDeviation : ConformanceStatus::kPass)
        << result.test << ": " << result.note;
  }
}

// Every test can fail: some fault above is caught by it.
TEST(Suite, EveryTestCatchesSomething) {
  std::vector<std::string> catching;
  for (const auto& cases : {set_up_faults(), contact_faults(), state_faults(), motion_faults(), joint_faults(),
                            constraint_faults(), shape_faults(), actuator_faults(), wide_faults(), rest_faults()}) {
    for (const Case& c : cases) catching.insert(catching.end(), c.caught_by.begin(), c.caught_by.end());
  }
  for (const ConformanceTest& test : conformance_tests()) EXPECT_THAT(catching, testing::Contains(test.name));
}

// The same mistakes without a wrapper: engines' own settings that are known to be wrong for a comparison.
TEST(Suite, SeesSettingsThatAreKnownToBeWrong) {
  struct Wrong {
    std::string contender, setting, value;
    std::vector<std::string> caught_by;
  };
  const std::vector<Wrong> wrongs = {
      {"ode-step", "gyroscopic", "off", {"torque-free-top", "spatial-chain", "oblique-trees", "torque-reaction"}},
      {"bullet-si-f64", "gyroscopic", "off", {"torque-free-top", "spatial-chain", "oblique-trees", "torque-reaction"}},
      {"bullet-si-f64", "linear_slop", "0.01", {"resting-height", "bodies-collide"}},
      {"jolt-f64", "pair_cache", "on", {"bodies-at-rest", "cylinders-at-rest"}},
      {"jolt-f64", "inner_edges", "on", {"bodies-on-field", "cylinders-on-field"}},
      {"rapier-impulse-f64", "contact_coherence", "on", {"bodies-at-rest"}},
      {"rapier-impulse-f64", "contact_natural_frequency", "30", {"stacks-at-rest"}},
  };
  const auto names = Registry::instance().contender_names();
  int seen = 0;
  for (const Wrong& wrong : wrongs) {
    if (std::ranges::find(names, wrong.contender) == names.end()) continue;
    const auto contender = Registry::instance().resolve(wrong.contender, {{wrong.setting, wrong.value}});
    for (const ConformanceResult& result : run_conformance(contender, {.tests = wrong.caught_by})) {
      // an adapter may declare what a setting does
      EXPECT_THAT(result.status, testing::AnyOf(ConformanceStatus::kFail, ConformanceStatus::kDeviation))
          << wrong.contender << " " << wrong.setting << "=" << wrong.value << " passed " << result.test;
    }
    ++seen;
  }
  if (seen == 0) GTEST_SKIP() << "none of the engines is built";
}

// What loses slow turns at short timesteps says from which one on it can be asked.
TEST(Suite, AsksForNoTimestepThatAContenderDeclaresTooShort) {
  const auto names = Registry::instance().contender_names();
  if (std::ranges::find(names, "jolt-f64") == names.end()) GTEST_SKIP() << "Jolt is not built";
  const auto finest = [](const std::string& slow_turns) {
    const auto contender = Registry::instance().resolve("jolt-f64", {{"slow_turns", slow_turns}});
    return contender.engine->capabilities(contender.settings).finest_timestep;
  };
  EXPECT_GT(finest("off"), 0.5e-3);
  EXPECT_EQ(finest("on"), 0);
}

TEST(Suite, RefusesAnEngineThatDoesNothing) {
  const auto names = Registry::instance().contender_names();
  if (std::ranges::find(names, "null") == names.end()) GTEST_SKIP() << "the null engine is not built";
  const auto results = run_conformance(Registry::instance().resolve("null"), {.tests = {"free-fall", "planar-chain"}});
  ASSERT_EQ(results.size(), 2U);
  for (const ConformanceResult& result : results) EXPECT_EQ(result.status, ConformanceStatus::kFail) << result.test;
  EXPECT_FALSE(conforms(results));
}

}  // namespace
}  // namespace assay
