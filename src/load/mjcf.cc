#include "load/mjcf.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/paths.h"
#include "isolate/activity.h"
#include "load/adapt_spec.h"
#include "load/capsules.h"
#include "load/drawing.h"
#include "load/mesh_facts.h"
#include "load/mjcf_document.h"
#include "load/mujoco_messages.h"
#include "load/outside_files.h"
#include "load/parser_faults.h"
#include "load/repair.h"
#include "load/sdf.h"
#include "load/start.h"
#include "load/translation.h"
#include "load/urdf.h"
#include "load/usd.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

// MuJoCo puts the folder of a relative path twice before the assets of a file that it includes from another folder, and
// takes ".." for the folder above whatever links there are.
mjSpec* parse_file(const std::string& path, char* message, int size) {
  const fs::path file = model_folder(path) / fs::path(path).filename();
  return mj_parseXML(file.c_str(), nullptr, message, size);
}

using Texts = std::map<std::string, std::string>;  // of files, by path

// The same with another text in place of that file's, and others in place of those that it includes.
mjSpec* parse_as_file(const std::string& text, const std::string& path, const Texts& included, char* message,
                      int size) {
  if (path.empty()) return mj_parseXMLString(text.c_str(), nullptr, message, size);
  const fs::path file = model_folder(path) / fs::path(path).filename();
  mjVFS vfs;
  mj_defaultVFS(&vfs);
  mj_addBufferVFS(&vfs, file.c_str(), text.data(), static_cast<int>(text.size()));
  for (const auto& [name, other] : included) {
    mj_addBufferVFS(&vfs, name.c_str(), other.data(), static_cast<int>(other.size()));
  }
  mjSpec* spec = mj_parseXML(file.c_str(), &vfs, message, size);
  mj_deleteVFS(&vfs);
  return spec;
}

// Formats that people have beside MJCF and URDF, by their root element.
bool refuse_other_format(const std::string& root, LoadReport& report) {
  static const std::map<std::string, std::string> kOthers = {
      {"COLLADA", "a COLLADA mesh; name the URDF, SDF or MJCF file that uses it"},
      {"world", "a world file; name the URDF or MJCF file of the robot"},
      {"package", "a package.xml; name the URDF file of that package"},
      {"launch", "a launch file; name the URDF or MJCF file of the robot"}};
  const auto found = kOthers.find(root);
  if (found == kOthers.end()) return false;
  report.refuse(fmt::format("it is not MJCF, URDF or SDF but {}", found->second));
  return true;
}

// MuJoCo's parser keeps no lines of a URDF document. A shape gets its link's.
void add_urdf_lines(const Model& model, const UrdfDocument& urdf, std::map<std::string, int>& lines) {
  lines = urdf.lines;
  for (const Shape& shape : model.shapes) {
    if (shape.body == kWorld) continue;
    const auto link = lines.find(fmt::format("body '{}'", model.bodies[shape.body].name));
    if (link != lines.end()) lines.emplace(fmt::format("geom '{}'", shape.name), link->second);
  }
}

// Fills in the places of problems about included files. An element without a name is where its body is.
void place_problems(const std::map<std::string, IncludedPlace>& included, std::vector<Problem>& problems) {
  for (Problem& problem : problems) {
    if (problem.line > 0) continue;
    const size_t kind = problem.element.find("body '");
    const size_t from = kind == std::string::npos || included.contains(problem.element) ? 0 : kind;
    const auto place = included.find(problem.element.substr(from));
    if (place == included.end()) continue;
    problem.line = place->second.line;
    problem.file = place->second.file;
  }
}

