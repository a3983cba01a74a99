// jolt_world.h over Jolt's API. Compiled natively in two precisions and to WebAssembly: no exceptions, no threads,
// nothing of the machine.
#include "jolt_world.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <unordered_map>
#include <vector>

// clang-format off: Jolt wants this one before its others
#include <Jolt/Jolt.h>
// clang-format on

#include <Jolt/Core/Factory.h>
#include <Jolt/Core/JobSystemSingleThreaded.h>
#include <Jolt/Core/TempAllocator.h>
#include <Jolt/Physics/Body/BodyCreationSettings.h>
#include <Jolt/Physics/Collision/ContactListener.h>
#include <Jolt/Physics/Collision/Shape/BoxShape.h>
#include <Jolt/Physics/Collision/Shape/CapsuleShape.h>
#include <Jolt/Physics/Collision/Shape/ConvexHullShape.h>
#include <Jolt/Physics/Collision/Shape/CylinderShape.h>
#include <Jolt/Physics/Collision/Shape/EmptyShape.h>
#include <Jolt/Physics/Collision/Shape/MeshShape.h>
#include <Jolt/Physics/Collision/Shape/OffsetCenterOfMassShape.h>
#include <Jolt/Physics/Collision/Shape/PlaneShape.h>
#include <Jolt/Physics/Collision/Shape/RotatedTranslatedShape.h>
#include <Jolt/Physics/Collision/Shape/ScaledShape.h>
#include <Jolt/Physics/Collision/Shape/SphereShape.h>
#include <Jolt/Physics/Collision/Shape/StaticCompoundShape.h>
#include <Jolt/Physics/Collision/SimShapeFilter.h>
#include <Jolt/Physics/Constraints/FixedConstraint.h>
#include <Jolt/Physics/Constraints/HingeConstraint.h>
#include <Jolt/Physics/Constraints/PointConstraint.h>
#include <Jolt/Physics/Constraints/SixDOFConstraint.h>
#include <Jolt/Physics/Constraints/SliderConstraint.h>
#include <Jolt/Physics/PhysicsStepListener.h>
#include <Jolt/Physics/PhysicsSystem.h>
#include <Jolt/Physics/StateRecorder.h>
#include <Jolt/RegisterTypes.h>

namespace {

constexpr JPH::BroadPhaseLayer kStaticLayer(0), kMovingLayer(1);
constexpr JPH::uint kTempBytes = 10 << 20;  // as in Jolt's own example; a larger step takes more from the heap
constexpr float kNoSpeedLimit = 1e18f;      // Jolt squares it in single precision

void initialise_library() {
  static const bool done = [] {
    JPH::RegisterDefaultAllocator();
    JPH::Factory::sInstance = new JPH::Factory();
    JPH::RegisterTypes();
    return true;
  }();
  (void)done;
}

float real(double x) { return static_cast<float>(x); }
JPH::Vec3 vec(const double* v) { return JPH::Vec3(real(v[0]), real(v[1]), real(v[2])); }
JPH::RVec3 point(const double* v) { return JPH::RVec3(JPH::Real(v[0]), JPH::Real(v[1]), JPH::Real(v[2])); }
JPH::Quat quat(const double* q) { return JPH::Quat(real(q[1]), real(q[2]), real(q[3]), real(q[0])); }

template <typename Vector>
void store(const Vector& v, double* out) {
  out[0] = v.GetX();
  out[1] = v.GetY();
  out[2] = v.GetZ();
}

// What may touch what, and with which friction. Each body that can touch something has an object layer of its own; 0 is
// the layer of all others. Jolt asks by layer before it looks at shapes, by shape where a body has several.
class Contacts final : public JPH::ObjectLayerPairFilter, public JPH::SimShapeFilter {
 public:
  void set_up(const jolt_shape* shapes, int shape_count, const jolt_pair* pairs, int pair_count, int body_count) {
    rows_ = static_cast<size_t>(shape_count);
    layer_of_row_.assign(rows_, 0);
    std::vector<JPH::ObjectLayer> layer_of_body(body_count, 0);
    std::vector<char> used(rows_, 0);
    for (int i = 0; i < pair_count; ++i) used[pairs[i].shape_a] = used[pairs[i].shape_b] = 1;
    for (size_t s = 0; s < rows_; ++s) {
      if (!used[s]) continue;
      if (shapes[s].body < 0) {
        layer_of_row_[s] = static_cast<JPH::ObjectLayer>(layers_++);
        static_layer_.resize(layers_, 0);
        static_layer_.back() = 1;
        continue;
      }
      JPH::ObjectLayer& layer = layer_of_body[shapes[s].body];
      if (layer == 0) layer = static_cast<JPH::ObjectLayer>(layers_++);
      static_layer_.resize(layers_, 0);
      layer_of_row_[s] = layer;
    }

    touch_.assign(layers_ * layers_, 0);
    shape_touch_.assign(rows_ * rows_, 0);
    uniform_ = pair_count > 0 ? real(pairs[0].friction) : 0;
    bool by_pair = false;
    for (int i = 0; i < pair_count; ++i) by_pair = by_pair || real(pairs[i].friction) != uniform_;
    if (by_pair) friction_.assign(rows_ * rows_, 0);
    for (int i = 0; i < pair_count; ++i) {
      const size_t a = pairs[i].shape_a, b = pairs[i].shape_b;
      touch_[layer_of_row_[a] * layers_ + layer_of_row_[b]] = touch_[layer_of_row_[b] * layers_ + layer_of_row_[a]] = 1;
      shape_touch_[a * rows_ + b] = shape_touch_[b * rows_ + a] = 1;
      if (by_pair) friction_[a * rows_ + b] = friction_[b * rows_ + a] = real(pairs[i].friction);
    }

    // is the answer for two bodies that of all their shapes?
    for (size_t a = 0; a < rows_; ++a) {
      for (size_t b = 0; b < rows_; ++b) {
        if (used[a] && used[b] && touch_[layer_of_row_[a] * layers_ + layer_of_row_[b]] &&
            !shape_touch_[a * rows_ + b]) {
          filter_shapes_ = true;
        }
      }
    }
  }

