// `assay parity`: does this file mean the same robot in every engine?
#include "report/parity.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/output_file.h"
#include "base/quantity.h"
#include "base/text.h"
#include "base/write_file.h"
#include "check/parity/examination.h"
#include "cli/commands.h"
#include "cli/model_options.h"
#include "engines/facts.h"

namespace assay::cli {
namespace {

struct ParityOptions {
  ModelOptions model;
  std::vector<std::string> contenders;
  std::string samples = "6", seed = "1";
  std::string out;
  bool all = false;
  bool json = false;
};

std::vector<ResolvedContender> chosen(const ParityOptions& options, const Model& model) {
  std::vector<ResolvedContender> contenders;
  contenders.reserve(options.contenders.size());
  for (const std::string& name : options.contenders) contenders.push_back(Registry::instance().resolve(name));
  return contenders.empty() ? parity::contenders_for(model, options.all) : contenders;
}

// The file, or in a folder of results the file that the report shows.
void write_certificate(const Json& document, const std::string& out) {
  namespace fs = std::filesystem;
  std::error_code error;
  const bool folder = out.ends_with('/') || fs::is_directory(out, error);
  const std::string text = dump_json(document, 1) + "\n";
  if (!folder) {
    OutputFile file(out);
    file.write(text);
    file.finish();
    return;
  }
  const std::string path = parity_file(out, document.at("model").get<std::string>());
  make_own_folder(fs::path(path).parent_path());
  write_file(path, text);
  message(fs::exists(fs::path(out) / "assay.sqlite", error)
              ? fmt::format("the certificate is in '{}'; `assay report {}` shows it", path, out)
              : fmt::format("the certificate is in '{}'", path));
}

int run_parity(const ParityOptions& options) {
  const Model model = load(options.model);
  if (model.dof() == 0) throw InputError("nothing moves in this model");
  const parity::ExperimentOptions experiments{
      .samples = parse_count("--samples", options.samples, 2, 1000),
      .seed = static_cast<unsigned long>(parse_count("--seed", options.seed, 0, 1'000'000'000))};
  const parity::Bench bench(model, experiments);
  Json certificates = Json::array();
  ProgressLine progress;
  const std::vector<ResolvedContender> contenders = chosen(options, model);
  tell_notes(model);
  for (const ResolvedContender& contender : contenders) {
    progress.show(fmt::format("{} of {}: {}", certificates.size() + 1, contenders.size(), contender.name));
    auto certificate = parity::examined_apart(model, contender.name, contender.engine->name(),
                                              [&] { return parity::examine(model, bench, contender); });
    if (!certificate) throw SystemError("interrupted: nothing was written");
    certificates.push_back(std::move(*certificate));
  }
  progress.clear();
  const Json document = {{"model", model.name},      {"hash", model.hash},
                         {"notes", model.notes},     {"samples", experiments.samples},
                         {"seed", experiments.seed}, {"certificates", certificates}};
  if (!options.out.empty()) write_certificate(document, options.out);
  if (options.json) {
    print_json(document);
  } else {
    print(parity::certificates_text(certificates));
  }
  const bool same = std::ranges::all_of(certificates, [](const Json& c) {
    const auto verdict = c.at("verdict").get<std::string>();
    return verdict != "differs" && verdict != "unexplained";
  });
  return same ? kDone : kFailed;
}

}  // namespace

void add_parity(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "parity", "Test whether a model means the same robot in every engine",
      {{"assay parity my_robot.urdf", "one contender an engine against Newton and Euler's equations"},
       {"assay parity humanoid mujoco-euler dart --out parity.json", "two contenders, the certificate as JSON"},
       {"assay parity my_robot.urdf --out my_robot-results", "into results, whose report then shows it"}});
  const auto options = std::make_shared<ParityOptions>();
  add_model_options(*command, options->model);
  command->add_option("CONTENDER", options->contenders, "Contenders (default: one of each engine)")->type_name("");
  command->add_flag("--all", options->all, "All contenders of all engines")->disable_flag_override();
  command->add_option("--samples", options->samples, "Random configurations")->type_name("N")->capture_default_str();
  command->add_option("--seed", options->seed, "Of the random configurations")->type_name("N")->capture_default_str();
  command
      ->add_option("--out", options->out,
                   "Write the certificate as JSON to this file too; of a folder with results, "
                   "the report shows it")
      ->type_name("FILE|DIR");
  command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  command->callback([&action, options] { action = [options] { return run_parity(*options); }; });
}

}  // namespace assay::cli
