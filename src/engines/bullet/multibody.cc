// Bullet's multibodies (Featherstone): every tree of the model is one btMultiBody, a single free body one without
// links.
#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyFixedConstraint.h>
#include <BulletDynamics/Featherstone/btMultiBodyJointLimitConstraint.h>
#include <BulletDynamics/Featherstone/btMultiBodyJointMotor.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <BulletDynamics/Featherstone/btMultiBodyPoint2Point.h>
#include <Eigen/Cholesky>

#include "convert.h"
#include "model/weld_frames.h"
#include "world.h"

namespace assay::bullet {
namespace {

// position of one joint - the others' shares = offset, of joints of one or two trees. Bullet's own gear couples two
// joints; its row leaves out that an impulse on one moves the other, and is the slower for it.
class CouplingRow final : public btMultiBodyConstraint {
 public:
  struct Term {
    btMultiBody* tree;
    int link;
    btScalar coefficient, reference;  // position = Bullet's + reference
  };

  // `other` is a term of the second tree, or of the first where there is none.
  CouplingRow(std::vector<Term> terms, const Term& other, btScalar offset)
      : btMultiBodyConstraint(terms.front().tree, other.tree, terms.front().link, other.link, 1, false,
                              MAX_MULTIBODY_CONSTRAINT_TYPE),
        terms_(std::move(terms)),
        offset_(offset) {}

  void finalizeMultiDof() override {
    allocateJacobiansMultiDof();
    for (const Term& term : terms_) {
      btScalar* jacobian = term.tree == m_bodyA ? jacobianA(0) : jacobianB(0);
      jacobian[6 + term.tree->getLink(term.link).m_dofOffset] += term.coefficient;
    }
    m_numDofsFinalized = m_jacSizeBoth;
  }
  int getIslandIdA() const override { return m_bodyA->getLink(m_linkA).m_collider->getIslandTag(); }
  int getIslandIdB() const override { return m_bodyB->getLink(m_linkB).m_collider->getIslandTag(); }
  void createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                            const btContactSolverInfo& info) override {
    if (m_numDofsFinalized != m_jacSizeBoth) finalizeMultiDof();
    btScalar error = -offset_;
    for (const Term& term : terms_) error += term.coefficient * (term.tree->getJointPos(term.link) + term.reference);
    btMultiBodySolverConstraint& row = rows.expandNonInitializing();
    const btVector3 none(0, 0, 0);
    fillMultiBodyConstraint(row, data, jacobianA(0), jacobianB(0), none, none, none, none, error, info,
                            -m_maxAppliedImpulse, m_maxAppliedImpulse);
    row.m_orgConstraint = this;
    row.m_orgDofIndex = 0;
  }
  void debugDraw(btIDebugDraw* /*drawer*/) override {}

 private:
  std::vector<Term> terms_;
  btScalar offset_;
};

// The armatures a of a tree's joints, as rows of Bullet's solver with the impulse -a (rate at the step's end - rate at
// its start). Bullet starts its sweeps at the impulses that solve these rows without any others, so that without limits
// and contacts they are exact.
class ArmatureRows final : public btMultiBodyConstraint {
 public:
  struct Freedom {
    int coordinate;  // of the tree's joints
    btScalar armature;
  };

  // `link` is one with a collider.
  ArmatureRows(btMultiBody* tree, int link, std::vector<Freedom> freedoms)
      : btMultiBodyConstraint(tree, nullptr, link, -1, static_cast<int>(freedoms.size()), false,
                              MAX_MULTIBODY_CONSTRAINT_TYPE),
        freedoms_(std::move(freedoms)),
        start_(freedoms_.size()) {}

  // Before Bullet applies a step's forces.
  void begin_step() {
    for (size_t i = 0; i < freedoms_.size(); ++i) start_[i] = rate(i);
  }

