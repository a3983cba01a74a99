// Pieces of work in processes of their own: one that crashes, hangs or throws is told, and the others go on.
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <map>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "isolate/activity.h"
#include "isolate/contained.h"

namespace assay {
namespace {

using testing::HasSubstr;
using Kind = PieceEnd::Kind;

std::map<size_t, PieceEnd> ends_of(size_t count, int jobs, double limit_s,
                                   const std::function<std::string(size_t)>& work) {
  std::map<size_t, PieceEnd> ends;
  run_pieces(
      {.count = count,
       .jobs = jobs,
       .limit_s = limit_s,
       .what = [](size_t piece) { return "piece " + std::to_string(piece); },
       .work = work,
       .on_end = [&](size_t piece, const PieceEnd& end) { EXPECT_TRUE(ends.emplace(piece, end).second) << piece; },
       .writable = {}});
  return ends;
}

TEST(Pieces, EachGivesItsOwnResult) {
  const auto ends = ends_of(20, 3, 60, [](size_t piece) { return std::string(100'000 * piece, 'x'); });
  ASSERT_EQ(ends.size(), 20U);
  for (const auto& [piece, end] : ends) {
    EXPECT_EQ(end.kind, Kind::kDone) << end.text;
    EXPECT_EQ(end.text.size(), 100'000 * piece);
  }
}

TEST(Pieces, NoneIsNone) {
  EXPECT_TRUE(ends_of(0, 2, 60, [](size_t) { return ""; }).empty());
}

TEST(Pieces, OneThatCrashesHangsOrThrowsLeavesTheOthers) {
  constexpr double kLimit = 0.5;  // s
  const auto ends = ends_of(7, 2, kLimit, [](size_t piece) -> std::string {
    if (piece == 1) {
      std::signal(SIGSEGV, SIG_DFL);  // a sanitizer would take it
      std::raise(SIGSEGV);
    }
    if (piece == 2) std::this_thread::sleep_for(std::chrono::hours(1));
    if (piece == 3) throw InputError("no such file");
    if (piece == 4) ::_exit(7);
    if (piece == 5) {
      const Activity reading("reading 'hostile.xml'");
      std::signal(SIGABRT, SIG_DFL);
      std::abort();
    }
    return "done";
  });
  ASSERT_EQ(ends.size(), 7U);
  for (const size_t piece : {0, 6}) EXPECT_EQ(ends.at(piece).text, "done");
  EXPECT_EQ(ends.at(1).kind, Kind::kCrashed);
  EXPECT_THAT(ends.at(1).text, HasSubstr("piece 1 ended with SIGSEGV"));
  EXPECT_EQ(ends.at(2).kind, Kind::kTooLong);
  EXPECT_THAT(ends.at(2).text, HasSubstr("piece 2 was stopped: it takes more than"));
  EXPECT_EQ(ends.at(3).kind, Kind::kThrew);
  EXPECT_EQ(ends.at(3).text, "no such file");
  EXPECT_EQ(ends.at(4).kind, Kind::kCrashed);
  EXPECT_THAT(ends.at(4).text, HasSubstr("piece 4 ended the process early, with status 7"));
  EXPECT_EQ(ends.at(5).kind, Kind::kCrashed);
  EXPECT_THAT(ends.at(5).text, HasSubstr("reading 'hostile.xml' ended with SIGABRT"));
}

TEST(Pieces, OneThatIsEndedFromOutsideIsTriedThreeTimes) {
  const auto ends = ends_of(2, 1, 60, [](size_t piece) -> std::string {
    if (piece == 0) std::raise(SIGKILL);
    return "done";
  });
  EXPECT_EQ(ends.at(0).kind, Kind::kCrashed);
  EXPECT_THAT(ends.at(0).text, HasSubstr("piece 0 was ended from outside (SIGKILL)"));
  EXPECT_EQ(ends.at(1).text, "done");
}

TEST(Pieces, AResultHasABound) {
  const auto ends = ends_of(2, 2, 60, [](size_t piece) { return std::string(piece == 0 ? size_t{65} << 20 : 3, 'x'); });
  EXPECT_EQ(ends.at(0).kind, Kind::kCrashed);
  EXPECT_THAT(ends.at(0).text, HasSubstr("64 MiB"));
  EXPECT_EQ(ends.at(1).text, "xxx");
}

}  // namespace
}  // namespace assay
