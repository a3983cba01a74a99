// Devices that batches can run on. The CUDA driver is asked through its own library, which is loaded when a GPU is
// asked for: no engine needs to be there, and a machine without one loses nothing.
#include <array>
#include <cstddef>
#include <dlfcn.h>
#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "engines/batch.h"

namespace assay {
namespace {

constexpr std::string_view kCuda = "cuda:";

// The number of a GPU; nothing for "cpu". Throws InputError for anything else.
std::optional<int> gpu_of(const std::string& device) {
  if (device == "cpu") return std::nullopt;
  constexpr int kMostGpus = 64;
  const auto number = device.starts_with(kCuda) ? parse_integer(std::string_view(device).substr(kCuda.size()))
                                                : std::optional<long long>();
  if (!number || *number < 0 || *number >= kMostGpus) {
    throw InputError(fmt::format("'{}' is no device: give cpu, or cuda:0 for the first GPU", device));
  }
  return static_cast<int>(*number);
}

// The CUDA driver's functions that are used here; CUresult 0 is success (CUDA Driver API, cuda.h).
class CudaDriver {
 public:
  CudaDriver() : library_(::dlopen("libcuda.so.1", RTLD_NOW | RTLD_LOCAL)) {
    if (library_ == nullptr || !call<int (*)(unsigned)>("cuInit", 0U)) return;
    if (!call<int (*)(int*)>("cuDeviceGetCount", &count_)) count_ = 0;
  }

  int count() const { return count_; }
  bool is_there() const { return library_ != nullptr; }

  std::string name(int gpu) const {
    std::array<char, 256> text{};
    int handle = 0;
    const bool known =
        call<int (*)(int*, int)>("cuDeviceGet", &handle, gpu) &&
        call<int (*)(char*, int, int)>("cuDeviceGetName", text.data(), static_cast<int>(text.size() - 1), handle);
    return known ? text.data() : "a GPU";
  }

  // "CUDA 12.8": the newest that the driver supports.
  std::string version() const {
    int number = 0;
    if (!call<int (*)(int*)>("cuDriverGetVersion", &number)) return "";
    return fmt::format("CUDA {}.{}", number / 1000, number % 1000 / 10);
  }

 private:
  template <typename Function, typename... Arguments>
  bool call(const char* name, Arguments... arguments) const {
    auto* const function = reinterpret_cast<Function>(::dlsym(library_, name));
    return function != nullptr && function(arguments...) == 0;
  }

  void* library_;  // stays loaded
  int count_ = 0;
};

const CudaDriver& driver() {
  static const CudaDriver kDriver;
  return kDriver;
}

}  // namespace

void require_device(const std::string& device) {
  const std::optional<int> gpu = gpu_of(device);
  if (!gpu || *gpu < driver().count()) return;
  const std::string advice = "leave --device out to measure on the processor";
  if (!driver().is_there()) {
    throw InputError(
        fmt::format("'{}' is not there: this machine has no CUDA driver (libcuda.so.1); {}", device, advice));
  }
  throw InputError(fmt::format("'{}' is not there: the CUDA driver knows {}; {}", device,
                               driver().count() == 0 ? "no GPU" : fmt::format("{} GPUs, from cuda:0", driver().count()),
                               advice));
}

DeviceFacts device_facts(const std::string& device) {
  const std::optional<int> gpu = gpu_of(device);
  if (!gpu) return {};
  return {driver().name(*gpu), driver().version()};
}

}  // namespace assay