  JPH::ObjectLayer layer(int row) const { return layer_of_row_[row]; }
  bool filter_shapes() const { return filter_shapes_; }
  bool friction_by_pair() const { return !friction_.empty(); }

  bool ShouldCollide(JPH::ObjectLayer a, JPH::ObjectLayer b) const override { return touch_[a * layers_ + b] != 0; }

  // Only shapes without children carry their row, plus one.
  bool ShouldCollide(const JPH::Body& /*body_a*/, const JPH::Shape* a, const JPH::SubShapeID& /*id_a*/,
                     const JPH::Body& /*body_b*/, const JPH::Shape* b, const JPH::SubShapeID& /*id_b*/) const override {
    const JPH::uint64 row_a = a->GetUserData(), row_b = b->GetUserData();
    return row_a == 0 || row_b == 0 || shape_touch_[(row_a - 1) * rows_ + row_b - 1] != 0;
  }

  bool is_static(JPH::ObjectLayer layer) const { return static_layer_[layer] != 0; }
  size_t layers() const { return layers_; }

  // Jolt's hook for the pair's coefficient; it has no context, so a body carries the address of its world's table.
  static float friction(const JPH::Body& a, const JPH::SubShapeID& id_a, const JPH::Body& b,
                        const JPH::SubShapeID& id_b) {
    const auto& self = *reinterpret_cast<const Contacts*>(static_cast<uintptr_t>(a.GetUserData()));
    if (self.friction_.empty()) return self.uniform_;
    const size_t row_a = a.GetShape()->GetSubShapeUserData(id_a) - 1,
                 row_b = b.GetShape()->GetSubShapeUserData(id_b) - 1;
    return self.friction_[row_a * self.rows_ + row_b];
  }

 private:
  size_t rows_ = 0, layers_ = 1;
  std::vector<JPH::ObjectLayer> layer_of_row_;
  std::vector<char> static_layer_ = {0};
  std::vector<char> touch_;        // layers x layers
  std::vector<char> shape_touch_;  // rows x rows
  std::vector<float> friction_;    // rows x rows; empty: one for all
  float uniform_ = 0;
  bool filter_shapes_ = false;
};

class BroadPhaseLayers final : public JPH::BroadPhaseLayerInterface, public JPH::ObjectVsBroadPhaseLayerFilter {
 public:
  explicit BroadPhaseLayers(const Contacts& contacts) : contacts_(contacts) {}
  JPH::uint GetNumBroadPhaseLayers() const override { return 2; }
  JPH::BroadPhaseLayer GetBroadPhaseLayer(JPH::ObjectLayer layer) const override {
    return contacts_.is_static(layer) ? kStaticLayer : kMovingLayer;
  }
  bool ShouldCollide(JPH::ObjectLayer layer, JPH::BroadPhaseLayer /*other*/) const override { return layer != 0; }

