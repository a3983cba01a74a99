// `assay engines`: who takes part.
#include <fmt/format.h>

#include "cli/cli.h"
#include "cli/facts.h"
#include "engines/describe.h"
#include "engines/registry.h"

namespace assay::cli {
namespace {

int list_engines(bool as_json) {
  const Registry& registry = Registry::instance();
  std::vector<ResolvedContender> contenders;
  for (const std::string& name : registry.contender_names()) contenders.push_back(registry.resolve(name));

  if (as_json) {
    Json json = {{"contenders", Json::array()}, {"absent", Json::array()}};
    for (const ResolvedContender& contender : contenders) json["contenders"].push_back(contender_json(contender));
    for (const AbsentEngine& engine : registry.absent()) {
      json["absent"].push_back({{"engine", engine.name}, {"reason", engine.reason}});
    }
    print_json(json);
    return kDone;
  }

  std::vector<std::vector<std::string>> rows;
  rows.reserve(contenders.size());
  for (const ResolvedContender& contender : contenders) {
    const Capabilities can = contender.engine->capabilities(contender.settings);
    const std::string& solver = can.coordinates == Coordinates::kJoint ? can.contact_solver : can.joint_solver;
    rows.push_back({contender.name, contender.engine->name(), contender.engine->build().version,
                    precision_text(can.precision), coordinates_text(can.coordinates), can.integrator,
                    can.contact ? "yes" : "no", solver});
  }
  print(table({"contender", "engine", "version", "precision", "coordinates", "integrator", "contact", "solver"}, rows));
  if (!registry.absent().empty()) print("\nnot available:\n");
  for (const AbsentEngine& engine : registry.absent()) print(fmt::format("  {}: {}\n", engine.name, engine.reason));
  return kDone;
}

}  // namespace

void add_engines(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "engines", "List the contenders: engine, version, precision, solver, build",
      {{"assay engines", "a table of all contenders, and why an engine is absent"},
       {"assay engines --json | jq '.contenders[] | {contender, settings}'", "every setting with its meaning"}});
  const auto as_json = std::make_shared<bool>(false);
  command->add_flag("--json", *as_json, "Print everything that is known as JSON")->disable_flag_override();
  command->callback([&action, as_json] { action = [as_json] { return list_engines(*as_json); }; });
}

}  // namespace assay::cli
