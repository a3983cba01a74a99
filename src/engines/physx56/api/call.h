// Calls of the module's exports, with arguments of this program's memory.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include "foundation/PxTransform.h"
#include "host.h"

#define PHYSX56_EXPORT(name) w2c_physx56_emscripten_bind_##name

namespace physx56 {

// Arguments by reference take the slots from 0 on, in their order.
inline constexpr int kResultSlot = 7;

// The process's module, made with the first call and kept until the process ends, as PhysX itself is elsewhere.
class Process {
 public:
  static Process& instance() {
    static auto* const process = new Process;
    return *process;
  }

  Instance module;
  bool broken = false;  // the module trapped
  Callbacks* complaints = nullptr;
  std::map<const void*, std::pair<float, float>> limits;

  // A trap is reported as PhysX reports its own errors; the module is good for nothing afterwards.
  void fail(const char* why) {
    broken = true;
    constexpr std::uint32_t kAbort = 64;
    if (complaints != nullptr) complaints->report_error(kAbort, why);
  }
};

inline Instance& module() { return Process::instance().module; }
inline void report_to(Callbacks* complaints) { Process::instance().complaints = complaints; }

// Limits of joints, which the exports set and do not give back.
inline std::map<const void*, std::pair<float, float>>& limits_of_joints() { return Process::instance().limits; }

// The object at an address of the module; nullptr at 0.
template <typename T>
T* at(Address address) {
  return address == 0 ? nullptr : reinterpret_cast<T*>(module().bytes(address));
}

// A copy of the value at an address of the module.
template <typename T>
T read(Address address) {
  T value{};
  if (address != 0) std::memcpy(static_cast<void*>(&value), module().bytes(address), sizeof(T));
  return value;
}

inline Address copied(const void* source, std::uint32_t size) { return module().copied(source, size); }
inline void freed(Address address) { module().free(address); }

// One argument as the export takes it: numbers as they are, objects by their address, values by that of a copy.
template <typename Parameter, typename T>
Parameter passed(const T& argument, int& slot) {
  if constexpr (std::is_pointer_v<T>) {
    return argument == nullptr ? 0 : module().address(argument);
  } else if constexpr (std::is_class_v<T>) {
    return module().in(argument, slot++);
  } else {
    static_assert(std::is_floating_point_v<T> == std::is_floating_point_v<Parameter>);
    return static_cast<Parameter>(argument);
  }
}

template <typename Result, typename... Parameters, typename... Arguments>
Result call(Result (*exported)(w2c_physx56*, Parameters...), const Arguments&... arguments) {
  Process& process = Process::instance();
  if (process.broken) {
    process.fail("its module trapped before");
    return Result();
  }
  try {
    [[maybe_unused]] int slot = 0;
    return exported(process.module, passed<Parameters>(arguments, slot)...);
  } catch (const Error& error) {
    process.fail(error.what());
    return Result();
  }
}

}  // namespace physx56
