// `assay parity`: does this file mean the same robot in every engine, or do two files mean one robot?
#include "report/parity.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/output_file.h"
#include "base/paths.h"
#include "base/quantity.h"
#include "base/text.h"
#include "base/write_file.h"
#include "check/pairing/motion.h"
#include "check/pairing/pairing_text.h"
#include "check/pairing/read.h"
#include "check/parity/examination.h"
#include "cli/commands.h"
#include "cli/model_options.h"
#include "engines/facts.h"
#include "load/model_mjcf.h"
#include "load/usd.h"

namespace assay::cli {
namespace {

struct ParityOptions {
  ModelOptions model;
  std::vector<std::string> contenders;
  std::string samples = "6", seed = "1";
  std::string out;
  std::vector<std::string> map;
  std::optional<std::string> contender, fail_above, write;  // of two files alone, as --map and --matches
  bool matches = false;
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
void write_certificate(const Json& document, const std::string& out, const std::string& name) {
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
  const std::string path = parity_file(out, name);
  make_own_folder(fs::path(path).parent_path());
  write_file(path, text);
  message(fs::exists(fs::path(out) / "assay.sqlite", error)
              ? fmt::format("the certificate is in '{}'; `assay report {}` shows it", path, out)
              : fmt::format("the certificate is in '{}'", path));
}

// Whether a word behind the model is another file and no contender: it ends as one, or is a file, or a system's name.
bool is_model(const std::string& word) {
  std::error_code error;
  const std::string ending = std::filesystem::path(word).extension().string();
  if (ending == ".xml" || ending == ".urdf" || ending == ".mjcf" || ending == ".sdf" || is_usd(word)) return true;
  if (word.starts_with("robots:")) return true;
  const std::vector<std::string> contenders = Registry::instance().contender_names(), systems = system_names();
  if (std::ranges::find(contenders, word) != contenders.end()) return false;
  return std::ranges::find(systems, word) != systems.end() || std::filesystem::is_regular_file(word, error);
}

pairing::Options pairing_options(const ParityOptions& options) {
  pairing::Options pairing{.samples = static_cast<int>(parse_count("--samples", options.samples, 2, 1000)),
                           .seed = static_cast<unsigned long>(parse_count("--seed", options.seed, 0, 1'000'000'000))};
  for (const std::string& text : options.map) {
    const size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
      throw InputError(
          fmt::format("--map is '{}': write it as A_NAME=B_NAME, a joint, body or actuator of each file", text));
    }
    pairing.map.emplace_back(text.substr(0, equals), text.substr(equals + 1));
  }
  return pairing;
}

// Two files.
int run_pairing(const ParityOptions& options) {
  if (options.contenders.size() > 1) {
    throw InputError(
        fmt::format("'{}' follows on two files: two files are compared in one contender, which --contender names",
                    options.contenders[1]));
  }
  const pairing::Options how = pairing_options(options);
  const double fail_above = options.fail_above ? parse_quantity("--fail-above", *options.fail_above, "1") : 0;
  const ResolvedContender contender = Registry::instance().resolve(options.contender.value_or("mujoco-euler"));
  const auto [a, b] = pairing::read_pair(find_model(options.model.model), find_model(options.contenders[0]),
                                         load_options(options.model));
  for (const pairing::Side* side : {&a, &b}) {
    if (side->model.dof() == 0) throw InputError(fmt::format("nothing moves in '{}'", side->file));
  }
  pairing::Comparison comparison = pairing::compare(a, b, how);
  comparison.motion = pairing::one_second(a, b, how, contender);
  const Json document = pairing::comparison_json(a, b, comparison);
  if (options.write) {
    OutputFile file(*options.write);
    file.write(model_mjcf(pairing::agreed(a, b, how)));
    file.finish();
  }
  if (!options.out.empty()) write_certificate(document, options.out, fmt::format("{}-{}", a.model.name, b.model.name));
  if (options.json) {
    print_json(document);
  } else {
    print(pairing::comparison_text(document, options.matches, options.all));
  }
  return comparison.differs_above(fail_above) ? exits::kFailed : exits::kDone;
}

int run_parity(const ParityOptions& options) {
  if (!options.contenders.empty() && is_model(options.contenders[0])) return run_pairing(options);
  for (const auto& [option, given] :
       {std::pair("--map", !options.map.empty()), std::pair("--contender", options.contender.has_value()),
        std::pair("--fail-above", options.fail_above.has_value()), std::pair("--write", options.write.has_value()),
        std::pair("--matches", options.matches)}) {
    if (given)
      throw InputError(fmt::format("{} is for two files: give a second one behind '{}'", option, options.model.model));
  }
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
  if (!options.out.empty()) write_certificate(document, options.out, model.name);
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
      app, "parity", "Test whether a model means the same robot in every engine, or two files are one robot",
      {{"assay parity my_robot.urdf", "one contender an engine against Newton and Euler's equations"},
       {"assay parity my_robot.urdf my_robot.xml",
        "what differs between two files, first what changes the motion most"},
       {"assay parity old.urdf new.xml --map elbow=joint4 --fail-above 1%", "status 1 for differences of 1 % and more"},
       {"assay parity right.urdf wrong.xml --write corrected.xml", "the second file with the first one's values"},
       {"assay parity humanoid mujoco-euler dart --out parity.json", "two contenders, the certificate as JSON"},
       {"assay parity my_robot.urdf --out my_robot-results", "into results, whose report then shows it"}});
  const auto options = std::make_shared<ParityOptions>();
  add_model_options(*command, options->model);
  command
      ->add_option(
          "CONTENDER", options->contenders,
          "Contenders (default: one of each engine), or a second MJCF, URDF or USD file to compare with the first")
      ->type_name("");
  command->add_flag("--all", options->all, "All contenders of all engines; of two files all differences")
      ->disable_flag_override();
  command->add_option("--samples", options->samples, "Random configurations")->type_name("N")->capture_default_str();
  command->add_option("--seed", options->seed, "Of the random configurations")->type_name("N")->capture_default_str();
  command
      ->add_option("--out", options->out,
                   "Write the certificate as JSON to this file too; of a folder with results, "
                   "the report shows it")
      ->type_name("FILE|DIR");
  constexpr const char* kTwoFiles = "Two files";
  command
      ->add_option("--map", options->map,
                   "A joint, body or actuator of the first file and the one of the second that it is, where names and "
                   "kinematics do not tell; may be repeated")
      ->type_name("A_NAME=B_NAME")
      ->allow_extra_args(false)
      ->group(kTwoFiles);
  command->add_flag("--matches", options->matches, "List all matches")->disable_flag_override()->group(kTwoFiles);
  command
      ->add_option("--contender", options->contender, "Where both are simulated for one second (default: mujoco-euler)")
      ->type_name("NAME")
      ->group(kTwoFiles);
  command
      ->add_option("--fail-above", options->fail_above,
                   "Status 1 only where a difference has this effect or more: of a joint's root mean square force in "
                   "random motions; of limits of the range, of drives and contact friction of the first file's value, "
                   "of shapes of their size (default: whatever is beyond the rounding of files, 0.05 %, 0.02 mm, 0.02 "
                   "degrees); an element that only one file has always counts")
      ->type_name("SHARE")
      ->group(kTwoFiles);
  command
      ->add_option("--write", options->write,
                   "Write the second file as MJCF with the first one's values where they match")
      ->type_name("FILE")
      ->group(kTwoFiles);
  command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  command->callback([&action, options] { action = [options] { return run_parity(*options); }; });
}

}  // namespace assay::cli
