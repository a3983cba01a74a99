#include "check/pairing/align.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include "model/joint.h"
#include "model/kinematics.h"

namespace assay::pairing {
namespace {

double angle_between(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }
double line_angle(const Vec3& a, const Vec3& b) {
  const double angle = angle_between(a, b);
  return std::min(angle, M_PI - angle);
}
double off_line(const Vec3& apart, const Vec3& axis) { return (apart - axis * axis.dot(apart)).norm(); }

// 0 for rounding; else 1, and a little more the larger it is, so that of two ways with as many differences the one with
// the smaller ones is taken.
double difference(double value, double rounding) {
  if (value <= rounding) return 0;
  return 1 + 0.3 * std::min(1.0, std::log10(value / rounding) / 5);
}

// A joint's line in a frame.
struct Line {
  Vec3 p = Vec3::Zero(), axis = Vec3::Zero();
  JointType type = JointType::kFree;
};
Line own_line(const Model& model, const Body& body) {
  Line line{.type = joint_type(model, body)};
  if (body.joint >= 0) line.p = model.joints[body.joint].p_BJ, line.axis = model.joints[body.joint].axis_B;
  if (body.ball >= 0) line.p = model.balls[body.ball].p_BJ;
  return line;
}
Line moved(const Line& line, const Pose& X) { return {X * line.p, X.q * line.axis, line.type}; }
Line line_in_parent(const Model& model, const Body& body) { return moved(own_line(model, body), body.X_PB); }

double differences(const Line& a, const Line& b) {
  if (a.type != b.type || a.type == JointType::kFree) return 0;
  double sum = 0;
  if (a.type != JointType::kBall) sum += difference(line_angle(a.axis, b.axis), kRoundingAngle);
  if (a.axis.dot(b.axis) < 0) sum += 0.5;  // turned round
  if (a.type == JointType::kHinge) sum += difference(off_line(b.p - a.p, a.axis), kRoundingLength);
  if (a.type == JointType::kBall) sum += difference((b.p - a.p).norm(), kRoundingLength);
  return sum;
}

struct Points {
  bool as_written =
      false;  // axes as they point, else as they nearly lie: a base that is turned by 180 degrees turns them
  std::vector<Vec3> from, to;
  void add(const Line& a, const Line& b, const Pose& roughly) {
    constexpr double kAlong = 0.1;  // m
    if (a.type != b.type || a.type == JointType::kFree) return;
    if (a.type != JointType::kSlide) from.push_back(b.p), to.push_back(a.p);
    if (a.type == JointType::kBall) return;
    const double sign = !as_written && (roughly.q * b.axis).dot(a.axis) < 0 ? -1 : 1;
    if (a.type == JointType::kSlide) return;
    from.push_back(b.p + kAlong * sign * b.axis), to.push_back(a.p + kAlong * a.axis);
  }
};

class Placer {
 public:
  Placer(const Model& a, const Model& b, const std::vector<int>& b_of) : a_(a), b_(b) {
    out_.b_of = b_of;
    out_.a_of.assign(b.bodies.size(), -1);
    for (size_t i = 0; i < b_of.size(); ++i) {
      if (b_of[i] >= 0) out_.a_of[static_cast<size_t>(b_of[i])] = static_cast<int>(i);
    }
    children_.resize(a.bodies.size() + 1);
    for (size_t i = 0; i < a.bodies.size(); ++i) {
      if (b_of[i] >= 0) children_[static_cast<size_t>(a.bodies[i].parent + 1)].push_back(static_cast<int>(i));
    }
    out_.X_AB.resize(a.bodies.size());
    out_.reversed.resize(a.bodies.size());
  }

  Placement result() {
    world();
    for (size_t i = 0; i < a_.bodies.size(); ++i) {
      if (out_.b_of[i] >= 0) body(static_cast<int>(i));
    }
    return std::move(out_);
  }

 private:
  const Body& a(int i) const { return a_.bodies[static_cast<size_t>(i)]; }
  const Body& match(int i) const { return b_.bodies[static_cast<size_t>(out_.b_of[static_cast<size_t>(i)])]; }
  const Pose& X(int i) const { return i == kWorld ? out_.X_world : out_.X_AB[static_cast<size_t>(i)]; }

  double of_children(int i, const Pose& X) const {
    double sum = 0;
    for (const int child : children_[static_cast<size_t>(i + 1)]) {
      const Body &of_a = a(child), &of_b = match(child);
      sum += differences(line_in_parent(a_, of_a), moved(line_in_parent(b_, of_b), X));
      // a slide's line may lie anywhere: its body says where it is, but less surely
      if (of_a.mass == 0 || of_b.mass == 0 || !slides(a_, of_a) || !slides(b_, of_b)) continue;
      sum += 0.5 * difference((X * (of_b.X_PB * of_b.p_BBcm) - of_a.X_PB * of_a.p_BBcm).norm(), kRoundingLength);
    }
    return sum;
  }
  void add_children(int i, const Pose& roughly, Points& points) const {
    for (const int child : children_[static_cast<size_t>(i + 1)]) {
      points.add(line_in_parent(a_, a(child)), line_in_parent(b_, match(child)), roughly);
    }
  }

