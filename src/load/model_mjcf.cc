#include "load/model_mjcf.h"

#include <algorithm>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "model/kinematics.h"

namespace assay {
namespace {

std::string numbers(std::initializer_list<double> values) {
  std::string text;
  for (const double value : values) text += fmt::format("{}{}", text.empty() ? "" : " ", value);
  return text;
}
std::string numbers(const Vec3& v) { return numbers({v.x(), v.y(), v.z()}); }
std::string numbers(const Quat& q) { return numbers({q.w(), q.x(), q.y(), q.z()}); }

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

class Writer {
 public:
  explicit Writer(const Model& model) : model_(model) {}

  std::string text() {
    line(0, fmt::format("<mujoco model=\"{}\">", escaped(model_.name)));
    line(1, "<compiler angle=\"radian\" autolimits=\"false\" inertiafromgeom=\"false\"/>");
    line(1, fmt::format("<option gravity=\"{}\"/>", numbers(model_.gravity)));
    if (!model_.hulls.empty()) assets();
    line(1, "<worldbody>");
    shapes(kWorld, 2);
    sites(kWorld, 2);
    bodies(kWorld, 2);
    line(1, "</worldbody>");
    if (!model_.contacts.empty()) pairs();
    sums();
    equalities();
    if (!model_.actuators.empty()) actuators();
    sines();
    line(0, "</mujoco>");
    return std::move(text_);
  }

 private:
  void line(size_t depth, const std::string& content) { text_ += std::string(2 * depth, ' ') + content + "\n"; }

  std::string shape_name(size_t index) const {
    const std::string& name = model_.shapes[index].name;
    return name.empty() ? fmt::format("shape{}", index) : escaped(name);
  }

  void assets() {
    line(1, "<asset>");
    for (size_t i = 0; i < model_.hulls.size(); ++i) {
      std::string vertices;
      for (const Vec3& vertex : model_.hulls[i].vertices) vertices += (vertices.empty() ? "" : " ") + numbers(vertex);
      line(2, fmt::format("<mesh name=\"hull{}\" vertex=\"{}\"/>", i, vertices));
    }
    line(1, "</asset>");
  }

  void shapes(int body, size_t depth) {
    for (size_t i = 0; i < model_.shapes.size(); ++i) {
      const Shape& shape = model_.shapes[i];
      if (shape.body != body) continue;
      std::string size, type;
      switch (shape.type) {
        case ShapeType::kSphere:
          type = "sphere", size = numbers({shape.radius});
          break;
        case ShapeType::kCapsule:
          type = "capsule", size = numbers({shape.radius, shape.half_length});
          break;
        case ShapeType::kCylinder:
          type = "cylinder", size = numbers({shape.radius, shape.half_length});
          break;
        case ShapeType::kPlane:
          type = "plane", size = "0 0 1";
          break;
        case ShapeType::kBox:
          type = "box", size = numbers(shape.half_size);
          break;
        case ShapeType::kEllipsoid:
          type = "ellipsoid", size = numbers(shape.half_size);
          break;
        case ShapeType::kHull:
          type = "mesh";
          break;
        case ShapeType::kHeightField:
          throw InputError(fmt::format("the height field '{}' is not written to MJCF", shape.name));
      }
      // pairs below say what touches
      std::string geom = fmt::format("<geom name=\"{}\" type=\"{}\"", shape_name(i), type);
      if (!size.empty()) geom += fmt::format(" size=\"{}\"", size);
      if (shape.type == ShapeType::kHull) geom += fmt::format(" mesh=\"hull{}\"", shape.data);
      geom += fmt::format(" pos=\"{}\" quat=\"{}\" friction=\"{} 0 0\" contype=\"0\" conaffinity=\"0\" rgba=\"{}\"/>",
                          numbers(shape.X_BS.p), numbers(shape.X_BS.q), shape.friction,
                          numbers({shape.rgba[0], shape.rgba[1], shape.rgba[2], shape.rgba[3]}));
      line(depth, geom);
    }
  }

