// Joint coordinates: every tree with joints is a PxArticulationReducedCoordinate. A free body without children is a
// PxRigidDynamic, as it is in the other formulation.
#include <algorithm>
#include <array>

#include "convert.h"
#include "model/kinematics.h"
#include "world.h"

namespace assay::px {

using namespace physx;

namespace {

class ArticulatedSimulation final : public PhysxSimulation {
 public:
  ArticulatedSimulation(const Model& model, const State& state, const Options& options)
      : PhysxSimulation(model, state, options), places_(model.bodies.size()), in_trees_(bodies_in_trees(model_)) {
    find_trees();
    for (size_t b = 0; b < model_.bodies.size(); ++b) {
      if (model_.bodies[b].parent == kWorld) make_root(static_cast<int>(b));
    }
    make_constraints();
    finish_set_up();
  }

 private:
  struct Tree {
    Owned<PxArticulationReducedCoordinate> articulation;
    Owned<PxArticulationCache> cache;  // goes first
    int root = 0;                      // body
  };

  // Where a body of the model is: tree -1 is a PxRigidDynamic, dof -1 the floating base of its tree.
  struct Place {
    int root = 0;
    int tree = -1;
    int dof = -1;
  };

  void find_trees() {
    for (size_t b = 0; b < places_.size(); ++b) {
      const Body& body = model_.bodies[b];
      places_[b].root = body.parent == kWorld ? static_cast<int>(b) : places_[body.parent].root;
    }
  }

  void make_root(int root) {
    if (!in_trees_[root]) {
      make_dynamic(root);
      return;
    }
    Tree tree;
    tree.root = root;
    tree.articulation.reset(sdk().createArticulationReducedCoordinate());
    PxArticulationReducedCoordinate& articulation = *tree.articulation;
    const bool fixed = !model_.bodies[root].is_free();
    articulation.setArticulationFlag(PxArticulationFlag::eFIX_BASE, fixed);
    articulation.setArticulationFlag(PxArticulationFlag::eDRIVE_LIMITS_ARE_FORCES, true);
    articulation.setSolverIterationCounts(options_.position_iterations, options_.velocity_iterations);
    articulation.setSleepThreshold(0);
    articulation.setStabilizationThreshold(0);
#if PX_PHYSICS_VERSION_MAJOR == 5 && PX_PHYSICS_VERSION_MINOR < 6  // later ones have only the links' limits
    articulation.setMaxCOMLinearVelocity(PX_MAX_F32);
    articulation.setMaxCOMAngularVelocity(PX_MAX_F32);
#endif

    // a hinged root hangs on a link that stands in the world's origin
    PxArticulationLink* ground = nullptr;
    if (fixed) ground = articulation.createLink(nullptr, PxTransform(PxIdentity));
    for (size_t b = root; b < places_.size(); ++b) {
      if (places_[b].root != root) continue;
      places_[b].tree = static_cast<int>(trees_.size());
      const int parent = model_.bodies[b].parent;
      make_link(articulation, static_cast<int>(b),
                parent == kWorld ? ground : static_cast<PxArticulationLink*>(actors_[parent]));
    }
    scene_->addArticulation(articulation);
    articulation.setWakeCounter(PX_MAX_F32);
    number_coordinates(root, articulation);
    tree.cache.reset(articulation.createCache());
    if (tree.cache == nullptr) throw EngineError("PhysX made no cache of an articulation: " + take_complaint());
    trees_.push_back(std::move(tree));
    place(trees_.back());
  }

  // PhysX's coordinates are in the order of its links.
  void number_coordinates(int root, const PxArticulationReducedCoordinate& articulation) {
    std::vector<int> body_of_link(articulation.getNbLinks(), -1);
    for (size_t b = root; b < places_.size(); ++b) {
      if (places_[b].root != root || model_.bodies[b].is_free()) continue;
      body_of_link[static_cast<const PxArticulationLink*>(actors_[b])->getLinkIndex()] = static_cast<int>(b);
    }
    int dof = 0;
    for (const int b : body_of_link) {
      if (b < 0) continue;
      places_[b].dof = dof;
      dof += model_.bodies[b].ball >= 0 ? 3 : 1;
    }
  }

  void make_link(PxArticulationReducedCoordinate& articulation, int b, PxArticulationLink* parent) {
    const BodyState& s = start_.bodies[b];
    PxArticulationLink* link =
        articulation.createLink(parent, to_px(Pose{s.p_WBcm, s.q_WB * collision_.frame(b).X_BI.q}));
    if (link == nullptr) throw EngineError("PhysX made no link: " + take_complaint());
    actors_[b] = link;
    prepare(*link, b);
    link->setCfmScale(real(options_.link_cfm));
    const Body& body = model_.bodies[b];
    if (body.is_free()) return;

    // both frames agree at the reference configuration, where PhysX's joint position is zero
    const Pose X_BJ = joint_frame(body);
    Pose X_PJ = body.X_PB * X_BJ;
    if (body.parent != kWorld) X_PJ = collision_.frame(body.parent).X_BI.inverse() * X_PJ;
    PxArticulationJointReducedCoordinate& joint = *link->getInboundJoint();
    joint.setParentPose(to_px(X_PJ));
    joint.setChildPose(to_px(collision_.frame(b).X_BI.inverse() * X_BJ));
    joint.setFrictionCoefficient(0);
    joint.setMaxJointVelocity(PX_MAX_F32);
    if (body.ball >= 0) {
      make_ball(joint, model_.balls[body.ball]);
    } else {
      make_joint(joint, model_.joints[body.joint]);
    }
  }

