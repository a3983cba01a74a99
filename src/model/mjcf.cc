#include "model/mjcf.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/paths.h"
#include "model/capsules.h"
#include "model/mujoco_messages.h"
#include "model/translation.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

// The file's bytes. Throws InputError when the file cannot be read.
std::string read_text(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) throw InputError(fmt::format("there is no file '{}'; check the path", path));
  if (fs::is_directory(status)) {
    throw InputError(fmt::format("'{}' is a folder; name an .xml (MJCF) or .urdf file in it", path));
  }
  if (!fs::is_regular_file(status))
    throw InputError(fmt::format("'{}' is not a file; name an .xml or .urdf file", path));
  std::ifstream stream(path, std::ios::binary);
  std::string text;
  std::array<char, 1 << 16> block = {};
  while (stream.read(block.data(), block.size()) || stream.gcount() > 0) {
    text.append(block.data(), static_cast<size_t>(stream.gcount()));
  }
  if (!stream.eof()) throw InputError(fmt::format("'{}' cannot be read; check its permissions", path));
  return text;
}

// URDF elements that MuJoCo's parser ignores.
void note_urdf(const std::string& text, Model& model) {
  if (text.find("<robot") == std::string::npos) return;
  for (const auto& [needle, what] :
       {std::pair{"velocity=", "velocity limits"}, std::pair{"<transmission", "transmissions"},
        std::pair{"<gazebo", "gazebo extensions"}}) {
    if (text.find(needle) != std::string::npos) {
      model.notes.push_back(fmt::format("{} of the URDF file are left out: MuJoCo's parser does not read them", what));
    }
  }
}

// `parse` calls one of MuJoCo's parsers with a buffer for its message. `text` is what it parses.
template <typename Parse>
LoadReport load(const std::string& stem, const std::string& text, const LoadOptions& options, Parse parse) {
  LoadReport report;
  if (text.find_first_not_of(" \t\r\n") == std::string::npos) {
    report.refuse("it is empty; an MJCF or URDF model is expected");
    return report;
  }
  const MessageGuard guard;
  std::array<char, 2000> error = {};
  const SpecPtr spec(parse(error.data(), static_cast<int>(error.size())));
  if (spec == nullptr) {
    report.refuse(fmt::format("MuJoCo cannot parse it: {}", one_line(error.data())));
    return report;
  }
  for (const std::string& warning : MessageGuard::warnings()) {
    if (warning.find("NaN") != std::string::npos) {
      report.refuse("it contains a number that is NaN", "replace it");
      return report;
    }
  }

  // static bodies are fused here, where shapes keep their lines and names
  spec->compiler.fusestatic = false;
  spec->compiler.usethread = false;
  const CompiledPtr compiled(mj_compile(spec.get(), nullptr));
  if (compiled == nullptr) {
    report.refuse(fmt::format("MuJoCo cannot compile it: {}", one_line(mjs_getError(spec.get()))));
    return report;
  }
  report = translate({.spec = spec.get(),
                      .compiled = compiled.get(),
                      .drop_unsupported = options.drop_unsupported,
                      .keyframe = options.keyframe,
                      .massless = {}});
  if (!report.model) return report;
  Model& model = *report.model;

  const std::string own_name = mjs_getString(spec->modelname);
  model.name = own_name.empty() || own_name == "MuJoCo Model" ? stem : own_name;
  for (int i = 0; i < mjs_numWarnings(spec.get()); ++i) {
    model.notes.push_back(fmt::format("MuJoCo warns: {}", one_line(mjs_getWarning(spec.get(), i))));
  }
  for (const std::string& warning : MessageGuard::warnings()) {
    model.notes.push_back(fmt::format("MuJoCo warns: {}", one_line(warning)));
  }
  note_urdf(text, model);
  model.hash = model_hash(model);
  return report;
}

Model required(LoadReport report, const std::string& file) {
  if (report.model) return std::move(*report.model);
  std::vector<std::string> texts;
  for (const Problem& problem : report.problems) {
    if (problem.severity == Severity::kRefused) texts.push_back(problem_text(problem));
  }
  const std::string first = fmt::format("{}: {}", file, texts.front());
  if (texts.size() == 1) throw InputError(first);
  throw InputError(fmt::format("{} (and {} more; `assay check {}` lists all)", first, texts.size() - 1, file));
}

}  // namespace

LoadReport inspect_model(const std::string& path, const LoadOptions& options) {
  const std::optional<int> capsules = capsules_count(fs::path(path).stem().string());
  std::error_code error;
  LoadReport report;
  if (capsules && !fs::exists(path, error)) {
    report = inspect_model_text(capsules_mjcf(*capsules), path, options);
  } else {
    report = load(fs::path(path).stem().string(), read_text(path), options,
                  [&](char* message, int size) { return mj_parseXML(path.c_str(), nullptr, message, size); });
  }
  if (report.model) report.model->source = path;
  return report;
}

LoadReport inspect_model_text(const std::string& xml, const std::string& name, const LoadOptions& options) {
  return load(name, xml, options,
              [&](char* error, int size) { return mj_parseXMLString(xml.c_str(), nullptr, error, size); });
}

Model load_model(const std::string& path, const LoadOptions& options) {
  return required(inspect_model(path, options), path);
}

Model load_model_text(const std::string& xml, const std::string& name, const LoadOptions& options) {
  return required(inspect_model_text(xml, name, options), name);
}

}  // namespace assay
