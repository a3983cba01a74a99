// Reading of the claims file.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <set>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/paths.h"
#include "base/text.h"
#include "base/toml_file.h"
#include "results/claims/claims.h"
#include "results/line_up.h"

namespace assay {
namespace {

using Kind = ClaimTest::Kind;

constexpr std::array<std::pair<const char*, Kind>, 7> kKinds = {{{"at-timestep", Kind::kAtTimestep},
                                                                 {"at-equal-speed", Kind::kEqualSpeed},
                                                                 {"value", Kind::kValue},
                                                                 {"slope", Kind::kSlope},
                                                                 {"unstable", Kind::kUnstable},
                                                                 {"largest-step", Kind::kLargestStep},
                                                                 {"order", Kind::kOrder}}};

constexpr std::array<std::pair<const char*, ClaimBound::Kind>, 4> kBounds = {
    {{"above", ClaimBound::Kind::kAbove},
     {"below", ClaimBound::Kind::kBelow},
     {"between", ClaimBound::Kind::kBetween},
     {"not_above", ClaimBound::Kind::kNotAbove}}};

// A table of the file; complains with file and line.
class Table {
 public:
  Table(const toml::table& table, std::string what, const std::string& source)
      : table_(table), what_(std::move(what)), source_(source) {}

  [[noreturn]] void fail(const toml::node* node, const std::string& sentence) const {
    const toml::source_region& region = node != nullptr ? node->source() : table_.source();
    throw InputError(fmt::format("{}:{}: {}", source_, region.begin.line, sentence));
  }

  void allow(const std::vector<std::string>& known) const {
    for (const auto& [key, node] : table_) {
      const std::string name(key.str());
      if (std::ranges::find(known, name) == known.end()) {
        fail(&node, fmt::format("{} has no key '{}'{}", what_, name, did_you_mean(name, known)));
      }
    }
  }

  bool has(std::string_view key) const { return table_.contains(key); }
  const toml::node* find(std::string_view key) const { return table_.get(key); }

  std::string text(std::string_view key) const {
    const toml::node* node = find(key);
    const auto value = node == nullptr ? std::nullopt : node->value_exact<std::string>();
    if (!value || value->empty()) fail(node, fmt::format("{} needs a text '{}'", what_, key));
    return *value;
  }

  std::vector<std::string> texts(std::string_view key) const {
    const toml::node* node = find(key);
    const toml::array* list = node == nullptr ? nullptr : node->as_array();
    std::vector<std::string> found;
    for (const auto& item : list == nullptr ? toml::array() : *list) {
      const auto value = item.value_exact<std::string>();
      if (!value || value->empty()) fail(node, fmt::format("'{}' of {} is no list of texts", key, what_));
      found.push_back(*value);
    }
    if (found.empty()) fail(node, fmt::format("{} needs '{}', a list of texts", what_, key));
    return found;
  }

  // A number, or a fraction as text.
  double number(std::string_view key, const toml::node& node) const {
    std::optional<double> value;
    if (const auto text = node.value_exact<std::string>()) {
      value = parse_fraction(*text);
    } else if (!node.is_boolean()) {
      value = node.value<double>();
    }
    if (!value || !std::isfinite(*value)) {
      fail(&node, fmt::format("'{}' of {} is no number: give one, or a fraction as text like \"1/64\"", key, what_));
    }
    return *value;
  }

  double positive(std::string_view key) const {
    const double value = number(key, *find(key));
    if (!(value > 0)) fail(find(key), fmt::format("'{}' of {} is {}: give a positive number", key, what_, value));
    return value;
  }

  bool flag(std::string_view key, bool otherwise) const {
    const toml::node* node = find(key);
    if (node == nullptr) return otherwise;
    const auto value = node->value_exact<bool>();
    if (!value) fail(node, fmt::format("'{}' of {} is neither true nor false", key, what_));
    return *value;
  }

