// The part of PhysX's C++ interface that its adapter (src/engines/physx) and its findings use, on the module that PhysX
// 5.6.1 is here: the same names with the same meaning, so that their sources compile for either version.
//
// An object of PhysX lies in the module's memory. The classes here have no members: `this` is where the object lies,
// and a function calls the module's export of that name. What PhysX takes or gives by value lies in this program's
// memory. Enumerators that the exports lack are PhysX's own numbers.
#pragma once

#include <cstdio>
#include <vector>

#include "call.h"
#include "foundation/PxTransform.h"

#define PX_PHYSICS_VERSION_MAJOR 5
#define PX_PHYSICS_VERSION_MINOR 6
#define PX_PHYSICS_VERSION_BUGFIX 1
#define PX_PHYSICS_VERSION \
  ((PX_PHYSICS_VERSION_MAJOR << 24) + (PX_PHYSICS_VERSION_MINOR << 16) + (PX_PHYSICS_VERSION_BUGFIX << 8))

namespace physx {

using physx56::Address;
using physx56::at;
using physx56::call;
using physx56::read;

// ---- enumerations ---------------------------------------------------------------------------------------------------

// NOLINTBEGIN(performance-enum-size): PhysX's own

// Bits of an enumeration, which combine to more of them.
template <typename Enum>
class PxFlags {
 public:
  PxFlags() = default;
  PxFlags(Enum flag) : bits_(static_cast<PxU32>(flag)) {}  // NOLINT(google-explicit-constructor): as PhysX's
  explicit PxFlags(PxU32 bits) : bits_(bits) {}
  PxFlags& operator|=(PxFlags other) {
    bits_ |= other.bits_;
    return *this;
  }
  PxFlags operator|(PxFlags other) const { return PxFlags(bits_ | other.bits_); }
  PxFlags operator|(Enum flag) const { return *this | PxFlags(flag); }
  PxFlags operator&(Enum flag) const { return PxFlags(bits_ & static_cast<PxU32>(flag)); }
  operator bool() const { return bits_ != 0; }  // NOLINT(google-explicit-constructor): as PhysX's
  PxU32 bits() const { return bits_; }

 private:
  PxU32 bits_ = 0;
};

#define ASSAY_PX_FLAGS(flag)           \
  using flag##s = PxFlags<flag::Enum>; \
  inline flag##s operator|(flag::Enum a, flag::Enum b) { return flag##s(a) | flag##s(b); }

struct PxErrorCode {
  enum Enum : int {
    eDEBUG_INFO = 1,
    eDEBUG_WARNING = 2,
    eINVALID_PARAMETER = 4,
    eINVALID_OPERATION = 8,
    eOUT_OF_MEMORY = 16,
    eINTERNAL_ERROR = 32,
    eABORT = 64,
    ePERF_WARNING = 128
  };
};
struct PxForceMode {
  enum Enum { eFORCE, eIMPULSE, eVELOCITY_CHANGE, eACCELERATION };
};
struct PxRigidBodyFlag {
  enum Enum { eENABLE_GYROSCOPIC_FORCES = 1 << 10 };
};
struct PxShapeFlag {
  enum Enum { eSIMULATION_SHAPE = 1 << 0, eSCENE_QUERY_SHAPE = 1 << 1 };
};
ASSAY_PX_FLAGS(PxShapeFlag)
struct PxCombineMode {
  enum Enum { eAVERAGE, eMIN, eMULTIPLY, eMAX };
};
struct PxFilterFlag {
  enum Enum { eKILL = 1 << 0, eSUPPRESS = 1 << 1, eDEFAULT = 0 };
};
ASSAY_PX_FLAGS(PxFilterFlag)
struct PxPairFlag {
  enum Enum {
    eSOLVE_CONTACT = 1 << 0,
    eMODIFY_CONTACTS = 1 << 1,
    eNOTIFY_TOUCH_FOUND = 1 << 2,
    eNOTIFY_TOUCH_PERSISTS = 1 << 3,
    eNOTIFY_CONTACT_POINTS = 1 << 9,
    eDETECT_DISCRETE_CONTACT = 1 << 10,
    eCONTACT_DEFAULT = eSOLVE_CONTACT | eDETECT_DISCRETE_CONTACT
  };
};
ASSAY_PX_FLAGS(PxPairFlag)
struct PxFrictionType {
  enum Enum { ePATCH };
};
struct PxSolverType {
  enum Enum { ePGS, eTGS };
};
struct PxSceneFlag {
  enum Enum { eENABLE_PCM = 1 << 6, eENABLE_FRICTION_EVERY_ITERATION = 1 << 15 };
};
ASSAY_PX_FLAGS(PxSceneFlag)
struct PxConvexFlag {
  enum Enum { eCOMPUTE_CONVEX = 1 << 1 };
};
ASSAY_PX_FLAGS(PxConvexFlag)
struct PxConstraintFlag {
  enum Enum { eCOLLISION_ENABLED = 1 << 3, eDRIVE_LIMITS_ARE_FORCES = 1 << 5 };
};
struct PxJointActorIndex {
  enum Enum { eACTOR0, eACTOR1 };
};
struct PxD6Axis {
  enum Enum { eX, eY, eZ, eTWIST, eSWING1, eSWING2 };
};
struct PxD6Motion {
  enum Enum { eLOCKED, eLIMITED, eFREE };
};
struct PxD6Drive {
  enum Enum { eX = 0, eY = 1, eZ = 2, eSWING = 3, eTWIST = 4, eSLERP = 5 };
};
struct PxRevoluteJointFlag {
  enum Enum { eLIMIT_ENABLED = 1 << 0 };
};
ASSAY_PX_FLAGS(PxRevoluteJointFlag)
struct PxArticulationFlag {
  enum Enum { eFIX_BASE = 1 << 0, eDRIVE_LIMITS_ARE_FORCES = 1 << 1 };
};
struct PxArticulationJointType {
  enum Enum { eFIX = 0, ePRISMATIC = 1, eREVOLUTE = 2, eREVOLUTE_UNWRAPPED = 3, eSPHERICAL = 4 };
};
struct PxArticulationAxis {
  enum Enum { eTWIST, eSWING1, eSWING2, eX, eY, eZ };
};
struct PxArticulationMotion {
  enum Enum { eLOCKED, eLIMITED, eFREE };
};
struct PxArticulationDriveType {
  enum Enum { eFORCE, eACCELERATION };
};
struct PxArticulationCacheFlag {
  enum Enum {
    eVELOCITY = 1 << 0,
    eACCELERATION = 1 << 1,
    ePOSITION = 1 << 2,
    eFORCE = 1 << 3,
    eROOT_TRANSFORM = 1 << 6,
    eROOT_VELOCITIES = 1 << 7
  };
};
ASSAY_PX_FLAGS(PxArticulationCacheFlag)

#undef ASSAY_PX_FLAGS
// NOLINTEND(performance-enum-size)

// ---- objects --------------------------------------------------------------------------------------------------------

class PxBase {
 public:
  PxBase() = delete;
  void release() { call(PHYSX56_EXPORT(PxBase_release_0), this); }