// The same for the model's elements, and of their meshes.
void place_facts(const std::map<std::string, IncludedPlace>& included, const Model& model, FileFacts& facts) {
  const auto put = [&facts](const std::string& label, const IncludedPlace& place) {
    facts.lines[label] = place.line;
    facts.files[label] = place.file;
  };
  for (const auto& [label, place] : included) put(label, place);
  const auto put_with_body = [&](const char* kind, const std::string& name, int body) {
    const std::string label = fmt::format("{} '{}'", kind, name);
    if (body == kWorld || facts.lines.contains(label)) return;
    const auto place = included.find(fmt::format("body '{}'", model.bodies[body].name));
    if (place != included.end()) put(label, place->second);
  };
  for (const Joint& joint : model.joints) put_with_body("joint", joint.name, joint.body);
  for (const BallJoint& ball : model.balls) put_with_body("joint", ball.name, ball.body);
  for (const Shape& shape : model.shapes) put_with_body("geom", shape.name, shape.body);
  for (MeshFacts& mesh : facts.meshes) {
    const auto place = included.find(fmt::format("mesh '{}'", mesh.name));
    if (mesh.line > 0 || place == included.end()) continue;
    mesh.line = place->second.line;
    mesh.in = place->second.file;
  }
}

// Mends the text of a document in memory.
void mend(std::string& text, const std::string& file, const LoadOptions& options, std::vector<std::string>& notes,
          Texts& others) {
  std::vector<Mend> mends;
  try {
    std::vector<Mend> of_assets;
    if (root_element(text) == "mujoco") others = mended_assets(text, file, of_assets);
    text = mended_model(text, file, file, mends, options);
    mends.insert(mends.end(), of_assets.begin(), of_assets.end());
  } catch (const InputError&) {
    return;  // reading the document says why
  }
  for (const Mend& mend : mends) {
    notes.push_back(mend.line > 0 ? fmt::format("repaired: {} (line {})", mend.what, mend.line)
                                  : fmt::format("repaired: {}", mend.what));
  }
}

// Takes what MJCF does not know out of the document, until MuJoCo reads it or complains of something else.
SpecPtr parse_known_parts(std::string& text, const std::string& file, Texts included, LoadReport& report,
                          std::vector<std::string>& notes, char* message, int size) {
  constexpr int kMost = 2000;
  for (int round = 0; round < kMost; ++round) {
    const std::optional<UnknownPart> unknown = unknown_part(message, elements_in(text, file, included));
    if (!unknown) return nullptr;
    std::string* source = &text;
    if (!unknown->path.empty()) {
      const auto [other, fresh] = included.try_emplace(unknown->path);
      source = &other->second;
      if (fresh) *source = model_text(unknown->path);
    }
    std::string shorter = without(*source, unknown->part);
    if (shorter == *source) return nullptr;
    *source = std::move(shorter);
    report.problems.push_back(unknown->problem);
    notes.push_back(problem_text(unknown->problem));
    if (SpecPtr spec(parse_as_file(text, file, included, message, size)); spec != nullptr) return spec;
  }
  return nullptr;
}

