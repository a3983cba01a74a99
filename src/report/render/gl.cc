#include "report/render/gl.h"

#include <array>
#include <cstdlib>
#include <dlfcn.h>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"

namespace assay {
namespace {

// Stays loaded: MuJoCo keeps pointers into it.
class Library {
 public:
  explicit Library(const char* name) : handle_(dlopen(name, RTLD_NOW | RTLD_GLOBAL)) {}
  explicit operator bool() const { return handle_ != nullptr; }
  template <typename Function>
  Function* find(const char* name) const {
    return reinterpret_cast<Function*>(dlsym(handle_, name));  // NOLINT(*-reinterpret-cast): what dlsym is for
  }

 private:
  void* handle_;
};

// MuJoCo reads from this variable which library's functions it has to load.
void choose(const char* library) { ::setenv("MUJOCO_GL", library, 1); }

// Names and numbers below are those of GL/osmesa.h and EGL/egl.h; so few do not justify depending on the headers.

class OsMesa final : public GlContext {
 public:
  static std::unique_ptr<GlContext> make(std::string& why) {
    const Library library("libOSMesa.so.8");
    if (!library) {
      why = "libOSMesa.so.8 is not installed";
      return nullptr;
    }
    constexpr unsigned kRgba = 0x1908, kUnsignedByte = 0x1401;
    constexpr int kDepthBits = 24, kStencilBits = 8;
    auto* create = library.find<void*(unsigned, int, int, int, void*)>("OSMesaCreateContextExt");
    auto* make_current = library.find<unsigned char(void*, void*, unsigned, int, int)>("OSMesaMakeCurrent");
    auto* destroy = library.find<void(void*)>("OSMesaDestroyContext");
    if (create == nullptr || make_current == nullptr || destroy == nullptr) {
      why = "libOSMesa.so.8 lacks its functions";
      return nullptr;
    }
    std::unique_ptr<OsMesa> made(new OsMesa(destroy));
    made->context_ = create(kRgba, kDepthBits, kStencilBits, 0, nullptr);
    // MuJoCo draws into a buffer of its own; this one only has to exist.
    if (made->context_ == nullptr ||
        make_current(made->context_, made->window_.data(), kUnsignedByte, kWindowSide, kWindowSide) == 0) {
      why = "OSMesa makes no context";
      return nullptr;
    }
    choose("osmesa");
    return made;
  }
  OsMesa(const OsMesa&) = delete;
  OsMesa& operator=(const OsMesa&) = delete;
  ~OsMesa() override {
    if (context_ != nullptr) destroy_(context_);
  }

 private:
  explicit OsMesa(void (*destroy)(void*)) : destroy_(destroy) {}
  static constexpr int kWindowSide = 16;
  std::array<unsigned char, size_t{4} * kWindowSide * kWindowSide> window_{};
  void (*destroy_)(void*);
  void* context_ = nullptr;
};

class Egl final : public GlContext {
 public:
  static std::unique_ptr<GlContext> make(std::string& why) {
    const Library library("libEGL.so.1");
    if (!library) {
      why = "libEGL.so.1 is not installed";
      return nullptr;
    }
    auto* get_display = library.find<void*(void*)>("eglGetDisplay");
    auto* get_address = library.find<void*(const char*)>("eglGetProcAddress");
    auto* initialize = library.find<unsigned(void*, int*, int*)>("eglInitialize");
    auto* choose_config = library.find<unsigned(void*, const int*, void**, int, int*)>("eglChooseConfig");
    auto* bind_api = library.find<unsigned(unsigned)>("eglBindAPI");
    auto* create = library.find<void*(void*, void*, void*, const int*)>("eglCreateContext");
    auto* make_current = library.find<unsigned(void*, void*, void*, void*)>("eglMakeCurrent");
    if (get_display == nullptr || get_address == nullptr || initialize == nullptr || choose_config == nullptr ||
        bind_api == nullptr || create == nullptr || make_current == nullptr) {
      why = "libEGL.so.1 lacks its functions";
      return nullptr;
    }
    constexpr unsigned kOpenGl = 0x30A2, kPlatformDevice = 0x313F, kPlatformSurfaceless = 0x31DD;
    std::unique_ptr<Egl> made(new Egl());
    // Devices first, then Mesa without a surface, then the default display.
    using QueryDevices = unsigned(int, void**, int*);
    using GetPlatformDisplay = void*(unsigned, void*, const int*);
    auto* query_devices = reinterpret_cast<QueryDevices*>(get_address("eglQueryDevicesEXT"));  // NOLINT(*-cast)
    auto* platform_display =
        reinterpret_cast<GetPlatformDisplay*>(get_address("eglGetPlatformDisplayEXT"));  // NOLINT(*-cast)
    std::vector<void*> displays;
    if (platform_display != nullptr) {
      std::array<void*, 16> devices{};
      int count = 0;
      if (query_devices != nullptr && query_devices(static_cast<int>(devices.size()), devices.data(), &count) != 0) {
        for (int i = 0; i < count; ++i) {
          displays.push_back(platform_display(kPlatformDevice, devices.at(static_cast<size_t>(i)), nullptr));
        }
      }
      displays.push_back(platform_display(kPlatformSurfaceless, nullptr, nullptr));
    }
    displays.push_back(get_display(nullptr));
    constexpr int kNone = 0x3038, kSurfaceType = 0x3033, kPbuffer = 0x0001, kRenderable = 0x3040, kOpenGlBit = 0x0008;
    const std::array attributes = {kSurfaceType, kPbuffer, kRenderable, kOpenGlBit, kNone};
    for (void* display : displays) {
      int major = 0, minor = 0, count = 0;
      void* config = nullptr;
      if (display == nullptr || initialize(display, &major, &minor) == 0) continue;
      if (choose_config(display, attributes.data(), &config, 1, &count) == 0 || count == 0) continue;
      if (bind_api(kOpenGl) == 0) continue;
      void* context = create(display, config, nullptr, nullptr);
      if (context == nullptr || make_current(display, nullptr, nullptr, context) == 0) continue;
      made->display_ = display;
      made->context_ = context;
      made->make_current_ = make_current;
      made->destroy_ = library.find<unsigned(void*, void*)>("eglDestroyContext");
      choose("egl");
      return made;
    }
    why = "EGL has no device that draws OpenGL";
    return nullptr;
  }
  Egl(const Egl&) = delete;
  Egl& operator=(const Egl&) = delete;
  ~Egl() override {
    if (context_ == nullptr) return;
    make_current_(display_, nullptr, nullptr, nullptr);
    if (destroy_ != nullptr) destroy_(display_, context_);
  }

 private:
  Egl() = default;
  void *display_ = nullptr, *context_ = nullptr;
  unsigned (*make_current_)(void*, void*, void*, void*) = nullptr;
  unsigned (*destroy_)(void*, void*) = nullptr;
};

}  // namespace

std::unique_ptr<GlContext> GlContext::make() {
  const char* wish = std::getenv("MUJOCO_GL");
  std::string why_osmesa, why_egl;
  std::unique_ptr<GlContext> made;
  if (wish != nullptr && std::string_view(wish) == "egl") made = Egl::make(why_egl);
  if (!made) made = OsMesa::make(why_osmesa);
  if (!made && why_egl.empty()) made = Egl::make(why_egl);
  if (made) return made;
  throw SystemError(
      fmt::format("pictures need OSMesa or EGL ({}; {}): install one of them, as Debian's libosmesa6 or libegl1",
                  why_osmesa, why_egl));
}

}  // namespace assay