  // The object as one of that class, nullptr when it is of another.
  template <typename T>
  const T* is() const {
    const PxU32 type = call(PHYSX56_EXPORT(PxBase_getConcreteType_0), this);
    return type == T::kConcreteType ? static_cast<const T*>(this) : nullptr;
  }
};

struct PxTolerancesScale {
  float length = 1;
  float speed = 10;
};

struct PxFilterData {
  PxU32 word0 = 0, word1 = 0, word2 = 0, word3 = 0;
  PxFilterData() = default;
  PxFilterData(PxU32 w0, PxU32 w1, PxU32 w2, PxU32 w3) : word0(w0), word1(w1), word2(w2), word3(w3) {}
};

class PxMaterial : public PxBase {
 public:
  void setFrictionCombineMode(PxCombineMode::Enum mode) {
    call(PHYSX56_EXPORT(PxMaterial_setFrictionCombineMode_1), this, mode);
  }
};

class PxShape : public PxBase {
 public:
  void setLocalPose(const PxTransform& pose) { call(PHYSX56_EXPORT(PxShape_setLocalPose_1), this, pose); }
  void setContactOffset(float offset) { call(PHYSX56_EXPORT(PxShape_setContactOffset_1), this, offset); }
  void setRestOffset(float offset) { call(PHYSX56_EXPORT(PxShape_setRestOffset_1), this, offset); }
  void setSimulationFilterData(const PxFilterData& data) {
    call(PHYSX56_EXPORT(PxShape_setSimulationFilterData_1), this, data);
  }
  PxFilterData getSimulationFilterData() const {
    return read<PxFilterData>(call(PHYSX56_EXPORT(PxShape_getSimulationFilterData_0), this));
  }
};

class PxActor : public PxBase {};

class PxRigidActor : public PxActor {
 public:
  PxTransform getGlobalPose() const {
    return read<PxTransform>(call(PHYSX56_EXPORT(PxRigidActor_getGlobalPose_0), this));
  }
};

class PxRigidStatic : public PxRigidActor {};

class PxRigidBody : public PxRigidActor {
 public:
  void setMass(float mass) { call(PHYSX56_EXPORT(PxRigidBody_setMass_1), this, mass); }
  float getMass() const { return call(PHYSX56_EXPORT(PxRigidBody_getMass_0), this); }
  void setMassSpaceInertiaTensor(const PxVec3& inertia) {
    call(PHYSX56_EXPORT(PxRigidBody_setMassSpaceInertiaTensor_1), this, inertia);
  }
  PxVec3 getMassSpaceInertiaTensor() const {
    return read<PxVec3>(call(PHYSX56_EXPORT(PxRigidBody_getMassSpaceInertiaTensor_0), this));
  }
  void setLinearDamping(float damping) { call(PHYSX56_EXPORT(PxRigidBody_setLinearDamping_1), this, damping); }
  void setAngularDamping(float damping) { call(PHYSX56_EXPORT(PxRigidBody_setAngularDamping_1), this, damping); }
  PxVec3 getLinearVelocity() const { return read<PxVec3>(call(PHYSX56_EXPORT(PxRigidBody_getLinearVelocity_0), this)); }
  PxVec3 getAngularVelocity() const {
    return read<PxVec3>(call(PHYSX56_EXPORT(PxRigidBody_getAngularVelocity_0), this));
  }
  void setMaxLinearVelocity(float limit) { call(PHYSX56_EXPORT(PxRigidBody_setMaxLinearVelocity_1), this, limit); }
  void setMaxAngularVelocity(float limit) { call(PHYSX56_EXPORT(PxRigidBody_setMaxAngularVelocity_1), this, limit); }
  void setMaxDepenetrationVelocity(float limit) {
    call(PHYSX56_EXPORT(PxRigidBody_setMaxDepenetrationVelocity_1), this, limit);
  }
  void setRigidBodyFlag(PxRigidBodyFlag::Enum flag, bool value) {
    call(PHYSX56_EXPORT(PxRigidBody_setRigidBodyFlag_2), this, flag, value);
  }
  void addForce(const PxVec3& force, PxForceMode::Enum mode = PxForceMode::eFORCE, bool autowake = true) {
    call(PHYSX56_EXPORT(PxRigidBody_addForce_3), this, force, mode, autowake);
  }
  void addTorque(const PxVec3& torque, PxForceMode::Enum mode = PxForceMode::eFORCE, bool autowake = true) {
    call(PHYSX56_EXPORT(PxRigidBody_addTorque_3), this, torque, mode, autowake);
  }
  void clearForce() { call(PHYSX56_EXPORT(PxRigidBody_clearForce_1), this, PxForceMode::eFORCE); }
  void clearTorque() { call(PHYSX56_EXPORT(PxRigidBody_clearTorque_1), this, PxForceMode::eFORCE); }
};

class PxRigidDynamic : public PxRigidBody {
 public:
  void setLinearVelocity(const PxVec3& v) { call(PHYSX56_EXPORT(PxRigidDynamic_setLinearVelocity_1), this, v); }
  void setAngularVelocity(const PxVec3& w) { call(PHYSX56_EXPORT(PxRigidDynamic_setAngularVelocity_1), this, w); }
  void setSleepThreshold(float limit) { call(PHYSX56_EXPORT(PxRigidDynamic_setSleepThreshold_1), this, limit); }
  void setStabilizationThreshold(float limit) {
    call(PHYSX56_EXPORT(PxRigidDynamic_setStabilizationThreshold_1), this, limit);
  }
  void setWakeCounter(float seconds) { call(PHYSX56_EXPORT(PxRigidDynamic_setWakeCounter_1), this, seconds); }
  void setSolverIterationCounts(PxU32 position, PxU32 velocity) {
    call(PHYSX56_EXPORT(PxRigidDynamic_setSolverIterationCounts_2), this, position, velocity);
  }
};

// ---- shapes ---------------------------------------------------------------------------------------------------------

struct PxHullPolygon {
  float mPlane[4] = {};
  PxU16 mNbVerts = 0, mIndexBase = 0;
};

class PxConvexMesh : public PxBase {
 public:
  PxU32 getNbVertices() const { return call(PHYSX56_EXPORT(PxConvexMesh_getNbVertices_0), this); }
  const PxVec3* getVertices() const { return at<PxVec3>(call(PHYSX56_EXPORT(PxConvexMesh_getVertices_0), this)); }
  PxU32 getNbPolygons() const { return call(PHYSX56_EXPORT(PxConvexMesh_getNbPolygons_0), this); }
  bool getPolygonData(PxU32 index, PxHullPolygon& out) const {
    const Address place = physx56::module().in(out, physx56::kResultSlot);
    const bool found = call(PHYSX56_EXPORT(PxConvexMesh_getPolygonData_2), this, index, place) != 0;
    out = read<PxHullPolygon>(place);
    return found;
  }
};

class PxHeightField : public PxBase {};

struct PxPlane {
  PxVec3 n;
  float d = 0;
  PxPlane(float x, float y, float z, float d_) : n(x, y, z), d(d_) {}
  float distance(const PxVec3& p) const { return p.dot(n) + d; }
};

struct PxMeshScale {
  float scale = 1;
  explicit PxMeshScale(float scale_) : scale(scale_) {}
};
struct PxMeshGeometryFlags {};

// One of PhysX's geometries: its export that makes it, with its arguments.
class PxGeometry {
 public:
  // The geometry in the module's memory, for `use` of its address.
  template <typename Use>
  auto placed(const Use& use) const {
    const Address geometry = make();
    const auto result = use(geometry);
    call(PHYSX56_EXPORT(PxGeometry_0x5F_destroy_0x5F_0), geometry);
    return result;
  }

