#include "check/parity/inverse_dynamics.h"

#include <cmath>
#include <vector>

#include "model/joint.h"

namespace assay::parity {
namespace {

// Kinematics and load of one body, world axes. The point of a body is the origin of its frame.
struct Link {
  Pose X_WB;
  Vec3 w = Vec3::Zero(), alpha = Vec3::Zero();  // angular velocity and acceleration
  Vec3 a = Vec3::Zero();                        // acceleration of the frame's origin
  Vec3 force = Vec3::Zero();                    // on the body and all that it carries, from its joint
  Vec3 moment = Vec3::Zero();                   // the same about the frame's origin
};

double sign(double value) { return static_cast<double>(value > 0) - static_cast<double>(value < 0); }

}  // namespace

SpeedLayout::SpeedLayout(const Model& model) : of_joint(model.joints.size()) {
  for (const Body& body : model.bodies) {
    first.push_back(count);
    if (body.joint >= 0) of_joint[body.joint] = count;
    count += speeds_of(body);
  }
}

Eigen::VectorXd speeds(const Model& model, const SpeedLayout& layout, const State& state) {
  Eigen::VectorXd u(layout.count);
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const BodyState& s = state.bodies[i];
    if (body.joint >= 0) {
      u[layout.first[i]] = state.velocity[body.joint];
    } else if (body.ball >= 0) {
      const Vec3 w_WP = body.parent == kWorld ? Vec3(Vec3::Zero()) : state.bodies[body.parent].w_WB;
      u.segment<3>(layout.first[i]) = s.w_WB - w_WP;
    } else {
      u.segment<3>(layout.first[i]) = s.v_WBcm;
      u.segment<3>(layout.first[i] + 3) = s.w_WB;
    }
  }
  return u;
}

Eigen::VectorXd inverse_dynamics(const Model& model, const SpeedLayout& layout, const State& state,
                                 const Eigen::VectorXd& acceleration) {
  std::vector<Link> links(model.bodies.size());
  for (size_t i = 0; i < links.size(); ++i) {
    const Body& body = model.bodies[i];
    const Link parent = body.parent == kWorld ? Link{} : links[body.parent];
    Link& link = links[i];
    link.X_WB = body_pose(body, state.bodies[i]);
    link.w = state.bodies[i].w_WB;
    const int u = layout.first[i];

    if (body.is_free()) {
      link.alpha = acceleration.segment<3>(u + 3);
      const Vec3 arm = link.X_WB.q * body.p_BBcm;  // from the origin to the centre of mass
      link.a = acceleration.segment<3>(u) - link.alpha.cross(arm) - link.w.cross(link.w.cross(arm));
      continue;
    }
    if (slides(model, body)) {
      // a point of the parent that carries the origin, plus the motion along the axis
      const Vec3 axis = link.X_WB.q * model.joints[body.joint].axis_B;
      const Vec3 arm = link.X_WB.p - parent.X_WB.p;
      const double rate = state.velocity[body.joint];
      link.alpha = parent.alpha;
      link.a = parent.a + parent.alpha.cross(arm) + parent.w.cross(parent.w.cross(arm)) +
               2 * rate * parent.w.cross(axis) + axis * acceleration[u];
      continue;
    }
    const Vec3& p_BJ = anchor_of(model, body);
    if (body.joint >= 0) {
      const Vec3 axis = link.X_WB.q * model.joints[body.joint].axis_B;
      link.alpha = parent.alpha + axis * acceleration[u] + parent.w.cross(axis * state.velocity[body.joint]);
    } else {
      link.alpha = parent.alpha + acceleration.segment<3>(u);
    }
    const Vec3 in_parent = link.X_WB * p_BJ - parent.X_WB.p;  // from the parent's origin to the anchor
    const Vec3 in_child = link.X_WB.q * -p_BJ;                // from the anchor to the child's origin
    link.a = parent.a + parent.alpha.cross(in_parent) + parent.w.cross(parent.w.cross(in_parent)) +
             link.alpha.cross(in_child) + link.w.cross(link.w.cross(in_child));
  }

  Eigen::VectorXd forces = Eigen::VectorXd::Zero(layout.count);
  for (size_t n = links.size(); n-- > 0;) {
    const Body& body = model.bodies[n];
    Link& link = links[n];
    const Vec3 arm = link.X_WB.q * body.p_BBcm;
    const Mat3 R = link.X_WB.q.toRotationMatrix();
    const Mat3 I = R * body.I_BBcm_B * R.transpose();
    const Vec3 a_cm = link.a + link.alpha.cross(arm) + link.w.cross(link.w.cross(arm));
    const Vec3 force = body.mass * (a_cm - model.gravity);
    link.force += force;
    link.moment += I * link.alpha + link.w.cross(I * link.w) + arm.cross(force);

    const int u = layout.first[n];
    if (body.joint >= 0) {
      const Joint& joint = model.joints[body.joint];
      const Vec3 axis = R * joint.axis_B;
      const double rate = state.velocity[body.joint];
      const Vec3 about_anchor = link.moment - (R * joint.p_BJ).cross(link.force);
      forces[u] = joint.is_slide() ? axis.dot(link.force) : axis.dot(about_anchor);
      forces[u] += joint.armature * acceleration[u] - spring_torque(joint, state.position[body.joint], rate) +
                   joint.dry_friction * sign(rate);
    } else if (body.ball >= 0) {
      const BallJoint& ball = model.balls[body.ball];
      const Vec3 velocity = ball_velocity(model, state, body.ball);
      Vec3 own = -ball_spring_torque(ball, ball_rotation(model, state, body.ball), velocity);
      for (int k = 0; k < 3; ++k) own[k] += ball.dry_friction * sign(velocity[k]);
      // armature acts on the relative angular velocity in child axes, whose derivative is R^T (u' - w x u)
      const Vec3 relative = R * velocity;
      own += ball.armature * (R.transpose() * (acceleration.segment<3>(u) - link.w.cross(relative)));
      forces.segment<3>(u) = link.moment - (R * ball.p_BJ).cross(link.force) + R * own;
    } else {
      forces.segment<3>(u) = link.force;
      forces.segment<3>(u + 3) = link.moment - arm.cross(link.force);
    }
    if (body.parent != kWorld) {
      Link& parent = links[body.parent];
      parent.force += link.force;
      parent.moment += link.moment + (link.X_WB.p - parent.X_WB.p).cross(link.force);
    }
  }
  for (const Tendon& tendon : model.tendons) {
    if (!tendon.has_spring() && tendon.dry_friction == 0) continue;
    const double speed = sum_of_terms(tendon.terms, state.velocity);
    const double tension =
        tendon_tension(tendon, sum_of_terms(tendon.terms, state.position), speed) - tendon.dry_friction * sign(speed);
    for (const JointTerm& term : tendon.terms) forces[layout.of_joint[term.joint]] -= term.coefficient * tension;
  }
  return forces;
}

}  // namespace assay::parity
