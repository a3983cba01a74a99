// Campaign files: what they say, and the sentence that each mistake in one gets.
#include "campaign/campaign.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "base/paths.h"
#include "campaign/plan.h"
#include "engines/builds.h"

namespace assay {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr const char* kGood = R"(
name = "good"
contenders = ["null", "A"]
timesteps_ms = [4, "1/4", 1]
measures = ["consistency", "raw_speed"]
reference_ms = "1/16"

[[contender]]
name = "A"
base = "mujoco-euler"
set = {jacobian = "dense"}

[[system]]
name = "planar-chain"
duration_s = 2
measures = ["truth", "drift"]

[[system]]
name = "pile"
model = "capsules-27"
duration_s = 0.5
sample_ms = 4
piece_ms = 100
pieces = 3
gravity = false
timing_ms = ["1/2"]
)";

// `text` with `from` replaced, which has to be there.
std::string with(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string error_of(const std::string& text) {
  try {
    parse_campaign(text, "dir/file.toml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "(accepted)";
}

std::string error_of(const std::string& from, const std::string& to) { return error_of(with(kGood, from, to)); }

// Declares a finest timestep of 3 ms.
class LosesSlowMotions final : public Engine {
 public:
  std::string name() const override { return "slow"; }
  BuildFacts build() const override { return {}; }
  std::vector<Setting> settings() const override { return {}; }
  std::vector<Contender> contenders() const override { return {}; }
  Capabilities capabilities(const Settings& /*settings*/) const override {
    Capabilities can;
    can.finest_timestep = 3e-3;
    return can;
  }
  std::vector<Limitation> check(const Model& /*model*/, const Settings& /*settings*/) const override { return {}; }
  std::unique_ptr<Simulation> create(const Model&, const State&, const Settings&) const override { return nullptr; }
};

TEST(Campaign, FineStepRunsAreNoFinerThanTheContenderDeclares) {
  const Campaign campaign = parse_campaign(kGood, "file.toml");
  const LosesSlowMotions engine;
  CampaignContender contender = campaign.contenders[0];
  EXPECT_EQ(campaign.systems[0].reference_of(contender), 1.0 / 16);
  contender.resolved.engine = &engine;
  // of 1/16, 1/4, 1 and 4 ms the first that is no finer, and that samples can be taken from
  EXPECT_EQ(campaign.systems[1].reference_of(contender), 4);
}

TEST(Campaign, SaysWhatItSays) {
  const Campaign campaign = parse_campaign(kGood, "file.toml");
  EXPECT_EQ(campaign.name, "good");
  EXPECT_EQ(campaign.title, "good");
  ASSERT_EQ(campaign.contenders.size(), 2U);
  EXPECT_EQ(campaign.contenders[0].resolved.name, "null");
  EXPECT_EQ(campaign.contenders[1].resolved.name, "A");
  EXPECT_EQ(campaign.contenders[1].resolved.base, "mujoco-euler");
  EXPECT_EQ(setting_text(campaign.contenders[1].resolved.settings.values.at("jacobian")), "dense");
  ASSERT_EQ(campaign.systems.size(), 2U);
  const CampaignSystem& chain = campaign.systems[0];
  EXPECT_THAT(chain.measures, ElementsAre(find_measure("truth"), find_measure("drift")));
  EXPECT_THAT(chain.timesteps_ms, ElementsAre(0.25, 1, 4)) << "sorted";
  EXPECT_EQ(chain.sample_ms, 4) << "the largest timestep";
  EXPECT_EQ(chain.model.bodies.size(), 5U);
  const CampaignSystem& pile = campaign.systems[1];
  EXPECT_EQ(pile.name, "pile");
  EXPECT_EQ(pile.model.bodies.size(), 27U);
  EXPECT_TRUE(pile.model.gravity.isZero());
  EXPECT_THAT(pile.timesteps_ms, ElementsAre(1.0 / 16, 0.25, 1, 4)) << "with the reference's, for the restart floor";
  EXPECT_THAT(pile.timing_ms, ElementsAre(0.5));
  EXPECT_EQ(pile.pieces, 3);
}

// ---- sweeps -----------------------------------------------------------------------------------------------------------

constexpr const char* kSweep = R"(
name = "sweep"
contenders = ["null", "mujoco-euler", "mujoco-rk4"]
timesteps_ms = [1]
measures = ["raw_speed"]

[[contender]]
name = "A"
base = "mujoco-euler"
set = {contact_dampratio = 0.5}

[[sweep]]
contenders = ["*"]
iterations = [2, 100]
set = {contact_timeconst = [0.02, 0.005]}

[[sweep]]
contenders = ["mujoco-rk4"]
tolerance = [1e-4]
systems = ["pile"]

[[system]]
name = "planar-chain"
duration_s = 2

[[system]]
name = "pile"
model = "capsules-8"
duration_s = 0.5
contenders = ["mujoco-euler", "mujoco-rk4"]
)";

std::vector<std::string> names_on(const Campaign& campaign, size_t system) {
  std::vector<std::string> names;
  for (const int c : campaign.systems[system].contenders) {
    names.push_back(campaign.contenders[static_cast<size_t>(c)].resolved.name);
  }
  return names;
}

TEST(Sweep, MakesEveryCombinationBehindWhatItVariesAndTheUnchangedOneOnce) {
  const Campaign campaign = parse_campaign(kSweep, "file.toml");
  EXPECT_THAT(names_on(campaign, 0),
              ElementsAre("null", "mujoco-euler", "mujoco-euler it=2", "mujoco-euler it=2 contact_timeconst=0.005",
                          "mujoco-euler contact_timeconst=0.005", "mujoco-rk4", "mujoco-rk4 it=2",
                          "mujoco-rk4 it=2 contact_timeconst=0.005", "mujoco-rk4 contact_timeconst=0.005", "A",
                          "A it=2", "A it=2 contact_timeconst=0.005", "A contact_timeconst=0.005"));
  EXPECT_THAT(names_on(campaign, 1),
              ElementsAre("mujoco-euler", "mujoco-euler it=2", "mujoco-euler it=2 contact_timeconst=0.005",
                          "mujoco-euler contact_timeconst=0.005", "mujoco-rk4", "mujoco-rk4 it=2",
                          "mujoco-rk4 it=2 contact_timeconst=0.005", "mujoco-rk4 contact_timeconst=0.005",
                          "mujoco-rk4 tol=0.0001"))
      << "a system has the settings of the contenders that it lists";
  const auto named = [&](const std::string& name) {
    return *std::ranges::find_if(campaign.contenders,
                                 [&](const CampaignContender& each) { return each.resolved.name == name; });
  };
  const CampaignContender varied = named("A it=2");
  EXPECT_EQ(varied.varies, "A");
  EXPECT_EQ(varied.resolved.base, "mujoco-euler");
  EXPECT_EQ(setting_text(varied.resolved.settings.values.at("iterations")), "2");
  EXPECT_EQ(setting_text(varied.resolved.settings.values.at("contact_dampratio")), "0.5") << "what A has set stays";
  EXPECT_EQ(named("A").varies, "");
  EXPECT_THAT(campaign.notes, ElementsAre(AllOf(HasSubstr("'null'"), HasSubstr("'iterations'"))));
  EXPECT_NE(parse_campaign(with(kSweep, "[2, 100]", "[3, 100]"), "a.toml").hash(), campaign.hash());
}

TEST(Sweep, EachEngineTakesTheValuesByItsOwnSettingOfThatRole) {
  const std::map<std::string, std::string> own = {{"mujoco-euler", "iterations"},
                                                  {"bullet-si-f64", "iterations"},
                                                  {"ode-quick", "iterations"},
                                                  {"physx-d6-pgs", "position_iterations"},
                                                  {"jolt-f32", "velocity_steps"},
                                                  {"dart-pgs", "pgs_iterations"},
                                                  {"rapier-impulse-f64", "solver_iterations"}};
  const std::vector<std::string> known = Registry::instance().contender_names();
  for (const auto& [name, setting] : own) {
    if (std::ranges::find(known, name) == known.end()) continue;  // an engine that is not there
    const Campaign campaign =
        parse_campaign(fmt::format("name = \"s\"\ncontenders = [\"{0}\"]\ntimesteps_ms = [1]\nmeasures = [\"drift\"]\n"
                                   "[[sweep]]\ncontenders = [\"{0}\"]\niterations = [7]\n"
                                   "[[system]]\nname = \"planar-chain\"\nduration_s = 1\n",
                                   name),
                       "file.toml");
    ASSERT_EQ(campaign.contenders.size(), 2U) << name;
    EXPECT_EQ(campaign.contenders[1].resolved.name, name + " it=7");
    EXPECT_EQ(setting_text(campaign.contenders[1].resolved.settings.values.at(setting)), "7") << name;
  }
}

TEST(Sweep, MistakesAreSaidByName) {
  const auto error = [](const std::string& from, const std::string& to) { return error_of(with(kSweep, from, to)); };
  EXPECT_THAT(error("[\"*\"]", "[\"null\"]"),
              AllOf(StartsWith("dir/file.toml:13: "), HasSubstr("'null'"), HasSubstr("no setting for 'iterations'")));
  EXPECT_THAT(error("[\"*\"]", "[\"mujoco-eule\"]"), AllOf(HasSubstr("'mujoco-eule'"), HasSubstr("'mujoco-euler'")));
  EXPECT_THAT(error("[\"*\"]", "[\"ode-*\"]"), HasSubstr("'ode-*' is no contender of the campaign"));
  EXPECT_THAT(error("contact_timeconst = [", "contact_timecons = ["), AllOf(HasSubstr("(accepted)")))
      << "a pattern's contenders without it stay as they are, and the notes say so";
  EXPECT_THAT(error("[1e-4]", "[\"small\"]"), AllOf(HasSubstr("'mujoco-rk4'"), HasSubstr("'small'")));
  EXPECT_THAT(error("[2, 100]", "[2, 2]"), HasSubstr("2 twice"));
  EXPECT_THAT(error("[2, 100]", "[]"), HasSubstr("empty"));
  EXPECT_THAT(error("iterations = [2", "iteration = [2"), HasSubstr("'iterations'"));
  EXPECT_THAT(error("systems = [\"pile\"]", "systems = [\"pil\"]"), AllOf(HasSubstr("'pil'"), HasSubstr("'pile'")));
  EXPECT_THAT(error("tolerance = [1e-4]", ""), HasSubstr("varies nothing"));
  EXPECT_THAT(error("name = \"A\"\n", "name = \"mujoco-euler it=2\"\n"), HasSubstr("'mujoco-euler it=2'"));
}

// What cannot be given a compliance is named before anything runs.
TEST(Sweep, AComplianceThatAnEngineCannotHaveIsRefused) {
  const std::vector<std::string> known = Registry::instance().contender_names();
  const auto has = [&](const char* name) { return std::ranges::find(known, name) != known.end(); };
  const auto set = [&](const std::string& base, const std::string& settings) {
    return error_of(with(with(kGood, "mujoco-euler", base), "{jacobian = \"dense\"}", settings));
  };
  EXPECT_THAT(set("null", "{contact_stiffness = 1000}"),
              AllOf(HasSubstr("'null'"), HasSubstr("has no setting 'contact_stiffness'")));
  if (has("havok")) {
    EXPECT_THAT(set("havok", "{contact_stiffness = 1000}"),
                AllOf(HasSubstr("'havok'"), HasSubstr("has no setting 'contact_stiffness'")));
  }
}

TEST(Campaign, HashChangesWithWhatDecidesAResultAndWithNothingElse) {
  const std::string hash = parse_campaign(kGood, "a.toml").hash();
  EXPECT_EQ(parse_campaign(std::string("# a comment\ntitle = \"T\"\n") + kGood, "elsewhere/b.toml").hash(), hash);
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"duration_s = 2", "duration_s = 4"},
           {"\"dense\"", "\"sparse\""},
           {"[4, \"1/4\", 1]", "[4, \"1/4\", 1, 2]"},
           {"gravity = false", "gravity = true"},
           {"pieces = 3", "pieces = 4"},
           {R"(["null", "A"])", R"(["A"])"},
           {"reference_ms = \"1/16\"", "reference_ms = \"1/32\""},
           {"reference_ms = \"1/16\"", "reference_ms = \"1/16\"\nseed = 2"}}) {
    EXPECT_NE(parse_campaign(with(kGood, from, to), "a.toml").hash(), hash) << to;
  }
}