  void world() {
    std::vector<Pose> ways = {{}};
    Points points;
    add_children(kWorld, {}, points);
    if (!points.from.empty()) ways.push_back({points.to[0] - points.from[0], Quat::Identity()});
    if (const auto fit = best_fit(points.from, points.to)) ways.push_back(*fit);
    Points written{.as_written = true, .from = {}, .to = {}};
    add_children(kWorld, {}, written);
    if (const auto fit = best_fit(written.from, written.to)) ways.push_back(*fit);
    double least = std::numeric_limits<double>::infinity();
    for (const Pose& way : ways) {
      // a base that stands elsewhere is no difference of the robot; a joint on it that is a little off may be one
      const bool is_far = way.p.norm() > 0.02 || angle_of(way.q) > 0.035;
      const bool is_moved = way.p.norm() > kRoundingLength || angle_of(way.q) > kRoundingAngle;
      const double cost = of_children(kWorld, way) +
                          (is_far     ? 0.5
                           : is_moved ? 1.5
                                      : 0) +
                          difference(angle_between(way.q * b_.gravity, a_.gravity), 10 * kRoundingAngle);
      if (cost < least) least = cost, out_.X_world = way;
    }
  }

  void body(int i) {
    const Body& body_a = a(i);
    const Body& body_b = match(i);
    const Line line_a = own_line(a_, body_a), line_b = own_line(b_, body_b);
    // it lies where it lies at 0
    const Pose still = body_a.X_PB.inverse() * X(body_a.parent) * body_b.X_PB;
    std::vector<Pose> ways = {still, {}};
    Points points;
    points.add(line_a, line_b, still);
    if (body_a.mass > 0 && body_b.mass > 0) points.from.push_back(body_b.p_BBcm), points.to.push_back(body_a.p_BBcm);
    add_children(i, still, points);
    const auto shifted_to = [&](Pose way, const Vec3& b, const Vec3& to) {
      way.p += to - way * b;
      ways.push_back(way);
    };
    if (line_a.type == line_b.type && line_a.type != JointType::kFree) {
      shifted_to(still, line_b.p, line_a.p);
      const Vec3 axis = still.q * line_b.axis;
      if (line_a.type != JointType::kBall && axis.norm() > 0) {
        const Vec3 onto = axis.dot(line_a.axis) < 0 ? Vec3(-line_a.axis) : line_a.axis;
        Pose way = still;
        way.q = (Quat(Eigen::Quaterniond::FromTwoVectors(axis, onto)) * still.q).normalized();
        shifted_to(way, line_b.p, line_a.p);
      }
    }
    for (size_t k = 0; k < points.from.size() && k < 4; ++k) {
      if (body_a.is_free()) shifted_to(still, points.from[k], points.to[k]);
    }
    if (const auto fit = best_fit(points.from, points.to)) ways.push_back(*fit);
    Points written{.as_written = true, .from = {}, .to = {}};
    written.add(line_a, line_b, still);
    if (body_a.mass > 0 && body_b.mass > 0) written.from.push_back(body_b.p_BBcm), written.to.push_back(body_a.p_BBcm);
    add_children(i, still, written);
    if (const auto fit = best_fit(written.from, written.to)) ways.push_back(*fit);
    for (const Quat& q : principal_turns(body_a, body_b)) {
      for (size_t k = 0; k < points.from.size() && k < 6; ++k) ways.push_back({points.to[k] - q * points.from[k], q});
    }

    double least = std::numeric_limits<double>::infinity();
    for (const Pose& way : ways) {
      const double cost = of_children(i, way) + differences(line_a, moved(line_b, way)) + of_mass(body_a, body_b, way) +
                          of_place(body_a, line_a, still, way) + of_shapes(i, way);
      if (cost < least - 1e-9) least = cost, out_.X_AB[static_cast<size_t>(i)] = way;
    }
    if (line_a.type == JointType::kHinge || line_a.type == JointType::kSlide) {
      out_.reversed[static_cast<size_t>(i)] = (out_.X_AB[static_cast<size_t>(i)].q * line_b.axis).dot(line_a.axis) < 0;
    }
  }

