// What PhysX has once a process: its foundation and its PxPhysics. All simulations share them; each has its own scene.
#pragma once

#include <memory>
#include <string>

#include <PxPhysicsAPI.h>

namespace assay::px {

// Owner of an object that PhysX wants back by its release().
struct Releaser {
  template <typename T>
  void operator()(T* object) const {
    object->release();
  }
};
template <typename T>
using Owned = std::unique_ptr<T, Releaser>;

// Made with the first simulation and kept until the process ends: PhysX cannot be stopped and started again reliably.
physx::PxPhysics& sdk();

// What PhysX complained about on this thread since the last call, "" when nothing. Its warnings do not count.
std::string take_complaint();
bool has_complaint();

}  // namespace assay::px