 protected:
  enum class Kind : PxU8 { kSphere, kCapsule, kBox, kPlane, kConvexMesh, kHeightField };
  PxGeometry(Kind kind, const PxVec3& numbers, const PxBase* data = nullptr)
      : kind_(kind), numbers_(numbers), data_(data) {}

 private:
  Address make() const {
    const auto& [a, b, c] = numbers_;
    switch (kind_) {
      case Kind::kSphere:
        return call(PHYSX56_EXPORT(PxSphereGeometry_PxSphereGeometry_1), a);
      case Kind::kCapsule:
        return call(PHYSX56_EXPORT(PxCapsuleGeometry_PxCapsuleGeometry_2), a, b);
      case Kind::kBox:
        return call(PHYSX56_EXPORT(PxBoxGeometry_PxBoxGeometry_3), a, b, c);
      case Kind::kPlane:
        return call(PHYSX56_EXPORT(PxPlaneGeometry_PxPlaneGeometry_0));
      case Kind::kConvexMesh: {
        const Address scale = call(PHYSX56_EXPORT(PxMeshScale_PxMeshScale_1), a);
        const Address made = call(PHYSX56_EXPORT(PxConvexMeshGeometry_PxConvexMeshGeometry_2), data_, scale);
        call(PHYSX56_EXPORT(PxMeshScale_0x5F_destroy_0x5F_0), scale);
        return made;
      }
      case Kind::kHeightField:
        return call(PHYSX56_EXPORT(PxHeightFieldGeometry_PxHeightFieldGeometry_5), data_,
                    physx56::module().in(PxU8{0}, physx56::kResultSlot), a, b, c);
    }
    return 0;
  }

  Kind kind_;
  PxVec3 numbers_;
  const PxBase* data_;
};

struct PxSphereGeometry : PxGeometry {
  explicit PxSphereGeometry(float radius) : PxGeometry(Kind::kSphere, {radius, 0, 0}) {}
};
struct PxCapsuleGeometry : PxGeometry {
  PxCapsuleGeometry(float radius, float half_length) : PxGeometry(Kind::kCapsule, {radius, half_length, 0}) {}
};
struct PxBoxGeometry : PxGeometry {
  explicit PxBoxGeometry(const PxVec3& half) : PxGeometry(Kind::kBox, half) {}
  PxBoxGeometry(float x, float y, float z) : PxGeometry(Kind::kBox, {x, y, z}) {}
};
struct PxPlaneGeometry : PxGeometry {
  PxPlaneGeometry() : PxGeometry(Kind::kPlane, {}) {}
};
struct PxConvexMeshGeometry : PxGeometry {
  PxConvexMeshGeometry(const PxConvexMesh* mesh, const PxMeshScale& scale)
      : PxGeometry(Kind::kConvexMesh, PxVec3(scale.scale), mesh) {}
};
struct PxHeightFieldGeometry : PxGeometry {
  PxHeightFieldGeometry(const PxHeightField* field, PxMeshGeometryFlags /*flags*/, float height, float row,
                        float column)
      : PxGeometry(Kind::kHeightField, {height, row, column}, field) {}
};

class PxGeometryHolder {
 public:
  explicit PxGeometryHolder(const PxGeometry& geometry) : geometry_(geometry) {}
  const PxGeometry& any() const { return geometry_; }