 private:
  const Contacts& contacts_;
};

// Corners are sharp: Jolt's convex radius would round them.
constexpr float kConvexRadius = 0;
// Of a hull's size. Jolt's builder gives up on some hulls with many nearly coplanar corners, so those are made with the
// least of these that it takes; its own default is 1e-3 m.
constexpr float kHullTolerances[] = {1e-6f, 1e-5f, 1e-4f, 1e-3f};

// Jolt's builder gives up on triangles of less than 1 mm^2, so the hull is made at unit size and then scaled.
JPH::RefConst<JPH::Shape> hull(const double* points, int count, int row) {
  double size = 0;
  for (int i = 0; i < 3 * count; ++i) size = std::max(size, std::abs(points[i]));
  JPH::Array<JPH::Vec3> corners;
  for (int i = 0; i < count; ++i) {
    const double p[3] = {points[3 * i] / size, points[3 * i + 1] / size, points[3 * i + 2] / size};
    corners.push_back(vec(p));
  }
  for (const float tolerance : kHullTolerances) {
    JPH::ConvexHullShapeSettings settings(corners, kConvexRadius);
    settings.mHullTolerance = tolerance;
    settings.mUserData = static_cast<JPH::uint64>(row) + 1;
    const JPH::Shape::ShapeResult result = settings.Create();
    if (result.IsValid()) return new JPH::ScaledShape(result.Get(), JPH::Vec3::sReplicate(real(size)));
  }
  return nullptr;
}

JPH::RefConst<JPH::Shape> mesh(const double* numbers, const jolt_shape& shape, int row) {
  JPH::VertexList vertices;
  JPH::IndexedTriangleList triangles;
  for (int i = 0; i < shape.points; ++i) {
    const JPH::Vec3 p = vec(numbers + 3 * i);
    vertices.push_back(JPH::Float3(p.GetX(), p.GetY(), p.GetZ()));
  }
  const double* corner = numbers + 3 * shape.points;
  for (int i = 0; i < shape.triangles; ++i, corner += 3) {
    triangles.push_back(JPH::IndexedTriangle(static_cast<JPH::uint32>(corner[0]), static_cast<JPH::uint32>(corner[1]),
                                             static_cast<JPH::uint32>(corner[2]), 0));
  }
  JPH::MeshShapeSettings settings(std::move(vertices), std::move(triangles));
  settings.mUserData = static_cast<JPH::uint64>(row) + 1;
  const JPH::Shape::ShapeResult result = settings.Create();
  return result.IsValid() ? JPH::RefConst<JPH::Shape>(result.Get()) : nullptr;
}

// Null when Jolt refuses it.
JPH::RefConst<JPH::Shape> primitive(const jolt_shape& shape, const double* numbers, int row, double plane_half_extent) {
  JPH::Ref<JPH::Shape> made;
  switch (shape.type) {
    case JOLT_SPHERE:
      made = new JPH::SphereShape(real(shape.radius));
      break;
    case JOLT_CAPSULE:
      made = new JPH::CapsuleShape(real(shape.half_length), real(shape.radius));
      break;
    case JOLT_BOX:
      made = new JPH::BoxShape(vec(shape.half_size), kConvexRadius);
      break;
    case JOLT_CYLINDER:
      made = new JPH::CylinderShape(real(shape.half_length), real(shape.radius), kConvexRadius);
      break;
    case JOLT_HULL:
      return hull(numbers + shape.first, shape.points, row);
    case JOLT_MESH:
      return mesh(numbers + shape.first, shape, row);
    default:
      made = new JPH::PlaneShape(JPH::Plane(JPH::Vec3::sAxisY(), 0), nullptr, real(plane_half_extent));
      break;
  }
  made->SetUserData(static_cast<JPH::uint64>(row) + 1);
  return made.GetPtr();
}

bool is_at_origin(const jolt_shape& shape) {
  return shape.p[0] == 0 && shape.p[1] == 0 && shape.p[2] == 0 && shape.q[1] == 0 && shape.q[2] == 0 && shape.q[3] == 0;
}

// The shape of a body whose frame has its origin in the centre of mass, wherever the shapes' own centre is.
JPH::RefConst<JPH::Shape> body_shape(const jolt_shape* shapes, const double* numbers, const std::vector<int>& rows,
                                     double plane_half_extent) {
  if (rows.empty()) return new JPH::EmptyShape();
  JPH::RefConst<JPH::Shape> placed;
  if (rows.size() == 1) {
    const jolt_shape& shape = shapes[rows[0]];
    placed = primitive(shape, numbers, rows[0], plane_half_extent);
    if (placed == nullptr) return nullptr;
    if (!is_at_origin(shape))
      placed = new JPH::RotatedTranslatedShape(vec(shape.p), quat(shape.q).Normalized(), placed);
  } else {
    JPH::StaticCompoundShapeSettings settings;
    for (const int row : rows) {
      const JPH::RefConst<JPH::Shape> part = primitive(shapes[row], numbers, row, plane_half_extent);
      if (part == nullptr) return nullptr;
      settings.AddShape(vec(shapes[row].p), quat(shapes[row].q).Normalized(), part);
    }
    const JPH::Shape::ShapeResult result = settings.Create();
    if (result.HasError()) return nullptr;
    placed = result.Get();
  }
  const JPH::Vec3 centre = placed->GetCenterOfMass();
  if (centre == JPH::Vec3::sZero()) return placed;
  return new JPH::OffsetCenterOfMassShape(placed, -centre);
}

}  // namespace

namespace {

// A hinge or slide, whichever is there, with what a step needs of it.
struct Coordinate {
  JPH::Ref<JPH::HingeConstraint> hinge;
  JPH::Ref<JPH::SliderConstraint> slide;
  JPH::Vec3 axis_parent, axis_child, p_child;  // body frames
  float damping, armature;
};

JPH::Vec3 velocity_at(const JPH::Body& body, JPH::RVec3Arg point) {
  return body.IsDynamic() ? body.GetPointVelocity(point) : JPH::Vec3::sZero();
}

// Before each of Jolt's steps, substeps too. Armature a is a damper a / h towards the rate that the joint has now:
// Jolt's motor then gives the torque -a (rate at the step's end - rate) / h.
class Rotors final : public JPH::PhysicsStepListener {
 public:
  void add(const Coordinate& coordinate) { rotors_.push_back(coordinate); }
  bool empty() const { return rotors_.empty(); }

  void OnStep(const JPH::PhysicsStepListenerContext& context) override {
    for (const Coordinate& rotor : rotors_) {
      const float yielding = rotor.armature / context.mDeltaTime, share = yielding / (yielding + rotor.damping);
      if (rotor.hinge != nullptr) {
        const JPH::Body &parent = *rotor.hinge->GetBody1(), &child = *rotor.hinge->GetBody2();
        const JPH::Vec3 axis = parent.GetRotation() * rotor.axis_parent;
        const JPH::Vec3 w_parent = parent.IsDynamic() ? parent.GetAngularVelocity() : JPH::Vec3::sZero();
        rotor.hinge->GetMotorSettings().mSpringSettings.mDamping = rotor.damping + yielding;
        rotor.hinge->SetTargetAngularVelocity(share * axis.Dot(child.GetAngularVelocity() - w_parent));
      } else {
        const JPH::Body &parent = *rotor.slide->GetBody1(), &child = *rotor.slide->GetBody2();
        const JPH::Vec3 axis = parent.GetRotation() * rotor.axis_parent;
        const JPH::RVec3 p = child.GetCenterOfMassPosition() + child.GetRotation() * rotor.p_child;
        rotor.slide->GetMotorSettings().mSpringSettings.mDamping = rotor.damping + yielding;
        const float rate = axis.Dot(velocity_at(child, p) - velocity_at(parent, p));
        // the step measures it along the axis of its start, while the bodies turn
        const JPH::Vec3 w = child.GetAngularVelocity();
        const JPH::Vec3 arm(child.GetCenterOfMassPosition() - parent.GetCenterOfMassPosition());
        const float turning = parent.IsDynamic() ? axis.Dot(w.Cross(w.Cross(arm))) : 0;
        rotor.slide->SetTargetVelocity(share * (rate + context.mDeltaTime * turning));
      }
    }
  }

