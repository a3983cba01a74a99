// The list of measures: each object is whole for what it reads, and stored names find theirs.
#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "measures/batch.h"
#include "measures/measure.h"

namespace assay {
namespace {

const ValueInfo* row_of(const Measure& measure, std::string_view value) {
  const auto row = std::ranges::find(measure.values, value, &ValueInfo::name);
  return row == measure.values.end() ? nullptr : &*row;
}

TEST(MeasureList, EachHasWhatItsReaderCalls) {
  std::set<std::string_view> names;
  for (const Measure& measure : measures()) {
    EXPECT_TRUE(names.insert(measure.name).second) << measure.name;
    EXPECT_EQ(measure.of_run != nullptr, shares_runs(measure.reads)) << measure.name;
    EXPECT_EQ(measure.of_piece != nullptr, measure.reads == Reads::kPieces) << measure.name;
    EXPECT_EQ(measure.of_fine_runs != nullptr, measure.reads == Reads::kFineRuns) << measure.name;
    EXPECT_EQ(measure.experiment != nullptr, measure.of_experiment != nullptr) << measure.name;
    EXPECT_EQ(row_of(measure, measure.time) != nullptr, is_timed(measure.reads)) << measure.name;
    EXPECT_EQ(measure.values.empty(), measure.reads == Reads::kFineRun) << measure.name;
    if (!measure.held.empty()) {
      const ValueInfo* held = row_of(measure, measure.held);
      EXPECT_TRUE(held != nullptr && held->over_states == OverStates::kShare) << measure.name;
    }
  }
}

TEST(MeasureList, AStoredNameFindsItsMeasure) {
  for (const Measure& measure : measures()) {
    const std::string stored = measure.reads == Reads::kWorlds ? batch_name({16, "cuda:0"}) : std::string(measure.name);
    EXPECT_EQ(measure_of(stored), &measure);
    EXPECT_TRUE(reads(stored, measure.reads));
    EXPECT_EQ(is_timed(stored), is_timed(measure.reads));
  }
  EXPECT_EQ(measure_of("of-another-version"), nullptr);
  EXPECT_FALSE(reads("of-another-version", Reads::kRun));
  EXPECT_FALSE(is_timed("of-another-version"));
}

}  // namespace
}  // namespace assay
