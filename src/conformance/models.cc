#include "conformance/models.h"

#include <cmath>
#include <random>
#include <utility>

#include <fmt/format.h>

#include "model/kinematics.h"

namespace assay::conformance {
namespace {

Quat turned(double degrees, const Vec3& axis) { return about_axis(degrees * EIGEN_PI / 180, axis); }

// The bodies of joint coordinates, with the ball joints' relative motions as they are in `state`.
void place_with_balls(const Model& model, State& state) {
  std::vector<Quat> rotation;
  std::vector<Vec3> velocity;
  for (size_t k = 0; k < model.balls.size(); ++k) {
    rotation.push_back(ball_rotation(model, state, static_cast<int>(k)));
    velocity.push_back(ball_velocity(model, state, static_cast<int>(k)));
  }
  // a ball's absolute motion needs its parent's, so balls are set from the roots on
  for (size_t k = 0; k < model.balls.size(); ++k) {
    bodies_from_joints(model, state);
    set_ball(model, state, static_cast<int>(k), rotation[k], velocity[k]);
  }
  bodies_from_joints(model, state);
}

}  // namespace

Quat about_axis(double angle, const Vec3& axis) { return Quat(Eigen::AngleAxisd(angle, axis.normalized())); }

void set_ball(const Model& model, State& state, int ball, const Quat& rotation, const Vec3& velocity) {
  const int child = model.balls[ball].body;
  const Body& body = model.bodies[child];
  const bool root = body.parent == kWorld;
  BodyState& s = state.bodies[child];
  s.q_WB = ((root ? Quat(Quat::Identity()) : state.bodies[body.parent].q_WB) * body.X_PB.q * rotation).normalized();
  s.w_WB = (root ? Vec3(Vec3::Zero()) : state.bodies[body.parent].w_WB) + s.q_WB * velocity;
}

Solid sphere_solid(double mass, double radius) {
  return {mass, Vec3::Zero(), Mat3::Identity() * (2 * mass * radius * radius / 5)};
}

Solid capsule_solid(double mass, double radius, double half_length, const Vec3& axis) {
  const Vec3 I = capsule_inertia(mass, radius, half_length);
  const Vec3 n = axis.normalized();
  return {mass, Vec3::Zero(), I[0] * Mat3::Identity() + (I[2] - I[0]) * n * n.transpose()};
}

Solid principal_solid(double mass, const Vec3& p_BBcm, const Vec3& moments, const Quat& q_BI) {
  const Mat3 R = q_BI.toRotationMatrix();
  const Mat3 I = R * moments.asDiagonal() * R.transpose();
  return {mass, p_BBcm, (I + I.transpose()) / 2};
}

Solid box_solid(double mass, const Vec3& half) {
  const Vec3 square = half.cwiseProduct(half) * mass / 3;
  return principal_solid(mass, Vec3::Zero(), {square[1] + square[2], square[0] + square[2], square[0] + square[1]},
                         Quat::Identity());
}

Solid cylinder_solid(double mass, double radius, double half_length) {
  const double across = mass * (3 * radius * radius + 4 * half_length * half_length) / 12;
  return principal_solid(mass, Vec3::Zero(), {across, across, mass * radius * radius / 2}, Quat::Identity());
}

Body& add_free_body(Model& model, const std::string& name, const Solid& solid, const Pose& X_WB) {
  Body body;
  body.name = name;
  body.X_PB = X_WB;
  body.mass = solid.mass;
  body.p_BBcm = solid.p_BBcm;
  body.I_BBcm_B = solid.I_BBcm_B;
  model.bodies.push_back(body);
  return model.bodies.back();
}

Joint& add_hinged_body(Model& model, const std::string& name, int parent, const Pose& X_PB, const Solid& solid,
                       const Vec3& axis_B, const Vec3& p_BJ) {
  Body& body = add_free_body(model, name, solid, X_PB);
  body.parent = parent;
  body.joint = static_cast<int>(model.joints.size());
  Joint hinge;
  hinge.name = name + "_hinge";
  hinge.body = static_cast<int>(model.bodies.size()) - 1;
  hinge.axis_B = axis_B.normalized();
  hinge.p_BJ = p_BJ;
  model.joints.push_back(hinge);
  return model.joints.back();
}

Joint& add_sliding_body(Model& model, const std::string& name, int parent, const Pose& X_PB, const Solid& solid,
                        const Vec3& axis_B, const Vec3& p_BJ) {
  Joint& slide = add_hinged_body(model, name, parent, X_PB, solid, axis_B, p_BJ);
  slide.name = name + "_slide";
  slide.type = JointType::kSlide;
  return slide;
}

BallJoint& add_ball_body(Model& model, const std::string& name, int parent, const Pose& X_PB, const Solid& solid,
                         const Vec3& p_BJ) {
  Body& body = add_free_body(model, name, solid, X_PB);
  body.parent = parent;
  body.ball = static_cast<int>(model.balls.size());
  BallJoint ball;
  ball.name = name + "_ball";
  ball.body = static_cast<int>(model.bodies.size()) - 1;
  ball.p_BJ = p_BJ;
  model.balls.push_back(ball);
  return model.balls.back();
}

Solid massless() { return {0, Vec3::Zero(), Mat3::Zero()}; }

int add_shape(Model& model, ShapeType type, int body, const Pose& X_BS, double radius, double half_length,
              double friction) {
  Shape shape;
  shape.name = fmt::format("shape_{}", model.shapes.size());
  shape.type = type;
  shape.body = body;
  shape.X_BS = X_BS;
  shape.radius = radius;
  shape.half_length = half_length;
  shape.friction = friction;
  model.shapes.push_back(shape);
  return static_cast<int>(model.shapes.size()) - 1;
}

void add_contact(Model& model, int shape_a, int shape_b, double friction) {
  model.contacts.push_back({std::min(shape_a, shape_b), std::max(shape_a, shape_b), friction});
}

Hull box_hull(const Vec3& half_size) {
  Hull hull;
  hull.name = "box";
  // vertex i has the signs of its bits: 1 x, 2 y, 4 z
  for (int i = 0; i < 8; ++i) {
    const Vec3 signs((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
    hull.vertices.emplace_back(signs.cwiseProduct(half_size));
  }
  hull.faces = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  return hull;
}

HeightField flat_field(double half, double base, double slope) {
  constexpr int kSamples = 21;
  HeightField field{.name = "field",
                    .rows = kSamples,
                    .columns = kSamples,
                    .half_x = half,
                    .half_y = half,
                    .base = base,
                    .heights = {}};
  for (int row = 0; row < kSamples; ++row) {
    for (int column = 0; column < kSamples; ++column) {
      field.heights.push_back(slope * 2 * half * column / (kSamples - 1));
    }
  }
  return field;
}

Model finished(Model model) {
  model.initial = reference_state(model);
  model.hash = model_hash(model);
  return model;
}

State with_joints(const Model& model, const std::vector<double>& angle, const std::vector<double>& rate) {
  State state = model.initial;
  state.position = angle;
  state.velocity = rate;
  place_with_balls(model, state);
  return state;
}

Model chain(bool spatial) {
  Model model;
  model.name = spatial ? "conformance-spatial-chain" : "conformance-planar-chain";
  Solid link = capsule_solid(1, 0.05, 0.15, Vec3::UnitX());
  link.p_BBcm = {0.15, 0, 0};
  for (int i = 0; i < 5; ++i) {
    const Vec3 axis = spatial && i % 2 == 1 ? Vec3::UnitZ() : Vec3::UnitY();
    add_hinged_body(model, fmt::format("link_{}", i), i - 1, {Vec3(i == 0 ? 0 : 0.3, 0, 0), Quat::Identity()}, link,
                    axis);
  }
  model = finished(std::move(model));
  model.initial = with_joints(model, std::vector<double>(5, 0.0), std::vector<double>(5, 1.0));
  model.hash = model_hash(model);
  return model;
}

Model oblique_trees() {
  Model model;
  model.name = "conformance-oblique-trees";
  const Solid trunk = principal_solid(3, {0.04, -0.03, 0.05}, {0.05, 0.07, 0.04}, turned(40, {1, 2, 3}));
  const Solid arm = principal_solid(1.2, {0.12, 0.02, -0.01}, {0.004, 0.012, 0.014}, turned(25, {0, 1, 1}));
  const Solid hand = principal_solid(0.7, {0.02, 0.09, 0.03}, {0.006, 0.003, 0.007}, turned(-70, {2, -1, 1}));
  const Solid leg = principal_solid(1.6, {-0.02, 0.01, -0.15}, {0.018, 0.02, 0.005}, turned(15, {1, -1, 0}));
  const Solid vane = principal_solid(0.9, {0.08, -0.06, 0.1}, {0.007, 0.009, 0.012}, turned(55, {-1, 1, 2}));

  add_free_body(model, "trunk", trunk, {Vec3(0.3, -0.2, 1.1), turned(35, {1, 1, -1})});
  add_hinged_body(model, "arm", 0, {Vec3(0.15, 0.1, 0.08), turned(60, {0, 1, 2})}, arm, {1, 2, -1}, {-0.03, 0.02, 0.01})
      .reference = 0.3;
  add_hinged_body(model, "hand", 1, {Vec3(0.25, 0.03, -0.02), turned(-50, {3, 1, 0})}, hand, {0, 1, 3}, {0, -0.04, 0})
      .reference = -0.6;
  add_hinged_body(model, "leg", 0, {Vec3(-0.1, 0.05, -0.2), turned(80, {-1, 2, 1})}, leg, {2, 1, 1}, {0.01, 0, 0.05});
  add_hinged_body(model, "vane", kWorld, {Vec3(-1.2, 0.4, 0.6), turned(120, {1, 0, 2})}, vane, {-1, 1, 1},
                  {0.02, 0.03, -0.05})
      .reference = 0.8;
  return finished(std::move(model));
}

Flywheel flywheel() {
  Flywheel wheel;
  const Quat q_BI = turned(50, {1, 2, 2});
  const Vec3 moments(0.02, 0.03, 0.025);
  const Vec3 axis = q_BI * Vec3::UnitZ();
  // the anchor lies beside the centre of mass by 0.1 m along the first principal axis
  const Vec3 com(0.05, -0.02, 0.03);
  const Solid solid = principal_solid(2, com, moments, q_BI);
  wheel.model.name = "conformance-flywheel";
  wheel.model.gravity.setZero();
  add_hinged_body(wheel.model, "wheel", kWorld, {Vec3(0.2, 0.3, 0.5), turned(30, {0, 1, 1})}, solid, axis,
                  com + q_BI * Vec3(0.1, 0, 0));
  wheel.model = finished(std::move(wheel.model));
  wheel.axial_inertia = moments[2] + solid.mass * 0.1 * 0.1;
  return wheel;
}

PendulumModel pendulum() {
  PendulumModel result;
  Solid bob = capsule_solid(1, 0.05, 0.15, Vec3::UnitZ());
  bob.p_BBcm = {0, 0, -0.25};
  result.model.name = "conformance-pendulum";
  add_hinged_body(result.model, "bob", kWorld, {Vec3(0, 0, 1), Quat::Identity()}, bob, Vec3::UnitY());
  result.model = finished(std::move(result.model));
  const double pivot_inertia = bob.I_BBcm_B(1, 1) + bob.mass * 0.25 * 0.25;
  result.frequency = std::sqrt(bob.mass * kGravity * 0.25 / pivot_inertia);
  return result;
}

Model random_tree(unsigned seed, const TreeOptions& options) {
  // the standard's distributions differ between libraries; the generator does not
  std::mt19937 random(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
  };
  const auto direction = [&] {
    Vec3 v = Vec3::Zero();
    do {
      for (double& x : v) x = uniform(-1, 1);
    } while (v.norm() > 1 || v.norm() < 0.1);
    return Vec3(v.normalized());
  };
  const auto rotation = [&](double most) { return Quat(Eigen::AngleAxisd(uniform(-most, most), direction())); };

  Model model;
  model.name = fmt::format("conformance-tree-{}", seed);
  std::vector<int> heavy;                                        // bodies with mass
  const double rate = 0.2 * std::sqrt(kGravity / options.size);  // 1/s
  struct Start {
    double position = 0, velocity = 0;
  };
  std::vector<Start> starts;
  for (int i = 0; i < options.bodies; ++i) {
    const double mass = options.mass * std::exp2(uniform(-1, 1)), size = options.size * std::exp2(uniform(-1, 1));
    // a box whose edges are half to the whole of the size
    const Vec3 edge(size * uniform(0.5, 1), size * uniform(0.5, 1), size * uniform(0.5, 1));
    const Vec3 square = edge.cwiseProduct(edge) * mass / 12;
    const Solid solid =
        principal_solid(mass, 0.4 * size * direction(),
                        {square[1] + square[2], square[0] + square[2], square[0] + square[1]}, rotation(3));
    const bool root = i == 0 || i == options.bodies / 2 + 1;
    const Pose X_PB = {options.size * uniform(0.5, 1) * direction(), rotation(3)};
    if (i == 0 && options.free) {
      add_free_body(model, "body_0", solid, X_PB);
      heavy.push_back(0);
      continue;
    }
    int parent = root ? kWorld : heavy[random() % heavy.size()];
    Quat frame = rotation(3);  // joints in a row have perpendicular axes, far from where two of them coincide
    const int joints = options.massless ? 1 + static_cast<int>(random() % 3) : 1;
    const Vec3 anchor = 0.3 * size * direction();
    for (int k = 0; k < joints; ++k) {
      const bool last = k == joints - 1;
      const unsigned kind = random() % 4;
      const std::string name = last ? fmt::format("body_{}", i) : fmt::format("body_{}_part_{}", i, k);
      const Pose pose = k == 0 ? X_PB : Pose{};
      const Solid own = last ? solid : massless();
      if (options.balls && kind < 2 && joints == 1) {
        add_ball_body(model, name, parent, pose, own, anchor);
      } else {
        const Vec3 axis = frame * Vec3(Vec3::Unit(k));
        const bool slide = options.slides && kind == 2;
        Joint& joint = slide ? add_sliding_body(model, name, parent, pose, own, axis, anchor)
                             : add_hinged_body(model, name, parent, pose, own, axis, anchor);
        const double unit = slide ? options.size : 1;
        joint.reference = unit * uniform(-0.5, 0.5);
        starts.push_back({joint.reference + unit * uniform(-0.4, 0.4), unit * rate * uniform(-1, 1)});
      }
      parent = static_cast<int>(model.bodies.size()) - 1;
    }
    heavy.push_back(parent);
  }
  model = finished(std::move(model));

  State& state = model.initial;
  if (options.free) {
    state.bodies[0].v_WBcm = options.size * rate * direction();
    state.bodies[0].w_WB = rate * direction();
  }
  for (size_t j = 0; j < starts.size(); ++j) {
    state.position[j] = starts[j].position;
    state.velocity[j] = starts[j].velocity;
  }
  for (size_t k = 0; k < model.balls.size(); ++k) {
    bodies_from_joints(model, state);
    set_ball(model, state, static_cast<int>(k), rotation(1), rate * direction());
  }
  bodies_from_joints(model, state);
  model.hash = model_hash(model);
  return model;
}

}  // namespace assay::conformance
