#include "results/store/differences.h"

#include <algorithm>
#include <array>
#include <set>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/json.h"
#include "results/store/facts.h"

namespace assay {
namespace {

using nlohmann::json;

// Of the manifest.
constexpr std::array<std::string_view, 5> kProgramFacts = {"assay_version", "commit", "compiler", "flags",
                                                           "build_type"};
constexpr std::array<std::string_view, 2> kMethodFacts = {"timing", "seed"};

// Facts of a system's row that say which model it is, not how it is measured; and those that say neither.
constexpr std::array<std::string_view, 10> kModelFacts = {"model_hash",    "dof",     "bodies",  "hinges",   "shapes",
                                                          "contact_pairs", "mass_kg", "gravity", "contacts", "control"};
constexpr std::array<std::string_view, 5> kSilentFacts = {"model", "load", "measures", "family", "notes"};

template <size_t kCount>
bool is_among(const std::array<std::string_view, kCount>& names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

json parsed(const std::string& text) {
  json facts = json::parse(text, nullptr, /*allow_exceptions=*/false);
  return facts.is_object() ? facts : json::object();
}

std::string plain(const json& value) {
  if (value.is_null()) return "";
  return value.is_string() ? value.get<std::string>() : dump_json(value);
}

void compare_systems(const SystemRow& a, const SystemRow& b, std::vector<Difference>& found) {
  if (a.json == b.json) return;
  const json facts_a = parsed(a.json), facts_b = parsed(b.json);
  std::set<std::string> names;
  for (const json* facts : {&facts_a, &facts_b}) {
    for (const auto& [name, value] : facts->items()) names.insert(name);
  }
  const bool other_model = text_fact(facts_a, "model_hash") != text_fact(facts_b, "model_hash");
  for (const std::string& name : names) {
    // other counts of a model that differs as a whole say nothing more
    const bool of_model = is_among(kModelFacts, name);
    if (is_among(kSilentFacts, name) || (of_model && other_model && name != "model_hash")) continue;
    const json in_a = facts_a.value(name, json()), in_b = facts_b.value(name, json());
    if (in_a == in_b) continue;
    const bool is_control = name == "control";
    found.push_back({of_model ? DifferenceKind::kModel : DifferenceKind::kMethod, a.name,
                     name == "model_hash" ? fmt::format("the model of '{}'", a.name)
                                          : fmt::format("{} of '{}'", is_control ? "the control" : name, a.name),
                     plain(in_a), plain(in_b)});
  }
}

void compare_contenders(const ContenderRow& a, const ContenderRow& b, std::vector<Difference>& found) {
  const auto add = [&](DifferenceKind kind, const char* what, const std::string& in_a, const std::string& in_b) {
    if (in_a != in_b) found.push_back({kind, a.name, fmt::format("the {} of '{}'", what, a.name), in_a, in_b});
  };
  add(DifferenceKind::kSettings, "engine", a.engine, b.engine);
  add(DifferenceKind::kSettings, "settings", a.settings, b.settings);
  add(DifferenceKind::kBuild, "version", a.version, b.version);
  const json build_a = parsed(a.build_json), build_b = parsed(b.build_json);
  for (const char* fact : {"compiler", "flags", "plugin"}) {
    add(DifferenceKind::kBuild, fact, plain(build_a.value(fact, json())), plain(build_b.value(fact, json())));
  }
}

template <typename Row, typename Compare>
void compare_rows(const std::vector<Row>& a, const std::vector<Row>& b, const char* kind,
                  std::vector<Difference>& found, Compare compare) {
  const auto missing = [&](const std::vector<Row>& from, const std::vector<Row>& in, bool in_a) {
    for (const Row& row : from) {
      const auto same = std::ranges::find(in, row.name, &Row::name);
      if (same == in.end()) {
        found.push_back({DifferenceKind::kCoverage, row.name, fmt::format("{} '{}'", kind, row.name),
                         in_a ? "there" : "", in_a ? "" : "there"});
      } else if (in_a) {
        compare(row, *same, found);
      }
    }
  };
  missing(a, b, true);
  missing(b, a, false);
}

std::string machine_text(const json& facts) {
  const std::string name = text_fact(facts, "name"), cpu = text_fact(facts, "cpu", "unknown"),
                    cores = text_fact(facts, "cores");
  const std::string hardware = cores.empty() ? cpu : fmt::format("{}, {} cores", cpu, cores);
  return name.empty() ? hardware : fmt::format("{} ({})", name, hardware);
}

}  // namespace

std::string Difference::text(const std::string& dir_a, const std::string& dir_b) const {
  if (kind == DifferenceKind::kCoverage) return fmt::format("only '{}' has the {}", a.empty() ? dir_b : dir_a, what);
  const auto shown = [](const std::string& text) { return text.empty() ? std::string("not stored") : text; };
  return fmt::format("{} is {} in '{}' and {} in '{}'", what, shown(a), dir_a, shown(b), dir_b);
}

std::vector<std::string> machines(const Store& store) {
  std::set<std::string> found;
  for (const NodeRow& node : store.nodes()) found.insert(machine_text(parsed(node.json)));
  if (found.empty()) {
    json facts;
    for (const char* key : {"cpu", "cores"}) facts[key] = store.manifest(key).value_or("");
    found.insert(machine_text(facts));
  }
  return {found.begin(), found.end()};
}

std::string Description::fact(std::string_view key) const {
  const auto found = std::ranges::find(manifest, key, &ManifestEntry::key);
  return found == manifest.end() ? "" : found->value;
}

Description describe(const Store& store) {
  return {store.dir(), store.manifest(), store.systems(), store.contenders()};
}

std::vector<Difference> differences(const Store& a, const Store& b) { return differences(describe(a), describe(b)); }

std::vector<Difference> differences(const Description& a, const Description& b) {
  std::vector<Difference> found;
  const auto of_manifest = [&](DifferenceKind kind, std::string_view key, const std::string& what) {
    const std::string in_a = a.fact(key), in_b = b.fact(key);
    if (in_a != in_b) found.push_back({kind, "", what, in_a, in_b});
  };
  for (const std::string_view key : kProgramFacts) {
    of_manifest(DifferenceKind::kProgram, key,
                key == "assay_version" ? "assay's version" : fmt::format("assay's {}", key));
  }
  for (const char* key : {"cpu", "cores", "kernel"}) {
    of_manifest(DifferenceKind::kMachine, key, fmt::format("the machine's {}", key));
  }
  for (const std::string_view key : kMethodFacts) {
    of_manifest(DifferenceKind::kMethod, key, key == "seed" ? "the campaign's seed" : "the timing");
  }
  compare_rows(a.systems, b.systems, "system", found, compare_systems);
  compare_rows(a.contenders, b.contenders, "contender", found, compare_contenders);
  std::ranges::stable_sort(found, {}, &Difference::kind);
  return found;
}

}  // namespace assay
