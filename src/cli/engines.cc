// `assay engines`: the engines and their contenders.
#include <cstdio>

#include <fmt/format.h>

#include "cli/cli.h"
#include "cli/facts.h"
#include "cli/features.h"
#include "engines/describe.h"
#include "engines/registry.h"

namespace assay::cli {
namespace {

Json engines_json(const std::vector<ResolvedContender>& contenders, const std::vector<AbsentEngine>& absent) {
  Json json = {{"contenders", Json::array()}, {"absent", Json::array()}};
  for (const ResolvedContender& contender : contenders) json["contenders"].push_back(contender_json(contender));
  for (const AbsentEngine& engine : absent) {
    json["absent"].push_back({{"engine", engine.name}, {"reason", engine.reason}});
  }
  return json;
}

// One table of everything for programs.
void print_flat(const std::vector<ResolvedContender>& contenders) {
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
}

// What an engine's contenders share stands once, so that both tables fit a terminal.
void print_by_engine(const std::vector<ResolvedContender>& contenders) {
  std::vector<std::vector<std::string>> engines, rows;
  for (const ResolvedContender& contender : contenders) {
    const Engine& engine = *contender.engine;
    const Capabilities can = engine.capabilities(contender.settings);
    const std::string precision = precision_text(can.precision);
    if (engines.empty() || engines.back().front() != engine.name()) {
      engines.push_back({engine.name(), engine.build().version, precision, can.contact ? "yes" : "no",
                         std::to_string(engine.contenders().size())});
    }
    std::string& precisions = engines.back()[2];
    if (precisions.find(precision) == std::string::npos) precisions += ", " + precision;
    rows.push_back({contender.name, coordinates_text(can.coordinates), contender.summary});
  }
  print(table({"engine", "version", "precision", "contact", "contenders"}, engines, {4}));
  print("\n" + table({"contender", "coordinates", "summary"}, rows));
}

struct Options {
  bool json = false, features = false, markdown = false;
};

int list_features(const Options& options) {
  const Registry& registry = Registry::instance();
  std::vector<ResolvedContender> contenders;
  for (const std::string& name : registry.contender_names()) {
    if (name != "null") contenders.push_back(registry.resolve(name));
  }
  const std::vector<FeatureGroup> groups = feature_groups(contenders);
  if (options.json) {
    print_json(features_json(groups));
  } else {
    print(options.markdown ? features_markdown(groups) : features_text(groups));
  }
  return kDone;
}

int list_engines(bool as_json) {
  const Registry& registry = Registry::instance();
  std::vector<ResolvedContender> contenders;
  for (const std::string& name : registry.contender_names()) contenders.push_back(registry.resolve(name));

  if (as_json) {
    print_json(engines_json(contenders, registry.absent()));
    return kDone;
  }
  terminal_columns(stdout) ? print_by_engine(contenders) : print_flat(contenders);
  if (!registry.absent().empty()) print("\n" + heading("not available") + ":\n");
  for (const AbsentEngine& engine : registry.absent()) {
    print(paragraph(fmt::format("  {}: {}", engine.name, engine.reason), 4));
  }
  return kDone;
}

}  // namespace

void add_engines(CLI::App& app, Action& action) {
  CLI::App* command =
      add_command(app, "engines", "List the engines and their contenders",
                  {{"assay engines", "all contenders, and why an engine is absent"},
                   {"assay engines --features", "which parts of a model each engine has exactly, approximately or not"},
                   {"assay engines --json | jq '.contenders[].settings'", "every setting with its meaning"}});
  const auto options = std::make_shared<Options>();
  CLI::Option* json =
      command->add_flag("--json", options->json, "Print JSON with all settings, capabilities and builds");
  json->disable_flag_override();
  CLI::Option* features =
      command->add_flag("--features", options->features, "Print the table of features of models and engines");
  features->disable_flag_override();
  command->add_flag("--markdown", options->markdown, "Print that table for a document")
      ->disable_flag_override()
      ->needs(features)
      ->excludes(json);
  command->callback([&action, options] {
    action = [options] { return options->features ? list_features(*options) : list_engines(options->json); };
  });
}

}  // namespace assay::cli
