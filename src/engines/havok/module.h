// Havok's exported functions HP_*, called in this process (native.cc) or in Node (node.cc): the same simulation is
// built on either.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <type_traits>
#include <vector>

#include "types.h"

namespace assay::havok_adapter {

#define ASSAY_HAVOK_FUNCTIONS(X)           \
  X(World_Create)                          \
  X(World_SetGravity)                      \
  X(World_GetGravity)                      \
  X(World_SetIdealStepTime)                \
  X(World_SetSpeedLimit)                   \
  X(World_AddBody)                         \
  X(Body_Create)                           \
  X(Body_SetMotionType)                    \
  X(Body_SetShape)                         \
  X(Body_SetMassProperties)                \
  X(Body_GetMassProperties)                \
  X(Body_SetLinearDamping)                 \
  X(Body_SetAngularDamping)                \
  X(Body_SetActivationControl)             \
  X(Body_SetQTransform)                    \
  X(Body_GetQTransform)                    \
  X(Body_SetLinearVelocity)                \
  X(Body_GetLinearVelocity)                \
  X(Body_SetAngularVelocity)               \
  X(Body_GetAngularVelocity)               \
  X(Body_ApplyAngularImpulse)              \
  X(Body_ApplyImpulse)                     \
  X(Shape_CreateSphere)                    \
  X(Shape_CreateCapsule)                   \
  X(Shape_CreateBox)                       \
  X(Shape_CreateCylinder)                  \
  X(Shape_CreateConvexHull)                \
  X(Shape_CreateMesh)                      \
  X(Shape_CreateContainer)                 \
  X(Shape_AddChild)                        \
  X(Shape_SetFilterInfo)                   \
  X(Shape_SetMaterial)                     \
  X(Constraint_Create)                     \
  X(Constraint_SetParentBody)              \
  X(Constraint_SetChildBody)               \
  X(Constraint_SetAnchorInParent)          \
  X(Constraint_SetAnchorInChild)           \
  X(Constraint_SetAxisMode)                \
  X(Constraint_GetAxisMode)                \
  X(Constraint_SetAxisMinLimit)            \
  X(Constraint_GetAxisMinLimit)            \
  X(Constraint_SetAxisMaxLimit)            \
  X(Constraint_GetAxisMaxLimit)            \
  X(Constraint_SetAxisFriction)            \
  X(Constraint_SetAxisMotorType)           \
  X(Constraint_SetAxisMotorVelocityTarget) \
  X(Constraint_SetAxisMotorStiffness)      \
  X(Constraint_SetAxisMotorDamping)        \
  X(Constraint_SetAxisMotorMaxForce)       \
  X(Constraint_SetCollisionsEnabled)       \
  X(Constraint_SetEnabled)

enum class Function : std::uint8_t {
#define ASSAY_HAVOK_ENUMERATOR(name) k##name,
  ASSAY_HAVOK_FUNCTIONS(ASSAY_HAVOK_ENUMERATOR)
#undef ASSAY_HAVOK_ENUMERATOR
};

inline constexpr const char* kFunctionNames[] = {
#define ASSAY_HAVOK_NAME(name) "HP_" #name,
    ASSAY_HAVOK_FUNCTIONS(ASSAY_HAVOK_NAME)
#undef ASSAY_HAVOK_NAME
};

// An argument: a number, a structure that the function reads or writes in the module's memory, or an array of any
// length that it reads.
struct Arg {
  enum class Kind : std::uint8_t { kU32, kU64, kF32, kIn, kOut, kArray };

  Arg(std::uint32_t number) : kind(Kind::kU32), bits(number) {}  // NOLINT: implicit like a call's
  Arg(std::uint64_t number) : kind(Kind::kU64), bits(number) {}  // NOLINT: implicit like a call's
  Arg(float number) : kind(Kind::kF32), bits(__builtin_bit_cast(std::uint32_t, number)) {}  // NOLINT: the same
  Arg(double) = delete;
  Arg(int) = delete;

  Kind kind;
  std::uint64_t bits = 0;
  const void* source = nullptr;
  void* target = nullptr;
  std::uint32_t size = 0;
};

template <typename T>
Arg in(const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  Arg arg(std::uint32_t{0});
  arg.kind = Arg::Kind::kIn;
  arg.source = &value;
  arg.size = sizeof(T);
  return arg;
}

template <typename T>
Arg out(T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  Arg arg(std::uint32_t{0});
  arg.kind = Arg::Kind::kOut;
  arg.target = &value;
  arg.size = sizeof(T);
  return arg;
}

template <typename T>
Arg array(const std::vector<T>& values) {
  static_assert(std::is_trivially_copyable_v<T>);
  Arg arg(std::uint32_t{0});
  arg.kind = Arg::Kind::kArray;
  arg.source = values.data();
  arg.size = static_cast<std::uint32_t>(sizeof(T) * values.size());
  return arg;
}

// One instance of Havok: a memory, a heap, worlds. Every failure is an EngineError.
class Module {
 public:
  Module(const Module&) = delete;
  Module& operator=(const Module&) = delete;
  virtual ~Module() = default;

  virtual void call(Function function, std::initializer_list<Arg> arguments) = 0;

  // `count` calls of HP_World_Step.
  virtual void step(havok::Id world, float timestep, int count) = 0;

 protected:
  Module() = default;
};

std::unique_ptr<Module> make_module();

}  // namespace assay::havok_adapter