// A document on its way to the Model: `file` is where relative names count from, `parse` calls one of MuJoCo's parsers
// with a buffer for its message, and `text` is what is parsed unless it is URDF.
template <typename Parse>
LoadReport load(const std::string& stem, const std::string& file, const std::string& as_written,
                const LoadOptions& options, FileFacts* facts, Parse parse, Drawing* drawing = nullptr) {
  LoadReport report;
  std::string text = as_written;
  if (text.find_first_not_of(" \t\r\n") == std::string::npos) {
    report.refuse("it is empty; an MJCF, URDF or SDF model is expected");
    return report;
  }
  if (std::optional<Problem> problem = encoding_problem(text)) {
    problem->message = "it " + problem->message;
    report.problems.push_back(std::move(*problem));
    return report;
  }
  const std::string root = root_element(text);
  if (refuse_other_format(root, report)) return report;
  const bool is_urdf = root == "robot", is_sdf = root == "sdf";
  std::vector<std::string> notes;
  Texts others;  // of the files that it names, where they are mended
  UrdfDocument urdf;
  SdfDocument sdf;
  if (is_urdf) {
    if (options.repair) mend(text, file, options, notes, others);
    urdf = read_urdf(text, file, options);
    report.problems = urdf.problems;
    if (urdf.refused()) return report;
  } else if (is_sdf) {
    sdf = read_sdf(text, file, options);
    report.problems = sdf.parts.problems;
    if (report.refused()) return report;
    urdf = sdf.parts;
  } else {
    report.problems = document_refusals(text, file, options);
    if (report.refused()) return report;
    if (options.repair) mend(text, file, options, notes, others);
  }

  const MessageGuard guard;
  std::array<char, 2000> error = {};
  const int error_size = static_cast<int>(error.size());
  const auto refuse = [&](const std::string& message) {
    if (message.find("ould not allocate") != std::string::npos) {
      throw SystemError(fmt::format("not enough memory to read '{}': free some, or raise the limit (ulimit -v, -d)",
                                    file.empty() ? "the model" : file));
    }
    report.problems.push_back(is_sdf
                                  ? Problem{.message = fmt::format("its values cannot be used: {}", one_line(message)),
                                            .mend = "correct them"}
                                  : parser_problem(message, text, file));
    return std::move(report);
  };
  const Silence silence;
  SpecPtr spec;
  try {
    if (is_urdf) {
      spec.reset(mj_parseXMLString(urdf.text.c_str(), nullptr, error.data(), error_size));
    } else if (is_sdf) {
      spec = sdf_spec(sdf);
    } else {
      spec.reset(notes.empty() ? parse(error.data(), error_size)
                               : parse_as_file(text, file, others, error.data(), error_size));
      if (spec == nullptr && options.drop_unsupported) {
        spec = parse_known_parts(text, file, others, report, notes, error.data(), error_size);
      }
    }
  } catch (const InputError& fault) {  // of the guard
    return refuse(fault.what());
  }
  if (spec == nullptr) return refuse(error.data());
  for (const std::string& warning : MessageGuard::warnings()) {
    if (warning.find("NaN") != std::string::npos) {
      report.refuse("it contains a number that is NaN", "replace it");
      return report;
    }
  }

  const DocumentPlaces places = is_urdf  ? DocumentPlaces()
                                : is_sdf ? DocumentPlaces{.included = sdf.included, .models = {}}
                                         : places_in(text, file);
  const std::map<std::string, IncludedPlace>& included = places.included;
  notes.insert(notes.end(), urdf.notes.begin(), urdf.notes.end());
  if (is_urdf) {
    // a link without <inertial> has no mass, whatever its shapes are
    spec->compiler.inertiafromgeom = mjINERTIAFROMGEOM_FALSE;
    give_vertices(spec.get(), urdf.meshes, options.decompose);
    add_motors(spec.get(), urdf.driven);
  } else if (is_sdf) {
    spec->compiler.inertiafromgeom = mjINERTIAFROMGEOM_FALSE;
    give_vertices(spec.get(), urdf.meshes, options.decompose);
    add_motors(spec.get(), urdf.driven);
    apply_root_joint(spec.get(), options.root_joint, report, notes);
  } else {
    const std::string folder = fs::path(file).parent_path().string();
    leave_out_pictures(spec.get(), folder, drawing != nullptr, options.drop_unsupported, report, notes);
    for (Problem& problem : report.problems) problem.file = places.file_of_model(problem.file);
    adapt_to_compiler(spec.get(), notes);
    apply_root_joint(spec.get(), options.root_joint, report, notes);
  }
  const std::string ground = options.ground == Ground::kPlane ? add_ground(spec.get(), notes) : "";
  place_problems(included, report.problems);
  if (report.refused()) return report;

  // static bodies are fused here, where shapes keep their lines and names
  spec->compiler.fusestatic = false;
  // <size> is the room for MuJoCo's own simulation of the file, which there is none of; some files ask for GiB
  spec->memory = -1;
  spec->njmax = spec->nconmax = -1;
  spec->nstack = -1;
  CompiledPtr compiled;
  std::string fault;
  const auto compile = [&] {
    try {
      compiled.reset(mj_compile(spec.get(), nullptr));
      if (compiled == nullptr) fault = mjs_getError(spec.get());
    } catch (const InputError& thrown) {  // of the guard
      fault = thrown.what();
    }
  };
  compile();
  if (compiled == nullptr && fault.find("integrator='discrete'") != std::string::npos) {
    // some deformable bodies compile with this one alone; nothing here uses it
    const int integrator = spec->option.integrator;
    spec->option.integrator = mjINT_DISCRETE;
    compile();
    if (compiled != nullptr) compiled->opt.integrator = integrator;
  }
  if (compiled == nullptr) {
    if (!is_urdf && !is_sdf) report.problems = mjcf_faults(text, file);
    if (report.refused()) return report;
    return refuse(fault);
  }
  LoadReport translated =
      translate({.spec = spec.get(),
                 .compiled = compiled.get(),
                 .load = options,
                 .base_is_link = is_urdf,
                 .starts_mimics = is_sdf,
                 .base_floats = options.root_joint == RootJoint::kFloating || (is_urdf && !urdf.has_mass),
                 .massless = urdf.massless,
                 .inertia = urdf.inertia,
                 .file_of_model = [&](const std::string& name) { return places.file_of_model(name); },
                 .facts = facts,
                 .drawing = drawing});
  place_problems(included, translated.problems);
  report.problems.insert(report.problems.end(), translated.problems.begin(), translated.problems.end());
  if (!translated.model) return report;
  report.model = std::move(translated.model);
  Model& model = *report.model;
  for (ContactPair& pair : model.contacts) {  // Gazebo's rule, not MuJoCo's
    if (is_sdf) pair.friction = std::min(model.shapes[pair.shape_a].friction, model.shapes[pair.shape_b].friction);
  }

  const std::string own_name = mjs_getString(spec->modelname);
  model.name = own_name.empty() || own_name == "MuJoCo Model" ? stem : own_name;
  for (int i = 0; i < mjs_numWarnings(spec.get()); ++i) {
    notes.push_back(fmt::format("MuJoCo warns: {}", one_line(mjs_getWarning(spec.get(), i))));
  }
  for (const std::string& warning : MessageGuard::warnings()) {
    notes.push_back(fmt::format("MuJoCo warns: {}", one_line(warning)));
  }
  model.notes.insert(model.notes.end(), notes.begin(), notes.end());
  if (!urdf.starts.empty()) {
    std::string lines;
    for (const auto& [joint, position] : urdf.starts) lines += fmt::format("{} = {}\n", joint, position);
    start_from(model, lines, file);
  }
  if (!options.qpos.empty()) {
    constexpr std::uintmax_t kMostBytes = std::uintmax_t{16} << 20;
    const std::string give = "a file of MuJoCo's qpos, or of lines JOINT=VALUE";
    start_from(model, input_text(options.qpos, "the file of joint positions", give, kMostBytes), options.qpos);
  }
  if (options.within_limits) start_within_limits(model);
  if (!ground.empty()) put_under(model, ground);
  if (options.ground == Ground::kNone) remove_planes(model);
  if (facts != nullptr) {
    facts->is_urdf = is_urdf;
    facts->is_sdf = is_sdf;
    facts->velocity_limits = urdf.velocity_limits;
    facts->locked = urdf.locked;
    facts->drawn_reach = urdf.drawn_reach;
    facts->meshes = mesh_facts(model, spec.get(), compiled.get(), fs::path(file).parent_path().string(), urdf);
    for (MeshFacts& mesh : facts->meshes) mesh.in = places.file_of_model(mesh.in);
    if (is_urdf) add_urdf_lines(model, urdf, facts->lines);
    place_facts(included, model, *facts);
  }
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

// Decomposing meshes takes long.
ActivityLimits limits_of(const LoadOptions& options) {
  constexpr double kLong = 1800;  // s
  ActivityLimits limits;
  if (options.decompose) limits.cpu_s = limits.wall_s = kLong;
  return limits;
}

void require_file(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) throw InputError(fmt::format("there is no file '{}'; check the path", path));
  if (fs::is_directory(status)) {
    throw InputError(fmt::format("'{}' is a folder; name an .xml (MJCF), .urdf, .sdf or .usd file in it", path));
  }
  if (!fs::is_regular_file(status)) {
    throw InputError(fmt::format("'{}' is not a file; name an .xml, .urdf, .sdf or .usd file", path));
  }
}