 private:
  const toml::table& table_;
  std::string what_;
  const std::string& source_;
};

ClaimBound bound_of(const Table& table) {
  std::vector<ClaimBound> found;
  for (const auto& [key, kind] : kBounds) {
    const toml::node* node = table.find(key);
    if (node == nullptr) continue;
    ClaimBound bound{kind, 0, 0};
    if (kind == ClaimBound::Kind::kBetween) {
      const toml::array* ends = node->as_array();
      if (ends == nullptr || ends->size() != 2) table.fail(node, "'between' is no list of two numbers");
      bound.x = table.number(key, *ends->get(0));
      bound.y = table.number(key, *ends->get(1));
      if (!(bound.x < bound.y)) table.fail(node, fmt::format("'between' goes from {} to {}", bound.x, bound.y));
    } else {
      bound.x = table.number(key, *node);
    }
    found.push_back(bound);
  }
  if (found.size() != 1) table.fail(nullptr, "a test needs one of 'above', 'below', 'between' and 'not_above'");
  return found.front();
}

// The keys of a kind, beside 'kind' and 'today'.
std::vector<std::string> keys_of(Kind kind) {
  std::vector<std::string> keys = {"kind", "today", "systems"};
  const auto add = [&](const std::vector<std::string>& more) { keys.insert(keys.end(), more.begin(), more.end()); };
  const bool by_steps = kind == Kind::kLargestStep || kind == Kind::kOrder;
  if (kind != Kind::kUnstable && !by_steps) add({"value", "above", "below", "between", "not_above"});
  if (!by_steps) add({"who"});
  if (kind == Kind::kAtTimestep || kind == Kind::kEqualSpeed) add({"against", "is", "each", "but"});
  if (kind == Kind::kAtTimestep || kind == Kind::kValue) add({"timestep_ms"});
  if (kind == Kind::kValue) add({"family"});
  if (kind == Kind::kUnstable) add({"measure", "against", "always"});
  if (by_steps) add({"value"});
  if (kind == Kind::kLargestStep) add({"expected", "within"});
  if (kind == Kind::kOrder) add({"order"});
  return keys;
}

void check_engine(const Table& table, const toml::node* node, const std::string& name,
                  const std::vector<std::string>& known) {
  if (std::ranges::find(known, name) == known.end()) {
    table.fail(node, fmt::format("[engines] has no '{}'{}", name, did_you_mean(name, known)));
  }
}

std::vector<std::string> engines_of(const Table& table, std::string_view key, const std::vector<std::string>& known) {
  std::vector<std::string> names = table.texts(key);
  for (const std::string& name : names) check_engine(table, table.find(key), name, known);
  return names;
}

// Groups of engines: [["A", "B"], ["C"]].
std::vector<std::vector<std::string>> groups_of(const Table& table, const std::vector<std::string>& known) {
  constexpr const char* kForm = R"(a test needs 'order', groups of engines: [["A", "B"], ["C"]])";
  const toml::node* node = table.find("order");
  const toml::array* list = node == nullptr ? nullptr : node->as_array();
  if (list == nullptr || list->size() < 2) table.fail(node, kForm);
  std::vector<std::vector<std::string>> groups;
  for (const toml::node& item : *list) {
    const toml::array* names = item.as_array();
    if (names == nullptr || names->empty()) table.fail(&item, kForm);
    std::vector<std::string>& group = groups.emplace_back();
    for (const toml::node& each : *names) {
      const auto name = each.value_exact<std::string>();
      if (!name) table.fail(&each, kForm);
      check_engine(table, &each, *name, known);
      group.push_back(*name);
    }
  }
  return groups;
}

ClaimTest test_of(const toml::table& node, const std::string& source, const std::vector<std::string>& engines) {
  const Table table(node, "a test", source);
  const std::string kind = table.text("kind");
  const auto* found = std::ranges::find_if(kKinds, [&](const auto& each) { return each.first == kind; });
  if (found == kKinds.end()) {
    std::vector<std::string> known;
    known.reserve(kKinds.size());
    for (const auto& each : kKinds) known.emplace_back(each.first);
    table.fail(table.find("kind"), fmt::format("no kind of test is called '{}'{}", kind, did_you_mean(kind, known)));
  }
  ClaimTest test;
  test.kind = found->second;
  table.allow(keys_of(test.kind));
  if (table.has("family")) {
    if (table.has("systems")) table.fail(nullptr, "a test has either 'systems' or 'family'");
    test.family = table.text("family");
  } else {
    test.systems = table.texts("systems");
  }
  test.today = table.flag("today", true);
  test.value = table.text(test.kind == Kind::kUnstable ? "measure" : "value");
  if (test.kind == Kind::kLargestStep) {
    const toml::table* expected = table.find("expected") == nullptr ? nullptr : table.find("expected")->as_table();
    if (expected == nullptr || expected->empty()) table.fail(nullptr, "a test needs 'expected', timesteps by engine");
    for (const auto& [key, value] : *expected) {
      const std::string name(key.str());
      check_engine(table, &value, name, engines);
      test.expected[name] = table.number(name, value);
    }
    if (table.has("within")) test.within = table.positive("within");
    return test;
  }
  if (test.kind == Kind::kOrder) {
    test.order = groups_of(table, engines);
    return test;
  }
  test.who = engines_of(table, "who", engines);
  if (test.kind == Kind::kUnstable) {
    if (table.has("against")) test.against = engines_of(table, "against", engines);
    test.always = table.flag("always", false);
    if (test.always && !test.against.empty()) table.fail(nullptr, "a test has either 'against' or 'always'");
    return test;
  }
  test.bound = bound_of(table);
  if (test.kind == Kind::kAtTimestep || test.kind == Kind::kEqualSpeed) {
    test.against = engines_of(table, "against", engines);
    test.each = table.flag("each", false);
    if (table.has("but")) {
      const double but = table.positive("but");
      if (but != std::floor(but) || but >= static_cast<double>(test.against.size())) {
        table.fail(table.find("but"),
                   fmt::format("'but' is {}: give a whole number below the {} of 'against'", but, test.against.size()));
      }
      test.but = static_cast<int>(but);
    }
    const std::string is = table.has("is") ? table.text("is") : "less";
    if (is != "less" && is != "more") table.fail(table.find("is"), fmt::format("'is' is '{}': use less or more", is));
    test.more = is == "more";
  }
  if (table.has("timestep_ms")) test.timestep_ms = table.positive("timestep_ms");
  if (test.kind == Kind::kAtTimestep && !test.timestep_ms) table.fail(nullptr, "a test needs 'timestep_ms'");
  return test;
}

ClaimsFile claims_of(const toml::table& root, const std::string& source) {
  const Table top(root, "the file", source);
  top.allow({"engines", "claim"});
  ClaimsFile file;
  // The file's own engines, or else the paper's.
  if (const toml::table* engines = root["engines"].as_table()) {
    const Table own(*engines, "[engines]", source);
    for (const auto& [key, node] : *engines) file.engines.emplace_back(key.str(), own.texts(key.str()));
  } else if (top.has("engines")) {
    top.fail(top.find("engines"), "'engines' is no table: write [engines]");
  } else {
    file.engines = paper_line_up();
  }
  std::vector<std::string> names;
  names.reserve(file.engines.size());
  for (const auto& [engine, contenders] : file.engines) names.push_back(engine);
  const toml::array* claims = root["claim"].as_array();
  if (claims == nullptr || claims->empty()) top.fail(nullptr, "the file has no [[claim]]");
  std::set<int> numbers;
  for (const toml::node& node : *claims) {
    if (!node.is_table()) top.fail(&node, "'claim' is no list of tables: write [[claim]]");
    const Table table(*node.as_table(), "a claim", source);
    table.allow({"number", "title", "statement", "paper", "test"});
    Claim claim;
    const auto number = node.as_table()->get("number") == nullptr
                            ? std::nullopt
                            : node.as_table()->get("number")->value_exact<std::int64_t>();
    if (!number || *number < 1 || *number > 1000) table.fail(table.find("number"), "a claim needs a whole 'number'");
    claim.number = static_cast<int>(*number);
    if (!numbers.insert(claim.number).second) {
      table.fail(table.find("number"), fmt::format("two claims have number {}", claim.number));
    }
    claim.title = table.text("title");
    claim.statement = table.text("statement");
    claim.paper = table.text("paper");
    const toml::node* tests = table.find("test");
    if (tests == nullptr || !tests->is_array_of_tables()) table.fail(tests, "a claim needs [[claim.test]]");
    for (const toml::node& test : *tests->as_array()) claim.tests.push_back(test_of(*test.as_table(), source, names));
    file.claims.push_back(std::move(claim));
  }
  return file;
}

}  // namespace

ClaimsFile parse_claims(const std::string& toml, const std::string& source) {
  return claims_of(toml_table(toml, source), source);
}

ClaimsFile load_claims(const std::string& path) {
  constexpr std::uintmax_t kMostBytes = 16 << 20;
  return parse_claims(input_file(path, "the file of claims", "a TOML file", kMostBytes), path);
}

std::optional<std::string> paper_claims_file() {
  const std::filesystem::path path = std::filesystem::path(assay_data_dir()) / "campaigns" / "paper_claims.toml";
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
  return path.string();
}

}  // namespace assay
