// Texts of MuJoCo's editable models.
#pragma once

#include <string>

#include <mujoco/mujoco.h>

namespace assay {

inline std::string spec_text(const mjString* string) {
  const char* value = string == nullptr ? nullptr : mjs_getString(string);
  return value == nullptr ? "" : value;
}

}  // namespace assay