  // Frames of connects and welds in a body, as sites.
  void sites(int body, size_t depth) {
    const auto site = [&](const std::string& name, const Pose& X) {
      line(depth, fmt::format("<site name=\"{}\" pos=\"{}\" quat=\"{}\"/>", name, numbers(X.p), numbers(X.q)));
    };
    for (size_t i = 0; i < model_.connects.size(); ++i) {
      const Connect& c = model_.connects[i];
      if (c.body_a == body) site(fmt::format("connect{}a", i), {c.p_A, Quat::Identity()});
      if (c.body_b == body) site(fmt::format("connect{}b", i), {c.p_B, Quat::Identity()});
    }
    for (size_t i = 0; i < model_.welds.size(); ++i) {
      const Weld& weld = model_.welds[i];
      if (weld.body_a == body) site(fmt::format("weld{}a", i), weld.X_AB);
      if (weld.body_b == body) site(fmt::format("weld{}b", i), {});
    }
  }

  // The element of joint number `body`'s, in the frame that X_BF puts into the body's.
  std::string joint(const Body& body, const Pose& X_BF) const {
    const Pose X_FB = X_BF.inverse();
    if (body.joint >= 0) {
      const Joint& j = model_.joints[static_cast<size_t>(body.joint)];
      return fmt::format(
          "<joint name=\"{}\" type=\"{}\" pos=\"{}\" axis=\"{}\" ref=\"{}\" limited=\"{}\" range=\"{}\" "
          "stiffness=\"{}\" "
          "springref=\"{}\" damping=\"{}\" armature=\"{}\" frictionloss=\"{}\"/>",
          escaped(j.name), j.is_slide() ? "slide" : "hinge", numbers(Vec3(X_FB * j.p_BJ)),
          numbers(Vec3(X_FB.q * j.axis_B)), j.reference, j.limited, numbers({j.lower, j.upper}), j.stiffness,
          j.spring_reference, j.damping, j.armature, j.dry_friction);
    }
    if (body.ball < 0) return "<freejoint/>";
    const BallJoint& j = model_.balls[static_cast<size_t>(body.ball)];
    if (!j.spring_reference.isApprox(Quat::Identity())) {
      throw InputError(
          fmt::format("the ball joint '{}' has a spring that is not at rest at its reference, which MJCF cannot "
                      "say",
                      j.name));
    }
    return fmt::format(
        "<joint name=\"{}\" type=\"ball\" pos=\"{}\" limited=\"{}\" range=\"{}\" stiffness=\"{}\" damping=\"{}\" "
        "armature=\"{}\" "
        "frictionloss=\"{}\"/>",
        escaped(j.name), numbers(Vec3(X_FB * j.p_BJ)), j.limited, numbers({0, j.upper}), j.stiffness, j.damping,
        j.armature, j.dry_friction);
  }

  void bodies(int parent, size_t depth) {
    for (size_t i = 0; i < model_.bodies.size(); ++i) {
      if (model_.bodies[i].parent != parent) continue;
      // massless bodies are joints of the body behind them
      std::vector<size_t> chain = {i};
      Pose X_PB = model_.bodies[i].X_PB;
      while (model_.bodies[chain.back()].is_massless()) {
        const auto only = static_cast<int>(chain.back());
        size_t next = 0, children = 0;
        for (size_t k = 0; k < model_.bodies.size(); ++k) {
          if (model_.bodies[k].parent == only) next = k, ++children;
        }
        if (children != 1) {
          throw InputError(fmt::format("the massless body '{}' has no single body behind it, which MJCF needs",
                                       model_.bodies[chain.back()].name));
        }
        chain.push_back(next);
        X_PB = X_PB * model_.bodies[next].X_PB;
      }
      const Body& body = model_.bodies[chain.back()];
      line(depth, fmt::format("<body name=\"{}\" pos=\"{}\" quat=\"{}\">", escaped(body.name), numbers(X_PB.p),
                              numbers(X_PB.q)));
      // of the frame of each body of the chain the last one's
      std::vector<Pose> frames(chain.size());
      for (size_t k = chain.size() - 1; k > 0; --k) frames[k - 1] = model_.bodies[chain[k]].X_PB * frames[k];
      for (size_t k = 0; k < chain.size(); ++k) line(depth + 1, joint(model_.bodies[chain[k]], frames[k]));
      const Mat3& I = body.I_BBcm_B;
      line(depth + 1,
           fmt::format("<inertial pos=\"{}\" mass=\"{}\" fullinertia=\"{}\"/>", numbers(body.p_BBcm), body.mass,
                       fmt::format("{} {} {} {} {} {}", I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2))));
      const auto index = static_cast<int>(chain.back());
      shapes(index, depth + 1);
      sites(index, depth + 1);
      bodies(index, depth + 1);
      line(depth, "</body>");
    }
  }