TEST(Campaign, MistakesNameFileLineValueAndTheNearestName) {
  EXPECT_THAT(error_of("\"raw_speed\"", "\"raw_sped\""),
              AllOf(StartsWith("dir/file.toml:5: "), HasSubstr("'raw_sped'"), HasSubstr("'raw_speed'")));
  EXPECT_THAT(error_of("\"null\"", "\"mujoco-euer\""),
              AllOf(StartsWith("dir/file.toml:3: "), HasSubstr("'mujoco-euer'"), HasSubstr("'mujoco-euler'")));
  EXPECT_THAT(error_of("base = \"mujoco-euler\"", "base = \"mujoko-euler\""),
              AllOf(StartsWith("dir/file.toml:10: "), HasSubstr("'mujoco-euler'")));
  EXPECT_THAT(error_of("{jacobian", "{jacobien"),
              AllOf(StartsWith("dir/file.toml:11: "), HasSubstr("'jacobien'"), HasSubstr("'jacobian'")));
  EXPECT_THAT(error_of("\"dense\"", "\"thick\""), AllOf(StartsWith("dir/file.toml:11: "), HasSubstr("'thick'")));
  EXPECT_THAT(error_of("name = \"planar-chain\"", "name = \"planar-chian\""),
              AllOf(StartsWith("dir/file.toml:14: "), HasSubstr("'planar-chain'")));
  EXPECT_THAT(error_of("sample_ms", "sampel_ms"),
              AllOf(StartsWith("dir/file.toml:22: "), HasSubstr("'sampel_ms'"), HasSubstr("'sample_ms'")));
  EXPECT_THAT(error_of("name = \"good\"", "nam = \"good\""),
              AllOf(StartsWith("dir/file.toml:2: "), HasSubstr("'name'")));
  EXPECT_THAT(error_of("name = \"pile\"", "name = \"planar-chain\""), HasSubstr("two systems"));
  EXPECT_THAT(error_of("[\"null\", \"A\"]", "[\"null\", \"null\"]"), HasSubstr("twice"));
  EXPECT_THAT(error_of(R"(contenders = ["null", "A"])", "contenders = []"), HasSubstr("at least one"));
  EXPECT_THAT(error_of("name = \"good\"", "name = good"), AllOf(StartsWith("dir/file.toml:2: "), HasSubstr("TOML")));
  EXPECT_THAT(error_of("duration_s = 2\n", "\n"), AllOf(StartsWith("dir/file.toml:13: "), HasSubstr("duration_s")));
  EXPECT_THAT(error_of("gravity = false", "gravity = \"off\""), HasSubstr("true or false"));
  EXPECT_THAT(error_of("pieces = 3", "pieces = 0"), HasSubstr("from 1 to"));
  EXPECT_THAT(error_of("pieces = 3", "control = \"sign\""), HasSubstr("'sine'"));
  EXPECT_THAT(error_of(""), HasSubstr("'name'"));
}

