// Cells that do not count until they are measured again.
#include "results/withdrawn.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"

namespace assay {
namespace {

using nlohmann::json;

constexpr const char* kList = R"(
[[withdrawn]]
contenders = ["slippery-*"]
except = ["slippery-dry*"]
where = "contacts of joined bodies"
except_models = ["ball.xml"]
before = 2026-01-02T00:00:00Z
why = "it slides too far"
[[withdrawn]]
contenders = ["restless"]
where = "rest"
measures = ["consistency", "batch-*"]
before = 2026-01-02T01:00:00+01:00
why = "it rolls away"
)";

const json kRobot = {{"model", "robot.xml"}, {"contacts", true}, {"contact_pairs", 4}, {"hinges", 12}, {"dof", 18}};
const json kPile = {{"model", "pile.xml"}, {"contacts", true}, {"contact_pairs", 9}, {"hinges", 0}, {"dof", 18}};
constexpr double kBefore = 1767312000 - 1;  // the last second of 2026-01-01

std::string why(const std::string& contender, const json& facts, const std::string& measure = "consistency",
                double started = kBefore) {
  Cell cell;
  cell.contender = contender;
  cell.measure = measure;
  cell.started = started;
  return why_withdrawn(parse_withdrawals(kList, "list.toml"), cell, facts);
}

json with(json facts, const char* name, const json& value) {
  facts[name] = value;
  return facts;
}

TEST(Withdrawn, ByContenderPlaceAndTime) {
  EXPECT_EQ(why("slippery-tgs", kRobot), "it slides too far");
  EXPECT_EQ(why("slippery-tgs it=4", kRobot, "raw_speed"), "it slides too far");
  EXPECT_EQ(why("slippery-dry", kRobot), "");
  EXPECT_EQ(why("steady", kRobot), "");
  EXPECT_EQ(why("slippery-tgs", kPile), "");  // no joints
  EXPECT_EQ(why("slippery-tgs", with(kRobot, "contacts", false)), "");
  EXPECT_EQ(why("slippery-tgs", with(kRobot, "contact_pairs", 0)), "");
  EXPECT_EQ(why("slippery-tgs", with(kRobot, "model", "ball.xml")), "");
  EXPECT_EQ(why("slippery-tgs", kRobot, "violation", kBefore + 1), "");
  EXPECT_EQ(why("slippery-tgs", kRobot, "violation", 0), "");  // results that do not say when
  EXPECT_EQ(why("slippery-tgs", json::object()), "");
}

TEST(Withdrawn, RestNeedsGravityAndBodiesWithoutJoints) {
  EXPECT_EQ(why("restless", kPile), "it rolls away");
  EXPECT_EQ(why("restless", kPile, "batch-256"), "it rolls away");
  EXPECT_EQ(why("restless", kPile, "raw_speed"), "");
  EXPECT_EQ(why("restless", kPile, "consistency", kBefore + 1), "");  // the same moment in another time zone
  EXPECT_EQ(why("restless", with(kPile, "gravity", {0, 0, 0})), "");
  EXPECT_EQ(why("restless", with(kRobot, "dof", 12)), "");
}

TEST(Withdrawn, MistakesOfTheListAreNamed) {
  const auto error_of = [](const std::string& text) -> std::string {
    try {
      parse_withdrawals(text, "list.toml");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const std::string start = "[[withdrawn]]\ncontenders = [\"a\"]\n";
  EXPECT_THAT(error_of(start + "where = \"beds\"\n"), testing::HasSubstr("'where' is 'beds': use contacts"));
  EXPECT_THAT(error_of(start + "where = \"rest\"\nwhy = \"b\"\n"), testing::HasSubstr("list.toml:1: give the time"));
  EXPECT_THAT(error_of("[[withdrawn]]\nwhere = \"rest\"\n"), testing::HasSubstr("patterns of 'contenders'"));
  EXPECT_FALSE(withdrawals().empty());
}

}  // namespace
}  // namespace assay