  void finalizeMultiDof() override {
    allocateJacobiansMultiDof();
    for (size_t i = 0; i < freedoms_.size(); ++i) {
      jacobianA(static_cast<int>(i))[kBaseFreedoms + freedoms_[i].coordinate] = 1;
    }
    m_numDofsFinalized = m_jacSizeBoth;
  }
  int getIslandIdA() const override { return m_bodyA->getLink(m_linkA).m_collider->getIslandTag(); }
  int getIslandIdB() const override { return getIslandIdA(); }
  void createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                            const btContactSolverInfo& info) override {
    if (m_numDofsFinalized != m_jacSizeBoth) finalizeMultiDof();
    const auto count = static_cast<int>(freedoms_.size());
    const int first = rows.size();
    const btVector3 none(0, 0, 0);
    for (int i = 0; i < count; ++i) {
      btMultiBodySolverConstraint& row = rows.expandNonInitializing();
      row.m_solverBodyIdA = row.m_solverBodyIdB = data.m_fixedBodyId;
      fillMultiBodyConstraint(row, data, jacobianA(i), nullptr, none, none, none, none, 0, info, -m_maxAppliedImpulse,
                              m_maxAppliedImpulse);
      row.m_solverBodyIdA = row.m_solverBodyIdB = -1;
      row.m_orgConstraint = this;
      row.m_orgDofIndex = i;
    }
    // rates that a unit impulse of each row gives the others
    Eigen::MatrixXd response(count, count);
    Eigen::VectorXd wanted(count);
    for (int i = 0; i < count; ++i) {
      const btScalar* change = &data.m_deltaVelocitiesUnitImpulse[rows[first + i].m_jacAindex + kBaseFreedoms];
      for (int j = 0; j < count; ++j) response(j, i) = change[freedoms_[j].coordinate];
      wanted[i] = start_[i] - rate(i);
    }
    Eigen::MatrixXd soft = response;
    for (int i = 0; i < count; ++i) soft(i, i) += 1 / freedoms_[i].armature;
    const Eigen::VectorXd impulses = soft.llt().solve(wanted);
    const int size = kBaseFreedoms + m_bodyA->getNumDofs();
    for (int i = 0; i < count; ++i) {
      btMultiBodySolverConstraint& row = rows[first + i];
      const auto impulse = real(impulses[i]);
      row.m_jacDiagABInv = real(1 / soft(i, i));
      row.m_cfm = row.m_jacDiagABInv / freedoms_[i].armature;
      row.m_rhs = (real(wanted[i]) * row.m_jacDiagABInv) - (impulse * row.m_cfm);  // Bullet counts on from `impulse`
      btScalar* change = &data.m_deltaVelocitiesUnitImpulse[row.m_jacAindex];
      applyDeltaVee(data, change, impulse, row.m_deltaVelAindex, size);
      m_bodyA->applyDeltaVeeMultiDof2(change, impulse);
    }
  }
  void debugDraw(btIDebugDraw* /*drawer*/) override {}

 private:
  static constexpr int kBaseFreedoms = 6;

  btScalar rate(size_t i) const { return m_bodyA->getVelocityVector()[kBaseFreedoms + freedoms_[i].coordinate]; }

  std::vector<Freedom> freedoms_;
  std::vector<btScalar> start_;  // rates at the step's start
};

class MultibodySimulation final : public BulletSimulation {
 public:
  MultibodySimulation(const Model& model, const State& state, const Options& options)
      : BulletSimulation(model, state, options) {
    balls_.resize(model_.balls.size());
    place_bodies();
    for (size_t b = 0; b < model_.bodies.size(); ++b) {
      if (std::cmp_equal(places_[b].root, b)) make_tree(static_cast<int>(b));
    }
    make_limits();
    make_dry_friction();
    make_equalities();
    make_armature();
    make_colliders();
  }

  ~MultibodySimulation() override { destroy_world(); }
  MultibodySimulation(const MultibodySimulation&) = delete;
  MultibodySimulation& operator=(const MultibodySimulation&) = delete;

 private:
  // Where a body of the model is: link -1 is the base of its tree.
  struct Place {
    int root = 0;
    int link = -1;
    btMultiBody* tree = nullptr;
  };

  btMultiBodyDynamicsWorld& multibody_world() const { return static_cast<btMultiBodyDynamicsWorld&>(world()); }

  // Where a coupling has joints of several trees on the fixed world, these are one tree of Bullet's.
  void place_bodies() {
    places_.resize(model_.bodies.size());
    links_of_root_.assign(model_.bodies.size(), 0);
    const bool joined = std::ranges::any_of(model_.couplings, [](const Coupling& c) { return c.terms.size() > 1; });
    int first_fixed = -1;
    for (size_t b = 0; b < model_.bodies.size(); ++b) {
      const Body& body = model_.bodies[b];
      places_[b].root = body.parent == kWorld ? static_cast<int>(b) : places_[body.parent].root;
      if (joined && body.parent == kWorld && !body.is_free()) {
        if (first_fixed < 0) first_fixed = static_cast<int>(b);
        places_[b].root = first_fixed;
      }
      if (!body.is_free()) places_[b].link = links_of_root_[places_[b].root]++;
    }
  }

