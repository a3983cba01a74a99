// An OpenGL context without a window, by OSMesa (software) or EGL, whichever is installed. Both are loaded when they
// are wanted, so that nothing of assay needs them to start.
#pragma once

#include <memory>
#include <string>

namespace assay {

// Current in the thread that made it until it is destroyed. One at a time.
class GlContext {
 public:
  virtual ~GlContext() = default;
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  // OSMesa, else EGL; the other way round when the environment's MUJOCO_GL is "egl". Throws SystemError that says what
  // to install when there is neither.
  static std::unique_ptr<GlContext> make();

 protected:
  GlContext() = default;
};

}  // namespace assay