  void pairs() {
    line(1, "<contact>");
    for (const ContactPair& pair : model_.contacts) {
      const int dimensions = pair.rolling > 0 ? 6 : pair.torsional > 0 ? 4 : pair.friction > 0 ? 3 : 1;
      line(2, fmt::format("<pair geom1=\"{}\" geom2=\"{}\" condim=\"{}\" friction=\"{} {} {} {} {}\"/>",
                          shape_name(static_cast<size_t>(pair.shape_a)), shape_name(static_cast<size_t>(pair.shape_b)),
                          dimensions, pair.friction, pair.friction, pair.torsional, pair.rolling, pair.rolling));
    }
    line(1, "</contact>");
  }

  std::string joint_name(int joint) const { return escaped(model_.joints[static_cast<size_t>(joint)].name); }
  double reference(int joint) const { return model_.joints[static_cast<size_t>(joint)].reference; }

  // Equality constraints of fixed tendons and actuators of several joints need tendons of their own.
  static bool is_sum(const Coupling& coupling) { return coupling.terms.size() > 1; }
  static bool is_sum(const Actuator& actuator) { return actuator.terms.size() != 1; }

  void fixed(const std::string& name, const std::vector<JointTerm>& terms, const std::string& more = {}) {
    line(2, fmt::format("<fixed name=\"{}\"{}>", name, more));
    for (const JointTerm& term : terms) {
      line(3, fmt::format("<joint joint=\"{}\" coef=\"{}\"/>", joint_name(term.joint), term.coefficient));
    }
    line(2, "</fixed>");
  }

  void sums() {
    const bool any = !model_.tendons.empty() ||
                     std::ranges::any_of(model_.couplings, [](const Coupling& c) { return is_sum(c); }) ||
                     std::ranges::any_of(model_.actuators, [](const Actuator& a) { return is_sum(a); });
    if (!any) return;
    line(1, "<tendon>");
    for (const Tendon& t : model_.tendons) {
      std::string more = fmt::format(" damping=\"{}\" frictionloss=\"{}\" limited=\"{}\" range=\"{} {}\"", t.damping,
                                     t.dry_friction, t.limited, t.limited ? t.lower : 0, t.limited ? t.upper : 0);
      if (t.stiffness != 0) {
        const std::string rest =
            t.rest_lower == t.rest_upper ? numbers({t.rest_lower}) : numbers({t.rest_lower, t.rest_upper});
        more += fmt::format(" stiffness=\"{}\" springlength=\"{}\"", t.stiffness, rest);
      }
      fixed(escaped(t.name), t.terms, more);
    }
    for (size_t i = 0; i < model_.couplings.size(); ++i) {
      const Coupling& c = model_.couplings[i];
      if (!is_sum(c)) continue;
      std::vector<JointTerm> zero_sum = {{.joint = c.joint, .coefficient = 1}};
      for (const JointTerm& term : c.terms) zero_sum.push_back({.joint = term.joint, .coefficient = -term.coefficient});
      fixed(fmt::format("coupling{}", i), zero_sum);
    }
    for (size_t i = 0; i < model_.actuators.size(); ++i) {
      if (is_sum(model_.actuators[i])) fixed(fmt::format("actuator{}", i), model_.actuators[i].terms);
    }
    line(1, "</tendon>");
  }