TEST(Campaign, TwinsAreOnlyTimedAndWhereverTheirContenderIs) {
  const std::string text = std::string(kGood) + "\n[timing]\ntwins = [\"A\"]\n";
  const Campaign campaign = parse_campaign(text, "f");
  ASSERT_EQ(campaign.contenders.size(), 3U);
  EXPECT_EQ(campaign.contenders[2].resolved.name, "A-twin");
  EXPECT_EQ(campaign.contenders[2].content(), campaign.contenders[1].content());
  for (const CampaignSystem& system : campaign.systems) EXPECT_THAT(system.contenders, ElementsAre(0, 1, 2));
  std::set<std::string> measures;
  for (const PlannedCell& cell : make_plan(campaign).cells) {
    if (cell.contender == 2) measures.insert(cell.measure);
  }
  EXPECT_THAT(measures, ElementsAre("raw_speed"));
  EXPECT_THAT(error_of(std::string(kGood) + "\n[timing]\ntwins = [\"B\"]\n"),
              AllOf(HasSubstr("'B' is no contender"), HasSubstr("'A'")));
  EXPECT_THAT(error_of(std::string(kGood) + "\n[timing]\ntwins = [\"A\", \"A\"]\n"), HasSubstr("'A-twin' already"));
}

TEST(Campaign, CommonStatesAreOfOneContenderAndRefusedWhereAnotherCannotStartFromThem) {
  const std::string text = R"(
name = "shared"
contenders = ["ode-quick", "mujoco-euler", "mujoco-rk4"]
timesteps_ms = ["1/4", 1]
reference_ms = "1/4"
measures = ["raw_speed"]
[timing]
states = "common"
[[system]]
name = "planar-chain"
duration_s = 1
)";
  const Campaign campaign = parse_campaign(text, "f");
  EXPECT_TRUE(campaign.timing.common_states);
  EXPECT_EQ(campaign.systems[0].states_of, 1) << "the first one in joint coordinates";
  const Plan plan = make_plan(campaign);
  std::set<std::string> starts, own;
  for (const PlannedCell& cell : plan.cells) {
    if (cell.measure == "raw_speed") starts.insert(cell.trajectory);
    if (cell.measure == "reference" && cell.contender == 1) own.insert(cell.trajectory);
  }
  EXPECT_EQ(starts, own) << "all start from the states of that contender's run";
  EXPECT_NE(campaign.hash(), parse_campaign(with(text, "states = \"common\"", "states = \"own\""), "f").hash());
  EXPECT_THAT(error_of(with(text, "\"common\"\n", "\"common\"\nstates_of = \"ode-quick\"\n")),
              AllOf(StartsWith("dir/file.toml:9: "), HasSubstr("'mujoco-euler' cannot start from the states of "
                                                               "'ode-quick' on 'planar-chain'")));
  // free bodies have no joints that could come apart
  const std::string pile =
      with(with(text, "planar-chain", "capsules-27"), "\"common\"\n", "\"common\"\nstates_of = \"ode-quick\"\n");
  EXPECT_EQ(parse_campaign(pile, "f").systems[0].states_of, 0);
  EXPECT_THAT(error_of(with(text, "\"common\"", "4")), HasSubstr("'windows'"));
  EXPECT_THAT(error_of(with(text, "\"common\"\n", "\"own\"\nstates_of = \"ode-quick\"\n")), HasSubstr("no effect"));
  EXPECT_THAT(error_of(with(text, "\"common\"\n", "\"common\"\nstates_of = \"dart\"\n")), HasSubstr("'dart'"));
}

