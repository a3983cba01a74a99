#include "load/model_urdf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "model/joint.h"
#include "model/shape.h"

namespace assay {
namespace {

std::string xml_text(const std::string& text) {
  std::string out;
  for (const char c : text) {
    out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '"' ? "&quot;" : std::string(1, c);
  }
  return out;
}

std::string triple_text(const Vec3& v) { return fmt::format("{} {} {}", v.x(), v.y(), v.z()); }

// Roll, pitch and yaw.
Vec3 angles_of(const Quat& q) {
  const Mat3 R = q.normalized().toRotationMatrix();
  const double level = std::hypot(R(0, 0), R(1, 0));
  const double pitch = std::atan2(-R(2, 0), level);
  if (level > 1e-9) return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
  return {std::atan2(-R(1, 2), R(1, 1)), pitch, 0};
}

std::string origin_text(const Pose& X) {
  return fmt::format("<origin xyz=\"{}\" rpy=\"{}\"/>", triple_text(X.p), triple_text(angles_of(X.q)));
}

std::string stl_of(const Hull& hull) {
  std::string out(80, ' ');
  const auto put = [&out](const auto& value) { out.append(reinterpret_cast<const char*>(&value), sizeof value); };
  put(static_cast<std::uint32_t>(hull.faces.size()));
  for (const auto& face : hull.faces) {
    std::array<Vec3, 3> corner;
    for (size_t k = 0; k < 3; ++k) corner[k] = hull.vertices[static_cast<size_t>(face[k])];
    Vec3 normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    if (normal.norm() > 0) normal.normalize();
    for (const Vec3& v : {normal, corner[0], corner[1], corner[2]}) {
      for (int axis = 0; axis < 3; ++axis) put(static_cast<float>(v[axis]));
    }
    put(std::uint16_t{0});
  }
  return out;
}

class UrdfWriter {
 public:
  UrdfWriter(const Model& model, std::string folder, const std::map<std::string, double>& velocity_limits)
      : model_(from_zero(model)), folder_(std::move(folder)), velocity_limits_(velocity_limits) {}

  WrittenUrdf result() {
    if (!model_.balls.empty()) {
      throw InputError(fmt::format("'{}' has the ball joint '{}', which URDF has no joint for: convert it to MJCF",
                                   model_.name, model_.balls[0].name));
    }
    names();
    line(0, fmt::format("<robot name=\"{}\">", xml_text(model_.name)));
    line(1, fmt::format("<link name=\"{}\">", xml_text(world_)));
    collisions(kWorld, {});
    line(1, "</link>");
    for (size_t i = 0; i < model_.bodies.size(); ++i) link(static_cast<int>(i));
    for (size_t i = 0; i < model_.bodies.size(); ++i) joint(static_cast<int>(i));
    line(0, "</robot>");
    tell();
    return std::move(out_);
  }

 private:
  void line(size_t depth, const std::string& content) { out_.text += std::string(2 * depth, ' ') + content + "\n"; }

  void names() {
    std::set<std::string> taken;
    for (const Body& body : model_.bodies) taken.insert(body.name);
    while (taken.contains(world_)) world_ += "_";
  }

  std::string link_name(int body) const {
    return xml_text(body == kWorld ? world_ : model_.bodies[static_cast<size_t>(body)].name);
  }

  // The link's frame in its body's.
  Pose frame(int body) const {
    if (body == kWorld) return {};
    const Body& b = model_.bodies[static_cast<size_t>(body)];
    return b.is_free() ? Pose() : Pose{anchor_of(model_, b), Quat::Identity()};
  }

  void link(int index) {
    const Body& body = model_.bodies[static_cast<size_t>(index)];
    const Pose X_LB = frame(index).inverse();
    line(1, fmt::format("<link name=\"{}\">", link_name(index)));
    if (!body.is_massless()) {
      const Mat3& I = body.I_BBcm_B;
      line(2, "<inertial>");
      line(3, origin_text({X_LB * body.p_BBcm, Quat::Identity()}));
      line(3, fmt::format("<mass value=\"{}\"/>", body.mass));
      line(3, fmt::format("<inertia ixx=\"{}\" iyy=\"{}\" izz=\"{}\" ixy=\"{}\" ixz=\"{}\" iyz=\"{}\"/>", I(0, 0),
                          I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)));
      line(2, "</inertial>");
    }
    collisions(index, X_LB);
    line(1, "</link>");
  }