  // Of a hinge or slide with its axis along x; of a ball joint in body axes, which its coordinates are in then.
  Pose joint_frame(const Body& body) const {
    if (body.ball >= 0) return {model_.balls[body.ball].p_BJ, Quat::Identity()};
    const Joint& joint = model_.joints[body.joint];
    return {joint.p_BJ, x_to(joint.axis_B)};
  }

  void make_joint(PxArticulationJointReducedCoordinate& joint, const Joint& of) const {
    const PxArticulationAxis::Enum axis = axis_of(of);
    joint.setJointType(of.is_slide() ? PxArticulationJointType::ePRISMATIC
                                     : PxArticulationJointType::eREVOLUTE_UNWRAPPED);
    joint.setMotion(axis, of.limited ? PxArticulationMotion::eLIMITED : PxArticulationMotion::eFREE);
    if (of.limited) joint.setLimitParams(axis, {real(of.lower - of.reference), real(of.upper - of.reference)});
    joint.setArmature(axis, real(of.armature));
    if (of.has_spring() && options_.native_pd) {
      joint.setDriveParams(axis, {real(of.stiffness), real(of.damping), PX_MAX_F32});
      joint.setDriveTarget(axis, real(of.spring_reference - of.reference), false);
    } else if (of.dry_friction != 0) {
      joint.setDriveParams(axis, brake(of.dry_friction));
    }
  }

  static void make_ball(PxArticulationJointReducedCoordinate& joint, const BallJoint& ball) {
    joint.setJointType(PxArticulationJointType::eSPHERICAL);
    for (const PxArticulationAxis::Enum axis : kBallAxes) {
      joint.setMotion(axis, PxArticulationMotion::eFREE);
      joint.setArmature(axis, real(ball.armature));
      if (ball.dry_friction != 0) joint.setDriveParams(axis, brake(ball.dry_friction));
    }
  }

  // Dry friction: a damper so stiff that it stops the joint within a step, with no more than that force. PhysX leaves
  // out drives without stiffness and damping, whatever their type.
  static PxArticulationDrive brake(double force) {
    constexpr float kDamping = 1e20F;  // N s/m, Nm s/rad
    return {0, kDamping, real(force), PxArticulationDriveType::eFORCE};
  }

  static PxArticulationAxis::Enum axis_of(const Joint& joint) {
    return joint.is_slide() ? PxArticulationAxis::eX : PxArticulationAxis::eTWIST;
  }

  // Puts a tree into the start's state.
  void place(const Tree& tree) {
    PxArticulationCache& cache = *tree.cache;
    tree.articulation->zeroCache(cache);
    for (size_t b = tree.root; b < places_.size(); ++b) {
      const Place& place = places_[b];
      if (place.root != tree.root || place.dof < 0) continue;
      if (const int ball = model_.bodies[b].ball; ball >= 0) {
        const Vec3 rotation = rotation_vector(ball_rotation(model_, start_, ball));
        const Vec3 velocity = ball_velocity(model_, start_, ball);
        for (int k = 0; k < 3; ++k) {
          cache.jointPosition[place.dof + k] = real(rotation[k]);
          cache.jointVelocity[place.dof + k] = real(velocity[k]);
        }
        continue;
      }
      const int joint = model_.bodies[b].joint;
      cache.jointPosition[place.dof] = real(start_.position[joint] - model_.joints[joint].reference);
      cache.jointVelocity[place.dof] = real(start_.velocity[joint]);
    }
    cache.rootLinkData->transform = PxTransform(PxIdentity);
    if (model_.bodies[tree.root].is_free()) {
      const BodyState& s = start_.bodies[tree.root];
      cache.rootLinkData->transform = to_px(Pose{s.p_WBcm, s.q_WB * collision_.frame(tree.root).X_BI.q});
      cache.rootLinkData->worldLinVel = to_px(s.v_WBcm);
      cache.rootLinkData->worldAngVel = to_px(s.w_WB);
    }
    tree.articulation->applyCache(cache, kState, false);
  }

