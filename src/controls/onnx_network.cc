#include "controls/onnx_network.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <dlfcn.h>
#include <filesystem>
#include <regex>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/paths.h"
#include "base/text.h"

namespace assay {
namespace {

// ---- ONNX Runtime's C interface: its package has the library without a header -----------------------------------------
// The library answers with a table of functions, of which the first 102 are version 1 of the interface and keep their
// places in all later ones. Those that are called here, by their places:

enum Place : size_t {
  kGetErrorMessage = 2,
  kCreateEnv = 3,
  kCreateSessionFromArray = 8,
  kRun = 9,
  kCreateSessionOptions = 10,
  kSetIntraOpNumThreads = 24,
  kSetInterOpNumThreads = 25,
  kSessionGetInputCount = 30,
  kSessionGetOutputCount = 31,
  kSessionGetInputTypeInfo = 33,
  kSessionGetOutputTypeInfo = 34,
  kSessionGetInputName = 36,
  kSessionGetOutputName = 37,
  kCreateTensorWithData = 49,
  kCastTypeInfoToTensorInfo = 55,
  kGetTensorElementType = 60,
  kGetDimensionsCount = 61,
  kGetDimensions = 62,
  kCreateCpuMemoryInfo = 69,
  kAllocatorFree = 76,
  kGetAllocatorWithDefaultOptions = 78,
  kReleaseStatus = 93,
  kReleaseMemoryInfo = 94,
  kReleaseSession = 95,
  kReleaseValue = 96,
  kReleaseTypeInfo = 98,
  kReleaseSessionOptions = 100,
};

using Table = void* const*;
struct Base {
  Table (*table)(std::uint32_t version);
  const char* (*version)();
};
constexpr std::uint32_t kTableVersion = 1;

// Its handles.
struct Status;
struct Environment;
struct Session;
struct SessionOptions;
struct Tensor;
struct TypeInfo;
struct TensorInfo;
struct MemoryInfo;
struct Allocator;

constexpr int kFatalOnly = 4;                  // of logging levels
constexpr int kArena = 1, kDefaultMemory = 0;  // kinds of allocators and of memory
constexpr int kFloat = 1, kDouble = 11;        // types of elements, as ONNX numbers them
constexpr std::array kElementTypes = {"undefined", "float",  "uint8",     "int8",       "uint16",  "int16",
                                      "int32",     "int64",  "string",    "bool",       "float16", "double",
                                      "uint32",    "uint64", "complex64", "complex128", "bfloat16"};

std::string library_path() {
  return (std::filesystem::path(cache_dir()) / "libraries" / ASSAY_ONNXRUNTIME / "onnxruntime" / "capi" /
          ASSAY_ONNXRUNTIME_FILE)
      .string();
}

// The library, loaded once a process, and its functions.
class Runtime {
 public:
  static const Runtime& instance() {
    static const Runtime kRuntime;
    return kRuntime;
  }

  // Throws InputError with the library's own words behind `what`.
  template <Place place, typename... Arguments>
  void call(const std::string& what, Arguments... arguments) const {
    const std::string error = try_call<place>(arguments...);
    if (!error.empty()) throw InputError(fmt::format("{}: {}", what, error));
  }

  // "" or the library's words.
  template <Place place, typename... Arguments>
  std::string try_call(Arguments... arguments) const {
    Status* status = reinterpret_cast<Status* (*)(Arguments...)>(table_[place])(arguments...);
    if (status == nullptr) return "";
    const std::string text = reinterpret_cast<const char* (*)(const Status*)>(table_[kGetErrorMessage])(status);
    release<kReleaseStatus>(status);
    return onnx_words(text);
  }

  template <Place place, typename Handle>
  void release(Handle* handle) const {
    reinterpret_cast<void (*)(Handle*)>(table_[place])(handle);
  }

  Environment* environment() const { return environment_; }

