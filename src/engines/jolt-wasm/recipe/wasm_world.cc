// jolt_world.h over the same code as WebAssembly, which wasm2c turned into C. A world is an instance of the module with
// a memory of its own; arguments and results are copied through a buffer in it.
#include <algorithm>
#include <cstring>
#include <memory>
#include <mutex>

#include "jolt.h"
#include "jolt_world.h"

// The module that the imports come from; wasm2c leaves its type to us. The C library wants it for standard output,
// which Jolt does not write to.
struct w2c_wasi__snapshot__preview1 {};

namespace {
struct Trap {};
constexpr u32 kBadFile = 8;  // WASI's EBADF
}  // namespace

extern "C" {

// Called by wasm2c's runtime instead of a longjmp; the generated C is compiled so that exceptions pass through it.
[[noreturn]] void jolt_trap(wasm_rt_trap_t) { throw Trap(); }

u32 w2c_wasi__snapshot__preview1_fd_close(w2c_wasi__snapshot__preview1*, u32) { return kBadFile; }
u32 w2c_wasi__snapshot__preview1_fd_seek(w2c_wasi__snapshot__preview1*, u32, u64, u32, u32) { return kBadFile; }
u32 w2c_wasi__snapshot__preview1_fd_write(w2c_wasi__snapshot__preview1*, u32, u32, u32, u32) { return kBadFile; }

}  // extern "C"

struct jolt_world {
  jolt_world() {
    static std::once_flag once;
    std::call_once(once, wasm_rt_init);
    wasm2c_jolt_instantiate(&module, &wasi);
  }
  ~jolt_world() { wasm2c_jolt_free(&module); }
  jolt_world(const jolt_world&) = delete;
  jolt_world& operator=(const jolt_world&) = delete;

  u32 allocate(size_t bytes) {
    const u32 address = w2c_jolt_malloc(&module, static_cast<u32>(std::max<size_t>(bytes, 1)));
    if (address == 0) throw Trap();
    return address;
  }

  template <typename T>
  u32 copy_in(const T* source, int32_t count) {
    const u32 address = allocate(sizeof(T) * count);
    write(source, count, address);
    return address;
  }
  template <typename T>
  void write(const T* source, int32_t count, u32 address) {
    if (count > 0) std::memcpy(module.w2c_memory.data + address, source, sizeof(T) * count);
  }
  template <typename T>
  void read(u32 address, T* target, int32_t count) const {
    if (count > 0) std::memcpy(target, module.w2c_memory.data + address, sizeof(T) * count);
  }

  w2c_wasi__snapshot__preview1 wasi;
  w2c_jolt module{};
  u32 world = 0;
  u32 states = 0, torques = 0;  // buffers
  int32_t body_count = 0, coordinate_count = 0, torque_count = 0;
};

jolt_world* jolt_create(const jolt_settings* settings, const jolt_body* bodies, int32_t body_count,
                        const jolt_shape* shapes, int32_t shape_count, const jolt_pair* pairs, int32_t pair_count,
                        const double* numbers, int32_t number_count, const jolt_joint* joints, int32_t joint_count) {
  auto made = std::make_unique<jolt_world>();
  try {
    w2c_jolt* module = &made->module;
    w2c_jolt_0x5Finitialize(module);
    const u32 at_settings = made->copy_in(settings, 1);
    const u32 at_bodies = made->copy_in(bodies, body_count), at_shapes = made->copy_in(shapes, shape_count);
    const u32 at_pairs = made->copy_in(pairs, pair_count), at_joints = made->copy_in(joints, joint_count);
    const u32 at_numbers = made->copy_in(numbers, number_count);
    made->world = w2c_jolt_jolt_create(module, at_settings, at_bodies, body_count, at_shapes, shape_count, at_pairs,
                                       pair_count, at_numbers, number_count, at_joints, joint_count);
    for (const u32 address : {at_settings, at_bodies, at_shapes, at_pairs, at_joints, at_numbers})
      w2c_jolt_free(module, address);
    if (made->world == 0) return nullptr;
    made->states = made->allocate(sizeof(jolt_body_state) * body_count);
    for (int32_t j = 0; j < joint_count; ++j) {
      made->torque_count += joints[j].type == JOLT_BALL ? 3 : joints[j].type == JOLT_WELD ? 0 : 1;
      made->coordinate_count += joints[j].type == JOLT_HINGE || joints[j].type == JOLT_SLIDE ? 1 : 0;
    }
    made->torques = made->allocate(sizeof(double) * made->torque_count);
    made->body_count = body_count;
  } catch (const Trap&) {
    return nullptr;
  }
  return made.release();
}

void jolt_free(jolt_world* world) { delete world; }

int32_t jolt_step(jolt_world* world, int32_t count) {
  try {
    return static_cast<int32_t>(w2c_jolt_jolt_step(&world->module, world->world, count));
  } catch (const Trap&) {
    return -1;
  }
}

void jolt_read(jolt_world* world, jolt_body_state* out) {
  w2c_jolt_jolt_read(&world->module, world->world, world->states);
  world->read(world->states, out, world->body_count);
}

void jolt_set_torques(jolt_world* world, const double* torques) {
  world->write(torques, world->torque_count, world->torques);
  w2c_jolt_jolt_set_torques(&world->module, world->world, world->torques);
}

void jolt_view(jolt_world* world, jolt_body_view* bodies, jolt_joint_view* joints, double* gravity) {
  const u32 at_bodies = world->allocate(sizeof(jolt_body_view) * world->body_count);
  const u32 at_joints = world->allocate(sizeof(jolt_joint_view) * world->coordinate_count);
  const u32 at_gravity = world->allocate(3 * sizeof(double));
  w2c_jolt_jolt_view(&world->module, world->world, at_bodies, at_joints, at_gravity);
  world->read(at_bodies, bodies, world->body_count);
  world->read(at_joints, joints, world->coordinate_count);
  world->read(at_gravity, gravity, 3);
  for (const u32 address : {at_bodies, at_joints, at_gravity}) w2c_jolt_free(&world->module, address);
}

void jolt_keep_contacts(jolt_world* world) { w2c_jolt_jolt_keep_contacts(&world->module, world->world); }

int32_t jolt_contacts(jolt_world* world, jolt_contact* out, int32_t room) {
  try {
    const u32 address = world->allocate(sizeof(jolt_contact) * room);
    const auto count = static_cast<int32_t>(w2c_jolt_jolt_contacts(&world->module, world->world, address, room));
    world->read(address, out, std::min(count, room));
    w2c_jolt_free(&world->module, address);
    return count;
  } catch (const Trap&) {
    return -1;
  }
}

int32_t jolt_version() {
  jolt_world world;
  return static_cast<int32_t>(w2c_jolt_jolt_version(&world.module));
}