TEST(Campaign, RatiosAreOfItsContenders) {
  const std::string ratio = "\n[[ratio]]\nof = \"A\"\nto = \"null\"\n";
  EXPECT_EQ(parse_campaign(kGood + ratio, "f").ratios, (std::map<std::string, std::string>{{"A", "null"}}));
  EXPECT_THAT(error_of(with(kGood + ratio, "of = \"A\"", "of = \"B\"")),
              AllOf(HasSubstr("'of' is 'B'"), HasSubstr("'A'")));
  EXPECT_THAT(error_of(kGood + ratio + ratio), HasSubstr("two ratios of 'A'"));
}

TEST(Campaign, PatternsNameContendersOfTheEnginesThatAreThere) {
  const auto names_of = [](const std::string& contenders) {
    std::vector<std::string> names;
    for (const CampaignContender& each : parse_campaign(with(kGood, R"(["null", "A"])", contenders), "f").contenders) {
      names.push_back(each.resolved.name);
    }
    return names;
  };
  std::vector<std::string> mujoco;
  std::vector<std::string> all;
  for (const std::string& name : Registry::instance().contender_names()) {
    if (name.starts_with("mujoco-")) mujoco.push_back(name);
    if (name != "null") all.push_back(name);
  }
  // who is there already is not taken again
  std::erase(mujoco, "mujoco-rk4");
  mujoco.insert(mujoco.begin(), "mujoco-rk4");
  mujoco.emplace_back("A");
  EXPECT_EQ(names_of(R"(["mujoco-rk4", "mujoco-*", "A"])"), mujoco);
  // "*" leaves the engine out that does nothing
  all.emplace_back("A");
  EXPECT_EQ(names_of(R"(["*"])"), all);
  EXPECT_THAT(error_of(with(kGood, R"(["null", "A"])", R"(["hal9000-*"])")),
              AllOf(HasSubstr("'hal9000-*'"), HasSubstr("assay list engines")));
}