  // A free root is its tree's base; a hinged root is the first link of a base that is fixed in the world's origin.
  void make_tree(int root) {
    const bool fixed = !model_.bodies[root].is_free();
    const BodyFrame& frame = collision_.frame(root);
    const btScalar mass = fixed ? 0 : real(model_.bodies[root].mass);
    const btVector3 inertia = fixed ? btVector3(0, 0, 0) : to_bt(frame.inertia);
    auto tree = std::make_unique<btMultiBody>(links_of_root_[root], mass, inertia, fixed, false);
    tree->setLinearDamping(0);
    tree->setAngularDamping(0);
    tree->setUseGyroTerm(true);
    tree->setMaxCoordinateVelocity(SIMD_INFINITY);
    tree->setMaxAppliedImpulse(SIMD_INFINITY);
    tree->setHasSelfCollision(true);
    tree->useRK4Integration(options_.rk4);

    for (size_t b = root; b < model_.bodies.size(); ++b) {
      if (places_[b].root != root) continue;
      places_[b].tree = tree.get();
      if (places_[b].link >= 0) make_link(*tree, static_cast<int>(b));
    }
    tree->finalizeMultiDof();
    multibody_world().addMultiBody(tree.get());

    tree->setBasePos(btVector3(0, 0, 0));
    tree->setWorldToBaseRot(btQuaternion::getIdentity());
    if (!fixed) {
      const BodyState& s = start_.bodies[root];
      tree->setBasePos(to_bt(s.p_WBcm));
      tree->setWorldToBaseRot(to_bt(Quat((s.q_WB * frame.X_BI.q).conjugate())));
      tree->setBaseVel(to_bt(s.v_WBcm));
      tree->setBaseOmega(to_bt(s.w_WB));
    }
    for (size_t b = root; b < model_.bodies.size(); ++b) {
      if (places_[b].root != root || places_[b].link < 0) continue;
      if (model_.bodies[b].ball >= 0) {
        set_ball(*tree, static_cast<int>(b));
        continue;
      }
      const int joint = model_.bodies[b].joint;
      tree->setJointPos(places_[b].link, real(start_.position[joint] - model_.joints[joint].reference));
      tree->setJointVel(places_[b].link, real(start_.velocity[joint]));
    }
    trees_.push_back(std::move(tree));
  }

  // Bullet's ball joint has a quaternion, of the child's rotation from the pose at zero, and its velocity in child
  // axes.
  void set_ball(btMultiBody& tree, int b) const {
    const int ball = model_.bodies[b].ball;
    const Quat q_IB = collision_.frame(b).X_BI.q.conjugate();
    const btQuaternion position = to_bt(Quat(q_IB * ball_rotation(model_, start_, ball) * q_IB.conjugate()));
    const btVector3 velocity = to_bt(Vec3(q_IB * ball_velocity(model_, start_, ball)));
    const std::array<btScalar, 4> q = {position.x(), position.y(), position.z(), position.w()};
    tree.setJointPosMultiDof(places_[b].link, q.data());
    tree.setJointVelMultiDof(places_[b].link, velocity.m_floats);
  }

  void make_link(btMultiBody& tree, int b) {
    const Body& body = model_.bodies[b];
    const BodyFrame& frame = collision_.frame(b);
    const bool on_world = body.parent == kWorld;
    const Pose X_PQ = on_world ? Pose{} : collision_.frame(body.parent).X_BI;  // the parent's Bullet frame
    const Quat q_QI = X_PQ.q.conjugate() * body.X_PB.q * frame.X_BI.q;
    const Quat q_IB = frame.X_BI.q.conjugate();
    const int link = places_[b].link, parent = on_world ? -1 : places_[body.parent].link;
    const Vec3& p_BJ = body.ball >= 0 ? model_.balls[body.ball].p_BJ : model_.joints[body.joint].p_BJ;
    const btScalar mass = real(body.mass);
    const btVector3 inertia = to_bt(frame.inertia);
    const btQuaternion rotation = to_bt(Quat(q_QI.conjugate()));
    const btVector3 parent_to_anchor = to_bt(X_PQ.inverse() * (body.X_PB * p_BJ));
    const btVector3 anchor_to_com = to_bt(Vec3(q_IB * (body.p_BBcm - p_BJ)));
    if (body.ball >= 0) {
      tree.setupSpherical(link, mass, inertia, parent, rotation, parent_to_anchor, anchor_to_com, false);
      return;
    }
    const Joint& joint = model_.joints[body.joint];
    const btVector3 axis = to_bt(Vec3(q_IB * joint.axis_B));
    if (joint.is_slide()) {
      tree.setupPrismatic(link, mass, inertia, parent, rotation, axis, parent_to_anchor, anchor_to_com, false);
    } else {
      tree.setupRevolute(link, mass, inertia, parent, rotation, axis, parent_to_anchor, anchor_to_com, false);
    }
  }

