#include "engines/registry.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <span>
#include <string>
#include <unistd.h>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engines/builds.h"
#include "message_of.h"

namespace assay {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string parse_refusal(const Setting& setting, const std::string& text) {
  return message_of([&] { parse_setting(setting, text); });
}

TEST(ParseSetting, Switches) {
  const Setting setting{"warmstart", true, "", ""};
  for (const char* text : {"on", "true", "1"}) EXPECT_EQ(parse_setting(setting, text), SettingValue(true));
  for (const char* text : {"off", "false", "0"}) EXPECT_EQ(parse_setting(setting, text), SettingValue(false));
  EXPECT_EQ(parse_refusal(setting, "yes"), "setting 'warmstart' is 'yes': give on or off");
  EXPECT_NE(parse_refusal(setting, ""), "");
}

TEST(ParseSetting, WholeNumbersInRange) {
  const Setting setting{"iterations", 50LL, "", "", {}, 1.0, 1000.0};
  EXPECT_EQ(parse_setting(setting, "7"), SettingValue(7LL));
  EXPECT_EQ(parse_setting(setting, "1"), SettingValue(1LL));
  EXPECT_EQ(parse_setting(setting, "1000"), SettingValue(1000LL));
  EXPECT_EQ(parse_refusal(setting, "7.5"), "setting 'iterations' is '7.5': give a whole number");
  EXPECT_EQ(parse_refusal(setting, "0"), "setting 'iterations' is 0: give a value of at least 1 and at most 1000");
  EXPECT_NE(parse_refusal(setting, "1001"), "");
  EXPECT_NE(parse_refusal(setting, "many"), "");
}

TEST(ParseSetting, NumbersInRange) {
  const Setting setting{"erp", 0.2, "", "", {}, 0.0, {}};
  EXPECT_EQ(parse_setting(setting, "0.8"), SettingValue(0.8));
  EXPECT_EQ(parse_setting(setting, "1"), SettingValue(1.0));  // stays the setting's type
  EXPECT_EQ(parse_refusal(setting, "-0.1"), "setting 'erp' is -0.1: give a value of at least 0");
  for (const char* text : {"nan", "inf", "0,8", ""}) EXPECT_NE(parse_refusal(setting, text), "") << text;
}

TEST(ParseSetting, Choices) {
  const Setting setting{"solver", std::string("newton"), "", "", {"newton", "cg", "pgs"}};
  EXPECT_EQ(parse_setting(setting, "cg"), SettingValue(std::string("cg")));
  EXPECT_EQ(parse_refusal(setting, "newtown"), "setting 'solver' is 'newtown' (did you mean 'newton'?)");
  EXPECT_EQ(parse_refusal(setting, "dantzig"), "setting 'solver' is 'dantzig' (known: newton, cg, pgs)");
}

TEST(SettingText, ReadsBack) {
  EXPECT_EQ(setting_text(true), "on");
  EXPECT_EQ(setting_text(false), "off");
  EXPECT_EQ(setting_text(50LL), "50");
  EXPECT_EQ(setting_text(0.2), "0.2");
  EXPECT_EQ(setting_text(std::string("cg")), "cg");
  const Setting setting{"x", 0.1, "", ""};
  EXPECT_EQ(parse_setting(setting, setting_text(1.0 / 3)), SettingValue(1.0 / 3));
}

// Puts files that are no plugins into the search path before anything is loaded. The second is for
// python_engine_test.cc.
class BrokenPlugin : public testing::Environment {
 public:
  void SetUp() override {
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "assay-engine-broken.so") << "not a library";
    std::ofstream(folder_ / "assay-python-host-3.99.so") << "not a library";
    ::setenv("ASSAY_ENGINE_PATH", ("/nowhere::" + folder_.string()).c_str(), 1);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