 private:
  std::vector<Coordinate> rotors_;
};

// Body::AddRotationStep drops turns of at most this, rad, at any timestep: at 1/4 ms a body slower than 4 mrad/s would
// not turn at all (findings/jolt/slow_turns.cc).
constexpr float kLeastTurn = 1e-6f;

// Gives bodies the turns that Jolt dropped, once their sum is large enough for Jolt to make it. What single precision
// rounds away of that turn stays in the sum.
class SlowTurns final : public JPH::PhysicsStepListener {
 public:
  void add(JPH::Body* body) { turns_.push_back({body}); }

  // Between the substeps of a step.
  void OnStep(const JPH::PhysicsStepListenerContext& context) override {
    if (!context.mIsFirstStep) after(context.mDeltaTime);
  }

  // After a (sub)step of `h` seconds.
  void after(float h) {
    for (Turn& turn : turns_) {
      const JPH::Vec3 dropped = turn.body->GetAngularVelocity() * h;
      if (dropped.Length() > kLeastTurn || dropped == JPH::Vec3::sZero()) continue;
      double square = 0;
      for (int k = 0; k < 3; ++k) {
        turn.sum[k] += double{dropped[k]};
        square += turn.sum[k] * turn.sum[k];
      }
      if (square <= double{kLeastTurn} * double{kLeastTurn}) continue;
      const JPH::Quat from = turn.body->GetRotation();
      turn.body->AddRotationStep(vec(turn.sum));
      const JPH::Quat to = turn.body->GetRotation();
      // the vector part of to * conjugate(from) is half of the turn that was made
      const double w = from.GetW(), x = from.GetX(), y = from.GetY(), z = from.GetZ();
      const double tw = to.GetW(), tx = to.GetX(), ty = to.GetY(), tz = to.GetZ();
      turn.sum[0] -= 2 * (tx * w - tw * x - ty * z + tz * y);
      turn.sum[1] -= 2 * (ty * w - tw * y - tz * x + tx * z);
      turn.sum[2] -= 2 * (tz * w - tw * z - tx * y + ty * x);
    }
  }

 private:
  struct Turn {
    JPH::Body* body;
    double sum[3] = {0, 0, 0};  // rad, world axes
  };
  std::vector<Turn> turns_;
};

// Jolt's contact cache after a step has the impulses of its solver. No function of Jolt gives them; it saves them with
// its state (ContactConstraintManager::ManifoldCache::SaveState in Jolt 5.6, whose order this is).
struct CachedPoint {
  JPH::Float3 p_1, p_2;  // from the centre of mass of each body, in its axes
  float lambda;          // N s along the normal
};
struct CachedManifold {
  JPH::SubShapeIDPair key;
  float friction[2];  // N s along the two tangents that Jolt makes of the normal
  std::vector<CachedPoint> points;
};

// The normals of a step's contacts, from the first shape to the second, to the last bit: which tangents Jolt makes of a
// plane's depends on their rounding.
class Normals final : public JPH::ContactListener {
 public:
  void OnContactAdded(const JPH::Body& body_1, const JPH::Body& body_2, const JPH::ContactManifold& manifold,
                      JPH::ContactSettings& /*settings*/) override {
    JPH::SubShapeIDPair key(body_1.GetID(), manifold.mSubShapeID1, body_2.GetID(), manifold.mSubShapeID2);
    manifold.mWorldSpaceNormal.StoreFloat3(&normals_[key]);
  }
  void OnContactPersisted(const JPH::Body& body_1, const JPH::Body& body_2, const JPH::ContactManifold& manifold,
                          JPH::ContactSettings& settings) override {
    OnContactAdded(body_1, body_2, manifold, settings);
  }

  void clear() { normals_.clear(); }
  bool has(const JPH::SubShapeIDPair& key) const { return normals_.count(key) != 0; }
  JPH::Vec3 of(const JPH::SubShapeIDPair& key) const { return JPH::Vec3(normals_.find(key)->second); }

 private:
  struct Hash {
    size_t operator()(const JPH::SubShapeIDPair& key) const { return static_cast<size_t>(key.GetHash()); }
  };
  std::unordered_map<JPH::SubShapeIDPair, JPH::Float3, Hash> normals_;
};

class ContactCache final : public JPH::StateRecorder {
 public:
  void WriteBytes(const void* data, size_t size) override {
    const auto* bytes = static_cast<const JPH::uint8*>(data);
    bytes_.insert(bytes_.end(), bytes, bytes + size);
  }
  void ReadBytes(void* data, size_t size) override {
    if (failed_ || size > bytes_.size() - at_) {
      failed_ = true;
      std::memset(data, 0, size);
      return;
    }
    std::memcpy(data, bytes_.data() + at_, size);
    at_ += size;
  }
  bool IsEOF() const override { return at_ >= bytes_.size(); }
  bool IsFailed() const override { return failed_; }

  // False when there is none any more.
  bool next(CachedManifold& out) {
    if (at_ == 0) {
      take<JPH::EStateRecorderState>();
      pairs_ = take<JPH::uint32>();
    }
    while (manifolds_ == 0) {
      if (pairs_ == 0 || failed_) return false;
      --pairs_;
      take<JPH::BodyPair>();
      take<JPH::Float3>();  // relative position
      take<JPH::Float3>();  // relative rotation
      manifolds_ = take<JPH::uint32>();
    }
    --manifolds_;
    out.key = take<JPH::SubShapeIDPair>();
    const JPH::uint16 points = take<JPH::uint16>();
    take<JPH::Float3>();  // the normal, rounded by a rotation and back
    for (float& friction : out.friction) friction = take<float>();
    take<float>();  // what it turns about the normal
    out.points.clear();
    for (JPH::uint16 i = 0; i < points; ++i) {
      CachedPoint& point = out.points.emplace_back();
      point.p_1 = take<JPH::Float3>();
      point.p_2 = take<JPH::Float3>();
      point.lambda = take<float>();
    }
    return !failed_;
  }