  void make_limits() {
    limits_.resize(model_.joints.size());
    for (size_t j = 0; j < model_.joints.size(); ++j) {
      const Joint& hinge = model_.joints[j];
      if (!hinge.limited) continue;
      const Place& place = places_[hinge.body];
      limits_[j] = std::make_unique<btMultiBodyJointLimitConstraint>(
          place.tree, place.link, real(hinge.lower - hinge.reference), real(hinge.upper - hinge.reference));
      limits_[j]->setMaxAppliedImpulse(SIMD_INFINITY);
      multibody_world().addMultiBodyConstraint(limits_[j].get());
    }
  }

  // A joint's dry friction is a motor that wants speed 0 and is not stronger.
  void make_dry_friction() {
    motors_.resize(model_.joints.size());
    for (size_t j = 0; j < model_.joints.size(); ++j) {
      const Joint& joint = model_.joints[j];
      if (joint.dry_friction == 0) continue;
      const Place& place = places_[joint.body];
      motors_[j] = std::make_unique<btMultiBodyJointMotor>(place.tree, place.link, real(0),
                                                           real(joint.dry_friction * options_.timestep));
      multibody_world().addMultiBodyConstraint(motors_[j].get());
    }
  }

  void add_row(int body, std::unique_ptr<btMultiBodyConstraint> constraint) {
    has_rows_[body] = 1;
    constraint->setMaxAppliedImpulse(SIMD_INFINITY);
    multibody_world().addMultiBodyConstraint(constraint.get());
    equalities_.push_back(std::move(constraint));
  }

  // The body's tree and link, for a constraint; the world's is a tree of its own, which is fixed.
  Place end_of(int body) {
    if (body != kWorld) {
      has_rows_[body] = 1;
      return places_[body];
    }
    if (!world_tree_) {
      world_tree_ = std::make_unique<btMultiBody>(0, real(0), btVector3(0, 0, 0), true, false);
      world_tree_->finalizeMultiDof();
      multibody_world().addMultiBody(world_tree_.get());
    }
    return {.tree = world_tree_.get()};
  }
  Pose in_bullet(int body, const Pose& X_BF) const {
    return body == kWorld ? X_BF : collision_.frame(body).X_BI.inverse() * X_BF;
  }

  void make_equalities() {
    has_rows_.assign(model_.bodies.size(), 0);
    for (const Coupling& coupling : model_.couplings) {
      const auto term = [&](int joint, double coefficient) -> CouplingRow::Term {
        const Place place = end_of(model_.joints[joint].body);
        return {place.tree, place.link, real(coefficient), real(model_.joints[joint].reference)};
      };
      std::vector<CouplingRow::Term> terms = {term(coupling.joint, 1)};
      for (const JointTerm& other : coupling.terms) terms.push_back(term(other.joint, -other.coefficient));
      CouplingRow::Term other = terms.front();
      for (const CouplingRow::Term& each : terms) {
        if (each.tree != terms.front().tree) other = each;
      }
      add_row(model_.joints[coupling.joint].body,
              std::make_unique<CouplingRow>(std::move(terms), other, real(coupling.offset)));
    }
    for (const Connect& connect : model_.connects) {
      const Place a = end_of(connect.body_a), b = end_of(connect.body_b);
      add_row(connect.body_a == kWorld ? connect.body_b : connect.body_a,
              std::make_unique<btMultiBodyPoint2Point>(
                  a.tree, a.link, b.tree, b.link, to_bt(in_bullet(connect.body_a, {connect.p_A, Quat::Identity()}).p),
                  to_bt(in_bullet(connect.body_b, {connect.p_B, Quat::Identity()}).p)));
    }
    for (const Weld& weld : model_.welds) {
      const WeldFrames frames = weld_frames(model_, weld);
      const Place a = end_of(weld.body_a), b = end_of(weld.body_b);
      const Pose X_a = in_bullet(weld.body_a, frames.X_AS), X_b = in_bullet(weld.body_b, frames.X_BS);
      add_row(weld.body_a == kWorld ? weld.body_b : weld.body_a,
              std::make_unique<btMultiBodyFixedConstraint>(a.tree, a.link, b.tree, b.link, to_bt(X_a.p), to_bt(X_b.p),
                                                           btMatrix3x3(to_bt(X_a.q)), btMatrix3x3(to_bt(X_b.q))));
    }
  }

