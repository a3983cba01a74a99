// New adapters start as copies of the skeleton, so it has to pass the conformance suite although it is not a plugin.
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "conformance/conformance.h"

extern "C" assay::PluginEntry assay_engine_plugin();  // the skeleton's, linked in

namespace assay {
namespace {

using testing::HasSubstr;
using testing::IsSupersetOf;

// Of the suite it passes what needs no hinge, and refuses the rest by name.
TEST(Skeleton, PassesTheGateOrRefuses) {
  const PluginEntry plugin = assay_engine_plugin();
  ASSERT_EQ(plugin.version, kPluginVersion);
  const std::unique_ptr<Engine> engine(plugin.make());
  ResolvedContender contender;
  contender.name = contender.base = "skeleton";
  contender.engine = engine.get();

  std::vector<std::string> passed;
  for (const ConformanceResult& result : run_conformance(contender)) {
    if (result.status == ConformanceStatus::kPass) passed.push_back(result.test);
    if (result.status == ConformanceStatus::kFail) {
      EXPECT_THAT(result.note, HasSubstr("skeleton: hinge"))
          << result.test << ": " << result.figure << " " << result.unit;
    }
  }
  EXPECT_THAT(passed, IsSupersetOf({"free-fall", "torque-free-top"}));
}

TEST(Skeleton, IsNotListedAsAContender) {
  EXPECT_THAT(Registry::instance().contender_names(), testing::Not(testing::Contains("skeleton")));
}

}  // namespace
}  // namespace assay
