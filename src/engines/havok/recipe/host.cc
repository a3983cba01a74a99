// What Havok's module wants from its host: 25 functions, of which a simulation without JavaScript needs a clock, a
// larger heap and somewhere to write messages. The functions that describe the module's interface to JavaScript have
// nothing to do.
#include "host.h"

#include <chrono>
#include <mutex>
#include <unistd.h>

// The two modules that Havok's imports from; wasm2c leaves their types to us.
struct w2c_env {
  w2c_havok* module;
};
struct w2c_wasi__snapshot__preview1 {
  w2c_havok* module;
};

namespace {

constexpr std::uint64_t kPage = 65536;

std::uint32_t read_u32(w2c_havok* module, std::uint32_t address) {
  std::uint32_t value = 0;
  std::memcpy(&value, module->w2c_memory.data + address, sizeof value);
  return value;
}

}  // namespace

extern "C" {

// Called by the runtime instead of a longjmp; the generated C is compiled so that exceptions pass through it.
[[noreturn]] void havok_trap(wasm_rt_trap_t code) {
  throw havok::Error(std::string("Havok's module trapped: ") + wasm_rt_strerror(code));
}

void w2c_env_0x5Fabort_js(w2c_env*) { throw havok::Error("Havok called abort()"); }

u32 w2c_env_emscripten_get_heap_max(w2c_env* env) {
  return static_cast<u32>(env->module->w2c_memory.max_pages * kPage);
}

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

f64 w2c_env_emscripten_get_now(w2c_env*) {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::milli>(now).count();
}
u32 w2c_env_0x5Femscripten_get_now_is_monotonic(w2c_env*) { return 1; }

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

void w2c_env_0x5Fembind_finalize_value_array(w2c_env*, u32) {}
void w2c_env_0x5Fembind_register_bigint(w2c_env*, u32, u32, u32, u64, u64) {}
void w2c_env_0x5Fembind_register_bool(w2c_env*, u32, u32, u32, u32) {}
void w2c_env_0x5Fembind_register_emval(w2c_env*, u32) {}
void w2c_env_0x5Fembind_register_enum(w2c_env*, u32, u32, u32, u32) {}
void w2c_env_0x5Fembind_register_enum_value(w2c_env*, u32, u32, u32) {}
void w2c_env_0x5Fembind_register_float(w2c_env*, u32, u32, u32) {}
void w2c_env_0x5Fembind_register_function(w2c_env*, u32, u32, u32, u32, u32, u32, u32, u32) {}
void w2c_env_0x5Fembind_register_integer(w2c_env*, u32, u32, u32, u32, u32) {}
void w2c_env_0x5Fembind_register_memory_view(w2c_env*, u32, u32, u32) {}
void w2c_env_0x5Fembind_register_std_string(w2c_env*, u32, u32) {}
void w2c_env_0x5Fembind_register_std_wstring(w2c_env*, u32, u32, u32) {}
void w2c_env_0x5Fembind_register_value_array(w2c_env*, u32, u32, u32, u32, u32, u32) {}
void w2c_env_0x5Fembind_register_value_array_element(w2c_env*, u32, u32, u32, u32, u32, u32, u32, u32, u32) {}
void w2c_env_0x5Fembind_register_void(w2c_env*, u32, u32) {}
f64 w2c_env_0x5Femval_call_method(w2c_env*, u32, u32, u32, u32, u32) { return 0; }
void w2c_env_0x5Femval_decref(w2c_env*, u32) {}
u32 w2c_env_0x5Femval_get_method_caller(w2c_env*, u32, u32, u32) { return 0; }
void w2c_env_0x5Femval_run_destructors(w2c_env*, u32) {}

}  // extern "C"

namespace havok {

struct Instance::Host {
  w2c_env env;
  w2c_wasi__snapshot__preview1 wasi;
};

Instance::Instance() : host_(std::make_unique<Host>()) {
  static std::once_flag once;
  std::call_once(once, wasm_rt_init);
  host_->env.module = host_->wasi.module = &module_;
  wasm2c_havok_instantiate(&module_, &host_->env, &host_->wasi);
  try {
    w2c_havok_0x5F_wasm_call_ctors(&module_);
    w2c_havok_main(&module_, 0, 0);
    scratch_ = w2c_havok_malloc(&module_, kSlots * kSlotSize);
    if (scratch_ == 0) throw Error("Havok's heap has no room");
  } catch (...) {
    wasm2c_havok_free(&module_);
    throw;
  }
}

Instance::~Instance() { wasm2c_havok_free(&module_); }

}  // namespace havok