  void make_armature() {
    for (const auto& tree : trees_) {
      std::vector<ArmatureRows::Freedom> freedoms;
      int body = -1;
      const auto add = [&](int on, double armature, int count) {
        const Place& place = places_[on];
        if (place.tree != tree.get() || armature == 0) return;
        for (int k = 0; k < count; ++k) {
          freedoms.push_back({tree->getLink(place.link).m_dofOffset + k, real(armature)});
        }
        body = on;
      };
      for (const Joint& joint : model_.joints) add(joint.body, joint.armature, 1);
      for (const BallJoint& ball : model_.balls) add(ball.body, ball.armature, 3);
      if (freedoms.empty()) continue;
      armatures_.push_back(std::make_unique<ArmatureRows>(tree.get(), places_[body].link, std::move(freedoms)));
      armatures_.back()->setMaxAppliedImpulse(SIMD_INFINITY);
      has_rows_[body] = 1;
      multibody_world().addMultiBodyConstraint(armatures_.back().get());
    }
    if (armatures_.empty()) return;
    const auto begin_step = [](btDynamicsWorld* world, btScalar /*timestep*/) {
      const auto* self = static_cast<const MultibodySimulation*>(world->getWorldUserInfo());
      for (const auto& rows : self->armatures_) rows->begin_step();
    };
    world().setInternalTickCallback(begin_step, this, true);
  }

  // A collider for every body that can touch something, and for every link whose joint has rows: Bullet finds the
  // island of a limit or motor through the link's collider and skips one that has none.
  void make_colliders() {
    for (size_t b = 0; b < model_.bodies.size(); ++b) {
      const Place& place = places_[b];
      btCollisionShape* shape = collision_.body_shape(static_cast<int>(b));
      const int joint = model_.bodies[b].joint;
      const bool has_rows =
          has_rows_[b] != 0 || (joint >= 0 && (limits_[joint] != nullptr || motors_[joint] != nullptr));
      if (shape == nullptr && !has_rows) continue;
      auto collider = std::make_unique<btMultiBodyLinkCollider>(place.tree, place.link);
      collider->setCollisionShape(shape != nullptr ? shape : &no_shape_);
      collider->setActivationState(DISABLE_DEACTIVATION);
      const BodyState& s = start_.bodies[b];
      collider->setWorldTransform(to_bt(Pose{s.p_WBcm, s.q_WB * collision_.frame(static_cast<int>(b)).X_BI.q}));
      if (place.link < 0) {
        place.tree->setBaseCollider(collider.get());
      } else {
        place.tree->getLink(place.link).m_collider = collider.get();
      }
      if (shape != nullptr) {
        collision_.claim(*collider, static_cast<int>(b));
        world().addCollisionObject(collider.get());
      } else {
        world().addCollisionObject(collider.get(), 0, 0);
      }
      colliders_.push_back(std::move(collider));
    }
    btAlignedObjectArray<btQuaternion> rotations;
    btAlignedObjectArray<btVector3> origins;
    for (const auto& tree : trees_) {
      tree->forwardKinematics(rotations, origins);
      tree->updateCollisionObjectWorldTransforms(rotations, origins);
    }
  }