 private:
  template <typename T>
  T take() {
    T value;
    ReadBytes(&value, sizeof(T));
    return value;
  }

  std::vector<JPH::uint8> bytes_;
  size_t at_ = 0;
  bool failed_ = false;
  JPH::uint32 pairs_ = 0, manifolds_ = 0;
};

}  // namespace

struct jolt_world {
  explicit jolt_world(const jolt_settings& settings) : settings(settings) {}

  ~jolt_world() {
    JPH::BodyInterface& bodies_of = system.GetBodyInterfaceNoLock();
    if (!rotors.empty()) system.RemoveStepListener(&rotors);
    if (settings.collision_steps > 1) system.RemoveStepListener(&slow_turns);
    for (const JPH::Ref<JPH::Constraint>& constraint : constraints) system.RemoveConstraint(constraint);
    constraints.clear();
    coordinates.clear();
    balls.clear();
    for (JPH::Body* body : bodies) destroy(bodies_of, body);
    for (JPH::Body* body : statics) destroy(bodies_of, body);
  }
  jolt_world(const jolt_world&) = delete;
  jolt_world& operator=(const jolt_world&) = delete;

  bool create(const jolt_body* body_list, int body_count, const jolt_shape* shapes, int shape_count,
              const jolt_pair* pairs, int pair_count, const double* numbers, const jolt_joint* joints,
              int joint_count) {
    contacts.set_up(shapes, shape_count, pairs, pair_count, body_count);
    const int moving_and_static = body_count + shape_count;
    // at most the model's pairs touch; the caches are sized for twice that
    const JPH::uint room = std::clamp(2 * pair_count, 1024, 1 << 16);
    system.Init(moving_and_static, 1, room, room, layers, layers, contacts);
    JPH::PhysicsSettings physics;
    physics.mBaumgarte = real(settings.baumgarte);
    physics.mPenetrationSlop = real(settings.penetration_slop);
    physics.mSpeculativeContactDistance = real(settings.speculative_distance);
    physics.mMaxPenetrationDistance = real(settings.max_correction);
    physics.mNumVelocitySteps = settings.velocity_steps;
    physics.mNumPositionSteps = settings.position_steps;
    physics.mConstraintWarmStart = settings.warm_start != 0;
    physics.mUseBodyPairContactCache = settings.pair_cache != 0;
    physics.mUseLargeIslandSplitter = false;  // parallel batches; there is one thread
    physics.mDeterministicSimulation = true;
    physics.mAllowSleeping = false;
    physics.mMinVelocityForRestitution = real(settings.restitution_speed);
    system.SetPhysicsSettings(physics);
    system.SetGravity(vec(settings.gravity));
    system.SetCombineFriction(&Contacts::friction);
    if (contacts.filter_shapes()) system.SetSimShapeFilter(&contacts);

    std::vector<std::vector<int>> rows_of_body(body_count);
    for (int s = 0; s < shape_count; ++s) {
      if (contacts.layer(s) != 0 && shapes[s].body >= 0) rows_of_body[shapes[s].body].push_back(s);
    }
    for (int b = 0; b < body_count; ++b) {
      const JPH::RefConst<JPH::Shape> shape = body_shape(shapes, numbers, rows_of_body[b], settings.plane_half_extent);
      if (shape == nullptr) return false;
      add_body(body_list[b], shape, rows_of_body[b].empty() ? JPH::ObjectLayer(0) : contacts.layer(rows_of_body[b][0]),
               rows_of_body[b].size() > 1);
    }
    for (int s = 0; s < shape_count; ++s) {
      if (contacts.layer(s) != 0 && shapes[s].body < 0 && !add_static(shapes[s], numbers, s)) return false;
    }
    for (int j = 0; j < joint_count; ++j) add_joint(joints[j]);
    if (!rotors.empty()) system.AddStepListener(&rotors);
    if (settings.collision_steps > 1) system.AddStepListener(&slow_turns);
    system.OptimizeBroadPhase();
    return true;
  }

  const jolt_settings settings;
  Contacts contacts;
  BroadPhaseLayers layers{contacts};
  JPH::TempAllocatorImplWithMallocFallback memory{kTempBytes};
  JPH::JobSystemSingleThreaded jobs{JPH::cMaxPhysicsJobs};
  JPH::PhysicsSystem system;
  std::vector<JPH::Body*> bodies, statics;
  std::vector<JPH::Ref<JPH::Constraint>> constraints;
  std::vector<Coordinate> coordinates;  // the hinges and slides
  std::vector<JPH::Ref<JPH::PointConstraint>> balls;
  Rotors rotors;
  SlowTurns slow_turns;
  bool has_slides = false;
  bool keeps_contacts = false;
  Normals normals;                  // of the last step
  std::vector<JPH::RMat44> before;  // of the centres of mass where the last step began, by body
  std::vector<int> number;          // of moving bodies, by the index of their identifier; -1: static

 private:
  static void destroy(JPH::BodyInterface& interface, const JPH::Body* body) {
    interface.RemoveBody(body->GetID());
    interface.DestroyBody(body->GetID());
  }

