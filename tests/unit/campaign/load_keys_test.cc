// How a model is read: what is written into a campaign is read again, for every option there is.
#include "campaign/load_keys.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "base/text.h"
#include "base/toml_file.h"

namespace assay {
namespace {

using ::testing::HasSubstr;

const std::string kSource = "/robots/campaign.toml";

// Each option at another value than its default. `choice` is the value of enumerations.
LoadOptions all_set(int choice) {
  LoadOptions load;
  visit_load_fields(
      load, Overloaded{[](const LoadField&, bool& value) { value = true; },
                       [](const LoadField& field, std::string& value) {
                         value = field.is_path() ? "/poses/one \"two\".txt" : "a \"name\"";
                       },
                       [](const LoadField&, Folders& value) { value = {{"arm", "/arm"}, {"my hand", "/hands/mine"}}; },
                       [&]<typename Choice>(const LoadField&, Choice& value) { value = static_cast<Choice>(choice); }});
  load.allow_external_files = false;  // needs the user's agreement
  return load;
}

LoadOptions read(const std::vector<std::string>& lines) {
  const toml::table table = toml_table(join(lines, "\n"), kSource);
  const Section section(table, "[[system]]", kSource);
  section.allow(load_key_names());
  return load_options_of(section);
}

TEST(LoadKeys, WhatIsWrittenIsReadAgain) {
  const auto same = [](const std::string& path) { return path; };
  for (const int choice : {1, 2}) {
    const LoadOptions load = all_set(choice);
    EXPECT_EQ(read(load_lines(load, same)), load);
  }
  EXPECT_TRUE(load_lines({}, same).empty());
  EXPECT_EQ(read({}), LoadOptions());
}

TEST(LoadKeys, PathsCountFromTheCampaign) {
  const LoadOptions load = read({"qpos = \"../pose.txt\"", "packages = {arm = \"arm\"}"});
  EXPECT_EQ(load.qpos, "/pose.txt");
  EXPECT_EQ(load.packages.at("arm"), "/robots/arm");
}

TEST(LoadKeys, MistakesAreNamed) {
  const auto error_of = [](const std::string& line) -> std::string {
    try {
      static_cast<void>(read({line}));
    } catch (const InputError& error) {
      return error.what();
    }
    return "(accepted)";
  };
  EXPECT_THAT(error_of("ground = true\nno_ground = true"), HasSubstr("'ground' and 'no_ground' contradict each other"));
  EXPECT_THAT(error_of("floating_base = true\nfixed_base = true"), HasSubstr("contradict"));
  EXPECT_THAT(error_of("repair = 1"), HasSubstr("'repair' is 1: give true or false"));
  EXPECT_THAT(error_of("packages = {arm = 1}"), HasSubstr("'packages' has 1: give a folder"));
  EXPECT_THAT(error_of("allow_external_files = true"), HasSubstr("--allow-external-files"));
  EXPECT_THAT(error_of("grund = true"), HasSubstr("has no key 'grund' (did you mean 'ground'?)"));
}

}  // namespace
}  // namespace assay