// USD by way of MJCF. Messages name prims, and no lines of a text that nobody has seen.
LoadReport load_usd(const std::string& path, const LoadOptions& options, FileFacts* facts, Drawing* drawing = nullptr) {
  require_file(path);
  const UsdDocument usd = read_usd(path, options);
  LoadReport report;
  if (!usd.refused()) {
    report = load(
        fs::path(path).stem().string(), "", usd.text, options, facts,
        [&](char* message, int size) { return mj_parseXMLString(usd.text.c_str(), nullptr, message, size); }, drawing);
    for (Problem& problem : report.problems) usd.place(problem);
  }
  report.problems.insert(report.problems.begin(), usd.problems.begin(), usd.problems.end());
  if (report.model) {
    std::vector<std::string>& notes = report.model->notes;
    for (std::string& note : notes) note = UsdDocument::without_lines(note);
    std::vector<std::string> first = usd.notes;
    for (const Problem& problem : usd.problems) first.push_back(problem_text(problem));
    notes.insert(notes.begin(), first.begin(), first.end());
  }
  if (facts != nullptr) {
    facts->lines.clear();
    facts->files.clear();
    for (MeshFacts& mesh : facts->meshes) {
      mesh.line = 0;
      mesh.in.clear();
    }
  }
  return report;
}

}  // namespace