  void add_body(const jolt_body& body, const JPH::RefConst<JPH::Shape>& shape, JPH::ObjectLayer layer, bool several) {
    JPH::BodyCreationSettings made(shape.GetPtr(), point(body.p), quat(body.q).Normalized(), JPH::EMotionType::Dynamic,
                                   layer);
    made.mLinearVelocity = vec(body.v);
    made.mAngularVelocity = vec(body.w);
    made.mUserData = reinterpret_cast<uintptr_t>(&contacts);
    made.mLinearDamping = made.mAngularDamping = 0;
    made.mMaxLinearVelocity = made.mMaxAngularVelocity = kNoSpeedLimit;
    made.mApplyGyroscopicForce = settings.gyroscopic != 0;
    made.mAllowSleeping = false;
    made.mRestitution = real(settings.restitution);
    // a joint manifold of several shapes has one friction
    made.mUseManifoldReduction = !(several && contacts.friction_by_pair());
    made.mOverrideMassProperties = JPH::EOverrideMassProperties::MassAndInertiaProvided;
    made.mMassPropertiesOverride.mMass = real(body.mass);
    made.mMassPropertiesOverride.mInertia = JPH::Mat44::sScale(vec(body.inertia));
    JPH::BodyInterface& interface = system.GetBodyInterfaceNoLock();
    JPH::Body* created = interface.CreateBody(made);
    // Jolt would find the principal axes itself, in single precision
    JPH::MotionProperties& motion = *created->GetMotionProperties();
    motion.SetInverseMass(real(1 / body.mass));
    const double inverse[3] = {1 / body.inertia[0], 1 / body.inertia[1], 1 / body.inertia[2]};
    motion.SetInverseInertia(vec(inverse), quat(body.q_inertia).Normalized());
    interface.AddBody(created->GetID(), JPH::EActivation::Activate);
    bodies.push_back(created);
    if (settings.slow_turns != 0) slow_turns.add(created);
  }

  bool add_static(const jolt_shape& shape, const double* numbers, int row) {
    const JPH::RefConst<JPH::Shape> part = primitive(shape, numbers, row, settings.plane_half_extent);
    if (part == nullptr) return false;
    JPH::BodyCreationSettings made(part.GetPtr(), point(shape.p), quat(shape.q).Normalized(), JPH::EMotionType::Static,
                                   contacts.layer(row));
    made.mUserData = reinterpret_cast<uintptr_t>(&contacts);
    made.mRestitution = real(settings.restitution);
    // of the two bodies of a contact either may ask for it
    made.mEnhancedInternalEdgeRemoval = shape.type == JOLT_MESH && settings.inner_edges == 0;
    JPH::BodyInterface& interface = system.GetBodyInterfaceNoLock();
    JPH::Body* created = interface.CreateBody(made);
    interface.AddBody(created->GetID(), JPH::EActivation::DontActivate);
    statics.push_back(created);
    return true;
  }

  void add_constraint(JPH::Constraint* created) {
    system.AddConstraint(created);
    constraints.emplace_back(created);
  }

  void add_joint(const jolt_joint& joint) {
    JPH::Body& parent = joint.parent < 0 ? JPH::Body::sFixedToWorld : *bodies[joint.parent];
    JPH::Body& child = *bodies[joint.child];
    if (joint.type == JOLT_BALL) {
      JPH::PointConstraintSettings made;
      made.mSpace = JPH::EConstraintSpace::LocalToBodyCOM;
      made.mPoint1 = point(joint.p_parent);
      made.mPoint2 = point(joint.p_child);
      auto* created = static_cast<JPH::PointConstraint*>(made.Create(parent, child));
      add_constraint(created);
      balls.emplace_back(created);
      return;
    }
    if (joint.type == JOLT_WELD) {
      JPH::FixedConstraintSettings made;
      made.mSpace = JPH::EConstraintSpace::LocalToBodyCOM;
      made.mPoint1 = point(joint.p_parent);
      made.mAxisX1 = vec(joint.axis_parent).Normalized();
      made.mAxisY1 = vec(joint.normal_parent).Normalized();
      made.mPoint2 = point(joint.p_child);
      made.mAxisX2 = vec(joint.axis_child).Normalized();
      made.mAxisY2 = vec(joint.normal_child).Normalized();
      add_constraint(made.Create(parent, child));
      return;
    }
    Coordinate coordinate{nullptr,
                          nullptr,
                          vec(joint.axis_parent).Normalized(),
                          vec(joint.axis_child).Normalized(),
                          vec(joint.p_child),
                          real(joint.damping),
                          real(joint.armature)};
    if (joint.type == JOLT_SLIDE) {
      coordinate.slide = add_slide(joint, parent, child);
      has_slides = true;
    } else {
      coordinate.hinge = add_hinge(joint, parent, child);
    }
    coordinates.push_back(coordinate);
    if (joint.armature != 0) rotors.add(coordinate);
    // Jolt's own friction of a joint rests while its motor works
    if (joint.friction != 0 && has_motor(joint)) add_friction(joint, parent, child);
  }

  static bool has_motor(const jolt_joint& joint) {
    return joint.stiffness != 0 || joint.damping != 0 || joint.armature != 0;
  }
  static JPH::MotorSettings motor_of(const jolt_joint& joint) {
    JPH::MotorSettings motor;
    motor.mSpringSettings =
        JPH::SpringSettings(JPH::ESpringMode::StiffnessAndDamping, real(joint.stiffness), real(joint.damping));
    return motor;
  }