 private:
  std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / fmt::format("assay_plugins_{}", ::getpid());
};
const testing::Environment* const kBrokenPlugin = testing::AddGlobalTestEnvironment(new BrokenPlugin);

TEST(Registry, ABadPluginIsListedAndHarmsNobody) {
  const Registry& registry = Registry::instance();
  const auto broken = std::ranges::find(registry.absent(), "broken", &AbsentEngine::name);
  ASSERT_NE(broken, registry.absent().end());
  EXPECT_THAT(broken->reason, AllOf(HasSubstr("assay-engine-broken.so"), HasSubstr("cannot be loaded")));
  EXPECT_FALSE(registry.engines().empty());
}

TEST(Registry, ResolvesContendersWithCompleteSettings) {
  const Registry& registry = Registry::instance();
  EXPECT_THAT(registry.contender_names(), testing::Contains("null"));
  for (const std::string& name : registry.contender_names()) {
    SCOPED_TRACE(name);
    const ResolvedContender contender = registry.resolve(name);
    EXPECT_EQ(contender.name, name);
    EXPECT_EQ(contender.base, name);
    ASSERT_NE(contender.engine, nullptr);
    EXPECT_FALSE(contender.summary.empty());
    for (const Setting& setting : contender.engine->settings()) {
      ASSERT_TRUE(contender.settings.values.contains(setting.name));
      const SettingValue& value = contender.settings.values.at(setting.name);
      EXPECT_EQ(value.index(), setting.default_value.index()) << setting.name;
      // the ready-made value is one that a user could give, and its text reads back
      EXPECT_EQ(parse_setting(setting, setting_text(value)), value) << setting.name;
      EXPECT_FALSE(setting.meaning.empty()) << setting.name;
    }
  }
}

TEST(Registry, FamiliesAreInTheOrderOfTables) {
  std::vector<std::string> families;
  for (const Engine* engine : Registry::instance().engines()) {
    const std::string name = engine->name(), family = name.substr(0, name.find_first_of("-@"));
    if (families.empty() || families.back() != family) families.push_back(family);
  }
  std::vector<std::string> known = {"null",  "mujoco", "bullet",  "ode",  "physx",  "physx56",
                                    "havok", "dart",   "simbody", "jolt", "rapier", "box3d"};
  std::erase_if(known,
                [&](const std::string& family) { return std::ranges::find(families, family) == families.end(); });
  ASSERT_LE(known.size(), families.size());
  EXPECT_GE(known.size(), 3U);
  EXPECT_TRUE(std::ranges::equal(known, std::span(families).first(known.size())));
  EXPECT_TRUE(std::ranges::is_sorted(families.begin() + std::ssize(known), families.end())) << "others by name";
}

TEST(Registry, NamesAreUnique) {
  std::vector<std::string> names = Registry::instance().contender_names();
  std::ranges::sort(names);
  EXPECT_EQ(std::ranges::adjacent_find(names), names.end());
}

TEST(Registry, OverridesAreParsedAndShown) {
  const Registry& registry = Registry::instance();
  int tried = 0;
  for (const std::string& name : registry.contender_names()) {
    const ResolvedContender plain = registry.resolve(name);
    for (const Setting& setting : plain.engine->settings()) {
      const bool* flag = std::get_if<bool>(&plain.settings.values.at(setting.name));
      if (flag == nullptr) continue;
      const ResolvedContender changed = registry.resolve(name, {{setting.name, *flag ? "off" : "on"}});
      EXPECT_NE(settings_text(*plain.engine, changed.settings), settings_text(*plain.engine, plain.settings));
      EXPECT_EQ(changed.settings.get<bool>(setting.name), !*flag);
      ++tried;
    }
  }
  if (registry.engines().size() > 1) {
    EXPECT_GT(tried, 0);
  }
}

TEST(Registry, ABuildIsAPartOfAContendersName) {
  EXPECT_EQ(build_of("ode-quick"), kBaseline);
  EXPECT_EQ(build_of("ode-quick@v3"), "v3");
  EXPECT_EQ(without_build("ode-quick@v3"), "ode-quick");
  EXPECT_EQ(without_build("ode-quick"), "ode-quick");
  EXPECT_EQ(in_build("ode-quick", "v3"), "ode-quick@v3");
  EXPECT_EQ(in_build("ode-quick", kBaseline), "ode-quick");
  EXPECT_EQ(lacking_for(kBaseline), "");
  EXPECT_EQ(lacking_for("another"), "") << "of a build of somebody else's nothing is known";
}

TEST(Registry, OtherBuildsAreThereForThoseWhoAskByName) {
  const Registry& registry = Registry::instance();
  for (const std::string& name : registry.contender_names()) EXPECT_EQ(build_of(name), kBaseline);
  for (const Engine* engine : registry.engines()) EXPECT_EQ(build_of(engine->name()), kBaseline);
  EXPECT_FALSE(registry.has("null@v3"));
  EXPECT_THAT(message_of([&] { registry.resolve("null@v3"); }),
              HasSubstr("the build 'v3' of its engine, which is not here"));
  EXPECT_THAT(message_of([&] { registry.resolve("nul@v3"); }), HasSubstr("unknown contender 'nul@v3'"));
  for (const Engine* engine : registry.other_builds()) {
    SCOPED_TRACE(engine->name());
    const std::string build = build_of(engine->name());
    EXPECT_NE(build, kBaseline);
    for (const Contender& contender : engine->contenders()) {
      const ResolvedContender other = registry.resolve(in_build(contender.name, build));
      EXPECT_EQ(other.name, in_build(contender.name, build));
      EXPECT_EQ(other.engine, engine);
      const ResolvedContender plain = registry.resolve(contender.name);
      EXPECT_NE(plain.engine, engine);
      EXPECT_EQ(plain.settings.values, other.settings.values);
      EXPECT_THAT(registry.builds_of(contender.name), testing::Contains(build));
      EXPECT_NE(registry.plugin_path(plain.engine->name()), registry.plugin_path(engine->name()));
    }
  }
}

TEST(Registry, UnknownNamesAreRefusedWithTheNearest) {
  const Registry& registry = Registry::instance();
  EXPECT_THAT(message_of([&] { registry.resolve("nul"); }),
              HasSubstr("unknown contender 'nul' (did you mean 'null'?)"));
  EXPECT_THAT(message_of([&] { registry.resolve("null", {{"iterations", "3"}}); }),
              HasSubstr("'null' has no setting 'iterations'"));
  EXPECT_THAT(message_of([&] { registry.resolve("broken-fast"); }),
              AllOf(HasSubstr("contender 'broken-fast' needs the engine 'broken'"), HasSubstr("cannot be loaded")));
}

}  // namespace
}  // namespace assay
