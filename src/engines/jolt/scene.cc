#include "scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engines/adapter.h"

namespace assay::jolt {
namespace {

void store(const Vec3& v, double* out) { std::copy_n(v.data(), 3, out); }
void store(const Quat& q, double* out) {
  out[0] = q.w();
  out[1] = q.x();
  out[2] = q.y();
  out[3] = q.z();
}

// From the axes of Jolt's capsules and planes (y) to the model's (z).
Quat y_to_z() { return {std::numbers::sqrt2 / 2, std::numbers::sqrt2 / 2, 0, 0}; }

Quat shape_axes(const Shape& shape) {
  if (shape.type == ShapeType::kSphere) return shape.X_BS.q;
  return shape.X_BS.q * y_to_z();
}

int32_t jolt_type(ShapeType type) {
  switch (type) {
    case ShapeType::kSphere:
      return JOLT_SPHERE;
    case ShapeType::kCapsule:
      return JOLT_CAPSULE;
    case ShapeType::kPlane:
      return JOLT_PLANE;
    case ShapeType::kBox:
    case ShapeType::kCylinder:
    case ShapeType::kEllipsoid:
    case ShapeType::kHull:
    case ShapeType::kHeightField:
      break;
  }
  return -1;
}

jolt_body body_of(const Body& body, const BodyState& state, const Pose& frame) {
  const Mat3 R_BJ = frame.q.toRotationMatrix();
  const PrincipalInertia inertia = principal_inertia(R_BJ.transpose() * body.I_BBcm_B * R_BJ);
  jolt_body out{};
  out.mass = body.mass;
  store(inertia.diagonal, out.inertia);
  store(inertia.q_BI, out.q_inertia);
  store(state.p_WBcm, out.p);
  store(state.q_WB * frame.q, out.q);
  store(state.v_WBcm, out.v);
  store(state.w_WB, out.w);
  return out;
}

jolt_shape shape_of(const Shape& shape, const std::vector<Pose>& frames) {
  Pose X{shape.X_BS.p, shape_axes(shape)};
  if (shape.body != kWorld) {
    X = frames[shape.body].inverse() * X;
    // what body_frames() chose to be nothing is nothing, to the last bit
    if (X.p.norm() < 1e-14) X.p.setZero();
    if (X.q.vec().norm() < 1e-14) X.q.setIdentity();
  }
  jolt_shape out{};
  store(X.p, out.p);
  store(X.q, out.q);
  out.radius = shape.radius;
  out.half_length = shape.half_length;
  out.type = jolt_type(shape.type);
  out.body = shape.body;
  return out;
}

jolt_hinge hinge_of(const Model& model, int j, const std::vector<Pose>& frames, bool native_springs) {
  const Joint& hinge = model.joints[j];
  const Body& body = model.bodies[hinge.body];
  const Pose X_JB = frames[hinge.body].inverse();
  const Pose X_KP = body.parent == kWorld ? Pose{} : frames[body.parent].inverse();
  const double zero = zero_angle(hinge, native_springs);
  const Vec3 normal_B = hinge.axis_B.unitOrthogonal();
  const Vec3 turned_B = Eigen::AngleAxisd(zero - hinge.reference, hinge.axis_B) * normal_B;

  jolt_hinge out{};
  store(X_KP * anchor_in_parent(model, j), out.p_parent);
  store(X_KP.q * axis_in_parent(model, j), out.axis_parent);
  store(X_KP.q * (body.X_PB.q * turned_B), out.normal_parent);
  store(X_JB * hinge.p_BJ, out.p_child);
  store(X_JB.q * hinge.axis_B, out.axis_child);
  store(X_JB.q * normal_B, out.normal_child);
  out.parent = body.parent;
  out.child = hinge.body;
  out.limited = static_cast<int32_t>(hinge.limited);
  out.lower = hinge.lower - zero;
  out.upper = hinge.upper - zero;
  if (native_springs) {
    out.stiffness = hinge.stiffness;
    out.damping = hinge.damping;
    out.target = hinge.stiffness != 0 ? hinge.spring_reference - zero : 0;
  }
  return out;
}

}  // namespace

double zero_angle(const Joint& hinge, bool native_springs) {
  return middle_of_range(hinge, native_springs && hinge.stiffness != 0 ? hinge.spring_reference : hinge.reference);
}

std::vector<Pose> body_frames(const Model& model) {
  const ContactShapes touching = contact_shapes(model);
  std::vector<int> count(model.bodies.size(), 0);
  std::vector<const Shape*> only(model.bodies.size(), nullptr);
  for (size_t s = 0; s < model.shapes.size(); ++s) {
    const Shape& shape = model.shapes[s];
    if (!touching.contains(s) || shape.body == kWorld) continue;
    ++count[shape.body];
    only[shape.body] = &shape;
  }
  std::vector<Pose> frames;
  frames.reserve(model.bodies.size());
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    const Vec3& centre = model.bodies[b].p_BBcm;
    const bool centred = count[b] == 1 && (only[b]->X_BS.p - centre).norm() <= 1e-14 * (1 + centre.norm());
    Pose frame{centre, Quat::Identity()};
    if (centred) frame.q = shape_axes(*only[b]);
    frames.push_back(frame);
  }
  return frames;
}

World make_world(const Model& model, const State& state, const std::vector<Pose>& frames, const Options& options) {
  jolt_settings settings = options.world;
  store(model.gravity, settings.gravity);
  std::vector<jolt_body> bodies;
  std::vector<jolt_shape> shapes;
  std::vector<jolt_pair> pairs;
  std::vector<jolt_hinge> hinges;
  bodies.reserve(model.bodies.size());
  shapes.reserve(model.shapes.size());
  pairs.reserve(model.contacts.size());
  hinges.reserve(model.joints.size());
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    bodies.push_back(body_of(model.bodies[b], state.bodies[b], frames[b]));
  }
  for (const Shape& shape : model.shapes) shapes.push_back(shape_of(shape, frames));
  for (const ContactPair& pair : model.contacts) pairs.push_back({pair.friction, pair.shape_a, pair.shape_b});
  for (size_t j = 0; j < model.joints.size(); ++j) {
    hinges.push_back(hinge_of(model, static_cast<int>(j), frames, options.native_springs));
  }
  const auto count = [](const auto& list) { return static_cast<int32_t>(list.size()); };
  World world(jolt_create(&settings, bodies.data(), count(bodies), shapes.data(), count(shapes), pairs.data(),
                          count(pairs), hinges.data(), count(hinges)));
  if (!world) throw EngineError("Jolt could not make the model's bodies");
  return world;
}

}  // namespace assay::jolt
