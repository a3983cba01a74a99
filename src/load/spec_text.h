// What MuJoCo's editable models say in texts.
#pragma once

#include <filesystem>
#include <string>

#include <mujoco/mujoco.h>

#include "base/text.h"
#include "load/outside_files.h"

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

// The spec of the file that an element was written in: the model's, or that of the model asset that it was attached
// from. Each has a folder and a compiler of its own.
inline const mjSpec* origin_of(const mjSpec* spec, const mjsElement* element) {
  const mjSpec* origin = mjs_getOriginSpec(element);
  return origin == nullptr ? spec : origin;
}

// The name of the model asset that an element was attached from; empty for an element of the model's own files.
inline std::string spec_origin(const mjSpec* spec, const mjsElement* element) {
  const mjSpec* origin = origin_of(spec, element);
  return origin == spec ? "" : spec_text(origin->modelname);
}

// The file of a mesh or a height field that MuJoCo would open; `folder` is the model's. Empty where it has none.
template <typename Asset>
std::filesystem::path spec_mesh_path(const mjSpec* spec, const Asset* asset, const std::string& folder) {
  const std::string file = spec_text(asset->file);
  if (file.empty()) return file;
  const mjSpec* origin = origin_of(spec, asset->element);
  const std::string own = spec_text(origin->modelfiledir);
  const std::string name = spec->strippath ? file.substr(file.find_last_of("/\\") + 1) : file;
  return joined_path(joined_path(own.empty() ? folder : own, spec_text(origin->compiler.meshdir)), name);
}

}  // namespace assay