  // The four rotations that bring B's principal axes to A's; none where two moments are nearly equal.
  static std::vector<Quat> principal_turns(const Body& a, const Body& b) {
    std::vector<Quat> turns;
    if (a.mass == 0 || b.mass == 0) return turns;
    const Eigen::SelfAdjointEigenSolver<Mat3> of_a(a.I_BBcm_B), of_b(b.I_BBcm_B);
    const Vec3 moments = of_a.eigenvalues();
    if (std::min(moments[1] - moments[0], moments[2] - moments[1]) < 0.02 * moments[2]) return turns;
    const Mat3 U = of_a.eigenvectors();
    Mat3 V = of_b.eigenvectors();
    if ((U * V.transpose()).determinant() < 0) V.col(0) = -V.col(0);
    for (const Vec3& signs : {Vec3(1, 1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1), Vec3(-1, -1, 1)}) {
      turns.push_back(Quat(Mat3(U * signs.asDiagonal() * V.transpose())).normalized());
    }
    return turns;
  }

  static double of_mass(const Body& a, const Body& b, const Pose& way) {
    if (a.mass == 0 || b.mass == 0) return 0;
    const Mat3 R = way.q.toRotationMatrix();
    const Mat3 I = R * b.I_BBcm_B * R.transpose() * (a.mass / b.mass);
    return difference((way * b.p_BBcm - a.p_BBcm).norm(), kRoundingLength) +
           difference((I - a.I_BBcm_B).norm() / a.I_BBcm_B.norm(), 4 * kRoundingRelative);
  }

  // Where the body would be put on its parent other than at 0.
  static double of_place(const Body& a, const Line& line, const Pose& still, const Pose& way) {
    if (a.is_free()) return 0;
    const Pose change = still * way.inverse();  // of the child, in A's frame
    return difference(angle_of(change.q), kRoundingAngle) +
           difference((change * line.p - line.p).norm(), kRoundingLength);
  }

  // Centres of the shapes, where both have as many: a weak witness, because files choose shapes freely.
  double of_shapes(int i, const Pose& way) const {
    std::vector<Vec3> of_a, of_b;
    for (const Shape& shape : a_.shapes) {
      if (shape.body == i && shape.collides) of_a.push_back(shape.X_BS.p);
    }
    for (const Shape& shape : b_.shapes) {
      if (shape.body == out_.b_of[static_cast<size_t>(i)] && shape.collides) of_b.push_back(way * shape.X_BS.p);
    }
    if (of_a.empty() || of_a.size() != of_b.size()) return 0;
    size_t apart = 0;
    for (const Vec3& p : of_a) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const Vec3& q : of_b) nearest = std::min(nearest, (p - q).norm());
      if (nearest > kRoundingLength) ++apart;
    }
    return 0.5 * static_cast<double>(apart) / static_cast<double>(of_a.size());
  }

  const Model& a_;
  const Model& b_;
  Placement out_;
  std::vector<std::vector<int>> children_;  // by A's body + 1
};

}  // namespace

std::optional<Pose> best_fit(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
  if (from.size() < 3) return std::nullopt;
  std::vector<double> weights(from.size(), 1);
  Pose X;
  for (int round = 0; round < 30; ++round) {
    Vec3 mean_from = Vec3::Zero(), mean_to = Vec3::Zero();
    double sum = 0;
    for (size_t k = 0; k < from.size(); ++k) {
      mean_from += weights[k] * from[k], mean_to += weights[k] * to[k], sum += weights[k];
    }
    mean_from /= sum, mean_to /= sum;
    Mat3 H = Mat3::Zero();
    for (size_t k = 0; k < from.size(); ++k) H += weights[k] * (from[k] - mean_from) * (to[k] - mean_to).transpose();
    const Eigen::JacobiSVD<Mat3> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
    if (round == 0 && svd.singularValues()[1] < 1e-6 * svd.singularValues()[0]) return std::nullopt;  // on one line
    const Mat3 V = svd.matrixV(), U = svd.matrixU();
    const Vec3 signs(1, 1, (V * U.transpose()).determinant() < 0 ? -1 : 1);
    X.q = Quat(Mat3(V * signs.asDiagonal() * U.transpose())).normalized();
    X.p = mean_to - X.q * mean_from;
    // distances, not their squares, so that points which are off do not turn the others
    for (size_t k = 0; k < from.size(); ++k) weights[k] = 1 / std::max((X * from[k] - to[k]).norm(), 1e-7);
  }
  return X;
}

Placement placed(const Model& a, const Model& b, const std::vector<int>& b_of) { return Placer(a, b, b_of).result(); }

