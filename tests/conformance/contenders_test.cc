// One test for every contender x conformance test; a declared deviation passes, a missing capability is a skip that
// names it. Names have underscores for hyphens, which GoogleTest's filters keep for themselves.
#include <algorithm>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "conformance/conformance.h"

namespace assay {
namespace {

class ContenderTest : public testing::Test {
 public:
  ContenderTest(std::string contender, std::string test) : contender_(std::move(contender)), test_(std::move(test)) {}

  void TestBody() override {
    const ResolvedContender contender = Registry::instance().resolve(contender_);
    const auto results = run_conformance(contender, {.tests = {test_}});
    ASSERT_EQ(results.size(), 1U);
    const ConformanceResult& result = results.front();
    const std::string text = fmt::format("{}: {:.4g} (tolerance {:.4g}) {} -- {}", status_text(result.status),
                                         result.figure, result.tolerance, result.unit, result.note);
    if (result.status == ConformanceStatus::kNotApplicable) GTEST_SKIP() << text;
    EXPECT_NE(result.status, ConformanceStatus::kFail) << text;
    RecordProperty("verdict", text);
  }

 private:
  std::string contender_, test_;
};

std::string identifier(std::string name) {
  std::ranges::replace_if(name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

}  // namespace
}  // namespace assay

int main(int argc, char** argv) {
  using namespace assay;
  testing::InitGoogleTest(&argc, argv);
  const Registry& registry = Registry::instance();
  for (const Engine* engine : registry.engines()) {
    // the null engine is the harness's zero and simulates nothing; faults_test.cc shows that the gate refuses it
    if (engine->name() == "null") continue;
    for (const Contender& contender : engine->contenders()) {
      for (const ConformanceTest& test : conformance_tests()) {
        testing::RegisterTest(identifier(contender.name).c_str(), identifier(test.name).c_str(), nullptr, nullptr,
                              __FILE__, __LINE__, [contender = contender.name, test = test.name]() -> testing::Test* {
                                return new ContenderTest(contender, test);
                              });
      }
    }
  }
  return RUN_ALL_TESTS();
}
