#include "base/text.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/hash.h"

namespace assay {
namespace {

using testing::Eq;
using testing::Optional;

TEST(Text, NearestNameForgivesAMisspelling) {
  const std::vector<std::string> names = {"mujoco-euler", "mujoco-rk4", "bullet-mb", "ode-step"};
  EXPECT_THAT(nearest_name("mujoco-elur", names), Optional(Eq("mujoco-euler")));
  EXPECT_THAT(nearest_name("ode-setp", names), Optional(Eq("ode-step")));  // a swap is one edit
  EXPECT_THAT(nearest_name("bullet-mb", names), Optional(Eq("bullet-mb")));
  EXPECT_THAT(nearest_name("rk4", {"rk4x", "rk4"}), Optional(Eq("rk4")));
}

TEST(Text, NearestNameDoesNotGuessWildly) {
  EXPECT_EQ(nearest_name("havok", {"mujoco-euler", "ode-step"}), std::nullopt);
  EXPECT_EQ(nearest_name("abc", {}), std::nullopt);
  // at most two edits on short words, a third of the length on long ones
  EXPECT_EQ(nearest_name("abcdef", {"abcxyz"}), std::nullopt);
  EXPECT_THAT(nearest_name("abcdef", {"abcdxy"}), Optional(Eq("abcdxy")));
  EXPECT_THAT(nearest_name("abcdefghi", {"abcdefxyz"}), Optional(Eq("abcdefxyz")));
}

TEST(Text, DidYouMean) {
  EXPECT_EQ(did_you_mean("sien", {"sine", "passive"}), " (did you mean 'sine'?)");
  EXPECT_EQ(did_you_mean("quadratic", {"sine", "passive"}), " (known: sine, passive)");
  EXPECT_EQ(did_you_mean("x", {}), "");
}

TEST(Text, ShortestReadsBackTheSame) {
  EXPECT_EQ(shortest(0.1), "0.1");
  EXPECT_EQ(shortest(1e-6), "1e-06");
  for (const double value : {1.0 / 3, 0.1 + 0.2, 1e300, 5e-324, -123456.789}) {
    EXPECT_THAT(parse_number(shortest(value)), Optional(Eq(value)));
    EXPECT_THAT(parse_number(digits17(value)), Optional(Eq(value)));
  }
}

TEST(Text, ParseNumberTakesWholeFiniteNumbersOnly) {
  EXPECT_THAT(parse_number("-2.5e3"), Optional(Eq(-2500.0)));
  for (const char* text : {"", " 1", "1 ", "1x", "nan", "inf", "1e999", "0x10", "1,5", "--1"}) {
    EXPECT_EQ(parse_number(text), std::nullopt) << text;
  }
}

TEST(Text, ParseIntegerTakesWholeIntegersOnly) {
  EXPECT_THAT(parse_integer("-12"), Optional(Eq(-12LL)));
  for (const char* text : {"", "1.0", "1e3", "12 ", "99999999999999999999"}) {
    EXPECT_EQ(parse_integer(text), std::nullopt) << text;
  }
}

TEST(Text, TimestepsAreFractionsOrNumbers) {
  EXPECT_THAT(parse_fraction("1/64"), Optional(Eq(0.015625)));
  EXPECT_THAT(parse_fraction("0.5"), Optional(Eq(0.5)));
  EXPECT_THAT(parse_fraction("4"), Optional(Eq(4.0)));
  for (const char* text : {"", "/", "1/", "/2", "1/0", "1/2/3", "a/b", "1 / 2"}) {
    EXPECT_EQ(parse_fraction(text), std::nullopt) << text;
  }
}

TEST(Text, TimestepLabelsReadBack) {
  EXPECT_EQ(timestep_label(1.0 / 64), "1/64");
  EXPECT_EQ(timestep_label(0.5), "1/2");
  EXPECT_EQ(timestep_label(32), "32");
  EXPECT_EQ(timestep_label(0.3), "0.3");
  for (int exponent = -6; exponent <= 5; ++exponent) {
    const double step = std::ldexp(1.0, exponent);
    EXPECT_THAT(parse_fraction(timestep_label(step)), Optional(Eq(step)));
  }
}

TEST(Text, Join) {
  EXPECT_EQ(join({}, ", "), "");
  EXPECT_EQ(join({"a"}, ", "), "a");
  EXPECT_EQ(join({"a", "b", "c"}, ", "), "a, b, c");
}

TEST(Hash, DependsOnEveryByte) {
  EXPECT_EQ(content_hash("abc"), content_hash(std::string("abc")));
  EXPECT_NE(content_hash("abc"), content_hash("abd"));
  EXPECT_NE(content_hash("abc"), content_hash("ab"));
  EXPECT_THAT(content_hash(""), testing::MatchesRegex("[0-9a-f]{32}"));
}

}  // namespace
}  // namespace assay