 private:
  PxGeometry geometry_;
};

// The exports have no geometry of a program's own.
struct PxCustomGeometryCallbacks {
  virtual ~PxCustomGeometryCallbacks() = default;
};

struct PxRigidActorExt {
  static PxShape* createExclusiveShape(PxRigidActor& actor, const PxGeometry& geometry, const PxMaterial& material) {
    return geometry.placed([&](Address placed) {
      return at<PxShape>(call(PHYSX56_EXPORT(PxRigidActorExt_createExclusiveShape_3), &actor, placed, &material));
    });
  }
  static PxShape* createExclusiveShape(PxRigidActor& actor, const PxGeometry& geometry, const PxMaterial& material,
                                       PxShapeFlags flags) {
    return geometry.placed([&](Address placed) {
      return at<PxShape>(call(PHYSX56_EXPORT(PxRigidActorExt_createExclusiveShape_4), &actor, placed, &material,
                              physx56::module().in(static_cast<PxU8>(flags.bits()), physx56::kResultSlot)));
    });
  }
};

class PxInsertionCallback {
 public:
  PxInsertionCallback() = delete;
};

struct PxCookingParams {
  explicit PxCookingParams(const PxTolerancesScale& scale_) : scale(scale_) {}
  PxTolerancesScale scale;
};

struct PxConvexMeshDesc {
  struct Points {
    PxU32 count = 0, stride = 0;
    const void* data = nullptr;
  } points;
  PxConvexFlags flags;
};

inline PxConvexMesh* PxCreateConvexMesh(const PxCookingParams& parameters, const PxConvexMeshDesc& description,
                                        PxInsertionCallback& /*insertion*/) {
  const Address points = physx56::copied(description.points.data, description.points.count * description.points.stride);
  const Address desc = call(PHYSX56_EXPORT(PxConvexMeshDesc_PxConvexMeshDesc_0));
  const Address list = call(PHYSX56_EXPORT(PxConvexMeshDesc_get_points_0), desc);
  call(PHYSX56_EXPORT(PxBoundedData_set_count_1), list, description.points.count);
  call(PHYSX56_EXPORT(PxBoundedData_set_stride_1), list, description.points.stride);
  call(PHYSX56_EXPORT(PxBoundedData_set_data_1), list, points);
  const Address flags = physx56::module().in(static_cast<PxU16>(description.flags.bits()), physx56::kResultSlot);
  call(PHYSX56_EXPORT(PxConvexMeshDesc_set_flags_1), desc, flags);
  const Address cooking = call(PHYSX56_EXPORT(PxCookingParams_PxCookingParams_1), parameters.scale);
  auto* const mesh = at<PxConvexMesh>(call(PHYSX56_EXPORT(PxTopLevelFunctions_CreateConvexMesh_2), cooking, desc));
  call(PHYSX56_EXPORT(PxCookingParams_0x5F_destroy_0x5F_0), cooking);
  call(PHYSX56_EXPORT(PxConvexMeshDesc_0x5F_destroy_0x5F_0), desc);
  physx56::freed(points);
  return mesh;
}

struct PxHeightFieldSample {
  PxI16 height = 0;
  PxU8 materialIndex0 = 0, materialIndex1 = 0;  // the highest bit is a flag
};

struct PxHeightFieldDesc {
  PxU32 nbRows = 0, nbColumns = 0;
  struct Samples {
    const void* data = nullptr;
    PxU32 stride = 0;
  } samples;
};

inline PxHeightField* PxCreateHeightField(const PxHeightFieldDesc& description, PxInsertionCallback& /*insertion*/) {
  const Address samples = physx56::copied(description.samples.data,
                                          description.nbRows * description.nbColumns * description.samples.stride);
  const Address desc = call(PHYSX56_EXPORT(PxHeightFieldDesc_PxHeightFieldDesc_0));
  call(PHYSX56_EXPORT(PxHeightFieldDesc_set_nbRows_1), desc, description.nbRows);
  call(PHYSX56_EXPORT(PxHeightFieldDesc_set_nbColumns_1), desc, description.nbColumns);
  const Address list = call(PHYSX56_EXPORT(PxHeightFieldDesc_get_samples_0), desc);
  call(PHYSX56_EXPORT(PxStridedData_set_stride_1), list, description.samples.stride);
  call(PHYSX56_EXPORT(PxStridedData_set_data_1), list, samples);
  auto* const field = at<PxHeightField>(call(PHYSX56_EXPORT(PxTopLevelFunctions_CreateHeightField_1), desc));
  call(PHYSX56_EXPORT(PxHeightFieldDesc_0x5F_destroy_0x5F_0), desc);
  physx56::freed(samples);
  return field;
}

// ---- joints ---------------------------------------------------------------------------------------------------------

struct PxJointLinearLimitPair {
  float lower = 0, upper = 0;
  PxJointLinearLimitPair(float lower_, float upper_) : lower(lower_), upper(upper_) {}
  PxJointLinearLimitPair(const PxTolerancesScale& /*scale*/, float lower_, float upper_)
      : lower(lower_), upper(upper_) {}
};
struct PxJointAngularLimitPair {
  float lower = 0, upper = 0;
  PxJointAngularLimitPair(float lower_, float upper_) : lower(lower_), upper(upper_) {}
};

// Laid out as PhysX has it.
struct PxD6JointDrive {
  float stiffness = 0, damping = 0, forceLimit = PX_MAX_F32;
  PxU32 flags = 0;
  PxD6JointDrive(float k, float b, float limit, bool isAcceleration = false)
      : stiffness(k), damping(b), forceLimit(limit), flags(isAcceleration ? 1 : 0) {}
};

class PxJoint : public PxBase {
 public:
  void release() {
    physx56::limits_of_joints().erase(this);
    PxBase::release();
  }
  void setConstraintFlag(PxConstraintFlag::Enum flag, bool value) {
    call(PHYSX56_EXPORT(PxJoint_setConstraintFlag_2), this, flag, value);
  }
  PxTransform getLocalPose(PxJointActorIndex::Enum actor) const {
    return read<PxTransform>(call(PHYSX56_EXPORT(PxJoint_getLocalPose_1), this, actor));
  }

