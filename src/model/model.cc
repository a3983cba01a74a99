#include "model/model.h"

#include <algorithm>

#include "base/hash.h"
#include "model/shape.h"

namespace assay {
namespace {

// The bytes that stand for a model's physics, in a fixed order; doubles bit by bit.
class Bytes {
 public:
  void add(double value) {
    const double canonical = value == 0 ? 0.0 : value;  // -0 and 0 are the same physics
    append(&canonical, sizeof canonical);
  }
  void add(int value) { append(&value, sizeof value); }
  void add(bool value) { add(static_cast<int>(value)); }
  void add(const std::string& text) {
    add(static_cast<int>(text.size()));
    bytes_ += text;
  }
  void add(const Vec3& v) {
    for (int i = 0; i < 3; ++i) add(v[i]);
  }
  void add(const Quat& q) {
    add(q.w());
    add(Vec3(q.vec()));
  }
  void add(const Pose& X) {
    add(X.p);
    add(X.q);
  }
  void add(const std::vector<double>& values) {
    add(static_cast<int>(values.size()));
    for (double value : values) add(value);
  }
  void add(const State& state) {
    for (const BodyState& body : state.bodies) {
      add(body.p_WBcm);
      add(body.q_WB);
      add(body.v_WBcm);
      add(body.w_WB);
    }
    add(state.position);
    add(state.velocity);
  }
  const std::string& text() const { return bytes_; }

