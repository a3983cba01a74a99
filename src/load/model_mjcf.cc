#include "load/model_mjcf.h"

#include <initializer_list>
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
    bodies(kWorld, 2);
    line(1, "</worldbody>");
    if (!model_.contacts.empty()) pairs();
    if (!model_.actuators.empty()) actuators();
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

  void actuators() {
    line(1, "<actuator>");
    for (const Actuator& a : model_.actuators) {
      if (a.terms.size() != 1 || a.has_activation()) {
        throw InputError(
            fmt::format("the actuator '{}' acts on a tendon or has an activation and is not written to MJCF", a.name));
      }
      line(2,
           fmt::format(
               "<general name=\"{}\" joint=\"{}\" gear=\"{}\" gainprm=\"{}\" biastype=\"affine\" biasprm=\"{}\" "
               "ctrllimited=\"{}\" ctrlrange=\"{}\" forcelimited=\"{}\" forcerange=\"{}\"/>",
               escaped(a.name), escaped(model_.joints[static_cast<size_t>(a.terms[0].joint)].name),
               a.terms[0].coefficient, a.gain, numbers({a.bias[0], a.bias[1], a.bias[2]}), a.control_limited,
               numbers({a.control_lower, a.control_upper}), a.force_limited, numbers({a.force_lower, a.force_upper})));
    }
    line(1, "</actuator>");
  }

  const Model& model_;
  std::string text_;
};

}  // namespace

std::string model_mjcf(const Model& model) {
  if (!model.couplings.empty() || !model.connects.empty() || !model.welds.empty() || !model.tendons.empty()) {
    throw InputError(fmt::format("the constraints and tendons of '{}' are not written to MJCF", model.name));
  }
  return Writer(model).text();
}

}  // namespace assay