Model in_frames_of(const Model& a, const Model& b, const Placement& placement) {
  Model out = b;
  const auto X = [&](int body_a) {
    return body_a == kWorld ? placement.X_world : placement.X_AB[static_cast<size_t>(body_a)];
  };
  const auto a_of = [&](int body_b) { return body_b == kWorld ? kWorld : placement.a_of[static_cast<size_t>(body_b)]; };
  std::vector<int> joint_of(b.joints.size(), -1);  // A's joint by B's
  std::vector<double> sign(b.joints.size(), 1);
  out.gravity = placement.X_world.q * b.gravity;
  out.bodies = a.bodies, out.joints = a.joints, out.balls = a.balls;
  for (size_t i = 0; i < a.bodies.size(); ++i) {
    const Body& from = b.bodies[static_cast<size_t>(placement.b_of[i])];
    Body& body = out.bodies[i];
    const Pose& X_AB = placement.X_AB[i];
    const Mat3 R = X_AB.q.toRotationMatrix();
    body.mass = from.mass;
    if (from.mass > 0) {
      body.p_BBcm = X_AB * from.p_BBcm;
      body.I_BBcm_B = R * from.I_BBcm_B * R.transpose();
    }
    body.X_PB = X(body.parent) * from.X_PB * X_AB.inverse();
    if (body.joint >= 0) {
      const auto j = static_cast<size_t>(body.joint);
      const Joint& mine = a.joints[j];
      Joint& joint = out.joints[j];
      const Joint& theirs = b.joints[static_cast<size_t>(from.joint)];
      const bool reversed = placement.reversed[i];
      joint = theirs;
      joint.name = mine.name, joint.body = mine.body;
      joint.axis_B = X_AB.q * theirs.axis_B;
      joint.p_BJ = X_AB * theirs.p_BJ;
      if (reversed) {
        joint.axis_B = -joint.axis_B;
        joint.lower = -theirs.upper, joint.upper = -theirs.lower;
        joint.spring_reference = -theirs.spring_reference;
      }
      // any point of the line is the same joint
      if (joint.is_slide()) {
        joint.p_BJ = mine.p_BJ;
      } else {
        joint.p_BJ += joint.axis_B * joint.axis_B.dot(mine.p_BJ - joint.p_BJ);
      }
      joint_of[static_cast<size_t>(from.joint)] = body.joint;
      sign[static_cast<size_t>(from.joint)] = reversed ? -1 : 1;
    } else if (body.ball >= 0) {
      const auto k = static_cast<size_t>(body.ball);
      BallJoint& ball = out.balls[k];
      ball = b.balls[static_cast<size_t>(from.ball)];
      ball.name = a.balls[k].name, ball.body = a.balls[k].body;
      ball.p_BJ = X_AB * ball.p_BJ;
      ball.spring_reference = X_AB.q * ball.spring_reference * X_AB.q.conjugate();
    }
  }
  for (Shape& shape : out.shapes) {
    shape.body = a_of(shape.body);
    shape.X_BS = X(shape.body) * shape.X_BS;
  }
  const auto terms = [&](std::vector<JointTerm>& list) {
    for (JointTerm& term : list) {
      term.coefficient *= sign[static_cast<size_t>(term.joint)];
      term.joint = joint_of[static_cast<size_t>(term.joint)];
    }
  };
  for (Coupling& coupling : out.couplings) {
    const double own = sign[static_cast<size_t>(coupling.joint)];
    terms(coupling.terms);
    coupling.joint = joint_of[static_cast<size_t>(coupling.joint)];
    coupling.offset *= own;
    for (JointTerm& term : coupling.terms) term.coefficient *= own;
  }
  for (Tendon& tendon : out.tendons) terms(tendon.terms);
  for (Actuator& actuator : out.actuators) {
    terms(actuator.terms);
    // a drive of a joint that was turned round is turned round, too
    if (actuator.terms.size() == 1 && (actuator.terms[0].coefficient < 0) && !b.actuators.empty()) {
      const size_t index = static_cast<size_t>(&actuator - out.actuators.data());
      if (sign[static_cast<size_t>(b.actuators[index].terms[0].joint)] < 0) {
        actuator.terms[0].coefficient = -actuator.terms[0].coefficient;
        actuator.bias[0] = -actuator.bias[0];
        std::tie(actuator.force_lower, actuator.force_upper) = std::pair(-actuator.force_upper, -actuator.force_lower);
        std::tie(actuator.control_lower, actuator.control_upper) =
            std::pair(-actuator.control_upper, -actuator.control_lower);
      }
    }
  }
  for (Connect& c : out.connects) {
    c.body_a = a_of(c.body_a), c.body_b = a_of(c.body_b);
    c.p_A = X(c.body_a) * c.p_A, c.p_B = X(c.body_b) * c.p_B;
  }
  for (Weld& weld : out.welds) {
    weld.body_a = a_of(weld.body_a), weld.body_b = a_of(weld.body_b);
    weld.X_AB = X(weld.body_a) * weld.X_AB * X(weld.body_b).inverse();
  }
  return out;
}

}  // namespace assay::pairing
