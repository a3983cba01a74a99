// What MuJoCo's editable models say in texts.
#pragma once

#include <filesystem>
#include <string>

#include <mujoco/mujoco.h>

#include "base/text.h"

namespace assay {

inline std::string spec_text(const mjString* string) {
  const char* value = string == nullptr ? nullptr : mjs_getString(string);
  return value == nullptr ? "" : value;
}

// The line of an element whose `info` this is: the parser writes "line 12"; 0 where it says nothing.
inline int spec_line(const mjString* info) {
  const std::string words = spec_text(info);
  if (!words.starts_with("line ")) return 0;
  const size_t end = words.find_first_not_of("0123456789", 5);
  return static_cast<int>(parse_integer(words.substr(5, end == std::string::npos ? end : end - 5)).value_or(0));
}

// The name of the model asset that an element was attached from; empty for an element of the model's own files.
inline std::string spec_origin(const mjSpec* spec, const mjsElement* element) {
  const mjSpec* origin = mjs_getOriginSpec(element);
  return origin == nullptr || origin == spec ? "" : spec_text(origin->modelname);
}

// The file of a mesh that MuJoCo would open; `folder` is the model's. Empty where the mesh has none.
inline std::filesystem::path spec_mesh_path(const mjSpec* spec, const mjsMesh* mesh, const std::string& folder) {
  std::filesystem::path file = spec_text(mesh->file);
  if (file.empty() || file.is_absolute()) return file;
  return (std::filesystem::path(folder) / spec_text(spec->compiler.meshdir) / file).lexically_normal();
}

}  // namespace assay
