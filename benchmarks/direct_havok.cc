// Havok as its user would write it against the exported functions: HP_World_Step in a loop.
#include <memory>

#include "direct.h"
#include "host.h"
#include "model/kinematics.h"

namespace assay::benchmarks {
namespace {

float f(double x) { return static_cast<float>(x); }
havok::Vector3 vector3(const Vec3& v) { return {f(v.x()), f(v.y()), f(v.z())}; }
havok::Quaternion quaternion(const Quat& q) { return {f(q.x()), f(q.y()), f(q.z()), f(q.w())}; }

class DirectHavok final : public Direct {
 public:
  DirectHavok(const Scene& scene, const State& start, const Settings& settings)
      : h_(f(settings.timestep)), timestep_(settings.timestep), world_(make_world()) {
    const Model& model = scene.model;
    w2c_havok_HP_World_SetGravity(havok_, world_, havok_.in(vector3(model.gravity)));
    w2c_havok_HP_World_SetIdealStepTime(havok_, world_, f(settings.get<double>("ideal_step_time")));
    w2c_havok_HP_World_SetSpeedLimit(havok_, world_, f(settings.get<double>("max_speed")),
                                     f(settings.get<double>("max_angular_speed")));
    if (!model.contacts.empty()) make_shapes(model, settings);
    for (size_t b = 0; b < model.bodies.size(); ++b) make_body(model, b, start.bodies[b]);
    for (const Joint& hinge : model.joints) make_hinge(model, hinge);
  }

  void run(int count) override {
    for (int i = 0; i < count; ++i) w2c_havok_HP_World_Step(havok_, world_, h_);
  }

  // One tree of hinges: body j hangs on body j - 1.
  void run_with_torques(std::span<const double> torques, int count) override {
    for (int i = 0; i < count; ++i) {
      for (size_t j = 0; j < torques.size(); ++j) {
        w2c_havok_HP_Body_GetQTransform(havok_, bodies_[j], havok_.out());
        const havok::Quaternion q = havok_.result<havok::QTransform>().rotation;
        const Vec3 axis = Quat(q.w, q.x, q.y, q.z).normalized() * axes_[j];
        const Vec3 impulse = (torques[j] * timestep_) * axis;
        w2c_havok_HP_Body_ApplyAngularImpulse(havok_, bodies_[j], havok_.in(vector3(impulse)));
        if (j > 0) w2c_havok_HP_Body_ApplyAngularImpulse(havok_, bodies_[j - 1], havok_.in(vector3(-impulse)));
      }
      w2c_havok_HP_World_Step(havok_, world_, h_);
    }
  }

  std::vector<Vec3> positions() const override {
    std::vector<Vec3> result;
    for (const havok::Id body : bodies_) {
      w2c_havok_HP_Body_GetQTransform(havok_, body, havok_.out());
      const havok::Vector3 p = havok_.result<havok::QTransform>().translation;
      result.emplace_back(p.x, p.y, p.z);
    }
    return result;
  }

 private:
  havok::Id make_world() {
    w2c_havok_HP_World_Create(havok_, havok_.out());
    return havok_.result<havok::Id>();
  }

  // Capsules along z through the centre of mass, one plane at height 0, one coefficient of friction.
  void make_shapes(const Model& model, const Settings& settings) {
    const float mu = f(model.contacts.front().friction), side = f(settings.get<double>("ground_size"));
    const float thickness = f(settings.get<double>("ground_thickness"));
    const havok::Material material{mu, mu, 0, havok::kMaximum, havok::kMaximum};
    const auto finish = [&](std::uint32_t group, std::uint32_t meets) {
      const auto shape = havok_.result<havok::Id>(7);
      w2c_havok_HP_Shape_SetFilterInfo(havok_, shape, havok_.in(havok::FilterInfo{group, meets}));
      w2c_havok_HP_Shape_SetMaterial(havok_, shape, havok_.in(material));
      return shape;
    };
    for (const Shape& shape : model.shapes) {
      if (shape.type == ShapeType::kPlane) {
        w2c_havok_HP_Shape_CreateBox(havok_, havok_.in(havok::Vector3{0, 0, -thickness / 2}, 0),
                                     havok_.in(havok::Quaternion{}, 1),
                                     havok_.in(havok::Vector3{side, side, thickness}, 2), havok_.out(7));
        fixed_body(finish(1, 2));
      } else {
        w2c_havok_HP_Shape_CreateCapsule(havok_, havok_.in(havok::Vector3{0, 0, f(-shape.half_length)}, 0),
                                         havok_.in(havok::Vector3{0, 0, f(shape.half_length)}, 1), f(shape.radius),
                                         havok_.out(7));
        shapes_.push_back(finish(2, 3));
      }
    }
  }

