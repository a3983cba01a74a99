#include "library.h"

#include <array>
#include <cstdarg>
#include <cstdio>
#include <mutex>
#include <string>

#include "base/errors.h"

namespace assay::ode {

thread_local long long lcp_failures = 0;

namespace {

std::string formatted(const char* text, va_list arguments) {
  std::array<char, 512> buffer{};
  std::vsnprintf(buffer.data(), buffer.size(), text, arguments);
  return buffer.data();
}

// Errors and failed assertions must not return to ODE. It is built with unwind tables, so they can be exceptions.
[[noreturn]] void on_error(int number, const char* text, va_list arguments) {
  throw EngineError("ODE error " + std::to_string(number) + ": " + formatted(text, arguments));
}

// The other messages say that ODE replaced an input, for example a singular inertia by the identity.
void on_message(int number, const char* text, va_list arguments) {
  if (number != d_ERR_LCP) on_error(number, text, arguments);
  ++lcp_failures;
}

}  // namespace

void initialise_library() {
  static std::once_flag once;
  std::call_once(once, [] {
    dSetErrorHandler(on_error);
    dSetDebugHandler(on_error);
    dSetMessageHandler(on_message);
    if (dInitODE2(0) == 0) throw EngineError("ODE's initialisation (dInitODE2) failed");
    if (dCheckConfiguration("ODE_double_precision") == 0) {
      throw EngineError(std::string("this ODE is not built in double precision: ") + dGetConfiguration());
    }
  });
  if (dAllocateODEDataForThread(dAllocateMaskAll) == 0) throw EngineError("ODE's thread data could not be allocated");
}

bool has_libccd() {
  static const bool has = [] {
    initialise_library();
    dxGeom* a = dCreateCylinder(nullptr, 1, 1);
    dxGeom* b = dCreateCylinder(nullptr, 1, 1);
    dGeomSetPosition(b, 0.5, 0, 0);
    dContactGeom contact;
    const bool found = dCollide(a, b, 1, &contact, sizeof contact) > 0;
    dGeomDestroy(a);
    dGeomDestroy(b);
    return found;
  }();
  return has;
}

}  // namespace assay::ode