  void read(State& out) const override {
    for (const Tree& tree : trees_) tree.articulation->copyInternalStateToCache(*tree.cache, kState);
    for (size_t b = 0; b < places_.size(); ++b) {
      const Place& place = places_[b];
      if (place.tree < 0) {
        read_dynamic(static_cast<int>(b), out.bodies[b]);
        continue;
      }
      const PxArticulationCache& cache = *trees_[place.tree].cache;
      if (place.dof < 0) {
        const Pose X_WI = from_px(cache.rootLinkData->transform);
        out.bodies[b] = {X_WI.p, (X_WI.q * collision_.frame(static_cast<int>(b)).X_BI.q.conjugate()).normalized(),
                         from_px(cache.rootLinkData->worldLinVel), from_px(cache.rootLinkData->worldAngVel)};
        continue;
      }
      const int joint = model_.bodies[b].joint;
      if (joint < 0) continue;
      out.position[joint] = cache.jointPosition[place.dof] + model_.joints[joint].reference;
      out.velocity[joint] = cache.jointVelocity[place.dof];
    }
    if (!model_.balls.empty()) read_balls(out);
    bodies_from_joints(model_, out);
  }

  // Orientation and angular velocity of the bodies on ball joints, which bodies_from_joints() starts from. Those of the
  // bodies between come along.
  void read_balls(State& out) const {
    for (size_t b = 0; b < places_.size(); ++b) {
      const Body& body = model_.bodies[b];
      if (body.is_free()) continue;
      BodyState& s = out.bodies[b];
      s.q_WB = body.X_PB.q;
      s.w_WB.setZero();
      if (body.parent != kWorld) {
        s.q_WB = out.bodies[body.parent].q_WB * s.q_WB;
        s.w_WB = out.bodies[body.parent].w_WB;
      }
      Vec3 rotation = Vec3::Zero(), velocity = Vec3::Zero();  // relative to the parent, in child axes
      if (body.ball >= 0) {
        const PxArticulationCache& cache = *trees_[places_[b].tree].cache;
        const int dof = places_[b].dof;
        for (int k = 0; k < 3; ++k) {
          rotation[k] = cache.jointPosition[dof + k];
          velocity[k] = cache.jointVelocity[dof + k];
        }
      } else if (const Joint& joint = model_.joints[body.joint]; !joint.is_slide()) {
        rotation = joint.axis_B * (out.position[body.joint] - joint.reference);
        velocity = joint.axis_B * out.velocity[body.joint];
      }
      if (const double angle = rotation.norm(); angle > 0) {
        s.q_WB = (s.q_WB * Quat(Eigen::AngleAxisd(angle, rotation / angle))).normalized();
      }
      s.w_WB += s.q_WB * velocity;
    }
  }

  void apply(const std::vector<double>& torques, const std::vector<Vec3>& balls) override {
    for (size_t j = 0; j < torques.size(); ++j) {
      const Place& place = places_[model_.joints[j].body];
      trees_[place.tree].cache->jointForce[place.dof] = real(torques[j]);
    }
    for (size_t i = 0; i < balls.size(); ++i) {
      const Place& place = places_[model_.balls[i].body];
      for (int k = 0; k < 3; ++k) trees_[place.tree].cache->jointForce[place.dof + k] = real(balls[i][k]);
    }
    for (const Tree& tree : trees_) {
      tree.articulation->applyCache(*tree.cache, PxArticulationCacheFlag::eFORCE, false);
    }
  }

  void withdraw() override {
    for (const Tree& tree : trees_) {
      std::fill_n(tree.cache->jointForce, tree.articulation->getDofs(), 0.0F);
      tree.articulation->applyCache(*tree.cache, PxArticulationCacheFlag::eFORCE, false);
    }
  }

  EngineJoint view_joint(int j) const override {
    const Joint& of = model_.joints[j];
    const auto& link = static_cast<const PxArticulationLink&>(*actors_[of.body]);
    const PxArticulationJointReducedCoordinate& joint = *link.getInboundJoint();
    const PxTransform X_WJ = link.getGlobalPose() * joint.getChildPose();
    EngineJoint seen;
    seen.p_WJ = from_px(X_WJ.p);
    seen.axis_W = from_px(X_WJ.q.getBasisVector0());
    seen.limited = joint.getMotion(axis_of(of)) == PxArticulationMotion::eLIMITED;
    if (seen.limited) {
      const PxArticulationLimit limit = joint.getLimitParams(axis_of(of));
      seen.lower = limit.low + of.reference;
      seen.upper = limit.high + of.reference;
    }
    return seen;
  }

  static constexpr std::array kBallAxes = {PxArticulationAxis::eTWIST, PxArticulationAxis::eSWING1,
                                           PxArticulationAxis::eSWING2};
  inline static const PxArticulationCacheFlags kState =
      PxArticulationCacheFlag::ePOSITION | PxArticulationCacheFlag::eVELOCITY |
      PxArticulationCacheFlag::eROOT_TRANSFORM | PxArticulationCacheFlag::eROOT_VELOCITIES;

  std::vector<Place> places_;  // by Model::bodies
  const std::vector<bool> in_trees_;
  std::vector<Tree> trees_;
};

}  // namespace

std::unique_ptr<Simulation> make_articulated(const Model& model, const State& state, const Options& options) {
  return std::make_unique<ArticulatedSimulation>(model, state, options);
}

}  // namespace assay::px
