#include "model/model.h"

#include <algorithm>

#include "base/hash.h"
#include "model/fields.h"

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
  void add(const Mat3& M) {
    for (int i = 0; i < 3; ++i) add(Vec3(M.col(i)));
  }
  void add(const std::vector<Vec3>& points) {
    for (const Vec3& point : points) add(point);
  }
  void add(const std::vector<JointTerm>& terms) {
    add(static_cast<int>(terms.size()));
    for (const JointTerm& term : terms) {
      add(term.joint);
      add(term.coefficient);
    }
  }
  void add(ShapeType type) { add(static_cast<int>(type)); }
  void add(JointType type) {
    if (type == JointType::kSlide) add(std::string("slide"));
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
    bytes.add(a.terms);
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

// Visits fields (fields.h): what the hash has of a part at its place.
struct Own {
  Bytes& bytes;

  template <typename T>
  Own& operator()(const char*, const T& member) {
    bytes.add(member);
    return *this;
  }
  Own& list(int count) {
    bytes.add(count);
    return *this;
  }
  template <typename... Rows>
  void later(const Rows&...) {}
  template <typename T>
  void unhashed(const char*, const T&) {}
};

// What it has of it after all else.
struct Later {
  Bytes& bytes;

  template <typename T>
  Later& operator()(const char*, const T&) {
    return *this;
  }
  Later& list(int) { return *this; }
  template <typename Default, typename T>
  void later(const Default& otherwise, const char*, const T& member) {
    if (member != otherwise) bytes.add(member);
  }
  void later(double otherwise, const char*, double a, const char*, double b) {
    if (a != otherwise || b != otherwise) bytes.add(std::vector<double>{a, b});
  }
  template <typename T>
  void unhashed(const char*, const T&) {}
};

template <typename Visitor, typename Part>
void add(Bytes& bytes, const std::vector<Part>& parts) {
  Visitor visitor{bytes};
  for (const Part& part : parts) fields(visitor, part);
}

// Of parts that a model may be without: nothing is added for none.
template <typename Part>
void add_whole(Bytes& bytes, const std::vector<Part>& parts) {
  for (const Part& part : parts) {
    Own own{bytes};
    fields(own, part);
    Later later{bytes};
    fields(later, part);
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
  add<Own>(bytes, model.bodies);
  add<Own>(bytes, model.joints);
  add<Own>(bytes, model.shapes);
  add<Own>(bytes, model.contacts);
  for (const Actuator& a : model.actuators) add(bytes, a);
  add<Later>(bytes, model.bodies);
  add<Later>(bytes, model.joints);
  add_whole(bytes, model.balls);
  add<Later>(bytes, model.shapes);
  add_whole(bytes, model.hulls);
  add_whole(bytes, model.height_fields);
  add<Later>(bytes, model.contacts);
  add_whole(bytes, model.couplings);
  add_whole(bytes, model.connects);
  add_whole(bytes, model.welds);
  add_whole(bytes, model.tendons);
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