  JPH::HingeConstraint* add_hinge(const jolt_joint& hinge, JPH::Body& parent, JPH::Body& child) {
    JPH::HingeConstraintSettings made;
    made.mSpace = JPH::EConstraintSpace::LocalToBodyCOM;
    made.mPoint1 = point(hinge.p_parent);
    made.mHingeAxis1 = vec(hinge.axis_parent).Normalized();
    made.mNormalAxis1 = vec(hinge.normal_parent).Normalized();
    made.mPoint2 = point(hinge.p_child);
    made.mHingeAxis2 = vec(hinge.axis_child).Normalized();
    made.mNormalAxis2 = vec(hinge.normal_child).Normalized();
    if (hinge.limited) {
      made.mLimitsMin = real(hinge.lower);
      made.mLimitsMax = real(hinge.upper);
    }
    const bool motor = has_motor(hinge);
    if (motor) {
      made.mMotorSettings = motor_of(hinge);
    } else {
      made.mMaxFrictionTorque = real(hinge.friction);
    }
    auto* created = static_cast<JPH::HingeConstraint*>(made.Create(parent, child));
    add_constraint(created);
    if (motor) {
      created->SetTargetAngle(real(hinge.target));
      created->SetTargetAngularVelocity(0);
      created->SetMotorState(JPH::EMotorState::PositionAndVelocity);
    }
    return created;
  }

  JPH::SliderConstraint* add_slide(const jolt_joint& slide, JPH::Body& parent, JPH::Body& child) {
    JPH::SliderConstraintSettings made;
    made.mSpace = JPH::EConstraintSpace::LocalToBodyCOM;
    made.mPoint1 = point(slide.p_parent);
    made.mSliderAxis1 = vec(slide.axis_parent).Normalized();
    made.mNormalAxis1 = vec(slide.normal_parent).Normalized();
    made.mPoint2 = point(slide.p_child);
    made.mSliderAxis2 = vec(slide.axis_child).Normalized();
    made.mNormalAxis2 = vec(slide.normal_child).Normalized();
    if (slide.limited) {
      made.mLimitsMin = real(slide.lower);
      made.mLimitsMax = real(slide.upper);
    }
    const bool motor = has_motor(slide);
    if (motor) {
      made.mMotorSettings = motor_of(slide);
    } else {
      made.mMaxFrictionForce = real(slide.friction);
    }
    auto* created = static_cast<JPH::SliderConstraint*>(made.Create(parent, child));
    add_constraint(created);
    if (motor) {
      created->SetTargetPosition(real(slide.target));
      created->SetTargetVelocity(0);
      created->SetMotorState(JPH::EMotorState::PositionAndVelocity);
    }
    return created;
  }

  // A joint that is free in all axes and has nothing but friction in one.
  void add_friction(const jolt_joint& joint, JPH::Body& parent, JPH::Body& child) {
    JPH::SixDOFConstraintSettings made;
    made.mSpace = JPH::EConstraintSpace::LocalToBodyCOM;
    made.mPosition1 = point(joint.p_parent);
    made.mAxisX1 = vec(joint.axis_parent).Normalized();
    made.mAxisY1 = vec(joint.normal_parent).Normalized();
    made.mPosition2 = point(joint.p_child);
    made.mAxisX2 = vec(joint.axis_child).Normalized();
    made.mAxisY2 = vec(joint.normal_child).Normalized();
    using Axes = JPH::SixDOFConstraintSettings;
    made.mMaxFriction[joint.type == JOLT_SLIDE ? Axes::TranslationX : Axes::RotationX] = real(joint.friction);
    add_constraint(made.Create(parent, child));
  }
};

jolt_world* jolt_create(const jolt_settings* settings, const jolt_body* bodies, int32_t body_count,
                        const jolt_shape* shapes, int32_t shape_count, const jolt_pair* pairs, int32_t pair_count,
                        const double* numbers, int32_t /*number_count*/, const jolt_joint* joints,
                        int32_t joint_count) {
  initialise_library();
  auto world = std::make_unique<jolt_world>(*settings);
  if (!world->create(bodies, body_count, shapes, shape_count, pairs, pair_count, numbers, joints, joint_count))
    return nullptr;
  return world.release();
}

void jolt_free(jolt_world* world) { delete world; }

int32_t jolt_step(jolt_world* world, int32_t count) {
  const float h = real(world->settings.timestep);
  const int collision_steps = world->settings.collision_steps;
  auto errors = JPH::EPhysicsUpdateError::None;
  for (int32_t i = 0; i < count; ++i) {
    if (world->keeps_contacts) {
      world->normals.clear();
      for (size_t b = 0; b < world->bodies.size(); ++b) world->before[b] = world->bodies[b]->GetCenterOfMassTransform();
    }
    errors |= world->system.Update(h, collision_steps, &world->memory, &world->jobs);
    world->slow_turns.after(h / static_cast<float>(collision_steps));
  }
  return static_cast<int32_t>(errors);
}

void jolt_keep_contacts(jolt_world* world) {
  world->keeps_contacts = true;
  world->system.SetContactListener(&world->normals);
  world->before.assign(world->bodies.size(), JPH::RMat44::sIdentity());
  for (size_t b = 0; b < world->bodies.size(); ++b) {
    const size_t index = world->bodies[b]->GetID().GetIndex();
    if (index >= world->number.size()) world->number.resize(index + 1, -1);
    world->number[index] = static_cast<int>(b);
  }
}