  void collision(const Pose& X, const std::string& geometry) {
    line(2, "<collision>");
    line(3, origin_text(X));
    line(3, fmt::format("<geometry>{}</geometry>", geometry));
    line(2, "</collision>");
  }

  void collisions(int body, const Pose& X_LB) {
    for (const Shape& shape : model_.shapes) {
      if (shape.body != body || !shape.collides) continue;
      const Pose X = X_LB * shape.X_BS;
      switch (shape.type) {
        case ShapeType::kSphere:
          collision(X, fmt::format("<sphere radius=\"{}\"/>", shape.radius));
          break;
        case ShapeType::kBox:
          collision(X, fmt::format("<box size=\"{}\"/>", triple_text(2 * shape.half_size)));
          break;
        case ShapeType::kCapsule:
          for (const double end : {-1.0, 1.0}) {
            collision(X * Pose{Vec3(0, 0, end * shape.half_length), Quat::Identity()},
                      fmt::format("<sphere radius=\"{}\"/>", shape.radius));
          }
          [[fallthrough]];
        case ShapeType::kCylinder:
          collision(X, fmt::format("<cylinder radius=\"{}\" length=\"{}\"/>", shape.radius, 2 * shape.half_length));
          break;
        case ShapeType::kHull: {
          const std::string file = fmt::format("{}/hull{}.stl", folder_, shape.data);
          collision(X, fmt::format("<mesh filename=\"{}\"/>", xml_text(file)));
          if (written_.insert(shape.data).second)
            out_.meshes.push_back({file, stl_of(model_.hulls[static_cast<size_t>(shape.data)])});
          break;
        }
        case ShapeType::kEllipsoid:
        case ShapeType::kPlane:
        case ShapeType::kHeightField:
          shapes_.insert(std::string(shapes_text(shape.type)));
      }
    }
  }

  // The largest force of the joint's actuators; 0 where they have no bound or there is none, as URDF's readers take it.
  double effort(int joint) {
    double sum = 0;
    for (const Actuator& a : model_.actuators) {
      if (a.terms.size() != 1 || a.terms[0].joint != joint) continue;
      double most = std::numeric_limits<double>::infinity();
      if (a.force_limited) most = std::max(std::abs(a.force_lower), std::abs(a.force_upper));
      if (a.control_limited && !a.has_feedback()) {
        most = std::min(most, std::abs(a.gain) * std::max(std::abs(a.control_lower), std::abs(a.control_upper)));
      }
      sum += std::abs(a.terms[0].coefficient) * most;
    }
    return std::isfinite(sum) ? sum : 0;
  }