// Of each system, by name.
std::vector<std::vector<std::string>> taking_part(const std::string& text) {
  const Campaign campaign = parse_campaign(text, "f");
  std::vector<std::vector<std::string>> names;
  for (const CampaignSystem& system : campaign.systems) {
    names.emplace_back();
    for (const int index : system.contenders) {
      names.back().push_back(campaign.contenders.at(static_cast<size_t>(index)).resolved.name);
    }
  }
  return names;
}

TEST(Campaign, BuildsMultiplyContendersWhoseEngineHasThem) {
  const Registry& registry = Registry::instance();
  EXPECT_THAT(error_of("name = \"good\"", "name = \"good\"\nbuilds = [\"v9\"]"),
              AllOf(HasSubstr("file.toml:3"), HasSubstr("no engine has a build 'v9' here")));
  EXPECT_THAT(error_of("name = \"good\"", "name = \"good\"\nbuilds = [3]"), HasSubstr("'builds' has 3"));
  EXPECT_THAT(error_of("name = \"good\"", "name = \"good\"\nbuilds = [\"best\", \"best\"]"), HasSubstr("there twice"));
  const Campaign best =
      parse_campaign(with(kGood, "name = \"good\"", "name = \"good\"\nbuilds = [\"best\"]"), "f.toml");
  EXPECT_EQ(best.contenders.at(1).resolved.name, "A") << "MuJoCo has one build";
  if (registry.other_builds().empty()) GTEST_SKIP() << "no other build of an engine here";
  const Engine& other = *registry.other_builds().front();
  const std::string build = build_of(other.name()), name = other.contenders().front().name;
  const std::string both =
      fmt::format("builds = [\"baseline\", \"{}\"]\ncontenders = [\"null\", \"A\", \"{}\"]", build, name);
  const Campaign campaign = parse_campaign(with(kGood, R"(contenders = ["null", "A"])", both), "f.toml");
  std::vector<std::string> names;
  std::ranges::transform(campaign.contenders, std::back_inserter(names),
                         [](const CampaignContender& contender) { return contender.resolved.name; });
  EXPECT_THAT(names, ElementsAre("null", "A", name, in_build(name, build)));
  EXPECT_NE(campaign.contenders[2].content(), campaign.contenders[3].content());
  EXPECT_THAT(campaign.notes,
              ElementsAre(HasSubstr("'null' takes part in its only build"), HasSubstr("'A' takes part")));
  const std::string derived =
      fmt::format("builds = [\"{}\"]\ncontenders = [\"B\"]\n[[contender]]\nname = \"B\"\nbase = \"{}\"\n", build, name);
  const Campaign alone = parse_campaign("name = \"x\"\nmeasures = [\"raw_speed\"]\ntimesteps_ms = [1]\n" + derived +
                                            "[[system]]\nname = \"planar-chain\"\nduration_s = 1\n",
                                        "f.toml");
  ASSERT_EQ(alone.contenders.size(), 1U);
  EXPECT_EQ(alone.contenders[0].resolved.name, in_build("B", build));
  EXPECT_EQ(alone.contenders[0].resolved.base, in_build(name, build));
  EXPECT_EQ(alone.contenders[0].resolved.engine, &other);
}

