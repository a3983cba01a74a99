// The course over releases: groups of equal bits, changes beyond the noise, releases that cannot be used, and the
// search by halves; what differs between the probes of two releases.
#include "bisect/bisect.h"

#include <cmath>
#include <set>

#include <gmock/gmock.h>

#include "bisect/probes.h"
#include "conformance/conformance.h"

namespace assay {
namespace {

using testing::ElementsAre, testing::IsEmpty, testing::SizeIs;

// Releases by their levels; a negative one cannot be used.
struct Releases {
  std::vector<double> levels;
  std::set<size_t> run = {};

  ReleaseCourse course(bool quick, double noise = 0) {
    const RunReleases make = [this](const std::vector<size_t>& which) {
      std::vector<ReleaseResult> results;
      for (const size_t i : which) {
        run.insert(i);
        const bool usable = levels[i] >= 0;
        results.push_back({std::to_string(i), usable ? "" : "withdrawn", usable ? std::to_string(levels[i]) : ""});
      }
      return results;
    };
    return find_course(levels.size(), quick, noise, make,
                       [this](size_t a, size_t b) { return std::abs(levels[a] - levels[b]); });
  }
};

std::vector<std::pair<size_t, size_t>> ends(const ReleaseCourse& course) {
  std::vector<std::pair<size_t, size_t>> found;
  for (const ReleaseChange& change : course.changes) found.emplace_back(change.before, change.after);
  return found;
}

TEST(Bisect, NeighboursWithTheSameBitsAreOneGroup) {
  const ReleaseCourse course = Releases{{1, 1, 2, 2, 2, 1}}.course(false);
  EXPECT_THAT(ends(course), ElementsAre(std::pair(1, 2), std::pair(4, 5)));
  ASSERT_THAT(course.groups, SizeIs(3));
  EXPECT_EQ(course.groups[1].first, 2U);
  EXPECT_EQ(course.groups[1].last, 4U);
  EXPECT_FALSE(course.groups[1].inferred);
  EXPECT_EQ(course.changes[0].size, 1);
}

TEST(Bisect, RepetitionsOfOneReleaseHaveNoChange) {
  const ReleaseCourse course = Releases{std::vector<double>(20, 3.0)}.course(false);
  EXPECT_THAT(course.changes, IsEmpty());
  EXPECT_THAT(course.groups, SizeIs(1));
}

TEST(Bisect, WhatOneReleaseScattersIsNoChange) {
  const ReleaseCourse course = Releases{{1, 1.01, 0.99, 2, 2.02}}.course(false, 0.1);
  EXPECT_THAT(ends(course), ElementsAre(std::pair(2, 3)));
}

TEST(Bisect, HalvesFindEveryChangeWithFewerRuns) {
  std::vector<double> levels(26, 1);
  std::fill(levels.begin() + 9, levels.end(), 2);
  Releases releases{levels};
  const ReleaseCourse course = releases.course(true);
  EXPECT_THAT(ends(course), ElementsAre(std::pair(8, 9)));
  EXPECT_LE(releases.run.size(), 8U);
  EXPECT_TRUE(course.groups[0].inferred);
}

TEST(Bisect, ReleasesThatCannotBeUsedWidenTheInterval) {
  for (const bool quick : {false, true}) {
    const ReleaseCourse course = Releases{{1, 1, -1, -1, 2, 2}}.course(quick);
    EXPECT_THAT(ends(course), ElementsAre(std::pair(1, 4))) << quick;
  }
  EXPECT_THAT(ends(Releases{{-1, 1, 1, 2, -1}}.course(true)), ElementsAre(std::pair(2, 3)));
  EXPECT_THAT(Releases({{-1, -1}}).course(true).groups, IsEmpty());
}

TEST(Probes, DifferenceBeyondRoundingIsAChange) {
  const std::vector<ProbeValue> before = {{"limits", "hinge", "violation", "rad", 0.25},
                                          {"margins", "two", "contacts", "1", 0}};
  std::vector<ProbeValue> after = before;
  EXPECT_THAT(probe_changes(before, after), IsEmpty());
  after[0].value *= 1 + 1e-12;
  after[1].value = 1;
  const std::vector<ProbeChange> changes = probe_changes(before, after);
  ASSERT_THAT(changes, SizeIs(1));
  EXPECT_EQ(probe_change_text(changes[0]), "margins (two): contacts 0 to 1");
}

TEST(Probes, AFigureHasToMoveByWhatCounts) {
  const std::vector<ProbeValue> before = {{"conformance", "free-fall", "figure", "m", 1e-6, 1e-8}};
  std::vector<ProbeValue> after = before;
  after[0].value += 0.9e-8;
  EXPECT_THAT(probe_changes(before, after), IsEmpty());
  after[0].value += 0.2e-8;
  EXPECT_THAT(probe_changes(before, after), SizeIs(1));
}

TEST(Probes, OfTheSuiteAreTestsOfIt) {
  std::set<std::string> known;
  for (const ConformanceTest& test : conformance_tests()) known.insert(test.name);
  for (const char* name : suite_probes()) EXPECT_TRUE(known.contains(name)) << name;
}

}  // namespace
}  // namespace assay
