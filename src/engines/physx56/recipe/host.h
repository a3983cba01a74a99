// PhysX's module as one C++ object: the C that wasm2c makes of it (physx56.h), its memory, and the host functions that
// it imports (host.cc). Everything else is the exported functions emscripten_bind_*, one for each function of PhysX
// that the package's interface lists, called as physx56.h declares them. References and pointers are addresses in the
// module's memory, vectors and poses lie there as PhysX declares them.
#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>

#include "physx56.h"

namespace physx56 {

using Address = std::uint32_t;

// The module trapped: a failed check of its own, or a call through a wrong pointer. It is good for nothing afterwards.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// What PhysX calls back. The package's classes *Impl hand each call on to their host, with their own address.
class Callbacks {
 public:
  Callbacks(const Callbacks&) = delete;
  Callbacks& operator=(const Callbacks&) = delete;
  virtual ~Callbacks() = default;

  // PassThroughFilterShaderImpl: attributes and four words of the first shape, then of the second. Gives PxFilterFlags.
  virtual std::uint32_t filter(const std::uint32_t* /*words*/) { return 0; }
  // PxSimulationEventCallbackImpl.
  virtual void on_contact(Address /*header*/, Address /*pairs*/, std::uint32_t /*count*/) {}
  // PxErrorCallbackImpl.
  virtual void report_error(std::uint32_t /*code*/, const char* /*message*/) {}

 protected:
  Callbacks() = default;
};

// Instances share nothing: each has its own memory, heap and globals. Not thread-safe.
class Instance {
 public:
  Instance();
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  operator w2c_physx56*() { return &module_; }  // NOLINT(google-explicit-constructor): the exports' first argument

  // Hands the calls of the *Impl object at `object` on to `callbacks`; nullptr: to nobody.
  void listen(Address object, Callbacks* callbacks);

  // The module's memory, which keeps its place when it grows.
  std::uint8_t* bytes(Address address) const { return module_.w2c_memory.data + address; }
  Address address(const void* place) const {
    return static_cast<Address>(static_cast<const std::uint8_t*>(place) - module_.w2c_memory.data);
  }
  std::uint64_t memory_size() const { return module_.w2c_memory.size; }

  // A copy on the module's heap, to be freed by the caller.
  Address copied(const void* source, std::uint32_t size);
  void free(Address address);

  // Slots of 64 bytes, 0 to kSlots - 1, for structures that a call takes by reference.
  template <typename T>
  Address in(const T& value, int slot = 0) {
    static_assert(sizeof(T) <= kSlotSize);
    const Address place = scratch_ + static_cast<Address>(slot) * kSlotSize;
    std::memcpy(bytes(place), &value, sizeof(T));
    return place;
  }

 private:
  static constexpr std::uint32_t kSlots = 8, kSlotSize = 64;

  struct Host;
  std::unique_ptr<Host> host_;
  w2c_physx56 module_{};
  Address scratch_ = 0;
};

}  // namespace physx56