  havok::Id fixed_body(havok::Id shape) {
    w2c_havok_HP_Body_Create(havok_, havok_.out());
    const auto body = havok_.result<havok::Id>();
    w2c_havok_HP_Body_SetMotionType(havok_, body, havok::kStatic);
    if (shape != 0) w2c_havok_HP_Body_SetShape(havok_, body, shape);
    w2c_havok_HP_Body_SetQTransform(havok_, body, havok_.in(havok::QTransform{}));
    w2c_havok_HP_World_AddBody(havok_, world_, body, 0);
    return body;
  }

  void make_body(const Model& model, size_t b, const BodyState& s) {
    const double mass = model.bodies[b].mass;
    w2c_havok_HP_Body_Create(havok_, havok_.out());
    const auto body = havok_.result<havok::Id>();
    bodies_.push_back(body);
    w2c_havok_HP_Body_SetMotionType(havok_, body, havok::kDynamic);
    if (!shapes_.empty()) w2c_havok_HP_Body_SetShape(havok_, body, shapes_[b]);
    havok::MassProperties properties;
    properties.mass = f(mass);
    properties.inertia_per_mass = vector3(model.bodies[b].I_BBcm_B.diagonal() / mass);
    w2c_havok_HP_Body_SetMassProperties(havok_, body, havok_.in(properties));
    w2c_havok_HP_Body_SetLinearDamping(havok_, body, 0);
    w2c_havok_HP_Body_SetAngularDamping(havok_, body, 0);
    w2c_havok_HP_Body_SetActivationControl(havok_, body, havok::kAlwaysActive);
    w2c_havok_HP_Body_SetQTransform(havok_, body, havok_.in(havok::QTransform{vector3(s.p_WBcm), quaternion(s.q_WB)}));
    w2c_havok_HP_World_AddBody(havok_, world_, body, 0);
    w2c_havok_HP_Body_SetLinearVelocity(havok_, body, havok_.in(vector3(s.v_WBcm)));
    w2c_havok_HP_Body_SetAngularVelocity(havok_, body, havok_.in(vector3(s.w_WB)));
  }

  void make_hinge(const Model& model, const Joint& hinge) {
    const Body& child = model.bodies[hinge.body];
    const bool root = child.parent == kWorld;
    Vec3 p_parent = anchor_in_parent(model, static_cast<int>(axes_.size()));
    if (!root) p_parent -= model.bodies[child.parent].p_BBcm;
    const havok::Id parent = root ? fixed_body(0) : bodies_[child.parent];
    const Vec3 side = hinge.axis_B.unitOrthogonal();
    axes_.push_back(hinge.axis_B);
    w2c_havok_HP_Constraint_Create(havok_, havok_.out());
    const auto joint = havok_.result<havok::Id>();
    w2c_havok_HP_Constraint_SetParentBody(havok_, joint, parent);
    w2c_havok_HP_Constraint_SetChildBody(havok_, joint, bodies_[hinge.body]);
    w2c_havok_HP_Constraint_SetAnchorInParent(havok_, joint, havok_.in(vector3(p_parent), 0),
                                              havok_.in(vector3(child.X_PB.q * hinge.axis_B), 1),
                                              havok_.in(vector3(child.X_PB.q * side), 2));
    w2c_havok_HP_Constraint_SetAnchorInChild(havok_, joint, havok_.in(vector3(hinge.p_BJ - child.p_BBcm), 0),
                                             havok_.in(vector3(hinge.axis_B), 1), havok_.in(vector3(side), 2));
    for (const havok::Axis axis :
         {havok::kLinearX, havok::kLinearY, havok::kLinearZ, havok::kAngularY, havok::kAngularZ}) {
      w2c_havok_HP_Constraint_SetAxisMode(havok_, joint, axis, havok::kLocked);
    }
    w2c_havok_HP_Constraint_SetCollisionsEnabled(havok_, joint, 0);
    w2c_havok_HP_Constraint_SetEnabled(havok_, joint, 1);
  }

  float h_;
  double timestep_;
  mutable havok::Instance havok_;  // every question writes into its memory
  havok::Id world_;
  std::vector<havok::Id> shapes_, bodies_;
  std::vector<Vec3> axes_;  // in the bodies' frames
};

std::unique_ptr<Direct> make(const Scene& scene, const State& start, const Settings& settings) {
  return std::make_unique<DirectHavok>(scene, start, settings);
}

}  // namespace
}  // namespace assay::benchmarks

ASSAY_DIRECT_LOOP(assay::benchmarks::make, "havok")
