// One test for every contender x conformance test; a declared deviation passes, a missing capability is a skip that
// names it.
#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <map>
#include <ostream>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "conformance/conformance.h"

namespace assay {
namespace {

struct Pair {
  std::string contender, test;
};

std::ostream& operator<<(std::ostream& out, const Pair& pair) { return out << pair.contender << " " << pair.test; }

// Engines whose adapters are in Python cannot share a process, and are tested on demand: ASSAY_TEST_ENGINE names one,
// which then is the only one.
bool is_tested(const Registry& registry, const std::string& engine) {
  // the null engine measures the harness and simulates nothing; faults_test.cc shows that the suite fails it
  if (engine == "null") return false;
  const char* wanted = std::getenv("ASSAY_TEST_ENGINE");
  return wanted != nullptr ? engine == wanted : registry.plugin_path(engine).ends_with(".so");
}

// Contenders of an engine that differ in numbers only, such as iterations, go the same ways through its adapter: the
// first of them is tested always, the others on demand (ASSAY_TEST_SETTINGS=others), as is Havok in a Node of its own,
// which takes as long as ten native contenders. Campaigns ask the suite about each of their contenders anyway.
std::vector<std::string> tested_contenders(const Engine& engine) {
  const char* wanted = std::getenv("ASSAY_TEST_SETTINGS");
  const bool others = wanted != nullptr && std::string(wanted) == "others";
  std::set<std::map<std::string, SettingValue>> seen;
  std::vector<std::string> names;
  for (const Contender& contender : engine.contenders()) {
    std::map<std::string, SettingValue> choices = contender.set;
    std::erase_if(choices, [](const auto& setting) {
      return std::holds_alternative<long long>(setting.second) || std::holds_alternative<double>(setting.second);
    });
    const bool first = seen.insert(choices).second && engine.name() != "havok-node";
    if (first != others || std::getenv("ASSAY_TEST_ENGINE") != nullptr) names.push_back(contender.name);
  }
  return names;
}

std::vector<Pair> all_pairs() {
  const Registry& registry = Registry::instance();
  std::vector<Pair> pairs;
  for (const Engine* engine : registry.engines()) {
    if (!is_tested(registry, engine->name())) continue;
    for (const std::string& contender : tested_contenders(*engine)) {
      for (const ConformanceTest& test : conformance_tests()) pairs.push_back({contender, test.name});
    }
  }
  return pairs;
}

class Contenders : public testing::TestWithParam<Pair> {};

TEST_P(Contenders, Conform) {
  const ResolvedContender contender = Registry::instance().resolve(GetParam().contender);
  const auto results = run_conformance(contender, {.tests = {GetParam().test}});
  ASSERT_EQ(results.size(), 1U);
  const ConformanceResult& result = results.front();
  const std::string text = fmt::format("{}: {:.4g} (tolerance {:.4g}) {} -- {}", status_text(result.status),
                                       result.figure, result.tolerance, result.unit, result.note);
  if (result.status == ConformanceStatus::kNotApplicable) GTEST_SKIP() << text;
  EXPECT_NE(result.status, ConformanceStatus::kFail) << text;
  RecordProperty("verdict", text);
}

INSTANTIATE_TEST_SUITE_P(All, Contenders, testing::ValuesIn(all_pairs()), [](const auto& parameter) {
  std::string name = parameter.param.contender + "__" + parameter.param.test;
  std::ranges::replace_if(name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
});

}  // namespace
}  // namespace assay