TEST(Campaign, ASystemMayHaveContendersOfItsOwn) {
  const auto own = [](const std::string& list) {
    return with(kGood, "name = \"pile\"", "name = \"pile\"\ncontenders = " + list);
  };
  const std::vector<std::string> both = {"null", "A"};
  EXPECT_THAT(taking_part(kGood), ElementsAre(both, both));
  EXPECT_THAT(taking_part(own(R"(["A"])")), ElementsAre(both, ElementsAre("A")));
  // others than the campaign's are added behind them and take part there alone
  EXPECT_THAT(taking_part(own(R"(["mujoco-rk*", "A", "null"])")),
              ElementsAre(both, ::testing::IsSupersetOf({"null", "A", "mujoco-rk4"})));
  // a table that only a system names is that system's
  const std::string third = "\n[[contender]]\nname = \"B\"\nbase = \"mujoco-rk4\"\n";
  EXPECT_THAT(taking_part(own(R"(["B"])") + third), ElementsAre(both, ElementsAre("B")));
  EXPECT_THAT(taking_part(own(R"(["A"])") + third), ElementsAre(ElementsAre("null", "A", "B"), ElementsAre("A")));

  EXPECT_THAT(error_of(own(R"(["mujoco-euer"])")),
              AllOf(StartsWith("dir/file.toml:20: "), HasSubstr("'mujoco-euler'")));
  EXPECT_THAT(error_of(own(R"(["A", "A"])")), AllOf(StartsWith("dir/file.toml:20: "), HasSubstr("twice")));
  EXPECT_THAT(error_of(own("[]")), HasSubstr("at least one"));
  EXPECT_THAT(error_of(with(own(R"(["B"])") + third, R"(contenders = ["null", "A"])", "")),
              ::testing::Not(HasSubstr("no contenders")))
      << "A is in no list and so takes part in the chain";
  EXPECT_THAT(error_of(with(own(R"(["A"])"), R"(contenders = ["null", "A"])", "")),
              AllOf(HasSubstr("'planar-chain'"), HasSubstr("no contenders")));
  EXPECT_NE(parse_campaign(own(R"(["A"])"), "f").hash(), parse_campaign(kGood, "f").hash());
  EXPECT_NE(parse_campaign(own(R"(["A"])"), "f").hash(), parse_campaign(own(R"(["null"])"), "f").hash());
  EXPECT_EQ(parse_campaign(own(R"(["A", "null"])"), "f").hash(), parse_campaign(kGood, "f").hash())
      << "the campaign's own, spelled out";
}