 private:
  void append(const void* data, size_t size) { bytes_.append(static_cast<const char*>(data), size); }
  std::string bytes_;
};

void add(Bytes& bytes, const std::vector<JointTerm>& terms) {
  bytes.add(static_cast<int>(terms.size()));
  for (const JointTerm& term : terms) {
    bytes.add(term.joint);
    bytes.add(term.coefficient);
  }
}

// The words "motor" and "position" of an actuator on one joint keep the form that such models always had, so that
// stored results stay comparable.
void add(Bytes& bytes, const Actuator& a) {
  const double kp = -a.bias[1], kv = -a.bias[2];
  const bool one = a.terms.size() == 1 && a.bias[0] == 0;
  const bool motor = one && a.gain == 1 && !a.has_feedback();
  const bool position = one && !motor && a.gain == kp;
  constexpr int kMotor = 0, kPosition = 1, kOther = 2;
  const int servo = position ? kPosition : kOther;
  bytes.add(motor ? kMotor : servo);
  if (motor || position) {
    bytes.add(a.terms[0].joint);
  } else {
    add(bytes, a.terms);
    bytes.add(std::vector<double>{a.gain, a.bias[0], a.bias[1], a.bias[2]});
  }
  bytes.add(std::vector<double>{one ? a.terms[0].coefficient : 1, kp, kv, a.control_lower, a.control_upper,
                                a.force_lower, a.force_upper});
  if (a.sine.amplitude != 0) bytes.add(std::vector<double>{a.sine.amplitude, a.sine.frequency, a.sine.phase});
  bytes.add(a.control_limited);
  bytes.add(a.force_limited);
  if (a.has_activation()) {
    bytes.add(static_cast<int>(a.activation));
    bytes.add(a.activation_limited);
    bytes.add(std::vector<double>{a.time_constant, a.activation_start, a.activation_lower, a.activation_upper});
  }
}

// What models had no words for at first: nothing is added for a model that does not use it.
void add_extensions(Bytes& bytes, const Model& model) {
  for (const Body& b : model.bodies) {
    if (b.ball >= 0) bytes.add(b.ball);
  }
  for (const Joint& j : model.joints) {
    if (j.type != JointType::kHinge) bytes.add(std::string("slide"));
    if (j.dry_friction != 0) bytes.add(j.dry_friction);
  }
  for (const BallJoint& b : model.balls) {
    bytes.add(b.body);
    bytes.add(b.p_BJ);
    bytes.add(b.limited);
    bytes.add(b.spring_reference);
    bytes.add(std::vector<double>{b.upper, b.stiffness, b.damping, b.armature, b.dry_friction});
  }
  for (const Shape& s : model.shapes) {
    if (has_half_size(s.type)) bytes.add(s.half_size);
    if (s.data >= 0) bytes.add(s.data);
  }
  for (const Hull& h : model.hulls) {
    for (const Vec3& v : h.vertices) bytes.add(v);
  }
  for (const HeightField& h : model.height_fields) {
    bytes.add(h.rows);
    bytes.add(h.columns);
    bytes.add(std::vector<double>{h.half_x, h.half_y, h.base});
    bytes.add(h.heights);
  }
  for (const ContactPair& c : model.contacts) {
    if (c.torsional != 0 || c.rolling != 0) bytes.add(std::vector<double>{c.torsional, c.rolling});
  }
  for (const Coupling& c : model.couplings) {
    bytes.add(c.joint);
    add(bytes, c.terms);
    bytes.add(c.offset);
  }
  for (const Connect& c : model.connects) {
    bytes.add(c.body_a);
    bytes.add(c.body_b);
    bytes.add(c.p_A);
    bytes.add(c.p_B);
  }
  for (const Weld& w : model.welds) {
    bytes.add(w.body_a);
    bytes.add(w.body_b);
    bytes.add(w.X_AB);
  }
  for (const Tendon& t : model.tendons) {
    add(bytes, t.terms);
    bytes.add(t.limited);
    bytes.add(
        std::vector<double>{t.stiffness, t.rest_lower, t.rest_upper, t.damping, t.lower, t.upper, t.dry_friction});
  }
}

}  // namespace

int Model::dof() const {
  const auto free = std::count_if(bodies.begin(), bodies.end(), [](const Body& b) { return b.is_free(); });
  return static_cast<int>(joints.size() + (3 * balls.size())) + (6 * static_cast<int>(free));
}

double Model::total_mass() const {
  double mass = 0;
  for (const Body& body : bodies) mass += body.mass;
  return mass;
}

bool Model::has_springs() const {
  return std::ranges::any_of(joints, [](const Joint& h) { return h.has_spring(); });
}

bool Model::has_armature() const {
  return std::ranges::any_of(joints, [](const Joint& h) { return h.armature != 0; });
}

bool Model::has_limits() const {
  return std::ranges::any_of(joints, [](const Joint& h) { return h.limited; });
}

std::string model_hash(const Model& model) {
  Bytes bytes;
  bytes.add(model.gravity);
  for (const Body& b : model.bodies) {
    bytes.add(b.name);
    bytes.add(b.parent);
    bytes.add(b.joint);
    bytes.add(b.X_PB);
    bytes.add(b.mass);
    bytes.add(b.p_BBcm);
    for (int i = 0; i < 3; ++i) bytes.add(Vec3(b.I_BBcm_B.col(i)));
  }
  for (const Joint& h : model.joints) {
    bytes.add(h.body);
    bytes.add(h.p_BJ);
    bytes.add(h.axis_B);
    bytes.add(h.reference);
    bytes.add(h.limited);
    bytes.add(std::vector<double>{h.lower, h.upper, h.stiffness, h.spring_reference, h.damping, h.armature});
  }
  for (const Shape& s : model.shapes) {
    bytes.add(static_cast<int>(s.type));
    bytes.add(s.body);
    bytes.add(s.X_BS);
    bytes.add(std::vector<double>{s.radius, s.half_length, s.friction});
    bytes.add(s.collides);
  }
  for (const ContactPair& c : model.contacts) {
    bytes.add(c.shape_a);
    bytes.add(c.shape_b);
    bytes.add(c.friction);
  }
  for (const Actuator& a : model.actuators) add(bytes, a);
  add_extensions(bytes, model);
  bytes.add(model.initial);
  bytes.add(model.control0);
  return content_hash(bytes.text());
}

Model without_contacts(Model model) {
  model.contacts.clear();
  model.hash = model_hash(model);
  return model;
}

Model without_gravity(Model model) {
  model.gravity.setZero();
  model.hash = model_hash(model);
  return model;
}

}  // namespace assay
