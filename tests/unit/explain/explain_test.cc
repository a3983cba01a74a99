// Gaps, shares and their ranking, on made-up runs whose causes are known.
#include "explain/explain.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "measures/gap.h"

namespace assay {
namespace {

using testing::DoubleNear;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr size_t kSamples = 11;

Track along_x(const std::vector<double>& x) {
  Track track;
  track.bodies = 1;
  for (const double each : x) track.positions.emplace_back(each, 0, 0);
  return track;
}

TEST(Gap, IsTheMeanDistanceUntilRunsPart) {
  const Track still = along_x({0, 0, 0, 0, 0}), moving = along_x({0, 0.004, 0.008, 0.02, 5});
  const std::vector<double> curve = gap_curve(still, moving, 5);
  EXPECT_THAT(curve, ElementsAre(0, 0.004, 0.008, kFarMetres, kFarMetres));
  EXPECT_EQ(gap_window(curve), 4);
  EXPECT_NEAR(gap_of(curve, 4), (0.004 + 0.008 + 0.01) / 3, 1e-15);
  EXPECT_EQ(gap_window(std::vector<double>{0, 0.001, 0.002}), 3);
  EXPECT_EQ(gap_window(std::vector<double>{kFarMetres, kFarMetres, 0}), 2);
}

TEST(Gap, OfARunThatEndedEarlyCountsAsFar) {
  EXPECT_THAT(gap_curve(along_x({0, 0, 0}), along_x({0}), 3), ElementsAre(0, kFarMetres, kFarMetres));
  EXPECT_THAT(gap_curve(along_x({0, 0, 0}), Track(), 3), Each(kFarMetres));
}

TEST(Gap, IsTheMeanOverBodies) {
  State a, b;
  a.bodies.resize(2);
  b.bodies.resize(2);
  b.bodies[0].p_WBcm = {0.003, 0.004, 0};
  EXPECT_THAT(gap_curve(track_of({a}), track_of({b}), 1), ElementsAre(DoubleNear(0.0025, 1e-15)));
}

TEST(Gap, ShareIsPairedOverStarts) {
  const std::vector<double> before = {1, 2, 3, 10, 4, 6};
  std::vector<double> after;
  after.reserve(before.size());
  for (const double gap : before) after.push_back(0.25 * gap);
  const Interval share = share_closed(before, after, 1);
  // the spread of the starts is taken out of it
  EXPECT_NEAR(share.value, 0.75, 1e-12);
  EXPECT_NEAR(share.low, 0.75, 1e-12);
  EXPECT_NEAR(share.high, 0.75, 1e-12);
  std::ranges::reverse(after);
  const Interval crossed = share_closed(before, after, 1);
  EXPECT_NEAR(crossed.value, 0.75, 1e-12);
  EXPECT_LT(crossed.low, 0.74);
  EXPECT_GT(crossed.high, 0.76);
  EXPECT_EQ(share_closed(std::vector<double>(4, 0.0), std::vector<double>(4, 0.1), 1).value, 0);
  // some starts without a gap
  EXPECT_NEAR(share_closed(std::vector<double>{0, 0, 1, 1}, std::vector<double>{0, 0, 0.5, 0.5}, 1).low, 0.5, 1e-12);
}

// ---- made-up runs ----------------------------------------------------------------------------------------------------

bool has(const Side& side, const char* text) {
  return std::ranges::find(side.changes, parse_change(text)) != side.changes.end();
}

// Where a side's only body is at the end of its run from a start; it gets there evenly.
using Place = std::function<double(const Side&, int start)>;

MakeRuns runner(const Place& place) {
  return [place](const std::vector<Side>& sides, int starts) {
    std::vector<RunSet> sets;
    for (const Side& side : sides) {
      RunSet& set = sets.emplace_back();
      for (int start = 0; start < starts; ++start) {
        const double end = place(side, start);
        if (std::isnan(end)) {
          set.tracks.emplace_back();
          set.failure = "crashed (signal 11)";
          continue;
        }
        std::vector<double> x(kSamples);
        for (size_t i = 0; i < kSamples; ++i) x[i] = end * static_cast<double>(i) / (kSamples - 1);
        set.tracks.push_back(along_x(x));
      }
    }
    return sets;
  };
}

Swap swap_of(const std::string& cause, const char* a, const char* b, bool advice = true, bool many = false) {
  Swap swap{.cause = cause,
            .words = fmt::format("{} {} {}", cause, a, b),
            .advice = advice ? "do it" : "",
            .a = {},
            .b = {},
            .many = many};
  if (*a != '\0') swap.a = {parse_change(a)};
  if (*b != '\0') swap.b = {parse_change(b)};
  return swap;
}

Explanation explained(const Place& place, const std::vector<Swap>& swaps, int starts = 8,
                      const std::vector<KnownDeviation>& known = {}) {
  Pairing pairing;
  pairing.a = {.name = "A", .contender = "mujoco-euler"};
  pairing.b = {.name = "B", .contender = "mujoco-rk4"};
  pairing.timestep_ms = 1;
  return explain(pairing, [&] { return swaps; }, runner(place),
                 {.starts = starts, .samples = kSamples, .tolerance = 1e-7, .known = known});
}

// Two causes of B that add up, 6 mm and 2 mm, of slightly different size from each start.
double two_causes(const Side& side, int start) {
  const double size = 1 + 0.05 * start;
  const bool b = side.name == "B";
  double place = b ? 0 : 0.1;
  if (b || has(side, "armature=off")) place += 0.006 * size;
  if (b || has(side, "limits=off")) place += 0.002 * size;
  return place - (b ? 0 : 0.1);
}

TEST(Explain, LeavesTheSideThatIsRightAsItIs) {
  // B has half the friction, as it declares: the gap closes with half of it in A, with B's solver in A, or A's in B
  const auto place = [](const Side& side, int /*start*/) {
    const bool wrong =
        side.name == "B" ? !has(side, "set:solver=pgs") : has(side, "friction=0.5") || has(side, "set:solver=tgs");
    return wrong ? 0.004 : 0.0;
  };
  const Swap factor = swap_of("contact friction", "friction=0.5", ""),
             to_wrong = swap_of("solver", "set:solver=tgs", ""), to_right = swap_of("solver", "", "set:solver=pgs");
  const KnownDeviation half{true, "friction-of-links", "half the friction", {"contact friction"}};
  EXPECT_EQ(explained(place, {factor, to_wrong}).verdict, GapVerdict::kExplained) << "nothing is known of either";

  const Explanation left = explained(place, {factor, to_wrong}, 8, {half});
  EXPECT_THAT(left.advice, testing::IsEmpty());
  EXPECT_EQ(left.wrong_is_b, true);
  ASSERT_EQ(left.concerned.size(), 1);
  EXPECT_EQ(left.concerned[0].of, "friction-of-links");
  const Explanation found = explained(place, {factor, to_wrong, to_right}, 8, {half});
  ASSERT_EQ(found.advice.size(), 1);
  EXPECT_THAT(found.causes[found.advice[0].result].swap.a, testing::IsEmpty());

  // a deviation of both does not say who is right, one of another kind does not concern the gap
  const KnownDeviation own{false, "box-slides", "a pyramid", {"contact friction"}};
  EXPECT_EQ(explained(place, {factor}, 8, {half, own}).wrong_is_b, std::nullopt);
  const Explanation other = explained(place, {factor}, 8, {{true, "joint-limit", "soft", {"limits"}}});
  EXPECT_EQ(other.wrong_is_b, std::nullopt);
  EXPECT_THAT(other.concerned, testing::IsEmpty());
}

TEST(Explain, RanksCausesByTheirShares) {
  const Explanation found = explained(
      two_causes, {swap_of("limits", "limits=off", ""), swap_of("gear", "", "gear=-1"),
                   swap_of("armature", "armature=off", ""), swap_of("limits", "limits=off", "limits=off", false)});
  ASSERT_EQ(found.causes.size(), 3);
  EXPECT_EQ(found.causes[0].swap.cause, "armature");
  EXPECT_NEAR(found.causes[0].share.value, 0.75, 0.02);
  EXPECT_EQ(found.causes[1].swap.cause, "limits");
  EXPECT_NEAR(found.causes[1].share.value, 0.25, 0.02);
  EXPECT_NEAR(found.causes[2].share.value, 0, 1e-12);
  EXPECT_FALSE(found.causes[2].closes());
  ASSERT_EQ(found.where.size(), 1);
  ASSERT_EQ(found.advice.size(), 2);
  EXPECT_EQ(found.advice[0].result, 0);
  EXPECT_EQ(found.advice[1].result, 1);
  EXPECT_NEAR(found.advice[1].share.value, 1, 1e-9);
  EXPECT_NEAR(found.remaining.value, 0, 1e-12);
  EXPECT_EQ(found.verdict, GapVerdict::kExplained);
  EXPECT_LE(found.gap.low, found.gap.value);
  EXPECT_GE(found.gap.high, found.gap.value);
}

TEST(Explain, ACauseThatAnotherOneHidesIsNoAdvice) {
  const auto one = [](const Side& side, int) {
    return side.name == "B" || has(side, "armature=off") || has(side, "limits=off") ? 0.006 : 0.0;
  };
  const Explanation found =
      explained(one, {swap_of("limits", "limits=off", ""), swap_of("armature", "armature=off", "")});
  EXPECT_EQ(found.advice.size(), 1);
  EXPECT_EQ(found.verdict, GapVerdict::kExplained);
}

// Two equal contenders that blow up at the same sample.
TEST(Explain, RunsThatEndTogetherEndThePair) {
  const auto ending = [](size_t samples_of_b) {
    return [=](const std::vector<Side>& sides, int starts) {
      std::vector<RunSet> sets;
      for (const Side& side : sides) {
        RunSet& set = sets.emplace_back();
        set.early = "diverged (not a number)";
        const std::vector<double> x(side.name == "B" ? samples_of_b : kSamples / 2, 0.0);
        for (int start = 0; start < starts; ++start) set.tracks.push_back(along_x(x));
      }
      return sets;
    };
  };
  Pairing pairing;
  pairing.a = {.name = "A", .contender = "mujoco-euler"};
  pairing.b = {.name = "B", .contender = "mujoco-euler"};
  const ExplainOptions options{.starts = 4, .samples = kSamples, .tolerance = 1e-7};
  const auto none = [] { return std::vector<Swap>(); };
  const Explanation equal = explain(pairing, none, ending(kSamples / 2), options);
  EXPECT_EQ(equal.verdict, GapVerdict::kNoDifference);
  EXPECT_EQ(equal.gap.value, 0);
  EXPECT_EQ(equal.parted, 0);
  EXPECT_EQ(equal.early_b, "diverged (not a number)");
  const Explanation earlier = explain(pairing, none, ending((kSamples / 2) - 1), options);
  EXPECT_GT(earlier.gap.value, 0);
  EXPECT_EQ(earlier.parted, 4);
}

TEST(Explain, EqualRunsAreNoDifference) {
  bool asked = false;
  Pairing pairing;
  pairing.a = {.name = "A", .contender = "mujoco-euler"};
  pairing.b = {.name = "B", .contender = "mujoco-euler"};
  const Explanation found = explain(pairing,
                                    [&] {
                                      asked = true;
                                      return std::vector<Swap>();
                                    },
                                    runner([](const Side& side, int) { return side.name == "B" ? 1e-9 : 0.0; }),
                                    {.starts = 4, .samples = kSamples, .tolerance = 1e-7});
  EXPECT_EQ(found.verdict, GapVerdict::kNoDifference);
  EXPECT_FALSE(asked);
}

TEST(Explain, AGapThatIsTheTimesteps) {
  // A errs by 4 mm at the timestep, and by half of it at half of it
  const auto place = [](const Side& side, int start) {
    if (side.name == "B") return 0.0;
    return 0.004 * (1 + 0.01 * start) * (has(side, "timestep=0.5") ? 0.4 : 1);
  };
  std::vector<Swap> swaps = {swap_of(kTimestepCause, "timestep=0.5", "timestep=0.5"),
                             swap_of("limits", "limits=off", "")};
  // from itself at half the timestep it is 2.4 mm apart: less than the gap
  EXPECT_EQ(explained(place, swaps).verdict, GapVerdict::kPartlyExplained);
  const auto more = [&](const Side& side, int start) {
    return place(side, start) * (has(side, "timestep=0.5") ? -1 : 1);
  };
  EXPECT_EQ(explained(more, swaps).verdict, GapVerdict::kTimestepAlone);
  const auto both = [](const Side& side, int start) {
    const double size = 0.004 * (1 + 0.01 * start) * (has(side, "timestep=0.5") ? 0.1 : 1);
    return side.name == "A" ? size : 0.5 * size * (has(side, "timestep=0.5") ? -1 : 1);
  };
  EXPECT_EQ(explained(both, swaps).verdict, GapVerdict::kTimestepAlone);
  // a cause that closes it is named all the same
  swaps.push_back(swap_of("damping law", "dampers=explicit", ""));
  const auto law = [&](const Side& side, int start) {
    return has(side, "dampers=explicit") ? both({.name = "B", .contender = ""}, start) : both(side, start);
  };
  const Explanation found = explained(law, swaps);
  EXPECT_EQ(found.verdict, GapVerdict::kExplained);
  EXPECT_EQ(found.causes[0].swap.cause, "damping law");
}

TEST(Explain, ManyAreTriedFromAFewStartsFirst) {
  const auto gear = [](const Side& side, int) { return side.name == "B" && !has(side, "gear:b=-1") ? 0.005 : 0.0; };
  const Explanation found =
      explained(gear, {swap_of("gear", "", "gear:a=-1", true, true), swap_of("gear", "", "gear:b=-1", true, true)});
  EXPECT_EQ(found.causes[0].swap.b.front().element, "b");
  EXPECT_EQ(found.causes[0].starts, 8);
  EXPECT_EQ(found.causes[1].starts, 3);
}

TEST(Explain, ACrashIsAnOutcomeOfASwapAndTheEndOfAPair) {
  const auto crashing = [](const Side& side, int start) {
    return has(side, "contacts=off") ? std::nan("") : two_causes(side, start);
  };
  const Explanation found =
      explained(crashing, {swap_of("contacts", "contacts=off", ""), swap_of("armature", "armature=off", "")});
  EXPECT_EQ(found.causes.back().swap.cause, "contacts");
  EXPECT_THAT(found.causes.back().failure, HasSubstr("crashed"));
  EXPECT_EQ(found.verdict, GapVerdict::kPartlyExplained);
  EXPECT_THROW(explained([](const Side&, int) { return std::nan(""); }, {}), EngineError);
}

TEST(Explain, NothingThatClosesIsUnexplained) {
  const Explanation found = explained(two_causes, {swap_of("gear", "", "gear=-1")});
  EXPECT_EQ(found.verdict, GapVerdict::kUnexplained);
  EXPECT_EQ(found.remaining.value, found.gap.value);
}

}  // namespace
}  // namespace assay
