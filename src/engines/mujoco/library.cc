#include "library.h"

#include <new>
#include <string_view>

#include <fmt/format.h>

#include "base/errors.h"
#include "release.h"

namespace assay::mujoco {
namespace {

// MuJoCo's own handler ends the process on an error, prints, and writes a log file. Here errors become exceptions (it
// is built with unwind tables), and warnings are read from mjData, where they are counted.
void on_error(const char* message) {
  // An outcome of the machine and not of the model: "could not allocate mjData buffer", "Could not allocate memory".
  if (std::string_view(message).find("ould not allocate") != std::string_view::npos) throw std::bad_alloc();
  throw EngineError(fmt::format("MuJoCo: {}", one_line(message)));
}

}  // namespace

void initialise_library() { handle_errors<on_error>(); }

std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  for (size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at)) text.replace(at, 1, "; ");
  return text;
}

}  // namespace assay::mujoco