 protected:
  // The exports set limits and do not give them back: this keeps what was set.
  void keep(float lower, float upper) { physx56::limits_of_joints()[this] = {lower, upper}; }
  template <typename Pair>
  Pair kept() const {
    const auto found = physx56::limits_of_joints().find(this);
    return found == physx56::limits_of_joints().end() ? Pair(0, 0) : Pair(found->second.first, found->second.second);
  }
  // The limit in the module's memory, for `use` of its address.
  template <typename Use>
  static void placed(const PxJointAngularLimitPair& limit, const Use& use) {
    const Address place =
        call(PHYSX56_EXPORT(PxJointAngularLimitPair_PxJointAngularLimitPair_2), limit.lower, limit.upper);
    use(place);
    call(PHYSX56_EXPORT(PxJointAngularLimitPair_0x5F_destroy_0x5F_0), place);
  }
};

class PxRevoluteJoint : public PxJoint {
 public:
  static constexpr PxU32 kConcreteType = 257;
  void setLimit(const PxJointAngularLimitPair& limit) {
    placed(limit, [this](Address place) { call(PHYSX56_EXPORT(PxRevoluteJoint_setLimit_1), this, place); });
    keep(limit.lower, limit.upper);
  }
  PxJointAngularLimitPair getLimit() const { return kept<PxJointAngularLimitPair>(); }
  void setRevoluteJointFlag(PxRevoluteJointFlag::Enum flag, bool value) {
    call(PHYSX56_EXPORT(PxRevoluteJoint_setRevoluteJointFlag_2), this, flag, value);
  }
  PxRevoluteJointFlags getRevoluteJointFlags() const {
    return PxRevoluteJointFlags(read<PxU16>(call(PHYSX56_EXPORT(PxRevoluteJoint_getRevoluteJointFlags_0), this)));
  }
};

class PxD6Joint : public PxJoint {
 public:
  static constexpr PxU32 kConcreteType = 261;
  void setMotion(PxD6Axis::Enum axis, PxD6Motion::Enum motion) {
    call(PHYSX56_EXPORT(PxD6Joint_setMotion_2), this, axis, motion);
  }
  PxD6Motion::Enum getMotion(PxD6Axis::Enum axis) const {
    return static_cast<PxD6Motion::Enum>(call(PHYSX56_EXPORT(PxD6Joint_getMotion_1), this, axis));
  }
  void setTwistLimit(const PxJointAngularLimitPair& limit) {
    placed(limit, [this](Address place) { call(PHYSX56_EXPORT(PxD6Joint_setTwistLimit_1), this, place); });
    keep(limit.lower, limit.upper);
  }
  PxJointAngularLimitPair getTwistLimit() const { return kept<PxJointAngularLimitPair>(); }
  void setLinearLimit(PxD6Axis::Enum axis, const PxJointLinearLimitPair& limit) {
    const Address rigid = call(PHYSX56_EXPORT(PxSpring_PxSpring_2), 0.0F, 0.0F);
    const Address place =
        call(PHYSX56_EXPORT(PxJointLinearLimitPair_PxJointLinearLimitPair_3), limit.lower, limit.upper, rigid);
    call(PHYSX56_EXPORT(PxD6Joint_setLinearLimit_2), this, axis, place);
    call(PHYSX56_EXPORT(PxJointLinearLimitPair_0x5F_destroy_0x5F_0), place);
    call(PHYSX56_EXPORT(PxSpring_0x5F_destroy_0x5F_0), rigid);
    keep(limit.lower, limit.upper);
  }
  PxJointLinearLimitPair getLinearLimit(PxD6Axis::Enum /*axis*/) const { return kept<PxJointLinearLimitPair>(); }
  void setDrive(PxD6Drive::Enum index, const PxD6JointDrive& drive) {
    call(PHYSX56_EXPORT(PxD6Joint_setDrive_2), this, index, drive);
  }
  void setDrivePosition(const PxTransform& pose) { call(PHYSX56_EXPORT(PxD6Joint_setDrivePosition_1), this, pose); }
};

// ---- articulations --------------------------------------------------------------------------------------------------

struct PxArticulationLimit {
  float low = 0, high = 0;
};

struct PxArticulationDrive {
  float stiffness = 0, damping = 0, maxForce = PX_MAX_F32;
  PxArticulationDriveType::Enum driveType = PxArticulationDriveType::eFORCE;
};

class PxArticulationJointReducedCoordinate : public PxBase {
 public:
  void setParentPose(const PxTransform& pose) {
    call(PHYSX56_EXPORT(PxArticulationJointReducedCoordinate_setParentPose_1), this, pose);
  }
  void setChildPose(const PxTransform& pose) {
    call(PHYSX56_EXPORT(PxArticulationJointReducedCoordinate_setChildPose_1), this, pose);
  }
  PxTransform getChildPose() const {
    return read<PxTransform>(call(PHYSX56_EXPORT(PxArticulationJointReducedCoordinate_getChildPose_0), this));
  }
  void setJointType(PxArticulationJointType::Enum type) {
    call(PHYSX56_EXPORT(PxArticulationJointReducedCoordinate_setJointType_1), this, type);
  }
  void setMotion(PxArticulationAxis::Enum axis, PxArticulationMotion::Enum motion) {
    call(PHYSX56_EXPORT(PxArticulationJointReducedCoordinate_setMotion_2), this, axis, motion);
  }
  PxArticulationMotion::Enum getMotion(PxArticulationAxis::Enum axis) const {
    return static_cast<PxArticulationMotion::Enum>(
        call(PHYSX56_EXPORT(PxArticulationJointReducedCoordinate_getMotion_1), this, axis));
  }
  void setLimitParams(PxArticulationAxis::Enum axis, const PxArticulationLimit& limit) {
    const Address place = call(PHYSX56_EXPORT(PxArticulationLimit_PxArticulationLimit_2), limit.low, limit.high);
    call(PHYSX56_EXPORT(PxArticulationJointReducedCoordinate_setLimitParams_2), this, axis, place);
    call(PHYSX56_EXPORT(PxArticulationLimit_0x5F_destroy_0x5F_0), place);
  }
  PxArticulationLimit getLimitParams(PxArticulationAxis::Enum axis) const {
    const Address place = call(PHYSX56_EXPORT(PxArticulationJointReducedCoordinate_getLimitParams_1), this, axis);
    return {call(PHYSX56_EXPORT(PxArticulationLimit_get_low_0), place),
            call(PHYSX56_EXPORT(PxArticulationLimit_get_high_0), place)};
  }
  void setDriveParams(PxArticulationAxis::Enum axis, const PxArticulationDrive& drive) {
    const Address place = call(PHYSX56_EXPORT(PxArticulationDrive_PxArticulationDrive_4), drive.stiffness,
                               drive.damping, drive.maxForce, drive.driveType);
    call(PHYSX56_EXPORT(PxArticulationJointReducedCoordinate_setDriveParams_2), this, axis, place);
    call(PHYSX56_EXPORT(PxArticulationDrive_0x5F_destroy_0x5F_0), place);
  }
  void setDriveTarget(PxArticulationAxis::Enum axis, float target, bool autowake) {
    call(PHYSX56_EXPORT(PxArticulationJointReducedCoordinate_setDriveTarget_3), this, axis, target, autowake);
  }
  void setArmature(PxArticulationAxis::Enum axis, float armature) {
    call(PHYSX56_EXPORT(PxArticulationJointReducedCoordinate_setArmature_2), this, axis, armature);
  }
  void setFrictionCoefficient(float coefficient) {
    call(PHYSX56_EXPORT(PxArticulationJointReducedCoordinate_setFrictionCoefficient_1), this, coefficient);
  }
  void setMaxJointVelocity(float limit) {
    call(PHYSX56_EXPORT(PxArticulationJointReducedCoordinate_setMaxJointVelocity_1), this, limit);
  }
};

class PxArticulationLink : public PxRigidBody {
 public:
  PxArticulationJointReducedCoordinate* getInboundJoint() const {
    return at<PxArticulationJointReducedCoordinate>(call(PHYSX56_EXPORT(PxArticulationLink_getInboundJoint_0), this));
  }
  PxU32 getLinkIndex() const { return call(PHYSX56_EXPORT(PxArticulationLink_getLinkIndex_0), this); }
  void setCfmScale(float cfm) { call(PHYSX56_EXPORT(PxArticulationLink_setCfmScale_1), this, cfm); }
};

struct PxArticulationRootLinkData {
  PxTransform transform;
  PxVec3 worldLinVel, worldAngVel, worldLinAccel, worldAngAccel;
};

// Of this program, with pointers into the module's memory.
class PxArticulationCache {
 public:
  explicit PxArticulationCache(Address cache)
      : jointVelocity(at<float>(read<Address>(call(PHYSX56_EXPORT(PxArticulationCache_get_jointVelocity_0), cache)))),
        jointPosition(at<float>(read<Address>(call(PHYSX56_EXPORT(PxArticulationCache_get_jointPosition_0), cache)))),
        jointForce(at<float>(read<Address>(call(PHYSX56_EXPORT(PxArticulationCache_get_jointForce_0), cache)))),
        rootLinkData(
            at<PxArticulationRootLinkData>(call(PHYSX56_EXPORT(PxArticulationCache_get_rootLinkData_0), cache))),
        cache_(cache) {}
  PxArticulationCache(const PxArticulationCache&) = delete;
  PxArticulationCache& operator=(const PxArticulationCache&) = delete;
  void release() {
    call(PHYSX56_EXPORT(PxArticulationCache_release_0), cache_);
    delete this;
  }

