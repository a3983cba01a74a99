// `assay engines`: the engines and their contenders.
#include <cstdio>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/cli.h"
#include "engines/binary_facts.h"
#include "engines/builds.h"
#include "engines/describe.h"
#include "engines/facts.h"
#include "engines/feature_table.h"
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

struct EnginesOptions {
  bool json = false, features = false, builds = false, markdown = false;
};

std::string code_or_dash(const std::string& text) { return text.empty() ? "–" : "`" + text + "`"; }

// One row an engine and build: what its binary says (engines/binary_facts.h), and how it was made.
int list_builds(const EnginesOptions& options) {
  const Registry& registry = Registry::instance();
  std::vector<const Engine*> engines = registry.engines();
  engines.insert(engines.end(), registry.other_builds().begin(), registry.other_builds().end());
  std::erase_if(engines, [](const Engine* engine) { return engine->name() == "null" || engine->name() == "skeleton"; });
  Json json = Json::array();
  std::vector<std::vector<std::string>> rows;
  for (const Engine* engine : engines) {
    const BuildFacts build = engine->build();
    const auto binary = binary_facts(registry.plugin_path(engine->name()));
    json.push_back({{"engine", without_build(engine->name())},
                    {"build", build_of(engine->name())},
                    {"version", build.version},
                    {"source", build.source},
                    {"compiler", build.compiler},
                    {"flags", build.flags},
                    {"binary", binary}});
    const auto fact = [&](const char* key) { return binary.is_null() ? "unknown" : binary.at(key).get<std::string>(); };
    const auto count = [&](const char* key) {
      return binary.is_null() ? "–" : std::to_string(binary.at("counts").at(key).get<long long>());
    };
    std::vector<std::string> libraries;
    if (!binary.is_null()) libraries = binary.at("libraries").get<std::vector<std::string>>();
    rows.push_back({without_build(engine->name()), build_of(engine->name()), build.version, fact("instruction_set"),
                    count("scalar"), count("vector"), count("avx"), count("avx256"), count("fma"), fact("arithmetic"),
                    fact("checks"), fmt::format("{}", fmt::join(libraries, ", ")), build.flags});
  }
  if (options.json) {
    print_json({{"builds", json}});
    return kDone;
  }
  const std::vector<std::string> heads = {
      "engine",      "build", "version",    "instruction set", "SSE scalar",      "SSE vector", "AVX",
      "AVX 256 bit", "FMA",   "arithmetic", "assertions",      "other libraries", "flags"};
  if (!options.markdown) {
    print(table(heads, rows, {4, 5, 6, 7, 8}));
    return kDone;
  }
  std::string text = fmt::format(
      "# Builds of engines\n\nWhat the binary of each engine is, as it was on the machine that wrote this page: "
      "instructions in the "
      "machine code, not those that\nrun ([methodology](methodology.md#builds)). `./assay engines --builds --markdown` "
      "writes this "
      "file.\n\n| {} |\n|{}|\n",
      fmt::join(heads, " | "), fmt::join(std::vector<std::string>(heads.size(), " --- "), "|"));
  for (std::vector<std::string>& row : rows) {
    row.back() = code_or_dash(row.back());
    text += fmt::format("| {} |\n", fmt::join(row, " | "));
  }
  print(text);
  return kDone;
}

int list_features(const EnginesOptions& options) {
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
                   {"assay engines --builds", "instruction sets, precision and assertions of each engine's binary"},
                   {"assay engines --json | jq '.contenders[].settings'", "every setting with its meaning"}});
  const auto options = std::make_shared<EnginesOptions>();
  CLI::Option* json =
      command->add_flag("--json", options->json, "Print JSON with all settings, capabilities and builds");
  json->disable_flag_override();
  CLI::Option* features =
      command->add_flag("--features", options->features, "Print the table of features of models and engines");
  features->disable_flag_override();
  CLI::Option* builds =
      command->add_flag("--builds", options->builds,
                        "Print how each engine was built: instruction sets, precision and assertions of its binary");
  builds->disable_flag_override()->excludes(features);
  command->add_flag("--markdown", options->markdown, "Print the table of --features or --builds for a document")
      ->disable_flag_override()
      ->excludes(json);
  command->callback([&action, options] {
    if (options->markdown && !options->features && !options->builds) {
      throw CLI::RequiresError("--markdown", "--features or --builds");
    }
    action = [options] {
      if (options->builds) return list_builds(*options);
      return options->features ? list_features(*options) : list_engines(options->json);
    };
  });
}

}  // namespace assay::cli
