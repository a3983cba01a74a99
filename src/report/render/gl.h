// An OpenGL context without a window, by OSMesa (software) or EGL, whichever is installed. Both are loaded on first
// use, so assay starts without them.
#pragma once

#include <memory>
#include <string>

namespace assay {

// The context is current in the thread that made it until it is destroyed. Only one may exist at a time.
class GlContext {
 public:
  virtual ~GlContext() = default;
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  // OSMesa, else EGL; in the reverse order when the environment's MUJOCO_GL is "egl". Throws SystemError, naming what
  // to install, when neither exists.
  static std::unique_ptr<GlContext> make();

 protected:
  GlContext() = default;
};

}  // namespace assay