  void joint(int index) {
    const Body& body = model_.bodies[static_cast<size_t>(index)];
    const Pose X_LL = frame(body.parent).inverse() * body.X_PB * frame(index);
    const auto open = [&](const std::string& name, const char* type) {
      line(1, fmt::format("<joint name=\"{}\" type=\"{}\">", xml_text(name), type));
      line(2, fmt::format("<parent link=\"{}\"/>", link_name(body.parent)));
      line(2, fmt::format("<child link=\"{}\"/>", link_name(index)));
      line(2, origin_text(X_LL));
    };
    if (body.is_free()) {
      open(body.name + "_base", "floating");
      line(1, "</joint>");
      return;
    }
    const Joint& j = model_.joints[static_cast<size_t>(body.joint)];
    constexpr double kAnyWay = 1e6, kAnySpeed = 1e3;  // m; rad/s, m/s: URDF wants numbers
    open(j.name, j.is_slide() ? "prismatic" : j.limited ? "revolute" : "continuous");
    line(2, fmt::format("<axis xyz=\"{}\"/>", triple_text(j.axis_B)));
    const double most = effort(body.joint);
    const auto known = velocity_limits_.find(j.name);
    const double fastest = known != velocity_limits_.end() ? known->second : kAnySpeed;
    if (known == velocity_limits_.end()) ++unknown_speeds_;
    if (j.limited || j.is_slide()) {
      line(2, fmt::format("<limit lower=\"{}\" upper=\"{}\" effort=\"{}\" velocity=\"{}\"/>",
                          j.limited ? j.lower : -kAnyWay, j.limited ? j.upper : kAnyWay, most, fastest));
    } else {
      line(2, fmt::format("<limit effort=\"{}\" velocity=\"{}\"/>", most, fastest));
    }
    if (j.damping != 0 || j.dry_friction != 0)
      line(2, fmt::format("<dynamics damping=\"{}\" friction=\"{}\"/>", j.damping, j.dry_friction));
    for (const Coupling& c : model_.couplings) {
      if (c.joint != body.joint || c.terms.size() != 1) continue;
      line(2, fmt::format("<mimic joint=\"{}\" multiplier=\"{}\" offset=\"{}\"/>",
                          xml_text(model_.joints[static_cast<size_t>(c.terms[0].joint)].name), c.terms[0].coefficient,
                          c.offset));
      break;
    }
    line(1, "</joint>");
  }

  void lacks(size_t count, const std::string& what) {
    if (count > 0) out_.left_out.push_back(fmt::format("URDF has no {}: {}", what, counted(count, "element")));
  }

  void tell() {
    const auto joints_with = [&](const auto& has) {
      return static_cast<size_t>(std::ranges::count_if(model_.joints, has));
    };
    lacks(joints_with([](const Joint& j) { return j.armature != 0; }), "armature of joints");
    lacks(joints_with([](const Joint& j) { return j.stiffness != 0; }), "springs of joints");
    lacks(static_cast<size_t>(std::ranges::count_if(
              model_.actuators,
              [](const Actuator& a) { return a.has_feedback() || a.has_activation() || a.terms.size() != 1; })),
          "drives but motors within an effort limit");
    lacks(static_cast<size_t>(
              std::ranges::count_if(model_.couplings, [](const Coupling& c) { return c.terms.size() != 1; })),
          "coupling of other than two joints");
    lacks(model_.connects.size() + model_.welds.size(), "closed loops");
    lacks(model_.tendons.size(), "tendons");
    for (const std::string& shape : shapes_) out_.left_out.push_back(fmt::format("URDF has no {}", shape));
    if (!model_.contacts.empty())
      out_.left_out.emplace_back("URDF has no friction of contacts and no list of the pairs that touch");
    if ((model_.gravity - Vec3(0, 0, -9.81)).norm() > 1e-9) out_.left_out.emplace_back("URDF has no gravity");
    if (unknown_speeds_ > 0) {
      out_.left_out.push_back(fmt::format("velocity limits are not known: 1000 rad/s or m/s is written for {}",
                                          counted(unknown_speeds_, "joint")));
    }
  }

  const Model model_;
  const std::string folder_;
  const std::map<std::string, double>& velocity_limits_;
  size_t unknown_speeds_ = 0;
  std::string world_ = "world";
  std::set<int> written_;         // hulls
  std::set<std::string> shapes_;  // types that are left out
  WrittenUrdf out_;
};

}  // namespace

WrittenUrdf model_urdf(const Model& model, const std::string& mesh_folder,
                       const std::map<std::string, double>& velocity_limits) {
  return UrdfWriter(model, mesh_folder, velocity_limits).result();
}

Model from_zero(Model model) {
  for (Joint& joint : model.joints) {
    if (joint.reference == 0) continue;
    Body& body = model.bodies[static_cast<size_t>(joint.body)];
    if (joint.is_slide()) {
      body.X_PB.p -= body.X_PB.q * (joint.reference * joint.axis_B);
    } else {
      const Quat turn(Eigen::AngleAxisd(-joint.reference, joint.axis_B));
      body.X_PB = body.X_PB * Pose{joint.p_BJ - turn * joint.p_BJ, turn};
    }
    joint.reference = 0;
  }
  return model;
}

}  // namespace assay
