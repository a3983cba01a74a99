// The library as all simulations share it: its start, its errors, its objects' owners.
#pragma once

#include <memory>
#include <vector>

#include <ode/ode.h>

namespace assay::ode {

// Starts ODE on this thread and turns its errors into EngineError. To be called before anything else of ODE.
void initialise_library();

// Whether this build of ODE has libccd, which finds contacts of cylinders with each other and of convex polyhedra.
bool has_libccd();

// How often the exact solver gave up on this thread. The caller of a step sets it to 0. ODE reports through functions
// without context, so the count cannot belong to a simulation.
extern thread_local long long lcp_failures;

// Frees an object of ODE, unless an error inside ODE interrupted a step: then spaces may be locked and lists
// half-changed, and freeing them could fail again. Such objects are kept until the process ends.
struct Destroy {
  const bool* failed;
  void operator()(dxWorld* world) const { free_or_keep(world, dWorldDestroy); }
  void operator()(dxSpace* space) const { free_or_keep(space, dSpaceDestroy); }
  void operator()(dxHeightfieldData* data) const { free_or_keep(data, dGeomHeightfieldDataDestroy); }
  void operator()(dxJointGroup* group) const { free_or_keep(group, dJointGroupDestroy); }

 private:
  template <typename T>
  void free_or_keep(T* object, void (*destroy)(T*)) const {
    static auto& kept = *new std::vector<T*>;  // outlives static destructors
    if (*failed) {
      kept.push_back(object);
    } else {
      destroy(object);
    }
  }
};
using World = std::unique_ptr<dxWorld, Destroy>;
using Space = std::unique_ptr<dxSpace, Destroy>;
using HeightData = std::unique_ptr<dxHeightfieldData, Destroy>;
using Group = std::unique_ptr<dxJointGroup, Destroy>;

}  // namespace assay::ode
