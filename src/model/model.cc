#include "model/model.h"

#include <algorithm>

#include "base/hash.h"

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
    add(state.angle);
    add(state.rate);
  }
  const std::string& text() const { return bytes_; }

 private:
  void append(const void* data, size_t size) { bytes_.append(static_cast<const char*>(data), size); }
  std::string bytes_;
};

}  // namespace

int Model::dof() const {
  const auto free = std::count_if(bodies.begin(), bodies.end(), [](const Body& b) { return b.is_free(); });
  return static_cast<int>(hinges.size()) + 6 * static_cast<int>(free);
}

double Model::total_mass() const {
  double mass = 0;
  for (const Body& body : bodies) mass += body.mass;
  return mass;
}

bool Model::has_springs() const {
  return std::ranges::any_of(hinges, [](const Hinge& h) { return h.has_spring(); });
}

bool Model::has_armature() const {
  return std::ranges::any_of(hinges, [](const Hinge& h) { return h.armature != 0; });
}

bool Model::has_limits() const {
  return std::ranges::any_of(hinges, [](const Hinge& h) { return h.limited; });
}

std::string model_hash(const Model& model) {
  Bytes bytes;
  bytes.add(model.gravity);
  for (const Body& b : model.bodies) {
    bytes.add(b.name);
    bytes.add(b.parent);
    bytes.add(b.hinge);
    bytes.add(b.X_PB);
    bytes.add(b.mass);
    bytes.add(b.p_BBcm);
    for (int i = 0; i < 3; ++i) bytes.add(Vec3(b.I_BBcm_B.col(i)));
  }
  for (const Hinge& h : model.hinges) {
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
  for (const Actuator& a : model.actuators) {
    bytes.add(static_cast<int>(a.type));
    bytes.add(a.hinge);
    bytes.add(std::vector<double>{a.gear, a.kp, a.kv, a.control_lower, a.control_upper, a.force_lower, a.force_upper});
    if (a.sine.amplitude != 0) bytes.add(std::vector<double>{a.sine.amplitude, a.sine.frequency, a.sine.phase});
    bytes.add(a.control_limited);
    bytes.add(a.force_limited);
  }
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