  float* jointVelocity;
  float* jointPosition;
  float* jointForce;
  PxArticulationRootLinkData* rootLinkData;

  Address address() const { return cache_; }

 private:
  ~PxArticulationCache() = default;

  Address cache_;
};

class PxArticulationReducedCoordinate : public PxBase {
 public:
  void setArticulationFlag(PxArticulationFlag::Enum flag, bool value) {
    call(PHYSX56_EXPORT(PxArticulationReducedCoordinate_setArticulationFlag_2), this, flag, value);
  }
  void setSolverIterationCounts(PxU32 position, PxU32 velocity) {
    call(PHYSX56_EXPORT(PxArticulationReducedCoordinate_setSolverIterationCounts_2), this, position, velocity);
  }
  void setSleepThreshold(float limit) {
    call(PHYSX56_EXPORT(PxArticulationReducedCoordinate_setSleepThreshold_1), this, limit);
  }
  void setStabilizationThreshold(float limit) {
    call(PHYSX56_EXPORT(PxArticulationReducedCoordinate_setStabilizationThreshold_1), this, limit);
  }
  void setWakeCounter(float seconds) {
    call(PHYSX56_EXPORT(PxArticulationReducedCoordinate_setWakeCounter_1), this, seconds);
  }
  PxArticulationLink* createLink(PxArticulationLink* parent, const PxTransform& pose) {
    return at<PxArticulationLink>(
        call(PHYSX56_EXPORT(PxArticulationReducedCoordinate_createLink_2), this, parent, pose));
  }
  PxU32 getNbLinks() const { return call(PHYSX56_EXPORT(PxArticulationReducedCoordinate_getNbLinks_0), this); }
  PxU32 getDofs() const { return call(PHYSX56_EXPORT(PxArticulationReducedCoordinate_getDofs_0), this); }
  PxArticulationCache* createCache() const {
    const Address cache = call(PHYSX56_EXPORT(PxArticulationReducedCoordinate_createCache_0), this);
    return cache == 0 ? nullptr : new PxArticulationCache(cache);
  }
  void zeroCache(PxArticulationCache& cache) const {
    call(PHYSX56_EXPORT(PxArticulationReducedCoordinate_zeroCache_1), this, cache.address());
  }
  void applyCache(PxArticulationCache& cache, PxArticulationCacheFlags flags, bool autowake = true) {
    call(PHYSX56_EXPORT(PxArticulationReducedCoordinate_applyCache_3), this, cache.address(), flags_at(flags),
         autowake);
  }
  void copyInternalStateToCache(PxArticulationCache& cache, PxArticulationCacheFlags flags) const {
    call(PHYSX56_EXPORT(PxArticulationReducedCoordinate_copyInternalStateToCache_2), this, cache.address(),
         flags_at(flags));
  }

 private:
  static Address flags_at(PxArticulationCacheFlags flags) {
    return physx56::module().in(flags.bits(), physx56::kResultSlot);
  }
};

// ---- callbacks ------------------------------------------------------------------------------------------------------

using PxFilterObjectAttributes = PxU32;
using PxSimulationFilterShader = PxFilterFlags (*)(PxFilterObjectAttributes, PxFilterData, PxFilterObjectAttributes,
                                                   PxFilterData, PxPairFlags&, const void*, PxU32);

// Every pair touches, as PhysX's own has it for shapes without filter data.
inline PxFilterFlags PxDefaultSimulationFilterShader(PxFilterObjectAttributes /*a*/, PxFilterData /*data_a*/,
                                                     PxFilterObjectAttributes /*b*/, PxFilterData /*data_b*/,
                                                     PxPairFlags& pair, const void* /*constants*/, PxU32 /*size*/) {
  pair = PxPairFlag::eCONTACT_DEFAULT;
  return PxFilterFlag::eDEFAULT;
}

struct PxContactPairHeader {};
struct PxConstraintInfo {};
struct PxTriggerPair {};

// Laid out as PhysX has it.
struct PxContactPairPoint {
  PxVec3 position;
  float separation = 0;
  PxVec3 normal;
  PxU32 internalFaceIndex0 = 0;
  PxVec3 impulse;
  PxU32 internalFaceIndex1 = 0;
};

class PxContactPair {
 public:
  explicit PxContactPair(Address pair)
      : shapes{at<PxShape>(call(PHYSX56_EXPORT(PxContactPair_get_shapes_1), pair, PxU32{0})),
               at<PxShape>(call(PHYSX56_EXPORT(PxContactPair_get_shapes_1), pair, PxU32{1}))},
        contactCount(static_cast<PxU8>(call(PHYSX56_EXPORT(PxContactPair_get_contactCount_0), pair))),
        pair_(pair) {}
  PxU32 extractContacts(PxContactPairPoint* points, PxU32 count) const {
    const Address place = physx56::copied(points, count * static_cast<PxU32>(sizeof(PxContactPairPoint)));
    const PxU32 found = call(PHYSX56_EXPORT(PxContactPair_extractContacts_2), pair_, place, count);
    for (PxU32 i = 0; i < found; ++i) {
      points[i] = read<PxContactPairPoint>(place + i * static_cast<PxU32>(sizeof(PxContactPairPoint)));
    }
    physx56::freed(place);
    return found;
  }

  PxShape* shapes[2];
  PxU8 contactCount;

 private:
  Address pair_;
};

class PxSimulationEventCallback {
 public:
  virtual void onConstraintBreak(PxConstraintInfo* constraints, PxU32 count) = 0;
  virtual void onWake(PxActor** actors, PxU32 count) = 0;
  virtual void onSleep(PxActor** actors, PxU32 count) = 0;
  virtual void onContact(const PxContactPairHeader& header, const PxContactPair* pairs, PxU32 count) = 0;
  virtual void onTrigger(PxTriggerPair* pairs, PxU32 count) = 0;
  virtual void onAdvance(const PxRigidBody* const* bodies, const PxTransform* poses, PxU32 count) = 0;

 protected:
  ~PxSimulationEventCallback() = default;
};

// The exports have no callback that modifies contacts: a scene with one is not made.
struct PxContactModifyPair {
  struct PxContactSet {
    // NOLINTNEXTLINE(readability-convert-member-functions-to-static): as PhysX has it
    PxU32 size() const { return 0; }
    void setStaticFriction(PxU32 /*i*/, float /*friction*/) {}
    void setDynamicFriction(PxU32 /*i*/, float /*friction*/) {}
  };
  const PxShape* shape[2];
  PxContactSet contacts;
};
class PxContactModifyCallback {
 public:
  virtual void onContactModify(PxContactModifyPair* pairs, PxU32 count) = 0;

