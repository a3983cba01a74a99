// Box3D as its user would write it: bodies, a revolute joint each, b3World_Step.
#include <vector>

#include <box3d/box3d.h>
#include <box3d/collision.h>

#include "direct.h"
#include "model/kinematics.h"

namespace assay::benchmarks {
namespace {

float real(double x) { return static_cast<float>(x); }
b3Vec3 vec(const Vec3& v) { return {real(v.x()), real(v.y()), real(v.z())}; }
b3Pos position(const Vec3& p) {
  using Number = decltype(b3Pos::x);
  return {static_cast<Number>(p.x()), static_cast<Number>(p.y()), static_cast<Number>(p.z())};
}
b3Quat quat(const Quat& q) { return b3NormalizeQuat({vec(q.vec()), real(q.w())}); }

class DirectBox3d final : public Direct {
 public:
  DirectBox3d(const Scene& scene, const State& start, const Settings& settings)
      : h_(real(settings.timestep)), sub_steps_(static_cast<int>(settings.get<long long>("sub_steps"))) {
    const Model& model = scene.model;
    b3WorldDef world = b3DefaultWorldDef();
    world.gravity = vec(model.gravity);
    world.contactHertz = real(settings.get<double>("contact_hertz"));
    world.contactDampingRatio = real(settings.get<double>("contact_damping_ratio"));
    world.contactSpeed = real(settings.get<double>("contact_speed"));
    world.maximumLinearSpeed = 1e9f;
    world.enableSleep = false;
    world.enableContinuous = settings.get<bool>("continuous");
    world.frictionCallback = [](float a, uint64_t, float b, uint64_t) { return a < b ? b : a; };
    world_ = b3CreateWorld(&world);
    make_bodies(model, start, settings);
    make_hinges(model, settings);
  }

  ~DirectBox3d() override { b3DestroyWorld(world_); }
  DirectBox3d(const DirectBox3d&) = delete;
  DirectBox3d& operator=(const DirectBox3d&) = delete;

  void run(int count) override {
    for (int i = 0; i < count; ++i) b3World_Step(world_, h_, sub_steps_);
  }

  void run_with_torques(std::span<const double> torques, int count) override {
    for (int i = 0; i < count; ++i) {
      for (size_t j = 0; j < torques.size(); ++j) {
        const b3Quat q = b3Body_GetRotation(children_[j]);
        const Vec3 torque = torques[j] * (Quat(q.s, q.v.x, q.v.y, q.v.z).normalized() * axes_[j]);
        sums_[hinged_[j]] += torque;
        if (parents_[j] != kWorld) sums_[parents_[j]] -= torque;
      }
      for (size_t b = 0; b < sums_.size(); ++b) {
        b3Body_ApplyTorque(bodies_[b], vec(sums_[b]), false);
        sums_[b].setZero();
      }
      b3World_Step(world_, h_, sub_steps_);
    }
  }

  std::vector<Vec3> positions() const override {
    std::vector<Vec3> result;
    for (const b3BodyId body : bodies_) {
      const b3Pos p = b3Body_GetWorldCenter(body);
      result.emplace_back(p.x, p.y, p.z);
    }
    return result;
  }

 private:
  void make_bodies(const Model& model, const State& start, const Settings& settings) {
    b3ShapeDef surface = b3DefaultShapeDef();
    surface.density = 0;
    surface.updateBodyMass = false;
    if (!model.contacts.empty()) surface.baseMaterial.friction = real(model.contacts.front().friction);
    for (const BodyState& state : start.bodies) {
      b3BodyDef body = b3DefaultBodyDef();
      body.type = b3_dynamicBody;
      body.position = position(state.p_WBcm);
      body.rotation = quat(state.q_WB);
      body.linearVelocity = vec(state.v_WBcm);
      body.angularVelocity = vec(state.w_WB);
      body.enableSleep = false;
      body.allowFastRotation = true;
      body.enableContactRecycling = settings.get<bool>("contact_recycling");
      bodies_.push_back(b3CreateBody(world_, &body));
    }
    if (!model.contacts.empty()) make_shapes(model, start, settings, surface);
    for (size_t b = 0; b < bodies_.size(); ++b) {
      const Mat3& I = model.bodies[b].I_BBcm_B;
      b3Body_SetMassData(bodies_[b],
                         {real(model.bodies[b].mass), {0, 0, 0}, {vec(I.col(0)), vec(I.col(1)), vec(I.col(2))}});
    }
    sums_.resize(bodies_.size(), Vec3::Zero());
  }

