#include <gmock/gmock.h>

#include "match/config.h"
#include "message_of.h"

namespace assay::match {
namespace {

using ::testing::HasSubstr;

std::string said(const std::string& text) {
  return message_of([&] { parse_match_config(text, "match.toml"); });
}

TEST(MatchConfig, ReadsEverythingThatThereIs) {
  const MatchConfig config = parse_match_config(R"([drive]
law = "pd"
stiffness = {knee = 30, hip = 50}
damping = 1
median = 5
[rows]
"run_*" = [[3, 4], [0, 1]]
[held_out]
logs = ["run_3"]
seed = 7
[windows]
fit_s = 0.25
report_s = 1
whole = true
[fit]
"mass:thigh" = [0.5, 2]
damping = true
armature = false
)",
                                                "match.toml");
  EXPECT_EQ(config.law, DriveLaw::kPd);
  EXPECT_EQ(config.stiffness.at("knee"), 30);
  EXPECT_EQ(config.damping.at(""), 1);
  EXPECT_EQ(config.torque_median, 5);
  ASSERT_EQ(config.rows.size(), 1);
  EXPECT_EQ(config.rows[0].second.front().second, 1);
  EXPECT_EQ(config.held_out.front(), "run_3");
  EXPECT_EQ(config.seed, 7);
  EXPECT_TRUE(config.whole_motions.value());
  ASSERT_EQ(config.fit.size(), 3);
  EXPECT_EQ(config.fit[0].parameter, "mass:thigh");  // in the file's order
  EXPECT_EQ(config.fit[0].upper, 2);
  EXPECT_TRUE(config.fit[1].fit);
  EXPECT_FALSE(config.fit[2].fit);
}

TEST(MatchConfig, RefusesWithLineAndFix) {
  EXPECT_THAT(said("[unit]\n"), HasSubstr("did you mean 'units'?"));
  EXPECT_THAT(said("[units]\nangle = \"grad\"\n"), HasSubstr("match.toml:2: 'angle' is 'grad': use one of rad, deg"));
  EXPECT_THAT(said("[drive]\nlaw = \"pd\"\n"), HasSubstr("no 'stiffness'"));
  EXPECT_THAT(said("[drive]\nstiffness = 3\n"), HasSubstr("only of law = \"pd\""));
  EXPECT_THAT(said("[drive]\nmedian = 4\n"), HasSubstr("an odd number"));
  EXPECT_THAT(said("[scale]\nknee = 0\n"), HasSubstr("leaves nothing of it"));
  EXPECT_THAT(said("[scale]\nknee = \"a\"\n"), HasSubstr("give a finite number"));
  EXPECT_THAT(said("[rows]\nrun = [[2, 1]]\n"), HasSubstr("give the lower number first"));
  EXPECT_THAT(said("[rows]\nrun = [[0, 2], [1, 3]]\n"), HasSubstr("overlap at 1 s"));
  EXPECT_THAT(said("[held_out]\nshare = 1\n"), HasSubstr("a number below 1"));
  EXPECT_THAT(said("[held_out]\nshare = 0.5\nleave_one_out = true\n"), HasSubstr("give one"));
  EXPECT_THAT(said("[fit]\nmass = 3\n"), HasSubstr("true, false or bounds"));
  EXPECT_THAT(said("[fit]\nmass = [2, nan]\n"), HasSubstr("give a finite number"));
}

TEST(MatchConfig, NoFileGivesTheDefaults) {
  const MatchConfig config = read_match_config("");
  EXPECT_EQ(config.fit_window_s, 0.5);
  EXPECT_EQ(config.report_window_s, 2);
  EXPECT_EQ(config.torque_median, 9);
  EXPECT_FALSE(config.law.has_value());
}

}  // namespace
}  // namespace assay::match