 protected:
  ~PxContactModifyCallback() = default;
};

class PxErrorCallback {
 public:
  virtual void reportError(PxErrorCode::Enum code, const char* message, const char* file, int line) = 0;

 protected:
  ~PxErrorCallback() = default;
};
class PxDefaultErrorCallback final : public PxErrorCallback {
 public:
  void reportError(PxErrorCode::Enum /*code*/, const char* message, const char* /*file*/, int /*line*/) override {
    std::fprintf(stderr, "PhysX: %s\n", message);
  }
};

// ---- scenes ---------------------------------------------------------------------------------------------------------

// One for all scenes, without threads: the exports' way to delete one frees what its allocator did not give.
class PxCpuDispatcher {};
class PxDefaultCpuDispatcher : public PxCpuDispatcher {
 public:
  PxDefaultCpuDispatcher() = delete;
  void release() {}
};
inline PxDefaultCpuDispatcher* PxDefaultCpuDispatcherCreate(PxU32 /*threads*/) {
  static auto* const dispatcher =
      at<PxDefaultCpuDispatcher>(call(PHYSX56_EXPORT(PxTopLevelFunctions_DefaultCpuDispatcherCreate_1), PxU32{0}));
  return dispatcher;
}

struct PxSceneDesc {
  explicit PxSceneDesc(const PxTolerancesScale& scale_)
      : scale(scale_),
        frictionOffsetThreshold(0.04F * scale_.length),
        frictionCorrelationDistance(0.025F * scale_.length) {}

  PxTolerancesScale scale;
  PxVec3 gravity;
  PxCpuDispatcher* cpuDispatcher = nullptr;
  PxSolverType::Enum solverType = PxSolverType::ePGS;
  PxFrictionType::Enum frictionType = PxFrictionType::ePATCH;
  float frictionOffsetThreshold, frictionCorrelationDistance;
  float bounceThresholdVelocity = 0.2F * scale.speed;
  PxSimulationFilterShader filterShader = nullptr;
  const void* filterShaderData = nullptr;
  PxU32 filterShaderDataSize = 0;
  PxContactModifyCallback* contactModifyCallback = nullptr;
  PxSceneFlags flags = PxSceneFlag::eENABLE_PCM;
};

// What a scene calls: its filter, and the receiver of its contact reports.
class SceneCallbacks final : public physx56::Callbacks {
 public:
  explicit SceneCallbacks(const PxSceneDesc& description)
      : filter_(call(PHYSX56_EXPORT(PassThroughFilterShaderImpl_PassThroughFilterShaderImpl_0))),
        events_(call(PHYSX56_EXPORT(PxSimulationEventCallbackImpl_PxSimulationEventCallbackImpl_0))),
        shader_(description.filterShader) {
    set_data(description.filterShaderData, description.filterShaderDataSize);
    physx56::module().listen(filter_, this);
    physx56::module().listen(events_, this);
  }
  ~SceneCallbacks() override {
    physx56::module().listen(filter_, nullptr);
    physx56::module().listen(events_, nullptr);
    call(PHYSX56_EXPORT(PassThroughFilterShaderImpl_0x5F_destroy_0x5F_0), filter_);
    call(PHYSX56_EXPORT(PxSimulationEventCallbackImpl_0x5F_destroy_0x5F_0), events_);
  }

  Address filter_object() const { return filter_; }
  Address events_object() const { return events_; }
  void set_data(const void* data, PxU32 size) {
    const auto* const bytes = static_cast<const PxU8*>(data);
    data_.assign(bytes, bytes + size);
  }
  void report_to(PxSimulationEventCallback* receiver) { receiver_ = receiver; }

  PxU32 filter(const PxU32* words) override {
    PxPairFlags pair;
    const PxFilterFlags result =
        shader_(words[0], {words[1], words[2], words[3], words[4]}, words[5], {words[6], words[7], words[8], words[9]},
                pair, data_.data(), static_cast<PxU32>(data_.size()));
    call(PHYSX56_EXPORT(PassThroughFilterShader_set_outputPairFlags_1), filter_, pair.bits());
    return result.bits();
  }
  void on_contact(Address /*header*/, Address pairs, PxU32 count) override {
    if (receiver_ == nullptr) return;
    std::vector<PxContactPair> list;
    for (PxU32 i = 0; i < count; ++i) {
      list.emplace_back(call(PHYSX56_EXPORT(NativeArrayHelpers_getContactPairAt_2), pairs, i));
    }
    receiver_->onContact({}, list.data(), count);
  }

 private:
  Address filter_, events_;
  PxSimulationFilterShader shader_;
  std::vector<PxU8> data_;
  PxSimulationEventCallback* receiver_ = nullptr;
};

class PxScene {
 public:
  PxScene() = delete;
  void release() {
    call(PHYSX56_EXPORT(PxScene_release_0), this);
    callbacks().erase(this);
  }
  bool addActor(PxActor& actor) { return call(PHYSX56_EXPORT(PxScene_addActor_1), this, &actor) != 0; }
  bool addArticulation(PxArticulationReducedCoordinate& articulation) {
    return call(PHYSX56_EXPORT(PxScene_addArticulation_1), this, &articulation) != 0;
  }
  bool simulate(float seconds) { return call(PHYSX56_EXPORT(PxScene_simulate_1), this, seconds) != 0; }
  bool fetchResults(bool block) { return call(PHYSX56_EXPORT(PxScene_fetchResults_1), this, block) != 0; }
  PxVec3 getGravity() const { return read<PxVec3>(call(PHYSX56_EXPORT(PxScene_getGravity_0), this)); }
  void setFilterShaderData(const void* data, PxU32 size) { callbacks().at(this)->set_data(data, size); }
  void setSimulationEventCallback(PxSimulationEventCallback* receiver) {
    callbacks().at(this)->report_to(receiver);
    call(PHYSX56_EXPORT(PxScene_setSimulationEventCallback_1), this, callbacks().at(this)->events_object());
  }

