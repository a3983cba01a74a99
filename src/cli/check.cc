// `assay check`: what is wrong with a model or worth knowing of it, and what each engine does with it, before anything
// is run. A folder is check_folder.cc's.
#include <algorithm>
#include <filesystem>
#include <optional>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/output_file.h"
#include "base/paths.h"
#include "base/quantity.h"
#include "base/text.h"
#include "check/findings_text.h"
#include "check/model_check.h"
#include "check/step_bounds.h"
#include "check/verdicts.h"
#include "cli/check_folder.h"
#include "cli/commands.h"
#include "cli/model_options.h"
#include "engines/facts.h"
#include "load/mjcf.h"
#include "load/repair.h"

namespace assay::cli {
namespace {

struct CheckOptions {
  ModelOptions model;
  std::vector<std::string> repair;  // the file to write, or the folder; empty: in memory
  bool json = false;
  FolderFlags of_folder;

  std::string repaired() const { return repair.empty() ? "" : repair.front(); }
};

// The folder that MODEL names; empty for a file or a system.
std::string named_folder(const std::string& model) {
  namespace fs = std::filesystem;
  constexpr std::string_view kRobots = "robots:";
  const std::string path =
      model.starts_with(kRobots) ? (fs::path(cache_dir()) / "robots" / model.substr(kRobots.size())).string() : model;
  const std::vector<std::string> systems = system_names();
  std::error_code error;
  return std::ranges::find(systems, model) == systems.end() && fs::is_directory(path, error) ? path : "";
}

// ---- a file that is refused, and its repair --------------------------------------------------------------------------

Json problem_json(const Problem& problem) {
  return {{"severity", problem.severity == Severity::kRefused ? "refused" : "left out"},
          {"element", problem.element},
          {"line", problem.line > 0 ? Json(problem.line) : Json(nullptr)},
          {"file", problem.file.empty() ? Json(nullptr) : Json(problem.file)},
          {"message", problem.message},
          {"mend", problem.mend},
          {"option", problem.option}};
}

// Several problems, each on a line of its own; one is an error like every other.
int print_refusal(const std::string& file, const LoadReport& report, const CheckOptions& options) {
  std::vector<const Problem*> refused;
  for (const Problem& problem : report.problems) {
    if (problem.severity == Severity::kRefused) refused.push_back(&problem);
  }
  if (options.json) {
    Json problems = Json::array();
    for (const Problem& problem : report.problems) problems.push_back(problem_json(problem));
    print_json({{"file", file}, {"problems", problems}});
    return kWrongInput;
  }
  if (refused.size() == 1) throw InputError(fmt::format("{}: {}", file, problem_text(*refused.front())));
  message(fmt::format("{}: it is refused for {} problems", file, refused.size()));
  for (const Problem* problem : refused) message("  " + problem_text(*problem));
  return kWrongInput;
}

int repair(const std::string& file, const std::string& out, const LoadOptions& how) {
  std::vector<Mend> mends;
  const std::string mended = mended_file(file, out, mends, how);
  if (mends.empty()) {
    const LoadReport report = inspect_model(file, how);
    message(fmt::format("--repair finds nothing in '{}' that it can mend{}", file,
                        report.refused() ? "" : fmt::format(", and it loads: '{}' is not written", out)));
    return report.refused() ? print_refusal(file, report, {}) : kDone;
  }
  OutputFile output(out);
  output.write(mended);
  output.finish();
  for (const Mend& mend : mends) {
    message(mend.line > 0 ? fmt::format("line {}: {}", mend.line, mend.what) : mend.what);
  }
  if (out == "-") return kDone;
  LoadReport report = inspect_model(out, how);
  std::string_view loads = ", and it loads";
  if (report.refused() && !how.allow_external_files) {
    LoadOptions trusting = how;
    trusting.allow_external_files = true;
    if (LoadReport trusted = inspect_model(out, trusting); !trusted.refused()) {
      report = std::move(trusted);
      loads = ", and it loads with --allow-external-files: it names files outside its folder";
    }
  }
  message(fmt::format("{}: changes {}{}", out, mends.size(), report.refused() ? "" : loads));
  return report.refused() ? print_refusal(out, report, {}) : kDone;
}

int check(const CheckOptions& options) {
  const LoadOptions how = load_options(options.model);
  if (const std::string folder = named_folder(options.model.model); !folder.empty()) {
    return check_folder({folder, how, options.repaired(), options.json, options.of_folder});
  }
  if (const std::string option = options.of_folder.given(); !option.empty()) {
    throw InputError(
        fmt::format("{} is for a folder, and '{}' is none: give the folder with that robot, or leave it out", option,
                    options.model.model));
  }
  const std::string file = find_model(options.model.model);
  if (!options.repaired().empty()) return repair(file, options.repaired(), how);
  FileFacts facts;
  const LoadReport report = inspect_model(file, how, &facts);
  if (!report.model) return print_refusal(file, report, options);
  const Model& model = *report.model;
  const StepBounds bounds = step_bounds(model, model.initial);
  const std::vector<Finding> findings = check_model(model, facts, bounds);
  const std::vector<ModelElement> elements = elements_of(model);
  const std::vector<EngineVerdict> verdicts = verdicts_on(model, elements, bounds);
  if (options.json) {
    Json problems = Json::array();
    for (const Problem& problem : report.problems) problems.push_back(problem_json(problem));
    constexpr int kDepth = 2;
    print_json_members({{"model", json_text(model_json(model.name, model), kDepth)},
                        {"problems", json_text(problems, kDepth)},
                        {"model_findings", json_text(findings_json(findings), kDepth)},
                        {"timestep", json_text(bounds_json(bounds, facts), kDepth)},
                        {"engines", verdicts_json_text(verdicts, facts, model, kDepth)},
                        {"elements", json_text(elements_json(verdicts, elements, facts), kDepth)}});
    return kDone;
  }
  print(paragraph(fmt::format("{}: {}, {} DOF, {}, {}", model.name, counted(model.bodies.size(), "body", "bodies"),
                              model.dof(), counted(model.contacts.size(), "contact pair"),
                              quantity_text(model.total_mass(), "kg"))));
  print(findings_text(findings, report.problems));
  print(bounds_text(bounds, facts));
  print(verdicts_text(verdicts));
  print(elements_table(verdicts, elements, facts));
  print(statements_text(verdicts, model));
  print(notes_text(model, report.problems));
  return kDone;
}

}  // namespace

void add_check(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "check", "Show what to fix in a model and what each engine does with it",
      {{"assay check planar-chain", "a system that comes with assay"},
       {"assay check my_robot.xml --drop-unsupported", "leaves out what no engine can be given, and names it"},
       {"assay check my_robot.urdf --json", "URDF files load the same way, and .usd files after ./assay setup usd"},
       {"assay check robots --baseline known.json --fail-on mend --sarif robots.sarif",
        "all robots of a folder: status 1 for what is new and to mend"}});
  const auto options = std::make_shared<CheckOptions>();
  add_model_options(*command, options->model, Repair::kOwn);
  command->get_option("MODEL")->description("MJCF, URDF or USD file, a system's name, or a folder of robots");
  const CLI::Option* repair =
      command
          ->add_option(
              "--repair", options->repair,
              "Write a mended URDF or MJCF file there and say what was changed; without OUT mend it in memory; "
              "of a folder, OUT is a folder, too")
          ->type_name("[OUT]")
          ->expected(0, 1);
  CLI::Option* json = command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  add_folder_flags(*command, options->of_folder, json);
  command->callback([&action, options, repair] {
    options->model.load.repair = repair->count() > 0;
    action = [options] { return check(*options); };
  });
}

}  // namespace assay::cli
