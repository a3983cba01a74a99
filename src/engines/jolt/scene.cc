#include "scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engines/adapter.h"
#include "model/ellipsoid.h"
#include "model/weld_frames.h"

namespace assay::jolt {
namespace {

constexpr int kEllipsoidSubdivisions = 2;  // Jolt's hulls have at most 256 corners

void store(const Vec3& v, double* out) { std::copy_n(v.data(), 3, out); }
void store(const Quat& q, double* out) {
  out[0] = q.w();
  out[1] = q.x();
  out[2] = q.y();
  out[3] = q.z();
}

// From the axes of Jolt's capsules, cylinders and planes (y) to the model's (z).
Quat y_to_z() { return {std::numbers::sqrt2 / 2, std::numbers::sqrt2 / 2, 0, 0}; }

Quat shape_axes(const Shape& shape) {
  const bool along_z =
      shape.type == ShapeType::kCapsule || shape.type == ShapeType::kPlane || shape.type == ShapeType::kCylinder;
  return along_z ? Quat(shape.X_BS.q * y_to_z()) : shape.X_BS.q;
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
      return JOLT_BOX;
    case ShapeType::kCylinder:
      return JOLT_CYLINDER;
    case ShapeType::kEllipsoid:
    case ShapeType::kHull:
      return JOLT_HULL;
    case ShapeType::kHeightField:
      return JOLT_MESH;
  }
  return -1;
}

// A point of a body's MJCF frame in its Jolt frame; the world's stay.
Vec3 in_frame(const std::vector<Pose>& frames, int body, const Vec3& p) {
  return body == kWorld ? p : frames[body].inverse() * p;
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

void add_point(const Vec3& p, std::vector<double>& numbers) { numbers.insert(numbers.end(), {p.x(), p.y(), p.z()}); }

// Jolt makes a hull at unit size, so its points count from their middle.
void add_points(const Hull& hull, Pose& X, jolt_shape& out, std::vector<double>& numbers) {
  Vec3 lower = hull.vertices[0], upper = lower;
  for (const Vec3& vertex : hull.vertices) {
    lower = lower.cwiseMin(vertex);
    upper = upper.cwiseMax(vertex);
  }
  const Vec3 middle = (lower + upper) / 2;
  X.p = X * middle;
  for (const Vec3& vertex : hull.vertices) add_point(vertex - middle, numbers);
  out.points = static_cast<int32_t>(hull.vertices.size());
}

// The field's upper surface, two triangles a cell.
void add_surface(const HeightField& field, jolt_shape& out, std::vector<double>& numbers) {
  const int rows = field.rows, columns = field.columns;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      add_point({-field.half_x + column * 2 * field.half_x / (columns - 1),
                 -field.half_y + row * 2 * field.half_y / (rows - 1), field.heights[(row * columns) + column]},
                numbers);
    }
  }
  for (int row = 0; row + 1 < rows; ++row) {
    for (int column = 0; column + 1 < columns; ++column) {
      const double a = (row * columns) + column, b = a + 1, c = a + columns, d = c + 1;
      numbers.insert(numbers.end(), {a, b, c, b, d, c});
    }
  }
  out.points = rows * columns;
  out.triangles = 2 * (rows - 1) * (columns - 1);
}

jolt_shape shape_of(const Model& model, const Shape& shape, const std::vector<Pose>& frames,
                    std::vector<double>& numbers) {
  Pose X{shape.X_BS.p, shape_axes(shape)};
  if (shape.body != kWorld) {
    X = frames[shape.body].inverse() * X;
    // what body_frames() chose to be nothing is nothing, to the last bit
    if (X.p.norm() < 1e-14) X.p.setZero();
    if (X.q.vec().norm() < 1e-14) X.q.setIdentity();
  }
  jolt_shape out{};
  out.radius = shape.radius;
  out.half_length = shape.half_length;
  store(shape.half_size, out.half_size);
  out.type = jolt_type(shape.type);
  out.body = shape.body;
  out.first = static_cast<int32_t>(numbers.size());
  if (shape.type == ShapeType::kHull) add_points(model.hulls[shape.data], X, out, numbers);
  if (shape.type == ShapeType::kEllipsoid) {
    add_points(ellipsoid_hull(shape.half_size, kEllipsoidSubdivisions), X, out, numbers);
  }
  if (shape.type == ShapeType::kHeightField) add_surface(model.height_fields[shape.data], out, numbers);
  store(X.p, out.p);
  store(X.q, out.q);
  return out;
}

