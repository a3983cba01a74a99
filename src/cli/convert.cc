// `assay convert`: a model in the other format.
#include <filesystem>
#include <map>
#include <memory>

#include <fmt/format.h>

#include "base/console.h"
#include "base/errors.h"
#include "base/output_file.h"
#include "base/paths.h"
#include "base/write_file.h"
#include "cli/commands.h"
#include "cli/model_options.h"
#include "engines/facts.h"
#include "load/mjcf.h"
#include "load/model_mjcf.h"
#include "load/model_urdf.h"

namespace assay::cli {
namespace {

namespace fs = std::filesystem;

struct ConvertOptions {
  ModelOptions model;
  std::string to, out;
};

void write_text(const std::string& text, const std::string& out) {
  OutputFile file(out);
  file.write(text);
  file.finish();
}

int run_convert(const ConvertOptions& options) {
  if (options.to != "mjcf" && options.to != "urdf") {
    throw InputError(fmt::format("--to is '{}': it is mjcf or urdf", options.to));
  }
  const std::string source = find_model(options.model.model);
  const LoadOptions how = load_options(options.model);
  FileFacts facts;
  LoadReport report = inspect_model(source, how, &facts);
  // a refused file is loaded again for what loading throws
  const Model model = report.model ? std::move(*report.model) : load_model(source, how);
  tell_notes(model);
  if (options.to == "mjcf") {
    write_text(model_mjcf(model), options.out);
    return kDone;
  }
  const fs::path out = options.out;
  const std::string meshes = out.stem().string() + "-meshes";
  const WrittenUrdf written = model_urdf(model, meshes, facts.velocity_limits);
  if (!written.meshes.empty()) {
    if (options.out == "-")
      throw InputError("'-' is standard output, and the model has meshes, which need files: give --out FILE");
    make_own_folder(out.parent_path() / meshes);
    for (const WrittenUrdf::Mesh& mesh : written.meshes) write_file((out.parent_path() / mesh.file).string(), mesh.stl);
  }
  write_text(written.text, options.out);
  for (const std::string& each : written.left_out) message("note: " + each);
  return kDone;
}

}  // namespace

void add_convert(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "convert", "Write a model as MJCF or URDF, and say what the format lacks",
      {{"assay convert my_robot.urdf --to mjcf --out my_robot.xml", "all that the URDF file says"},
       {"assay convert my_robot.xml --to urdf --out my_robot.urdf", "then assay parity my_robot.xml my_robot.urdf"}});
  const auto options = std::make_shared<ConvertOptions>();
  add_model_options(*command, options->model);
  command->add_option("--to", options->to, "mjcf or urdf")->required()->type_name("FORMAT");
  command
      ->add_option("--out,-o", options->out,
                   "File to write; '-' is standard output. Meshes of a URDF file go to a folder next to it")
      ->required()
      ->type_name("FILE");
  command->callback([&action, options] { action = [options] { return run_convert(*options); }; });
}

}  // namespace assay::cli
