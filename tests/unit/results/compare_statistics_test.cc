// The statistics of comparisons: rank tests, corrections for many of them, and the places where a series changes.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "measures/rank_test.h"
#include "measures/statistics.h"
#include "results/compare/change_points.h"

namespace assay {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(RankTest, OfSeparatedSamplesIsOneOrderOfAll) {
  const std::vector<double> low = {1, 2, 3, 4, 5}, high = {6, 7, 8, 9, 10};
  EXPECT_NEAR(rank_test(low, high), 2.0 / 252, 1e-12);
  EXPECT_NEAR(rank_test(high, low), 2.0 / 252, 1e-12);
  EXPECT_NEAR(smallest_rank_p(5, 5), 2.0 / 252, 1e-12);
}

// U = 5 of 0 to 12 with 3 and 4 samples: 12 + ... orders counted by hand from all 35.
TEST(RankTest, IsExactForFewSamples) {
  const std::vector<double> a = {1, 4, 6}, b = {2, 3, 5, 7};
  size_t as_extreme = 0, orders = 0;
  std::vector<int> which = {0, 0, 0, 0, 1, 1, 1};
  do {
    int u = 0;
    for (size_t i = 0; i < which.size(); ++i) {
      for (size_t k = 0; k < i; ++k) u += which[i] == 1 && which[k] == 0 ? 1 : 0;
    }
    ++orders;
    as_extreme += std::min(u, 12 - u) <= 5 ? 1 : 0;
  } while (std::ranges::next_permutation(which).found);
  EXPECT_EQ(orders, 35U);
  EXPECT_NEAR(rank_test(a, b), std::min(1.0, static_cast<double>(as_extreme) / 35.0), 1e-12);
}

TEST(RankTest, ApproximationAgreesWithTheExactTest) {
  std::mt19937_64 random(4);  // NOLINT(bugprone-random-generator-seed): the same test each time
  std::normal_distribution<double> normal;
  std::vector<double> a(20), b(20);
  for (double& sample : a) sample = normal(random);
  for (double& sample : b) sample = normal(random) + 0.6;
  const double exact = rank_test(a, b);
  std::vector<double> tied = b;
  a.push_back(100);
  tied.push_back(100);  // one tie: the approximation
  EXPECT_NEAR(rank_test(a, tied) / exact, 1, 0.35);
}

TEST(RankTest, AlarmsAsOftenAsItSays) {
  std::mt19937_64 random(7);  // NOLINT(bugprone-random-generator-seed): the same test each time
  std::normal_distribution<double> normal;
  int alarms = 0;
  constexpr int kTrials = 2000;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<double> a(8), b(8);
    for (double& sample : a) sample = normal(random);
    for (double& sample : b) sample = normal(random);
    alarms += rank_test(a, b) <= 0.05 ? 1 : 0;
  }
  EXPECT_LT(alarms, 0.065 * kTrials);
  EXPECT_GT(alarms, 0.03 * kTrials);
}

TEST(Correction, IsThatOfBenjaminiAndHochberg) {
  const std::vector<double> corrected = corrected_for_number({0.01, 0.04, 0.03, 0.005});
  const std::vector<double> expected = {0.02, 0.04, 0.04, 0.02};
  for (size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(corrected[i], expected[i], 1e-12);
  EXPECT_THAT(corrected_for_number({}), IsEmpty());
}

TEST(Correction, OfFamiliesIsTheLargerOfHolmOverThemAndBenjaminiAndHochbergWithin) {
  // Simes: 0.02 of a (2 * 0.02 / 2), 0.004 of b, 0.5 of c; Holm: 3 * 0.004, 2 * 0.02, 0.5
  const std::vector<double> corrected = corrected_by_family({0.02, 0.016, 0.004, 0.5}, {"a", "a", "b", "c"});
  const std::vector<double> expected = {0.04, 0.04, 0.012, 0.5};
  for (size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(corrected[i], expected[i], 1e-12) << i;
  EXPECT_THAT(corrected_by_family({}, {}), IsEmpty());
}

TEST(Correction, OfFamiliesNamesNoneInWhichNothingDiffersHoweverMuchOthersDo) {
  std::mt19937_64 random(11);  // NOLINT(bugprone-random-generator-seed): the same test each time
  std::uniform_real_distribution<double> uniform;
  int alarms = 0;
  constexpr int kTrials = 2000;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<double> p(20, 1e-9);  // all of "changed"
    std::vector<std::string> family(20, "changed");
    for (int other = 0; other < 10; ++other) {
      for (int i = 0; i < 20; ++i) {
        p.push_back(uniform(random));
        family.push_back(fmt::format("same-{}", other));
      }
    }
    const std::vector<double> corrected = corrected_by_family(p, family);
    EXPECT_LE(corrected[19], 0.05);
    alarms += std::any_of(corrected.begin() + 20, corrected.end(), [](double q) { return q <= 0.05; }) ? 1 : 0;
  }
  EXPECT_LT(alarms, 0.065 * kTrials);
}

TEST(StudentT, PValuesAgreeWithItsQuantiles) {
  for (const int freedom : {1, 2, 5, 10, 40}) EXPECT_NEAR(student_t_p(student_t_975(freedom), freedom), 0.05, 1e-4);
  EXPECT_NEAR(student_t_p(-2.5, 7), 0.04099, 1e-4) << "two-sided";
  EXPECT_EQ(student_t_p(0, 3), 1);
}

std::vector<double> noisy(const std::vector<double>& levels, double noise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, noise);
  std::vector<double> series = levels;
  for (double& figure : series) figure += normal(random);
  return series;
}

TEST(ChangePoints, AreWhereTheLevelChanged) {
  std::vector<double> levels(30, 1.0);
  std::fill(levels.begin() + 10, levels.begin() + 20, 2.0);
  const std::vector<double> series = noisy(levels, 0.1, 3);
  EXPECT_THAT(change_points(series, 0.1, 15), ElementsAre(10, 20));
  EXPECT_THAT(change_points(noisy(std::vector<double>(30, 1.0), 0.1, 3), 0.1, 15), IsEmpty());
  EXPECT_THAT(change_points(std::vector<double>{1, 2}, 0.1, 1), IsEmpty()) << "segments have two figures at least";
}

TEST(ChangePoints, NoiseIsThatBetweenNeighbours) {
  std::vector<double> levels(400, 1.0);
  std::fill(levels.begin() + 200, levels.end(), 5.0);
  EXPECT_NEAR(noise_of(noisy(levels, 0.1, 5)), 0.1, 0.02) << "a change of level is no noise";
}

}  // namespace
}  // namespace assay
