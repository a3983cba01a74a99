// Havok in this process: WebAssembly that was compiled to C.
#include <array>
#include <bit>
#include <string>
#include <utility>
#include <vector>

#include "base/errors.h"
#include "host.h"
#include "module.h"
#include "plugin.h"

namespace assay::havok_adapter {
namespace {

constexpr size_t kMaxArguments = 8;
using Numbers = std::array<std::uint64_t, kMaxArguments>;  // addresses are numbers, too

template <typename T>
T number(std::uint64_t bits) {
  if constexpr (std::is_same_v<T, float>) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
  } else {
    return static_cast<T>(bits);
  }
}

// One shape of call for all exports.
using Call = std::uint32_t (*)(w2c_havok*, const Numbers&);
template <auto function>
struct Adapt;
template <typename... Args, std::uint32_t (*function)(w2c_havok*, Args...)>
struct Adapt<function> {
  static std::uint32_t call(w2c_havok* module, const Numbers& numbers) {
    return apply(module, numbers, std::index_sequence_for<Args...>());
  }
  template <size_t... i>
  static std::uint32_t apply(w2c_havok* module, const Numbers& numbers, std::index_sequence<i...>) {
    return function(module, number<Args>(numbers[i])...);
  }
};

constexpr Call kCalls[] = {
#define ASSAY_HAVOK_CALL(name) &Adapt<&w2c_havok_HP_##name>::call,
    ASSAY_HAVOK_FUNCTIONS(ASSAY_HAVOK_CALL)
#undef ASSAY_HAVOK_CALL
};

[[noreturn]] void fail(const char* function, std::uint32_t result) {
  throw EngineError(std::string(function) + " failed with " + std::to_string(result));
}

class NativeModule final : public Module {
 public:
  void call(Function function, std::initializer_list<Arg> arguments) override {
    Numbers numbers{};
    int slot = 0;
    for (const Arg& arg : arguments) {
      numbers.at(slot) = arg.bits;
      if (arg.kind == Arg::Kind::kIn) numbers.at(slot) = havok_.in_bytes(arg.source, arg.size, slot);
      if (arg.kind == Arg::Kind::kOut) numbers.at(slot) = havok_.out(slot);
      if (arg.kind == Arg::Kind::kArray) numbers.at(slot) = copied(arg);
      ++slot;
    }
    const auto index = static_cast<size_t>(function);
    try {
      const std::uint32_t result = kCalls[index](havok_, numbers);
      if (result != 0) fail(kFunctionNames[index], result);
    } catch (const havok::Error& error) {
      throw EngineError(error.what());
    }
    slot = 0;
    for (const Arg& arg : arguments) {
      if (arg.kind == Arg::Kind::kOut) havok_.out_bytes(arg.target, arg.size, slot);
      if (arg.kind == Arg::Kind::kArray) w2c_havok_free(havok_, static_cast<std::uint32_t>(numbers.at(slot)));
      ++slot;
    }
  }

  void step(havok::Id world, float timestep, int count) override {
    try {
      for (int i = 0; i < count; ++i) {
        const std::uint32_t result = w2c_havok_HP_World_Step(havok_, world, timestep);
        if (result != 0) fail("HP_World_Step", result);
      }
    } catch (const havok::Error& error) {
      throw EngineError(error.what());
    }
  }

 private:
  // An array's copy on the module's heap, until the end of the call.
  std::uint32_t copied(const Arg& arg) {
    const std::uint32_t address = w2c_havok_malloc(havok_, arg.size);
    if (address == 0) throw EngineError("Havok's heap has no room");
    const w2c_havok* const module = havok_;
    std::memcpy(module->w2c_memory.data + address, arg.source, arg.size);
    return address;
  }

  havok::Instance havok_;
};

}  // namespace

std::unique_ptr<Module> make_module() {
  try {
    return std::make_unique<NativeModule>();
  } catch (const havok::Error& error) {
    throw EngineError(error.what());
  }
}

BuildFacts build_facts() { return {ASSAY_BUILD_VERSION, ASSAY_BUILD_SOURCE, ASSAY_BUILD_COMPILER, ASSAY_BUILD_FLAGS}; }

std::vector<Contender> plugin_contenders() {
  return {{"havok", "Havok, its WebAssembly compiled to native code", {}},
          {"havok-default", "Havok's own default: a solver tuned for steps of 1/60 s", {{"ideal_step_time", 1.0 / 60}}},
          {"havok-native-pd", "Havok, joint springs by its own motors", {{"pd", std::string("native")}}}};
}

std::string plugin_note() { return ""; }

}  // namespace assay::havok_adapter
