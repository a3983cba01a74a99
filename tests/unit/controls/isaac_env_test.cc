#include "controls/isaac_env.h"

#include <gtest/gtest.h>

#include "base/errors.h"
#include "controls/pattern.h"
#include "controls/yaml_tree.h"
#include "load/mjcf.h"

namespace assay {
namespace {

TEST(YamlTree, AnAliasIsTheNodeOfItsAnchor) {
  const YamlTree tree = YamlTree::parse("a: &x [1, 2]\nb: *x\nc: null\nd: 'null'\n", "x.yaml");
  const YamlNode& root = tree.root();
  ASSERT_EQ(root.kind, YamlNode::Kind::kMap);
  EXPECT_EQ(root.find("a"), root.find("b"));
  EXPECT_EQ(root.find("a")->items.size(), 2U);
  EXPECT_EQ(root.find("b")->line, 1);
  EXPECT_TRUE(root.find("c")->is_null());
  EXPECT_FALSE(root.find("d")->is_null());
  EXPECT_EQ(root.find("e"), nullptr);
}

TEST(YamlTree, TagsAreOnlyNames) {
  const YamlTree tree = YamlTree::parse("a: !!python/tuple [1]\nb: !own 3\nc: 4\n", "x.yaml");
  EXPECT_EQ(tree.root().find("a")->tag, "python/tuple");
  EXPECT_EQ(tree.root().find("b")->tag, "!own");
  EXPECT_EQ(tree.root().find("c")->tag, "");
}

TEST(YamlTree, ErrorsHaveTheLine) {
  try {
    YamlTree::parse("a: 1\nb: *nothing\n", "x.yaml");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("x.yaml:2"), std::string::npos) << error.what();
  }
}

TEST(YamlTree, DeepNestingIsRefusedBeforeItCostsTime) {
  std::string deep = "a: 1\nb: ";
  for (int i = 0; i < 200'000; ++i) deep += i % 2 == 0 ? "[" : "{c: ";
  try {
    YamlTree::parse(deep, "x.yaml");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("x.yaml:2: lists and maps are nested deeper than 100"), std::string::npos)
        << error.what();
  }
  std::string allowed = "a: ", end;
  for (int i = 0; i < 99; ++i) allowed += "[", end += "]";
  EXPECT_EQ(YamlTree::parse(allowed + end, "x.yaml").root().find("a")->items.size(), 1U);
}

TEST(Pattern, MatchesWholeNames) {
  EXPECT_TRUE(Pattern(".*_hip").matches("left_hip"));
  EXPECT_FALSE(Pattern(".*_hip").matches("left_hip_2"));
  EXPECT_TRUE(Pattern("left|left_hip").matches("left_hip"));
  EXPECT_FALSE(Pattern("(?!.*ankle).*").matches("left_ankle"));
  EXPECT_TRUE(Pattern("(?!.*ankle).*").matches("left_knee"));
}

TEST(Pattern, WhatIsNoneOrTakesTooLongIsAnError) {
  EXPECT_THROW(Pattern("("), PatternError);
  std::string slow;
  for (int i = 0; i < 12; ++i) slow += "([a-z_]*)*";
  EXPECT_THROW(Pattern(slow + "[0-9]").matches("left_hip"), PatternError);
  EXPECT_TRUE(Pattern(slow).matches("left_hip"));
}

TEST(IsaacEnv, JointsBreadthFirst) {
  // arm: shoulder -> elbow -> wrist; leg: hip -> knee, later in the file
  const Model model = load_model_text(R"(<mujoco><worldbody><body><freejoint/><geom size="1"/>
    <body><joint name="shoulder"/><geom size="1"/><body><joint name="elbow"/><geom size="1"/>
      <body><joint name="wrist"/><geom size="1"/></body></body></body>
    <body><joint name="hip"/><geom size="1"/><body><joint name="knee"/><geom size="1"/></body></body>
  </body></worldbody></mujoco>)",
                                      "tree");
  EXPECT_EQ(breadth_first_joints(model), (std::vector<std::string>{"shoulder", "hip", "elbow", "knee", "wrist"}));
}

}  // namespace
}  // namespace assay
