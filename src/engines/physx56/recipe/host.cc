// What the module wants from its host: 11 functions, of which a simulation needs clocks, a larger heap, somewhere to
// write messages, and the way to PhysX's callbacks.
#include "host.h"

#include <chrono>
#include <mutex>
#include <unistd.h>

// The two modules that PhysX's imports from; wasm2c leaves their types to us.
struct w2c_env {
  w2c_physx56* module;
  std::map<physx56::Address, physx56::Callbacks*> callbacks;
};
struct w2c_wasi__snapshot__preview1 {
  w2c_physx56* module;
};

namespace {

using physx56::Address;

constexpr std::uint64_t kPage = 65536;

// JavaScript that the module names by its place in this build (ASM_CONSTS of physx-js-webidl.mjs 2.7.3): a call of the
// function of that name, on the object whose address is the first argument.
enum Script : std::uint32_t {
  kFilterShader = 270506,
  kReportError = 271988,
  kOnConstraintBreak = 272797,
  kOnWake = 273077,
  kOnSleep = 273324,
  kOnContact = 273574,
  kOnTrigger = 273833
};

std::uint32_t read_u32(w2c_physx56* module, Address address) {
  std::uint32_t value = 0;
  std::memcpy(&value, module->w2c_memory.data + address, sizeof value);
  return value;
}

double milliseconds() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::milli>(now).count();
}

}  // namespace

extern "C" {

// Called by the runtime instead of a longjmp; the generated C is compiled so that exceptions pass through it.
[[noreturn]] void physx56_trap(wasm_rt_trap_t code) {
  throw physx56::Error(std::string("PhysX's module trapped: ") + wasm_rt_strerror(code));
}

void w2c_env_0x5Fabort_js(w2c_env*) { throw physx56::Error("PhysX's module called abort()"); }
void w2c_env_exit(w2c_env*, u32) { throw physx56::Error("PhysX's module called exit()"); }

u32 w2c_env_emscripten_resize_heap(w2c_env* env, u32 wanted) {
  wasm_rt_memory_t* memory = &env->module->w2c_memory;
  if (wanted <= memory->size) return 1;
  // A fifth more than is asked for, as far as that is allowed, so that growing stays rare.
  const std::uint64_t pages = (wanted + kPage - 1) / kPage;
  for (const std::uint64_t generous : {pages + pages / 5, pages}) {
    if (generous <= memory->max_pages && wasm_rt_grow_memory(memory, generous - memory->pages) != ~std::uint64_t{0}) {
      return 1;
    }
  }
  return 0;
}

// The arguments of all of these are words.
u32 w2c_env_emscripten_asm_const_int(w2c_env* env, u32 script, u32 /*signature*/, u32 arguments) {
  std::uint32_t words[11];
  std::memcpy(words, env->module->w2c_memory.data + arguments, sizeof words);
  const auto found = env->callbacks.find(words[0]);
  physx56::Callbacks* const callbacks = found == env->callbacks.end() ? nullptr : found->second;
  switch (script) {
    case kFilterShader:
      return callbacks == nullptr ? 0 : callbacks->filter(words + 1);
    case kOnContact:
      if (callbacks != nullptr) callbacks->on_contact(words[1], words[2], words[3]);
      return 0;
    case kReportError:
      if (callbacks != nullptr) {
        callbacks->report_error(words[1], reinterpret_cast<const char*>(env->module->w2c_memory.data) + words[2]);
      }
      return 0;
    case kOnConstraintBreak:
    case kOnWake:
    case kOnSleep:
    case kOnTrigger:
      return 0;
    default:
      throw physx56::Error("PhysX's module wants a function that its host does not have");
  }
}
f64 w2c_env_emscripten_asm_const_double(w2c_env*, u32, u32, u32) {
  throw physx56::Error("PhysX's module wants a function that its host does not have");
}

f64 w2c_env_emscripten_get_now(w2c_env*) { return milliseconds(); }
f64 w2c_env_emscripten_date_now(w2c_env*) { return milliseconds(); }
u32 w2c_wasi__snapshot__preview1_clock_time_get(w2c_wasi__snapshot__preview1* wasi, u32, u64, u32 result) {
  const auto nanoseconds = static_cast<std::uint64_t>(milliseconds() * 1e6);
  std::memcpy(wasi->module->w2c_memory.data + result, &nanoseconds, sizeof nanoseconds);
  return 0;
}

// Standard output would end among our own results: everything goes to standard error.
u32 w2c_wasi__snapshot__preview1_fd_write(w2c_wasi__snapshot__preview1* wasi, u32, u32 vectors, u32 count,
                                          u32 written) {
  u32 total = 0;
  for (u32 i = 0; i < count; ++i) {
    const u32 length = read_u32(wasi->module, vectors + 8 * i + 4);
    const u32 from = read_u32(wasi->module, vectors + 8 * i);
    if (length != 0 && write(STDERR_FILENO, wasi->module->w2c_memory.data + from, length) < 0) return 29;  // EIO
    total += length;
  }
  std::memcpy(wasi->module->w2c_memory.data + written, &total, sizeof total);
  return 0;
}
u32 w2c_wasi__snapshot__preview1_fd_close(w2c_wasi__snapshot__preview1*, u32) { return 0; }
u32 w2c_wasi__snapshot__preview1_fd_seek(w2c_wasi__snapshot__preview1*, u32, u64, u32, u32) { return 29; }

}  // extern "C"

namespace physx56 {

struct Instance::Host {
  w2c_env env;
  w2c_wasi__snapshot__preview1 wasi;
};

Instance::Instance() : host_(std::make_unique<Host>()) {
  static std::once_flag once;
  std::call_once(once, wasm_rt_init);
  host_->env.module = host_->wasi.module = &module_;
  wasm2c_physx56_instantiate(&module_, &host_->env, &host_->wasi);
  try {
    w2c_physx56_emscripten_stack_init(&module_);
    w2c_physx56_0x5F_wasm_call_ctors(&module_);
    scratch_ = w2c_physx56_webidl_malloc(&module_, kSlots * kSlotSize);
    if (scratch_ == 0) throw Error("the heap of PhysX's module has no room");
  } catch (...) {
    wasm2c_physx56_free(&module_);
    throw;
  }
}

Instance::~Instance() { wasm2c_physx56_free(&module_); }

void Instance::listen(Address object, Callbacks* callbacks) {
  if (callbacks == nullptr) {
    host_->env.callbacks.erase(object);
  } else {
    host_->env.callbacks[object] = callbacks;
  }
}

Address Instance::copied(const void* source, std::uint32_t size) {
  const Address place = w2c_physx56_webidl_malloc(&module_, size);
  if (place == 0) throw Error("the heap of PhysX's module has no room");
  std::memcpy(bytes(place), source, size);
  return place;
}

void Instance::free(Address address) { w2c_physx56_webidl_free(&module_, address); }

}  // namespace physx56