  // MuJoCo's polynomials are of departures from the reference.
  void equalities() {
    if (model_.couplings.empty() && model_.connects.empty() && model_.welds.empty()) return;
    line(1, "<equality>");
    for (size_t i = 0; i < model_.couplings.size(); ++i) {
      const Coupling& c = model_.couplings[i];
      double start = c.offset - reference(c.joint);
      for (const JointTerm& term : c.terms) start += term.coefficient * reference(term.joint);
      if (is_sum(c)) {
        line(2, fmt::format("<tendon name=\"{}\" tendon1=\"coupling{}\" polycoef=\"{} 0 0 0 0\"/>", escaped(c.name), i,
                            start));
      } else if (c.terms.empty()) {
        line(2, fmt::format("<joint name=\"{}\" joint1=\"{}\" polycoef=\"{} 0 0 0 0\"/>", escaped(c.name),
                            joint_name(c.joint), start));
      } else {
        line(2,
             fmt::format("<joint name=\"{}\" joint1=\"{}\" joint2=\"{}\" polycoef=\"{} {} 0 0 0\"/>", escaped(c.name),
                         joint_name(c.joint), joint_name(c.terms[0].joint), start, c.terms[0].coefficient));
      }
    }
    for (size_t i = 0; i < model_.connects.size(); ++i) {
      line(2, fmt::format("<connect name=\"{0}\" site1=\"connect{1}a\" site2=\"connect{1}b\"/>",
                          escaped(model_.connects[i].name), i));
    }
    for (size_t i = 0; i < model_.welds.size(); ++i) {
      line(2,
           fmt::format("<weld name=\"{0}\" site1=\"weld{1}a\" site2=\"weld{1}b\"/>", escaped(model_.welds[i].name), i));
    }
    line(1, "</equality>");
  }

  void actuators() {
    line(1, "<actuator>");
    for (size_t i = 0; i < model_.actuators.size(); ++i) {
      const Actuator& a = model_.actuators[i];
      const std::string acts_on =
          is_sum(a) ? fmt::format("tendon=\"actuator{}\" gear=\"1\"", i)
                    : fmt::format("joint=\"{}\" gear=\"{}\"", joint_name(a.terms[0].joint), a.terms[0].coefficient);
      std::string activation;
      if (a.has_activation()) {
        activation = a.activation == ActivationType::kFilter
                         ? fmt::format(" dyntype=\"filter\" dynprm=\"{}\"", a.time_constant)
                         : std::string(" dyntype=\"integrator\"");
        activation +=
            fmt::format(" actlimited=\"{}\" actrange=\"{} {}\"", a.activation_limited,
                        a.activation_limited ? a.activation_lower : 0, a.activation_limited ? a.activation_upper : 0);
      }
      line(2,
           fmt::format("<general name=\"{}\" {} gainprm=\"{}\" biastype=\"affine\" biasprm=\"{}\" ctrllimited=\"{}\" "
                       "ctrlrange=\"{}\" forcelimited=\"{}\" forcerange=\"{}\"{}/>",
                       escaped(a.name), acts_on, a.gain, numbers({a.bias[0], a.bias[1], a.bias[2]}), a.control_limited,
                       numbers({a.control_lower, a.control_upper}), a.force_limited,
                       numbers({a.force_lower, a.force_upper}), activation));
    }
    line(1, "</actuator>");
  }

  void sines() {
    if (std::ranges::none_of(model_.actuators, [](const Actuator& a) { return a.sine.amplitude != 0; })) return;
    line(1, "<custom>");
    for (const Actuator& a : model_.actuators) {
      if (a.sine.amplitude == 0) continue;
      line(2, fmt::format("<numeric name=\"assay:sine:{}\" data=\"{}\"/>", escaped(a.name),
                          numbers({a.sine.amplitude, a.sine.frequency, a.sine.phase})));
    }
    line(1, "</custom>");
  }

  const Model& model_;
  std::string text_;
};

}  // namespace

std::string model_mjcf(const Model& model) { return Writer(model).text(); }

}  // namespace assay