TEST(Campaign, TimestepsMakeSense) {
  for (const char* wrong : {"0", "-1", "\"1/0\"", "\"fast\"", "nan", "inf", "true", "[1]"}) {
    EXPECT_THAT(error_of("[4, \"1/4\", 1]", std::string("[4, ") + wrong + "]"),
                AllOf(StartsWith("dir/file.toml:4: "), HasSubstr("positive number")))
        << wrong;
  }
  EXPECT_THAT(error_of("[4, \"1/4\", 1]", "[4, 3]"),
              AllOf(HasSubstr("samples of 4 ms"), HasSubstr("timesteps of 3 ms")));
  EXPECT_THAT(error_of("duration_s = 2\n", "duration_s = 2.001\n"), HasSubstr("whole number of samples"));
  EXPECT_THAT(error_of("piece_ms = 100", "piece_ms = 101"), HasSubstr("piece_ms = 101"));
  EXPECT_THAT(error_of("piece_ms = 100", "piece_ms = 600"), HasSubstr("within the duration"));
  EXPECT_THAT(error_of("reference_ms = \"1/16\"", "reference_ms = 1"), HasSubstr("has to be the finest"));
  EXPECT_THAT(error_of("[4, \"1/4\", 1]", "[1, \"4/4\"]"), HasSubstr("twice"));
  EXPECT_THAT(error_of("pieces = 3", "violation_ms = [2]"),
              AllOf(StartsWith("dir/file.toml:24: "), HasSubstr("2 ms"), HasSubstr("1/16, 1/4, 1, 4 ms")));
}

TEST(Campaign, MeasuresThatASystemCannotHaveAreRefused) {
  const std::string pile = "name = \"pile\"\nmeasures = ";
  EXPECT_THAT(error_of("name = \"pile\"", pile + "[\"truth\"]"),
              AllOf(StartsWith("dir/file.toml:20: "), HasSubstr("'pile'"), HasSubstr("'truth'")));
  EXPECT_THAT(error_of("name = \"pile\"", pile + "[\"drift\"]"),
              AllOf(HasSubstr("conserves neither"), HasSubstr("'drift'")));
  EXPECT_THAT(error_of("duration_s = 2\n", "duration_s = 2\ncontrol = \"sine\"\n"), HasSubstr("not passive"));
}

