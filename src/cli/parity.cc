// `assay parity`: does this file mean the same robot in every engine?
#include "report/parity.h"

#include <algorithm>
#include <csignal>
#include <filesystem>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/output_file.h"
#include "base/quantity.h"
#include "base/text.h"
#include "base/write_file.h"
#include "check/parity/certificate.h"
#include "cli/cli.h"
#include "cli/model_options.h"
#include "isolate/guarded_child.h"
#include "isolate/processes.h"

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

// One contender an engine, in joint coordinates where it has one: all contenders of an engine are given the same robot.
std::vector<ResolvedContender> chosen(const ParityOptions& options, const Model& model) {
  const Registry& registry = Registry::instance();
  std::vector<ResolvedContender> contenders;
  contenders.reserve(options.contenders.size());
  for (const std::string& name : options.contenders) contenders.push_back(registry.resolve(name));
  if (!contenders.empty()) return contenders;
  for (const std::string& name : registry.contender_names()) {
    ResolvedContender contender = registry.resolve(name);
    const Capabilities own = contender.engine->capabilities(contender.settings);
    if (own.order < 1) continue;
    const auto known = std::ranges::find(contenders, contender.engine, &ResolvedContender::engine);
    if (options.all || known == contenders.end()) {
      contenders.push_back(std::move(contender));
      continue;
    }
    const auto refuses = [&model](const ResolvedContender& each) {
      return std::ranges::any_of(each.engine->check(without_contacts(model), each.settings),
                                 [](const Limitation& l) { return l.fidelity == Fidelity::kRefused; });
    };
    const Capabilities other = known->engine->capabilities(known->settings);
    const bool better = (own.coordinates == Coordinates::kJoint && other.coordinates == Coordinates::kMaximal) ||
                        (own.coordinates == other.coordinates && own.precision == Precision::kDouble &&
                         other.precision == Precision::kSingle);
    if ((better && !refuses(contender)) || (refuses(*known) && !refuses(contender))) *known = std::move(contender);
  }
  return contenders;
}

std::string percent(double share) { return fmt::format("{:.2g} %", 100 * share); }

// The largest error of a kind over the joints, as a cell.
std::string cell(const Json& certificate, const char* part) {
  double most = 0, noise = 0;
  for (const Json& joint : certificate.at("joints")) {
    const double error = joint.at(part).at("error").get<double>();
    if (error < most) continue;
    most = error;
    noise = joint.at(part).at("noise").get<double>();
  }
  return most <= std::max(4 * noise, 1e-9) ? fmt::format("< {}", percent(std::max(4 * noise, 1e-9))) : percent(most);
}

void print_certificates(const Json& certificates) {
  std::vector<std::vector<std::string>> rows;
  for (const Json& c : certificates) {
    std::vector<std::string> row = {c.at("contender").get<std::string>(), status(c.at("verdict").get<std::string>())};
    for (int p = 0; p < parity::kParts; ++p) {
      row.push_back(c.at("joints").empty() ? "" : cell(c, parity::part_name(static_cast<parity::Part>(p))));
    }
    rows.push_back(std::move(row));
  }
  print("\n" + table({"contender", "robot", "inertia", "Coriolis", "gravity", "springs", "damping", "dry friction",
                      "armature", "torque"},
                     rows, {2, 3, 4, 5, 6, 7, 8, 9}));
  print(
      paragraph(
          "Largest error of a joint's force, relative to the joint's largest force of that kind; armature: relative to "
          "the joint's inertia; torque: of its gain; \"<\": not told from rounding and the steps' own error.") +
      "\n");
  for (const Json& c : certificates) {
    const auto text = [&c](const char* key) { return c.at(key).get<std::string>(); };
    if (text("verdict") == "same") continue;
    if (text("verdict") == "not settled") {
      print(
          paragraph(fmt::format("{}: its own error in one small step is up to {}, which hides what is to be seen here",
                                text("contender"), percent(c.at("noise").get<double>())),
                    4) +
          "\n");
      continue;
    }
    print(heading(text("contender")) + "\n");
    if (!text("failure").empty()) print(paragraph("  " + text("failure"), 4));
    for (const Json& cause : c.at("causes")) {
      print(paragraph("  " + parity::cause_text(cause), 4));
    }
    if (text("verdict") == "unexplained" ||
        (text("verdict") == "differs" && c.at("unexplained").get<double>() > c.at("tolerance").get<double>())) {
      print(paragraph(fmt::format("  {} of the joint's inertia times 20 rad/s^2 stay unexplained by any one parameter",
                                  percent(c.at("unexplained").get<double>())),
                      4));
    }
    size_t shown = 0;
    for (const Json& declared : c.at("declared")) {
      constexpr size_t kMost = 4;
      if (++shown > kMost) {
        print(paragraph(fmt::format("  and {} more declared", c.at("declared").size() - kMost), 4));
        break;
      }
      print(paragraph("  declared: " + declared.get<std::string>(), 4));
    }
    if (!text("raised").empty()) print(paragraph("  examined with " + text("raised"), 4));
    print("\n");
  }
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
    Json certificate;
    const ChildEnd end = run_in_child(
        [&](const Send& send) {
          std::signal(SIGINT, SIG_DFL);
          std::signal(SIGTERM, SIG_DFL);
          send(dump_json(parity::certificate_json(model, parity::examine(model, bench, contender))));
          return kDone;
        },
        [&](const std::string& line) { certificate = Json::parse(line); });
    if (interrupted()) throw SystemError("interrupted: nothing was written");
    if (certificate.is_null() && end.from_outside()) {
      throw EndedFromOutside(fmt::format("examining {}", contender.name), end.signal);
    }
    if (certificate.is_null()) {
      parity::Certificate crashed;
      crashed.contender = contender.name;
      crashed.engine = contender.engine->name();
      crashed.failure =
          end.signal != 0 ? fmt::format("it crashed with {}", end.signal_text()) : "its process ended early";
      certificate = parity::certificate_json(model, crashed);
    }
    certificates.push_back(std::move(certificate));
  }
  progress.clear();
  const Json document = {{"model", model.name},      {"hash", model.hash},
                         {"notes", model.notes},     {"samples", experiments.samples},
                         {"seed", experiments.seed}, {"certificates", certificates}};
  if (!options.out.empty()) write_certificate(document, options.out);
  if (options.json) {
    print_json(document);
  } else {
    print_certificates(certificates);
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
      app, "parity", "Whether a model means the same robot in every engine, force by force",
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
