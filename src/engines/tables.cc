#include "engines/tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "engines/binary_facts.h"
#include "engines/builds.h"
#include "engines/describe.h"
#include "engines/facts.h"

namespace assay {
namespace {

const std::vector<std::string> kBuildHeads = {
    "engine",      "build", "version",    "instruction set", "SSE scalar",      "SSE vector", "AVX",
    "AVX 256 bit", "FMA",   "arithmetic", "assertions",      "other libraries", "flags"};
std::string code_or_dash(const std::string& text) { return text.empty() ? "–" : "`" + text + "`"; }

}  // namespace

Json engines_json(const std::vector<ResolvedContender>& contenders, const std::vector<AbsentEngine>& absent) {
  Json listed = {{"contenders", Json::array()}, {"absent", Json::array()}};
  for (const ResolvedContender& contender : contenders) listed["contenders"].push_back(contender_json(contender));
  for (const AbsentEngine& engine : absent) {
    listed["absent"].push_back({{"engine", engine.name}, {"reason", engine.reason}});
  }
  return listed;
}

std::string flat_table(const std::vector<ResolvedContender>& contenders) {
  std::vector<std::vector<std::string>> rows;
  rows.reserve(contenders.size());
  for (const ResolvedContender& contender : contenders) {
    const Capabilities can = contender.engine->capabilities(contender.settings);
    const std::string& solver = can.coordinates == Coordinates::kJoint ? can.contact_solver : can.joint_solver;
    rows.push_back({contender.name, contender.engine->name(), contender.engine->build().version,
                    precision_text(can.precision), coordinates_text(can.coordinates), can.integrator,
                    can.contact ? "yes" : "no", solver});
  }
  return table({"contender", "engine", "version", "precision", "coordinates", "integrator", "contact", "solver"}, rows);
}

std::string tables_by_engine(const std::vector<ResolvedContender>& contenders) {
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
  return table({"engine", "version", "precision", "contact", "contenders"}, engines, {4}) + "\n" +
         table({"contender", "coordinates", "summary"}, rows);
}

EngineBuilds engine_builds(const Registry& registry) {
  EngineBuilds found;
  std::vector<const Engine*> engines = registry.engines();
  engines.insert(engines.end(), registry.other_builds().begin(), registry.other_builds().end());
  std::erase_if(engines, [](const Engine* engine) { return engine->name() == "null" || engine->name() == "skeleton"; });
  for (const Engine* engine : engines) {
    const BuildFacts build = engine->build();
    const auto binary = binary_facts(registry.plugin_path(engine->name()));
    found.facts.push_back({{"engine", without_build(engine->name())},
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
    found.rows.push_back({without_build(engine->name()), build_of(engine->name()), build.version,
                          fact("instruction_set"), count("scalar"), count("vector"), count("avx"), count("avx256"),
                          count("fma"), fact("arithmetic"), fact("checks"),
                          fmt::format("{}", fmt::join(libraries, ", ")), build.flags});
  }
  return found;
}

std::string EngineBuilds::text() const { return table(kBuildHeads, rows, {4, 5, 6, 7, 8}); }

std::string EngineBuilds::markdown() const {
  std::string document = fmt::format(
      "# Builds of engines\n\nWhat the binary of each engine is, as it was on the machine that wrote this page: "
      "instructions in the "
      "machine code, not those that\nrun ([engines](../engines.md#builds)). `./assay list engines --builds "
      "--markdown` "
      "writes this "
      "file.\n\n| {} |\n|{}|\n",
      fmt::join(kBuildHeads, " | "), fmt::join(std::vector<std::string>(kBuildHeads.size(), " --- "), "|"));
  for (std::vector<std::string> row : rows) {
    row.back() = code_or_dash(row.back());
    document += fmt::format("| {} |\n", fmt::join(row, " | "));
  }
  return document;
}

}  // namespace assay