TEST(Campaign, FilesThatAreNotThere) { EXPECT_THROW(load_campaign("/nowhere/at-all.toml"), InputError); }

// Those that come with assay load, and their contenders are there or of an engine that is known to be absent.
TEST(Campaign, OursAreSound) {
  const std::vector<std::string> names = campaign_names();
  EXPECT_THAT(names, ::testing::IsSupersetOf({"aa", "paper", "quick"}));
  for (const std::string& name : names) {
    Campaign campaign;
    try {
      campaign = load_campaign(find_campaign(name));
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("fetch the robots with ./assay robots")) << name;
      continue;
    }
    EXPECT_EQ(campaign.name, name);
    EXPECT_FALSE(campaign.systems.empty());
    for (const CampaignContender& contender : campaign.contenders) {
      EXPECT_TRUE(contender.absent.empty() || contender.resolved.engine == nullptr) << contender.absent;
    }
  }
  const Campaign aa = load_campaign(find_campaign("aa"));
  EXPECT_EQ(aa.contenders.at(0).content(), aa.contenders.at(4).content()) << "a twin";
}

TEST(Campaign, InitialStatesAndLengthsOfPieces) {
  const std::string text = with(kGood, "piece_ms = 100", "piece_ms = [100, 2, 200]\ninitial_states = 3");
  const Campaign campaign = parse_campaign(text, "file.toml");
  const CampaignSystem& pile = campaign.systems[1];
  EXPECT_EQ(pile.piece_ms, 100);
  EXPECT_THAT(pile.more_pieces_ms, ElementsAre(2, 200));
  EXPECT_EQ(pile.initial_states.count, 3);
  EXPECT_EQ(pile.grid_ms(), 2) << "samples of the reference runs";
  EXPECT_NE(campaign.hash(), parse_campaign(kGood, "file.toml").hash());
  const auto refusal = [&](const std::string& from, const std::string& to) { return error_of(with(text, from, to)); };
  EXPECT_THAT(refusal("[100, 2, 200]", "[100, 3]"), HasSubstr("pieces of 3 ms do not fit samples of 4 ms"));
  EXPECT_THAT(refusal("[100, 2, 200]", "[100, 600]"), HasSubstr("pieces of 600 ms"));
  EXPECT_THAT(refusal("[100, 2, 200]", "[]"), HasSubstr("at least one"));
  EXPECT_THAT(refusal("[100, 2, 200]", "[100, 100]"), HasSubstr("100 ms twice"));
  EXPECT_THAT(refusal("initial_states = 3", "initial_states = 4"), HasSubstr("give pieces = 4 or more"));
  EXPECT_THAT(refusal("initial_states = 3", "initial_states = 0"), HasSubstr("from 1 to 1000"));
  EXPECT_THAT(refusal("initial_states = 3", "perturbation = {velocity = 1}"), HasSubstr("without initial_states"));
  EXPECT_THAT(refusal("initial_states = 3", "initial_states = 3\nperturbation = {velocty = 1}"),
              HasSubstr("did you mean 'velocity'"));
  EXPECT_THAT(refusal("initial_states = 3", "initial_states = 3\nperturbation = {velocity = -1}"),
              HasSubstr("positive number"));
  EXPECT_EQ(error_of("reference_ms = \"1/16\"", "reference_ms = \"1/16\"\nreference_single_ms = \"1/4\""),
            "(accepted)");
  EXPECT_THAT(error_of("reference_ms = \"1/16\"", "reference_ms = \"1/16\"\nreference_single_ms = \"1/10\""),
              HasSubstr("reference_single_ms = 0.1 is no whole number"));
  EXPECT_THAT(error_of("reference_ms = \"1/16\"", "reference_ms = \"1/16\"\nreference_single_ms = \"1/8\""),
              HasSubstr("none of the system's timesteps"));
}

}  // namespace
}  // namespace assay
