// Havok's module as one C++ object: the C that wasm2c makes of it (havok.h), its memory, and the host functions it
// imports (host.cc). Everything else is the exported functions HP_*, called as havok.h declares them:
//
//   havok::Instance havok;
//   havok::Id world = 0;
//   havok::check(w2c_havok_HP_World_Create(havok, havok.out<havok::Id>()), "HP_World_Create");
//   world = havok.result<havok::Id>();
//
// Their vectors, quaternions and structures are addresses in the module's memory. An Instance has a few scratch slots
// for them: in() writes an argument and gives its address, out() gives the address for a result, result() reads it.
#pragma once

#include <cstdint>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "havok.h"
#include "types.h"

namespace havok {

// The module trapped (a failed check of its own, a call through a wrong pointer) or a call did not return OK. After a
// trap the instance is good for nothing but to be destroyed.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline void check(std::uint32_t result, const char* call) {
  if (result != 0) throw Error(std::string(call) + " returned " + std::to_string(result));
}

// Instances share nothing: each has its own memory, heap and globals. Not thread-safe.
class Instance {
 public:
  Instance();
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  operator w2c_havok*() { return &module_; }  // NOLINT(google-explicit-constructor): the exports' first argument

  // Slots of 64 bytes, 0 to kSlots - 1; any of them holds any of the structures above.
  template <typename T>
  std::uint32_t in(const T& value, int slot = 0) {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= kSlotSize);
    return in_bytes(&value, sizeof(T), slot);
  }
  std::uint32_t out(int slot = 0) const { return address(slot); }
  template <typename T>
  T result(int slot = 0) const {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= kSlotSize);
    T value;
    out_bytes(&value, sizeof(T), slot);
    return value;
  }

  // The same for whoever knows the size only.
  std::uint32_t in_bytes(const void* source, std::uint32_t size, int slot) {
    std::memcpy(bytes(address(slot)), source, size);
    return address(slot);
  }
  void out_bytes(void* target, std::uint32_t size, int slot) const { std::memcpy(target, bytes(address(slot)), size); }

  std::uint64_t memory_size() const { return module_.w2c_memory.size; }

 private:
  static constexpr std::uint32_t kSlots = 8, kSlotSize = 64;
  std::uint32_t address(int slot) const { return scratch_ + static_cast<std::uint32_t>(slot) * kSlotSize; }
  std::uint8_t* bytes(std::uint32_t address) const { return module_.w2c_memory.data + address; }

  struct Host;
  std::unique_ptr<Host> host_;
  w2c_havok module_{};
  std::uint32_t scratch_ = 0;
};

}  // namespace havok
