#include "library.h"

#include <fmt/format.h>

#include "base/errors.h"

namespace assay::px {
namespace {

// All tasks run on the thread that steps, so PhysX's messages belong to that thread.
thread_local std::string complaint;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)

class Complaints final : public physx::PxErrorCallback {
 public:
  void reportError(physx::PxErrorCode::Enum code, const char* message, const char* /*file*/, int /*line*/) override {
    const int severe = physx::PxErrorCode::eINVALID_PARAMETER | physx::PxErrorCode::eINVALID_OPERATION |
                       physx::PxErrorCode::eOUT_OF_MEMORY | physx::PxErrorCode::eINTERNAL_ERROR |
                       physx::PxErrorCode::eABORT;
    if ((code & severe) != 0 && complaint.empty()) complaint = message;
  }
};

class Sdk {
 public:
  Sdk() : foundation_(PxCreateFoundation(PX_PHYSICS_VERSION, allocator_, complaints_)) {
    if (foundation_ == nullptr) throw EngineError("PhysX could not make its foundation: " + take_complaint());
    // lengths in metres, speeds in m/s; what depends on a model's size is set on its scene and its shapes
    physics_ = PxCreatePhysics(PX_PHYSICS_VERSION, *foundation_, physx::PxTolerancesScale());
    if (physics_ == nullptr || !PxInitExtensions(*physics_, nullptr)) {
      throw EngineError("PhysX could not be started: " + take_complaint());
    }
  }
  physx::PxPhysics& physics() { return *physics_; }

 private:
  physx::PxDefaultAllocator allocator_;
  Complaints complaints_;
  physx::PxFoundation* foundation_;
  physx::PxPhysics* physics_ = nullptr;
};

}  // namespace

physx::PxPhysics& sdk() {
  static auto* const instance = new Sdk();
  return instance->physics();
}

std::string take_complaint() {
  std::string text;
  text.swap(complaint);
  return text;
}

bool has_complaint() { return !complaint.empty(); }

}  // namespace assay::px
