#include "conformance/kept_verdicts.h"

#include <filesystem>

#include <gtest/gtest.h>

#include "temp_folder.h"

namespace assay {
namespace {

ConformanceResult of(const std::string& test, ConformanceStatus status) {
  ConformanceResult result;
  result.test = test, result.status = status;
  return result;
}

using KeptVerdicts = TempFolderTest;

TEST_F(KeptVerdicts, AreReadAsTheyWereKept) {
  const std::string file = kept_verdicts_file(dir_.string(), "contender", false);
  keep_verdicts(file, {of("readback", ConformanceStatus::kPass), of("free-fall", ConformanceStatus::kFail)});
  const auto kept = kept_verdicts(file);
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_EQ(kept[1].test, "free-fall");
  EXPECT_EQ(kept[1].status, ConformanceStatus::kFail);
}

// As where an environment's folder was moved away: the next campaign has to try again.
TEST_F(KeptVerdicts, AnEngineThatDidNotStartHasNone) {
  const std::string file = kept_verdicts_file(dir_.string(), "contender", false);
  keep_verdicts(file, {of("readback", ConformanceStatus::kFail), of("ball", ConformanceStatus::kNotApplicable)});
  EXPECT_FALSE(std::filesystem::exists(file));
}

}  // namespace
}  // namespace assay
