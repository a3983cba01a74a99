// `assay check`: what each engine does with a model, before anything is run.
#include <algorithm>

#include <fmt/format.h>

#include "base/paths.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/facts.h"
#include "model/mjcf.h"

namespace assay::cli {
namespace {

struct Options {
  std::string model;
  bool drop_unsupported = false;
  bool json = false;
};

// One engine's contenders that treat the model alike.
struct Verdict {
  std::string engine;
  std::vector<std::string> contenders;
  std::vector<Limitation> findings;  // nothing of kind kExact

  Fidelity worst() const {
    Fidelity worst = Fidelity::kExact;
    for (const Limitation& finding : findings) worst = std::max(worst, finding.fidelity);
    return worst;
  }
};

bool alike(const std::vector<Limitation>& a, const std::vector<Limitation>& b) {
  return std::ranges::equal(a, b, [](const Limitation& x, const Limitation& y) {
    return x.fidelity == y.fidelity && x.element == y.element && x.how == y.how;
  });
}

std::vector<Verdict> verdicts_on(const Model& model) {
  const Registry& registry = Registry::instance();
  std::vector<Verdict> verdicts;
  for (const std::string& name : registry.contender_names()) {
    const ResolvedContender contender = registry.resolve(name);
    std::vector<Limitation> findings = contender.engine->check(model, contender.settings);
    std::erase_if(findings, [](const Limitation& finding) { return finding.fidelity == Fidelity::kExact; });
    const auto same = std::ranges::find_if(verdicts, [&](const Verdict& verdict) {
      return verdict.engine == contender.engine->name() && alike(verdict.findings, findings);
    });
    if (same != verdicts.end()) {
      same->contenders.push_back(name);
    } else {
      verdicts.push_back({contender.engine->name(), {name}, std::move(findings)});
    }
  }
  return verdicts;
}

int check(const Options& options) {
  const Model model = load_model(find_model(options.model), {.drop_unsupported = options.drop_unsupported});
  const std::vector<Verdict> verdicts = verdicts_on(model);

  if (options.json) {
    Json json = {{"model", model_json(model.name, model)}, {"engines", Json::array()}};
    for (const Verdict& verdict : verdicts) {
      Json findings = Json::array();
      for (const Limitation& finding : verdict.findings) {
        findings.push_back(
            {{"fidelity", fidelity_text(finding.fidelity)}, {"element", finding.element}, {"how", finding.how}});
      }
      json["engines"].push_back({{"engine", verdict.engine},
                                 {"contenders", verdict.contenders},
                                 {"verdict", fidelity_text(verdict.worst())},
                                 {"findings", findings}});
    }
    print_json(json);
    return kDone;
  }

  print(fmt::format("{}: {}, {} DOF, {}, {:.6g} kg\n", model.name, counted(model.bodies.size(), "body", "bodies"),
                    model.dof(), counted(model.contacts.size(), "contact pair", "contact pairs"), model.total_mass()));
  for (const std::string& note : model.notes) print(fmt::format("  note: {}\n", note));
  for (const Verdict& verdict : verdicts) {
    print(
        fmt::format("\n{} ({}): {}\n", verdict.engine, join(verdict.contenders, ", "), fidelity_text(verdict.worst())));
    for (const Limitation& finding : verdict.findings) {
      print(fmt::format("  {:<13} {}: {}\n", fidelity_text(finding.fidelity), finding.element, finding.how));
    }
  }
  return kDone;
}

}  // namespace

void add_check(CLI::App& app, Action& action) {
  CLI::App* command =
      add_command(app, "check", "Say per engine what of a model is exact, approximated (how) or refused (what, where)",
                  {{"assay check planar-chain", "a system that comes with assay"},
                   {"assay check my_robot.xml --drop-unsupported", "leave boxes and meshes out, and say which"},
                   {"assay check my_robot.urdf --json", "URDF files load the same way"}});
  const auto options = std::make_shared<Options>();
  command->add_option("MODEL", options->model, "MJCF or URDF file, or a system's name")->required()->type_name("");
  command
      ->add_flag("--drop-unsupported", options->drop_unsupported,
                 "Leave out shapes that are no sphere, capsule or plane instead of refusing the model")
      ->disable_flag_override();
  command->add_flag("--json", options->json, "Print everything that is known as JSON")->disable_flag_override();
  command->callback([&action, options] { action = [options] { return check(*options); }; });
}

}  // namespace assay::cli