jolt_joint joint_of(const Model& model, int j, const std::vector<Pose>& frames, bool native_springs) {
  const Joint& hinge = model.joints[j];
  const Body& body = model.bodies[hinge.body];
  const Pose X_JB = frames[hinge.body].inverse();
  const Pose X_KP = body.parent == kWorld ? Pose{} : frames[body.parent].inverse();
  const double zero = zero_angle(hinge, native_springs);
  const Vec3 normal_B = hinge.axis_B.unitOrthogonal();
  const double way = zero - hinge.reference;  // from the pose X_PB to Jolt's zero
  const Vec3 turned_B = hinge.is_slide() ? normal_B : Vec3(Eigen::AngleAxisd(way, hinge.axis_B) * normal_B);
  Vec3 p_PJ = anchor_in_parent(model, j);
  if (hinge.is_slide()) p_PJ += way * axis_in_parent(model, j);

  jolt_joint out{};
  out.type = hinge.is_slide() ? JOLT_SLIDE : JOLT_HINGE;
  store(X_KP * p_PJ, out.p_parent);
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
  out.armature = hinge.armature;
  out.friction = hinge.dry_friction;
  if (native_springs) {
    out.stiffness = hinge.stiffness;
    out.damping = hinge.damping;
    out.target = hinge.stiffness != 0 ? hinge.spring_reference - zero : 0;
  }
  return out;
}

jolt_joint ball_of(const Model& model, const BallJoint& ball, const std::vector<Pose>& frames) {
  const Body& body = model.bodies[ball.body];
  jolt_joint out{};
  out.type = JOLT_BALL;
  out.parent = body.parent;
  out.child = ball.body;
  store(in_frame(frames, body.parent, body.X_PB * ball.p_BJ), out.p_parent);
  store(in_frame(frames, ball.body, ball.p_BJ), out.p_child);
  return out;
}

// The child is the body that is not the world.
jolt_joint connect_of(const Connect& connect, const std::vector<Pose>& frames) {
  const bool swapped = connect.body_a == kWorld;
  jolt_joint out{};
  out.type = JOLT_BALL;
  out.child = swapped ? connect.body_b : connect.body_a;
  out.parent = swapped ? connect.body_a : connect.body_b;
  store(in_frame(frames, out.child, swapped ? connect.p_B : connect.p_A), out.p_child);
  store(in_frame(frames, out.parent, swapped ? connect.p_A : connect.p_B), out.p_parent);
  return out;
}

jolt_joint weld_of(const Model& model, const Weld& weld, const std::vector<Pose>& frames) {
  const bool swapped = weld.body_a == kWorld;
  jolt_joint out{};
  out.type = JOLT_WELD;
  out.child = swapped ? weld.body_b : weld.body_a;
  out.parent = swapped ? weld.body_a : weld.body_b;
  const auto [X_A, X_B] = weld_frames(model, weld);
  const Pose& child = swapped ? X_B : X_A;
  const Pose& parent = swapped ? X_A : X_B;
  const auto axis = [&](int body, const Vec3& a) -> Vec3 {
    return body == kWorld ? a : Vec3(frames[body].q.conjugate() * a);
  };
  store(in_frame(frames, out.child, child.p), out.p_child);
  store(axis(out.child, child.q * Vec3::UnitX()), out.axis_child);
  store(axis(out.child, child.q * Vec3::UnitY()), out.normal_child);
  store(in_frame(frames, out.parent, parent.p), out.p_parent);
  store(axis(out.parent, parent.q * Vec3::UnitX()), out.axis_parent);
  store(axis(out.parent, parent.q * Vec3::UnitY()), out.normal_parent);
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
  if (settings.speculative_distance == 0) settings.speculative_distance = contact_margin(model, settings.timestep);
  std::vector<jolt_body> bodies;
  std::vector<jolt_shape> shapes;
  std::vector<jolt_pair> pairs;
  std::vector<jolt_joint> joints;
  std::vector<double> numbers;
  bodies.reserve(model.bodies.size());
  shapes.reserve(model.shapes.size());
  pairs.reserve(model.contacts.size());
  joints.reserve(model.joints.size());
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    bodies.push_back(body_of(model.bodies[b], state.bodies[b], frames[b]));
  }
  for (const Shape& shape : model.shapes) shapes.push_back(shape_of(model, shape, frames, numbers));
  for (const ContactPair& pair : model.contacts) pairs.push_back({pair.friction, pair.shape_a, pair.shape_b});
  for (size_t j = 0; j < model.joints.size(); ++j) {
    joints.push_back(joint_of(model, static_cast<int>(j), frames, options.native_springs));
  }
  for (const BallJoint& ball : model.balls) joints.push_back(ball_of(model, ball, frames));
  for (const Connect& connect : model.connects) joints.push_back(connect_of(connect, frames));
  for (const Weld& weld : model.welds) joints.push_back(weld_of(model, weld, frames));
  const auto count = [](const auto& list) { return static_cast<int32_t>(list.size()); };
  World world(jolt_create(&settings, bodies.data(), count(bodies), shapes.data(), count(shapes), pairs.data(),
                          count(pairs), numbers.data(), count(numbers), joints.data(), count(joints)));
  if (!world) throw EngineError("Jolt could not make the model's bodies");
  return world;
}

}  // namespace assay::jolt