  void make_shapes(const Model& model, const State& start, const Settings& settings, const b3ShapeDef& surface) {
    for (const Shape& shape : model.shapes) {
      if (shape.type == ShapeType::kPlane) {
        // where the bodies are, as the adapter puts it
        Vec3 middle = Vec3::Zero();
        for (const BodyState& body : start.bodies) middle += body.p_WBcm;
        middle /= static_cast<double>(start.bodies.size());
        middle.z() = 0;
        b3BodyDef ground = b3DefaultBodyDef();
        ground.position = position(middle);
        const float half = real(settings.get<double>("ground_size") / 2);
        const float thickness = real(settings.get<double>("ground_thickness") / 2);
        const b3BoxHull box = b3MakeOffsetBoxHull(half, half, thickness, {0, 0, -thickness});
        b3CreateHullShape(b3CreateBody(world_, &ground), &surface, &box.base);
      } else {
        const b3Capsule capsule{{0, 0, -real(shape.half_length)}, {0, 0, real(shape.half_length)}, real(shape.radius)};
        b3CreateCapsuleShape(bodies_[shape.body], &surface, &capsule);
      }
    }
  }

  void make_hinges(const Model& model, const Settings& settings) {
    for (size_t j = 0; j < model.joints.size(); ++j) {
      const Joint& hinge = model.joints[j];
      const Body& body = model.bodies[hinge.body];
      const Vec3 anchor = anchor_in_parent(model, static_cast<int>(j));
      const Vec3 normal = hinge.axis_B.unitOrthogonal();
      Mat3 axes;
      axes << normal, hinge.axis_B.cross(normal), hinge.axis_B;
      b3RevoluteJointDef made = b3DefaultRevoluteJointDef();
      made.base.constraintHertz = real(settings.get<double>("joint_hertz"));
      made.base.constraintDampingRatio = real(settings.get<double>("joint_damping_ratio"));
      made.base.bodyIdB = bodies_[hinge.body];
      made.base.localFrameB = {vec(hinge.p_BJ - body.p_BBcm), quat(Quat(axes))};
      made.base.localFrameA.q = quat(body.X_PB.q * Quat(axes));
      if (body.parent == kWorld) {
        b3BodyDef fixed = b3DefaultBodyDef();
        fixed.position = position(anchor);
        made.base.bodyIdA = b3CreateBody(world_, &fixed);
      } else {
        made.base.bodyIdA = bodies_[body.parent];
        made.base.localFrameA.p = vec(anchor - model.bodies[body.parent].p_BBcm);
      }
      b3CreateRevoluteJoint(world_, &made);
      children_.push_back(bodies_[hinge.body]);
      axes_.push_back(hinge.axis_B);
      hinged_.push_back(hinge.body);
      parents_.push_back(body.parent);
    }
  }

  float h_;
  int sub_steps_;
  b3WorldId world_{};
  std::vector<b3BodyId> bodies_;
  std::vector<b3BodyId> children_;  // of the hinges
  std::vector<Vec3> axes_;          // of the hinges, in the child
  std::vector<int> hinged_, parents_;
  std::vector<Vec3> sums_;  // Nm, by body
};

std::unique_ptr<Direct> make(const Scene& scene, const State& start, const Settings& settings) {
  return std::make_unique<DirectBox3d>(scene, start, settings);
}

}  // namespace
}  // namespace assay::benchmarks

#ifdef BOX3D_DOUBLE_PRECISION
ASSAY_DIRECT_LOOP(assay::benchmarks::make, "box3d")
#else
ASSAY_DIRECT_LOOP(assay::benchmarks::make, "box3d-f32")
#endif