int32_t jolt_contacts(jolt_world* world, jolt_contact* out, int32_t room) {
  ContactCache cache;
  world->system.SaveState(cache, JPH::EStateRecorderState::Contacts);
  const JPH::BodyLockInterface& bodies = world->system.GetBodyLockInterfaceNoLock();
  const auto start_of = [&](const JPH::Body& body) {
    const size_t index = body.GetID().GetIndex();
    const int b = index < world->number.size() ? world->number[index] : -1;
    return b < 0 ? body.GetCenterOfMassTransform() : world->before[b];
  };
  const auto shape_of = [](const JPH::Body& body, const JPH::SubShapeID& part) {
    return static_cast<int32_t>(body.GetShape()->GetSubShapeUserData(part)) - 1;
  };
  int32_t count = 0;
  for (CachedManifold manifold; cache.next(manifold);) {
    const JPH::Body* first = bodies.TryGetBody(manifold.key.GetBody1ID());
    const JPH::Body* second = bodies.TryGetBody(manifold.key.GetBody2ID());
    if (first == nullptr || second == nullptr || !world->normals.has(manifold.key)) continue;
    const JPH::RMat44 X_1 = start_of(*first), X_2 = start_of(*second);
    const JPH::Vec3 normal = world->normals.of(manifold.key);
    const JPH::Vec3 tangent = normal.GetNormalizedPerpendicular();
    const JPH::Vec3 friction = manifold.friction[0] * tangent + manifold.friction[1] * normal.Cross(tangent);
    float pressed = 0;
    for (const CachedPoint& point : manifold.points) pressed += point.lambda;
    for (const CachedPoint& point : manifold.points) {
      if (++count > room) continue;
      const JPH::RVec3 on_1 = X_1 * JPH::Vec3(point.p_1), on_2 = X_2 * JPH::Vec3(point.p_2);
      JPH::Vec3 impulse = point.lambda * normal;
      if (pressed > 0) impulse += point.lambda / pressed * friction;
      store(JPH::Real(0.5) * (on_1 + on_2), out->p);
      store(normal, out->normal);
      out->gap = JPH::Vec3(on_2 - on_1).Dot(normal);
      store(impulse, out->impulse);
      out->shape_a = shape_of(*first, manifold.key.GetSubShapeID1());
      out->shape_b = shape_of(*second, manifold.key.GetSubShapeID2());
      ++out;
    }
  }
  return count;
}

void jolt_read(jolt_world* world, jolt_body_state* out) {
  for (const JPH::Body* body : world->bodies) {
    store(body->GetCenterOfMassPosition(), out->p);
    const JPH::Quat q = body->GetRotation();
    out->q[0] = q.GetW();
    out->q[1] = q.GetX();
    out->q[2] = q.GetY();
    out->q[3] = q.GetZ();
    store(body->GetLinearVelocity(), out->v);
    store(body->GetAngularVelocity(), out->w);
    ++out;
  }
}

void jolt_set_torques(jolt_world* world, const double* torques) {
  for (JPH::Body* body : world->bodies) body->ResetTorque();
  if (world->has_slides) {
    for (JPH::Body* body : world->bodies) body->ResetForce();
  }
  for (const Coordinate& coordinate : world->coordinates) {
    const float torque = real(*torques++);
    if (torque == 0) continue;
    const bool hinge = coordinate.hinge != nullptr;
    JPH::TwoBodyConstraint& constraint = hinge ? static_cast<JPH::TwoBodyConstraint&>(*coordinate.hinge)
                                               : static_cast<JPH::TwoBodyConstraint&>(*coordinate.slide);
    JPH::Body* child = constraint.GetBody2();
    JPH::Body* parent = constraint.GetBody1();
    const JPH::Vec3 along_axis = torque * (child->GetRotation() * coordinate.axis_child);
    if (hinge) {
      child->AddTorque(along_axis);
      if (parent->IsDynamic()) parent->AddTorque(-along_axis);
    } else {
      const JPH::RVec3 p = child->GetCenterOfMassPosition() + child->GetRotation() * coordinate.p_child;
      child->AddForce(along_axis, p);
      if (parent->IsDynamic()) parent->AddForce(-along_axis, p);
    }
  }
  for (const JPH::Ref<JPH::PointConstraint>& ball : world->balls) {
    const JPH::Vec3 torque = vec(torques);
    torques += 3;
    if (torque == JPH::Vec3::sZero()) continue;
    ball->GetBody2()->AddTorque(torque);
    if (ball->GetBody1()->IsDynamic()) ball->GetBody1()->AddTorque(-torque);
  }
}

void jolt_view(jolt_world* world, jolt_body_view* bodies, jolt_joint_view* joints, double* gravity) {
  for (const JPH::Body* body : world->bodies) {
    const JPH::MotionProperties& motion = *body->GetMotionProperties();
    const JPH::Mat44 axes = JPH::Mat44::sRotation(body->GetRotation() * motion.GetInertiaRotation());
    const JPH::Vec3 inverse = motion.GetInverseInertiaDiagonal();
    bodies->mass = 1 / double{motion.GetInverseMass()};
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        double sum = 0;
        for (int k = 0; k < 3; ++k) sum += double{axes(row, k)} * double{axes(column, k)} / double{inverse[k]};
        bodies->inertia[3 * row + column] = sum;
      }
    }
    ++bodies;
  }
  for (const Coordinate& coordinate : world->coordinates) {
    if (coordinate.hinge != nullptr) {
      const JPH::HingeConstraint& hinge = *coordinate.hinge;
      store(hinge.GetLocalSpacePoint2(), joints->p_child);
      store(hinge.GetLocalSpaceHingeAxis2(), joints->axis_child);
      joints->limited = hinge.HasLimits() ? 1 : 0;
      joints->lower = hinge.GetLimitsMin();
      joints->upper = hinge.GetLimitsMax();
    } else {
      const JPH::SliderConstraint& slide = *coordinate.slide;
      const JPH::Mat44 frame = slide.GetConstraintToBody2Matrix();
      store(frame.GetTranslation(), joints->p_child);
      store(frame.GetAxisX(), joints->axis_child);
      joints->limited = slide.HasLimits() ? 1 : 0;
      joints->lower = slide.GetLimitsMin();
      joints->upper = slide.GetLimitsMax();
    }
    ++joints;
  }
  store(world->system.GetGravity(), gravity);
}

int32_t jolt_version() { return 1000000 * JPH_VERSION_MAJOR + 1000 * JPH_VERSION_MINOR + JPH_VERSION_PATCH; }