  void read(State& out) const override {
    for (size_t b = 0; b < places_.size(); ++b) {
      const Place& place = places_[b];
      if (const int ball = model_.bodies[b].ball; ball >= 0) {
        const Quat& q_BI = collision_.frame(static_cast<int>(b)).X_BI.q;
        const btScalar* q = place.tree->getJointPosMultiDof(place.link);
        const btScalar* w = place.tree->getJointVelMultiDof(place.link);
        balls_[ball] = {(q_BI * from_bt(btQuaternion(q[0], q[1], q[2], q[3])) * q_BI.conjugate()).normalized(),
                        q_BI * Vec3(w[0], w[1], w[2])};
        continue;
      }
      if (place.link >= 0) {
        const int joint = model_.bodies[b].joint;
        out.position[joint] = place.tree->getJointPos(place.link) + model_.joints[joint].reference;
        out.velocity[joint] = place.tree->getJointVel(place.link);
        continue;
      }
      const Quat q_WI = from_bt(place.tree->getWorldToBaseRot()).conjugate();
      out.bodies[b] = {from_bt(place.tree->getBasePos()),
                       (q_WI * collision_.frame(static_cast<int>(b)).X_BI.q.conjugate()).normalized(),
                       from_bt(place.tree->getBaseVel()), from_bt(place.tree->getBaseOmega())};
    }
    bodies_from_joints(model_, balls_, out);
  }

  void apply(const std::vector<double>& torques, const std::vector<Vec3>& ball_torques) override {
    for (const auto& tree : trees_) tree->clearForcesAndTorques();
    for (size_t j = 0; j < torques.size(); ++j) {
      const Place& place = places_[model_.joints[j].body];
      place.tree->addJointTorque(place.link, real(torques[j]));
    }
    for (size_t i = 0; i < ball_torques.size(); ++i) {
      const int b = model_.balls[i].body;
      const btVector3 torque = to_bt(Vec3(collision_.frame(b).X_BI.q.conjugate() * ball_torques[i]));
      places_[b].tree->addJointTorqueMultiDof(places_[b].link, torque.m_floats);
    }
  }

  void view_parts(EngineView& out) const override {
    btAlignedObjectArray<btQuaternion> rotations;
    btAlignedObjectArray<btVector3> origins;
    for (const auto& tree : trees_) tree->forwardKinematics(rotations, origins);
    for (size_t b = 0; b < places_.size(); ++b) {
      const btMultiBody& tree = *places_[b].tree;
      const int link = places_[b].link;
      const btTransform X_WI = link < 0 ? tree.getBaseWorldTransform() : tree.getLink(link).m_cachedWorldTransform;
      const Mat3 R = from_bt(X_WI.getBasis());
      EngineBody& seen = out.bodies[b];
      seen.mass = link < 0 ? tree.getBaseMass() : tree.getLinkMass(link);
      seen.p_WBcm = from_bt(X_WI.getOrigin());
      seen.I_BBcm_W =
          R * from_bt(link < 0 ? tree.getBaseInertia() : tree.getLinkInertia(link)).asDiagonal() * R.transpose();
      const int j = model_.bodies[b].joint;
      if (j < 0) continue;

      const Joint& hinge = model_.joints[j];
      EngineJoint& joint = out.joints[j];
      joint.p_WJ = from_bt(X_WI * (-tree.getLink(link).m_dVector));
      const btVector3& axis = hinge.is_slide() ? tree.getLink(link).getAxisBottom(0) : tree.getLink(link).getAxisTop(0);
      joint.axis_W = from_bt(X_WI.getBasis() * axis);
      joint.limited = limits_[j] != nullptr;
      if (joint.limited) {
        joint.lower = limits_[j]->getLowerBound() + hinge.reference;
        joint.upper = limits_[j]->getUpperBound() + hinge.reference;
      }
    }
  }

  btSphereShape no_shape_{real(1e-3)};  // of links whose joints have rows, but that touch nothing
  std::vector<Place> places_;           // by Model::bodies
  std::vector<int> links_of_root_;      // by Model::bodies, meaningful for roots
  std::vector<std::unique_ptr<btMultiBody>> trees_;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders_;
  std::vector<std::unique_ptr<btMultiBodyJointLimitConstraint>> limits_;  // by Model::joints, null without a limit
  std::vector<std::unique_ptr<btMultiBodyJointMotor>> motors_;            // by Model::joints, null without dry friction
  std::vector<std::unique_ptr<btMultiBodyConstraint>> equalities_;
  std::vector<std::unique_ptr<ArmatureRows>> armatures_;  // of each tree that has any
  std::unique_ptr<btMultiBody> world_tree_;               // the world's end of connects and welds
  std::vector<char> has_rows_;                            // by Model::bodies: an equality's
  mutable std::vector<BallCoordinates> balls_;            // scratch, by Model::balls
};

}  // namespace

std::unique_ptr<Simulation> make_multibody(const Model& model, const State& state, const Options& options) {
  return std::make_unique<MultibodySimulation>(model, state, options);
}

}  // namespace assay::bullet
