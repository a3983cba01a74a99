// Joint coordinates: every tree with hinges is a PxArticulationReducedCoordinate. A free body without children is a
// PxRigidDynamic, as it is in the other formulation.
#include <algorithm>

#include "convert.h"
#include "model/kinematics.h"
#include "world.h"

namespace assay::px {

using namespace physx;

namespace {

class ArticulatedSimulation final : public PhysxSimulation {
 public:
  ArticulatedSimulation(const Model& model, const State& state, const Options& options)
      : PhysxSimulation(model, state, options), places_(model.bodies.size()) {
    find_trees();
    for (size_t b = 0; b < model_.bodies.size(); ++b) {
      if (model_.bodies[b].parent == kWorld) make_root(static_cast<int>(b));
    }
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
    bool alone = true;
    int tree = -1;
    int dof = -1;
  };

  void find_trees() {
    for (size_t b = 0; b < places_.size(); ++b) {
      const Body& body = model_.bodies[b];
      places_[b].root = body.parent == kWorld ? static_cast<int>(b) : places_[body.parent].root;
      if (!body.is_free()) places_[places_[b].root].alone = false;
    }
  }

  void make_root(int root) {
    if (places_[root].alone) {
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
    articulation.setMaxCOMLinearVelocity(PX_MAX_F32);
    articulation.setMaxCOMAngularVelocity(PX_MAX_F32);

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
    for (size_t b = root; b < places_.size(); ++b) {
      if (places_[b].root != root || model_.bodies[b].is_free()) continue;
      // every link but the first has one degree of freedom
      places_[b].dof = static_cast<int>(static_cast<PxArticulationLink*>(actors_[b])->getLinkIndex()) - 1;
    }
    tree.cache.reset(articulation.createCache());
    if (tree.cache == nullptr) throw EngineError("PhysX made no cache of an articulation: " + take_complaint());
    trees_.push_back(std::move(tree));
    place(trees_.back());
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
    const Joint& hinge = model_.joints[body.joint];
    const Pose X_BJ{hinge.p_BJ, x_to(hinge.axis_B)};
    Pose X_PJ = body.X_PB * X_BJ;
    if (body.parent != kWorld) X_PJ = collision_.frame(body.parent).X_BI.inverse() * X_PJ;
    PxArticulationJointReducedCoordinate& joint = *link->getInboundJoint();
    joint.setParentPose(to_px(X_PJ));
    joint.setChildPose(to_px(collision_.frame(b).X_BI.inverse() * X_BJ));
    joint.setJointType(PxArticulationJointType::eREVOLUTE_UNWRAPPED);
    joint.setMotion(kAxis, hinge.limited ? PxArticulationMotion::eLIMITED : PxArticulationMotion::eFREE);
    if (hinge.limited) {
      joint.setLimitParams(kAxis, {real(hinge.lower - hinge.reference), real(hinge.upper - hinge.reference)});
    }
    joint.setArmature(kAxis, real(hinge.armature));
    joint.setFrictionCoefficient(0);
    joint.setMaxJointVelocity(PX_MAX_F32);
    if (hinge.has_spring() && options_.native_pd) {
      joint.setDriveParams(kAxis, {real(hinge.stiffness), real(hinge.damping), PX_MAX_F32});
      joint.setDriveTarget(kAxis, real(hinge.spring_reference - hinge.reference), false);
    }
  }

  // Puts a tree into the start's state.
  void place(const Tree& tree) {
    PxArticulationCache& cache = *tree.cache;
    tree.articulation->zeroCache(cache);
    for (size_t b = tree.root; b < places_.size(); ++b) {
      const Place& place = places_[b];
      if (place.root != tree.root || place.dof < 0) continue;
      const int hinge = model_.bodies[b].joint;
      cache.jointPosition[place.dof] = real(start_.position[hinge] - model_.joints[hinge].reference);
      cache.jointVelocity[place.dof] = real(start_.velocity[hinge]);
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
      const int hinge = model_.bodies[b].joint;
      out.position[hinge] = cache.jointPosition[place.dof] + model_.joints[hinge].reference;
      out.velocity[hinge] = cache.jointVelocity[place.dof];
    }
    bodies_from_joints(model_, out);
  }

  void apply(const std::vector<double>& torques) override {
    for (size_t j = 0; j < torques.size(); ++j) {
      const Place& place = places_[model_.joints[j].body];
      trees_[place.tree].cache->jointForce[place.dof] = real(torques[j]);
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

  EngineJoint view_hinge(int j) const override {
    const Joint& hinge = model_.joints[j];
    const auto& link = static_cast<const PxArticulationLink&>(*actors_[hinge.body]);
    const PxArticulationJointReducedCoordinate& joint = *link.getInboundJoint();
    const PxTransform X_WJ = link.getGlobalPose() * joint.getChildPose();
    EngineJoint seen;
    seen.p_WJ = from_px(X_WJ.p);
    seen.axis_W = from_px(X_WJ.q.getBasisVector0());
    seen.limited = joint.getMotion(kAxis) == PxArticulationMotion::eLIMITED;
    if (seen.limited) {
      const PxArticulationLimit limit = joint.getLimitParams(kAxis);
      seen.lower = limit.low + hinge.reference;
      seen.upper = limit.high + hinge.reference;
    }
    return seen;
  }

  static constexpr PxArticulationAxis::Enum kAxis = PxArticulationAxis::eTWIST;
  inline static const PxArticulationCacheFlags kState =
      PxArticulationCacheFlag::ePOSITION | PxArticulationCacheFlag::eVELOCITY |
      PxArticulationCacheFlag::eROOT_TRANSFORM | PxArticulationCacheFlag::eROOT_VELOCITIES;

  std::vector<Place> places_;  // by Model::bodies
  std::vector<Tree> trees_;
};

}  // namespace

std::unique_ptr<Simulation> make_articulated(const Model& model, const State& state, const Options& options) {
  return std::make_unique<ArticulatedSimulation>(model, state, options);
}

}  // namespace assay::px