  static PxScene* make(Address physics, const PxSceneDesc& description) {
    if (description.contactModifyCallback != nullptr) return nullptr;
    auto callbacks = std::make_unique<SceneCallbacks>(description);
    const Address desc = call(PHYSX56_EXPORT(PxSceneDesc_PxSceneDesc_1), description.scale);
    call(PHYSX56_EXPORT(PxSceneDesc_set_gravity_1), desc, description.gravity);
    call(PHYSX56_EXPORT(PxSceneDesc_set_cpuDispatcher_1), desc, description.cpuDispatcher);
    call(PHYSX56_EXPORT(PxSceneDesc_set_solverType_1), desc, description.solverType);
    call(PHYSX56_EXPORT(PxSceneDesc_set_frictionType_1), desc, description.frictionType);
    call(PHYSX56_EXPORT(PxSceneDesc_set_frictionOffsetThreshold_1), desc, description.frictionOffsetThreshold);
    call(PHYSX56_EXPORT(PxSceneDesc_set_frictionCorrelationDistance_1), desc, description.frictionCorrelationDistance);
    call(PHYSX56_EXPORT(PxSceneDesc_set_bounceThresholdVelocity_1), desc, description.bounceThresholdVelocity);
    call(PHYSX56_EXPORT(PxSceneDesc_set_flags_1), desc,
         physx56::module().in(description.flags.bits(), physx56::kResultSlot));
    call(PHYSX56_EXPORT(PxTopLevelFunctions_setupPassThroughFilterShader_2), desc, callbacks->filter_object());
    auto* const scene = at<PxScene>(call(PHYSX56_EXPORT(PxPhysics_createScene_1), physics, desc));
    call(PHYSX56_EXPORT(PxSceneDesc_0x5F_destroy_0x5F_0), desc);
    if (scene != nullptr) PxScene::callbacks()[scene] = std::move(callbacks);
    return scene;
  }

 private:
  static std::map<const PxScene*, std::unique_ptr<SceneCallbacks>>& callbacks() {
    static auto* const of_scenes = new std::map<const PxScene*, std::unique_ptr<SceneCallbacks>>;
    return *of_scenes;
  }
};

// ---- the library ----------------------------------------------------------------------------------------------------

class PxDefaultAllocator {};

class PxFoundation {
 public:
  PxFoundation() = delete;
  void release() { call(PHYSX56_EXPORT(PxFoundation_release_0), this); }
};

// Hands PhysX's complaints on, and those of its module.
class ErrorCallbacks final : public physx56::Callbacks {
 public:
  explicit ErrorCallbacks(PxErrorCallback& receiver) : receiver_(receiver) {}
  void report_error(PxU32 code, const char* message) override {
    receiver_.reportError(static_cast<PxErrorCode::Enum>(code), message, "", 0);
  }

 private:
  PxErrorCallback& receiver_;
};

inline PxFoundation* PxCreateFoundation(PxU32 version, PxDefaultAllocator& /*allocator*/, PxErrorCallback& complaints) {
  auto* const errors = new ErrorCallbacks(complaints);  // as long as the module
  physx56::report_to(errors);
  const Address allocator = call(PHYSX56_EXPORT(PxDefaultAllocator_PxDefaultAllocator_0));
  const Address callback = call(PHYSX56_EXPORT(PxErrorCallbackImpl_PxErrorCallbackImpl_0));
  physx56::module().listen(callback, errors);
  return at<PxFoundation>(call(PHYSX56_EXPORT(PxTopLevelFunctions_CreateFoundation_3), version, allocator, callback));
}

class PxPhysics {
 public:
  PxPhysics() = delete;
  void release() { call(PHYSX56_EXPORT(PxPhysics_release_0), this); }
  const PxTolerancesScale& getTolerancesScale() const {
    return *at<PxTolerancesScale>(call(PHYSX56_EXPORT(PxPhysics_getTolerancesScale_0), this));
  }
  PxInsertionCallback& getPhysicsInsertionCallback() {
    return *at<PxInsertionCallback>(call(PHYSX56_EXPORT(PxPhysics_getPhysicsInsertionCallback_0), this));
  }
  PxScene* createScene(const PxSceneDesc& description) {
    return PxScene::make(physx56::module().address(this), description);
  }
  PxMaterial* createMaterial(float static_friction, float dynamic_friction, float restitution) {
    return at<PxMaterial>(
        call(PHYSX56_EXPORT(PxPhysics_createMaterial_3), this, static_friction, dynamic_friction, restitution));
  }
  PxRigidStatic* createRigidStatic(const PxTransform& pose) {
    return at<PxRigidStatic>(call(PHYSX56_EXPORT(PxPhysics_createRigidStatic_1), this, pose));
  }
  PxRigidDynamic* createRigidDynamic(const PxTransform& pose) {
    return at<PxRigidDynamic>(call(PHYSX56_EXPORT(PxPhysics_createRigidDynamic_1), this, pose));
  }
  PxArticulationReducedCoordinate* createArticulationReducedCoordinate() {
    return at<PxArticulationReducedCoordinate>(
        call(PHYSX56_EXPORT(PxPhysics_createArticulationReducedCoordinate_0), this));
  }
};

inline PxPhysics* PxCreatePhysics(PxU32 version, PxFoundation& foundation, const PxTolerancesScale& scale) {
  return at<PxPhysics>(call(PHYSX56_EXPORT(PxTopLevelFunctions_CreatePhysics_3), version, &foundation, scale));
}
inline bool PxInitExtensions(PxPhysics& physics, const void* /*pvd*/) {
  return call(PHYSX56_EXPORT(PxTopLevelFunctions_InitExtensions_1), &physics) != 0;
}
inline void PxCloseExtensions() { call(PHYSX56_EXPORT(PxTopLevelFunctions_CloseExtensions_0)); }

inline PxRigidStatic* PxCreatePlane(PxPhysics& physics, const PxPlane& plane, PxMaterial& material) {
  return at<PxRigidStatic>(call(PHYSX56_EXPORT(PxTopLevelFunctions_CreatePlane_3), &physics, plane, &material));
}

inline PxD6Joint* PxD6JointCreate(PxPhysics& physics, PxRigidActor* actor0, const PxTransform& frame0,
                                  PxRigidActor* actor1, const PxTransform& frame1) {
  return at<PxD6Joint>(
      call(PHYSX56_EXPORT(PxTopLevelFunctions_D6JointCreate_5), &physics, actor0, frame0, actor1, frame1));
}
inline PxRevoluteJoint* PxRevoluteJointCreate(PxPhysics& physics, PxRigidActor* actor0, const PxTransform& frame0,
                                              PxRigidActor* actor1, const PxTransform& frame1) {
  return at<PxRevoluteJoint>(
      call(PHYSX56_EXPORT(PxTopLevelFunctions_RevoluteJointCreate_5), &physics, actor0, frame0, actor1, frame1));
}

}  // namespace physx

// PhysX has these in the global namespace, too.
using physx::PxCloseExtensions;
using physx::PxCreateConvexMesh;
using physx::PxCreateFoundation;
using physx::PxCreateHeightField;
using physx::PxCreatePhysics;
using physx::PxCreatePlane;
using physx::PxInitExtensions;