std::string model_text(const std::string& path) {
  require_file(path);
  return input_file(path, "model", "an .xml, .urdf or .sdf file", kMostModelFileBytes);
}

LoadReport inspect_model(const std::string& path, const LoadOptions& options, FileFacts* facts) {
  const Activity reading(fmt::format("reading '{}'", path), limits_of(options));
  const std::optional<CapsulesName> capsules = capsules_named(fs::path(path).stem().string());
  std::error_code error;
  LoadReport report;
  if (capsules && !fs::exists(path, error)) {
    report = inspect_model_text(capsules_mjcf(*capsules), path, options, facts);
  } else if (is_usd(path)) {
    report = load_usd(path, options, facts);
  } else {
    report = load(fs::path(path).stem().string(), path, model_text(path), options, facts,
                  [&](char* message, int size) { return parse_file(path, message, size); });
  }
  if (report.model) report.model->source = path;
  return report;
}

LoadReport inspect_model_text(const std::string& xml, const std::string& name, const LoadOptions& options,
                              FileFacts* facts) {
  return load(name, "", xml, options, facts,
              [&](char* error, int size) { return mj_parseXMLString(xml.c_str(), nullptr, error, size); });
}

Drawing read_drawing(const std::string& path, const LoadOptions& options) {
  Drawing drawing;
  std::error_code error;
  if (!fs::exists(path, error)) return drawing;  // generated models have capsules alone
  if (is_usd(path)) return load_usd(path, options, nullptr, &drawing).model ? drawing : Drawing();
  const std::string text = model_text(path);
  const LoadReport report = load(
      fs::path(path).stem().string(), path, text, options, nullptr,
      [&](char* message, int size) { return parse_file(path, message, size); }, &drawing);
  if (!report.model) return {};
  if (root_element(text) == "robot") add_urdf_visuals(text, path, options, drawing);
  return drawing;
}

Model load_model(const std::string& path, const LoadOptions& options) {
  return required(inspect_model(path, options), path);
}

Model load_model_text(const std::string& xml, const std::string& name, const LoadOptions& options) {
  return required(inspect_model_text(xml, name, options), name);
}

}  // namespace assay