 private:
  Runtime() {
    const std::string path = library_path();
    std::error_code error;
    if (!std::filesystem::exists(path, error)) {
      throw InputError(fmt::format(
          "networks need ONNX Runtime, but '{}' is not there: fetch it with setup/setup.sh (Python package: "
          "assay.fetch())",
          path));
    }
    void* library = ::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    const auto base =
        library == nullptr ? nullptr : reinterpret_cast<const Base* (*)()>(::dlsym(library, "OrtGetApiBase"));
    if (base == nullptr) {
      const char* why = ::dlerror();
      throw SystemError(fmt::format("ONNX Runtime cannot be loaded: {}", why == nullptr ? path : why));
    }
    table_ = base()->table(kTableVersion);
    if (table_ == nullptr) throw SystemError(fmt::format("'{}' has no version 1 of its interface", path));
    call<kCreateEnv>("ONNX Runtime cannot be started", kFatalOnly, "assay", &environment_);
  }

  Table table_ = nullptr;
  Environment* environment_ = nullptr;  // for the whole process
};

// One handle of the library, released with this object.
template <typename T, Place release>
class Handle {
 public:
  Handle() = default;
  ~Handle() {
    if (handle_ != nullptr) Runtime::instance().release<release>(handle_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  T* get() const { return handle_; }
  T** into() { return &handle_; }

 private:
  T* handle_ = nullptr;
};

// An input or output of a network.
struct Port {
  std::string name;
  int type = 0;
  std::vector<std::int64_t> shape;  // -1: not fixed

  // "float [1, ?, 29]"
  std::string text() const {
    std::vector<std::string> sizes;
    sizes.reserve(shape.size());
    for (const std::int64_t size : shape) sizes.push_back(size < 0 ? "?" : std::to_string(size));
    const auto known = static_cast<size_t>(type) < kElementTypes.size();
    return fmt::format("{} [{}]", known ? kElementTypes[static_cast<size_t>(type)] : "another type", join(sizes, ", "));
  }
};

class OnnxNetwork final : public ActionSource {
 public:
  OnnxNetwork(const std::string& bytes, const std::string& path, const PolicyConfig& config)
      : runtime_(Runtime::instance()) {
    const std::string unusable = fmt::format("the network '{}' cannot be used", path);
    Handle<SessionOptions, kReleaseSessionOptions> options;
    runtime_.call<kCreateSessionOptions>(unusable, options.into());
    runtime_.call<kSetIntraOpNumThreads>(unusable, options.get(), 1);
    runtime_.call<kSetInterOpNumThreads>(unusable, options.get(), 1);
    const std::string error = runtime_.try_call<kCreateSessionFromArray>(
        runtime_.environment(), static_cast<const void*>(bytes.data()), bytes.size(), options.get(), session_.into());
    if (!error.empty()) throw InputError(fmt::format("{}: {}: export it as ONNX again", unusable, error));
    const std::vector<Port> inputs = ports<kSessionGetInputCount, kSessionGetInputName, kSessionGetInputTypeInfo>();
    const std::vector<Port> outputs = ports<kSessionGetOutputCount, kSessionGetOutputName, kSessionGetOutputTypeInfo>();
    if (inputs.size() != 1) {
      throw InputError(
          fmt::format("the network '{}' has {} inputs ({}), but a policy gets one observation: export it "
                      "with one input",
                      path, inputs.size(), names(inputs)));
    }
    input_ = inputs.front();
    output_ = chosen(outputs, path, config);
    fit(input_, config.inputs(), path, "input", input_meaning(config));
    fit(output_, config.joints.size(), path, "output",
        fmt::format("the configuration '{}' has {}", config.path, counted(config.joints.size(), "action")));
    make_tensor(input_, in_, in_float_, in_value_);
    make_tensor(output_, out_, out_float_, out_value_);
  }

  void act(std::span<const double> observation, std::span<double> actions) override {
    for (size_t i = 0; i < observation.size(); ++i) {
      if (input_.type == kFloat) {
        in_float_[i] = static_cast<float>(observation[i]);
      } else {
        in_[i] = observation[i];
      }
    }
    const char* input = input_.name.c_str();
    const char* output = output_.name.c_str();
    const Tensor* in = in_value_.get();
    Tensor* out = out_value_.get();
    const std::string error = runtime_.try_call<kRun>(session_.get(), static_cast<const void*>(nullptr), &input, &in,
                                                      size_t{1}, &output, size_t{1}, &out);
    if (!error.empty()) throw PolicyError(fmt::format("the policy's network failed: {}", error));
    for (size_t i = 0; i < actions.size(); ++i) {
      actions[i] = output_.type == kFloat ? static_cast<double>(out_float_[i]) : out_[i];
    }
  }

 private:
  // What the library says of all inputs or all outputs.
  template <Place count, Place name, Place type>
  std::vector<Port> ports() const {
    const std::string what = "the network's inputs and outputs cannot be read";
    Allocator* allocator = nullptr;
    runtime_.call<kGetAllocatorWithDefaultOptions>(what, &allocator);
    size_t size = 0;
    runtime_.call<count>(what, static_cast<const Session*>(session_.get()), &size);
    std::vector<Port> all(size);
    for (size_t i = 0; i < size; ++i) {
      char* text = nullptr;
      runtime_.call<name>(what, static_cast<const Session*>(session_.get()), i, allocator, &text);
      all[i].name = text;
      runtime_.call<kAllocatorFree>(what, allocator, static_cast<void*>(text));
      Handle<TypeInfo, kReleaseTypeInfo> info;
      runtime_.call<type>(what, static_cast<const Session*>(session_.get()), i, info.into());
      const TensorInfo* tensor = nullptr;
      runtime_.call<kCastTypeInfoToTensorInfo>(what, static_cast<const TypeInfo*>(info.get()), &tensor);
      if (tensor == nullptr) continue;  // a sequence or a map
      runtime_.call<kGetTensorElementType>(what, tensor, &all[i].type);
      size_t rank = 0;
      runtime_.call<kGetDimensionsCount>(what, tensor, &rank);
      all[i].shape.resize(rank);
      runtime_.call<kGetDimensions>(what, tensor, all[i].shape.data(), rank);
    }
    return all;
  }

  static std::string names(const std::vector<Port>& ports) {
    std::vector<std::string> names;
    names.reserve(ports.size());
    for (const Port& port : ports) names.push_back(port.name);
    return join(names, ", ");
  }

  static Port chosen(const std::vector<Port>& outputs, const std::string& path, const PolicyConfig& config) {
    if (config.output.empty() && outputs.size() == 1) return outputs.front();
    for (const Port& output : outputs) {
      if (output.name == config.output) return output;
    }
    if (config.output.empty()) {
      throw InputError(
          fmt::format("the network '{}' has {} outputs ({}): say which has the actions with output = "
                      "\"...\" in '{}'",
                      path, outputs.size(), names(outputs), config.path));
    }
    throw InputError(fmt::format("the network '{}' has no output '{}', which '{}' names: it has {}", path,
                                 config.output, config.path, names(outputs)));
  }

  static std::string input_meaning(const PolicyConfig& config) {
    std::string text =
        fmt::format("the observation of the configuration '{}' has {}", config.path, config.observations());
    if (config.history > 1) text += fmt::format(" times a history of {}", config.history);
    return text;
  }

  // Throws when the port is no tensor of `size` numbers. Its shape becomes fixed.
  static void fit(Port& port, size_t size, const std::string& path, const std::string& what, const std::string& other) {
    if (port.type != kFloat && port.type != kDouble) {
      throw InputError(fmt::format("the {} '{}' of the network '{}' is {}: export it as float", what, port.name, path,
                                   port.type == 0 ? "no tensor" : port.text()));
    }
    const std::string had = port.text();
    if (port.shape.size() > 1 && port.shape.front() < 0) port.shape.front() = 1;
    std::uint64_t product = 1;
    bool fixed = true;
    constexpr std::int64_t kMostElements = 1 << 20;
    for (const std::int64_t each : port.shape) {
      fixed = fixed && each >= 0;
      product *= static_cast<std::uint64_t>(std::clamp<std::int64_t>(each, 0, kMostElements));
      product = std::min<std::uint64_t>(product, kMostElements);
    }
    if (!fixed) {
      throw InputError(
          fmt::format("the {} '{}' of the network '{}' is {}, whose size is not fixed: export it with "
                      "fixed sizes (only a first dimension may be dynamic)",
                      what, port.name, path, had));
    }
    if (product != size) {
      throw InputError(
          fmt::format("the {} '{}' of the network '{}' is {}, which is {} numbers, but {}: mend the "
                      "configuration, or take the network that belongs to it",
                      what, port.name, path, had, product, other));
    }
  }

  // A tensor over a buffer of ours.
  void make_tensor(const Port& port, std::vector<double>& doubles, std::vector<float>& floats,
                   Handle<Tensor, kReleaseValue>& value) {
    size_t size = 1;
    for (const std::int64_t each : port.shape) size *= static_cast<size_t>(each);
    const std::string what = "a tensor cannot be made";
    Handle<MemoryInfo, kReleaseMemoryInfo> memory;
    runtime_.call<kCreateCpuMemoryInfo>(what, kArena, kDefaultMemory, memory.into());
    void* data = nullptr;
    size_t bytes = 0;
    if (port.type == kFloat) {
      floats.assign(size, 0);
      data = floats.data();
      bytes = size * sizeof(float);
    } else {
      doubles.assign(size, 0);
      data = doubles.data();
      bytes = size * sizeof(double);
    }
    runtime_.call<kCreateTensorWithData>(what, static_cast<const MemoryInfo*>(memory.get()), data, bytes,
                                         port.shape.data(), port.shape.size(), port.type, value.into());
  }

  const Runtime& runtime_;
  Handle<Session, kReleaseSession> session_;
  Port input_, output_;
  std::vector<double> in_, out_;
  std::vector<float> in_float_, out_float_;
  Handle<Tensor, kReleaseValue> in_value_, out_value_;
};

}  // namespace

std::string onnx_words(const std::string& message) {
  static const std::regex kBlanks("\\s+"),
      kCode("\\[ONNXRuntimeError\\] : \\d+ : \\w+ : |Exception during initialization: "),
      kPlace("\\S+\\.(?:cc|cpp|cu|h|hpp):\\d+ ");
  std::string text = std::regex_replace(std::regex_replace(message, kBlanks, " "), kCode, "");
  for (std::smatch place; std::regex_search(text, place, kPlace);) {
    const auto begin = static_cast<size_t>(place.position());
    size_t end = begin + static_cast<size_t>(place.length());
    const size_t opens = std::min(text.find('(', end), text.size());
    if (text.substr(end, opens - end).find("::") != std::string::npos) {  // a signature
      int depth = 0;
      for (end = opens; end < text.size(); ++end) {
        if (text[end] == '(') ++depth;
        if (text[end] == ')' && --depth == 0) break;
      }
      end = std::min(end + 1, text.size());
      if (text.compare(end, 6, " const") == 0) end += 6;
      if (text.compare(end, 7, " [with ") == 0) end = std::min(text.find(']', end), text.size() - 1) + 1;
    } else {  // a name
      end = std::min(text.find(' ', end), text.size());
    }
    text.erase(begin, std::min(end + 1, text.size()) - begin);
  }
  while (text.ends_with('.') || text.ends_with(' ')) text.pop_back();  // the caller's sentence goes on
  static const std::regex kCxx("\\w::|\\w\\(\\) |std::");
  return text.empty() || std::regex_search(text, kCxx) ? "its graph is not valid" : text;
}

bool has_onnx_runtime() {
  std::error_code error;
  return std::filesystem::exists(library_path(), error);
}

std::unique_ptr<ActionSource> onnx_network(const std::string& bytes, const std::string& path,
                                           const PolicyConfig& config) {
  return std::make_unique<OnnxNetwork>(bytes, path, config);
}

}  // namespace assay
