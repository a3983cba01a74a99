// The keys of a campaign's file: one list for each table. What a table allows, how plain values are read, and
// docs/files.md follow from them.
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "base/fields.h"
#include "campaign/campaign.h"
#include "campaign/section.h"

namespace assay {

template <typename Table>
struct Key {
  const char* name;
  const char* example;  // as in the file; units are in the names, or said by the meaning
  const char* meaning;
  const char* otherwise = nullptr;  // the default in words; nullptr: the member's own
  // What read_plain() fills: a flag, a whole number from `least` to `most`, a positive number or a text. Other keys
  // have readers of their own.
  std::variant<std::monostate, bool Table::*, int Table::*, double Table::*, std::string Table::*> member = {};
  int least = 0, most = 0;
};

struct ReadElsewhere {};

inline constexpr const char* kRequired = "required";
inline constexpr const char* kOfCampaign = "the campaign's";
inline constexpr const char* kAsInModel = "as in the model";

inline constexpr auto kCampaignKeys = std::to_array<Key<Campaign>>({
    {"name", "\"quick\"", "Name of the campaign", kRequired},
    {"title", "\"A quick look\"", "Heading of the report", "the name"},
    {"contenders", R"(["mujoco-euler", "A", "ode-*"])",
     "Contenders, tables under [[contender]], or patterns (* and ?) that match contenders of the installed engines",
     "each system's"},
    {"timesteps_ms", R"(["1/64", "1/4", 1, 4])", "Timesteps: numbers, or fractions as text", "each system's"},
    {"reference_ms", "\"1/64\"", "Timestep of the fine-step runs", "\"1/64\""},
    {"reference_single_ms", "\"1/16\"",
     "The same for contenders in single precision. A contender that declares a longer finest timestep has the next of "
     "timesteps_ms",
     "reference_ms"},
    {"measures", R"(["raw_speed", "consistency"])", "What is measured: see [Measures](#measures)", "each system's"},
    {"time_limit_s", "600", "Time for one cell", nullptr, &Campaign::time_limit_s},
    {"seed", "1", "Seed of the order of contenders within a round of timing, of initial states and of intervals", "1"},
    {"builds", R"(["baseline", "v3"])",
     "Builds of the engines for contenders without one in their name; \"best\": the last that this processor runs",
     R"(["baseline"])"},
});

inline constexpr auto kTimingKeys = std::to_array<Key<TimingOptions>>({
    {"rounds", "24", "Rounds; in each every contender is measured once", nullptr, &TimingOptions::rounds, 1, 100000},
    {"processes", "8", "Processes of a contender, each of which measures some of the rounds", nullptr,
     &TimingOptions::processes, 1, 100},
    {"batch_ms", "100", "Time in the engine's steps of a turn, in the mean over contenders", nullptr,
     &TimingOptions::batch_ms},
    {"windows", "32", "Parts of the run that all contenders time", nullptr, &TimingOptions::windows, 1, 1000},
    {"warmup", "5", "Untimed steps after a saved state", nullptr, &TimingOptions::warmup, 0, 100000},
    {"states", "\"common\"",
     "Where windows start: \"own\": in states of each contender's own run at the timed timestep; \"common\": in states "
     "of "
     "one contender's fine-step run",
     "\"own\""},
    {"states_of", "\"mujoco-euler\"", "The contender with the common states",
     "the system's first one in joint coordinates"},
    {"twins", R"(["mujoco-euler"])", "Contenders that are timed twice, as NAME and as NAME-twin", "none"},
});

inline constexpr auto kSearchLimits = std::to_array<Key<SearchTable>>({
    {"error", "\"1mm\"", "Largest error", "no limit"},
    {"penetration", "\"2mm\"", "Largest penetration beyond the overlap at the start; \"any\": no limit",
     "the smallest of the systems' own"},
    {"slip", "\"2mm\"", "Largest slip in the hand; \"any\": no limit", "5 mm where something is held"},
    {"realtime", "\"5\"", "Least speed, in times real time", "no limit"},
});
inline constexpr auto kSearchKeys = std::to_array<Key<SearchTable>>({
    {"minutes", "10", "Time that the search may take", nullptr, &SearchTable::minutes},
    {"limits", R"(["joint_dislocation=0.1mm"])", "Largest values of any measured error", "no limit"},
});

inline constexpr auto kSystemKeys = std::to_array<Key<CampaignSystem>>({
    {"name", "\"planar-chain\"", "Name of the system", kRequired},
    {"model", "\"planar-chain\"", "A system that comes with assay, or a file, from the campaign's folder", "the name"},
    {"duration_s", "2", "Length of a run: a whole number of samples", kRequired},
    {"sample_ms", "16", "Distance of the states that measures read", "the largest timestep"},
    {"control", R"({kind = "sine", amplitude = 2})", "What drives the joints: a kind, or a table with its numbers",
     "\"passive\""},
    {"measures", R"(["drift"])", "What is measured", kOfCampaign},
    {"timesteps_ms", "[1, 4]", "Timesteps", kOfCampaign},
    {"timing_ms", "[1]", "Timesteps at which the speed is measured", "all"},
    {"violation_ms", "[1]", "Timesteps at which the violation of constraints is measured", "all"},
    {"reference_ms", "\"1/64\"", "Timestep of the fine-step runs", kOfCampaign},
    {"reference_single_ms", "\"1/16\"", "The same for contenders in single precision", kOfCampaign},
    {"contenders", R"(["ode-quick"])",
     "Contenders of this system. One that the campaign's list does not have takes part only in systems that name it",
     kOfCampaign},
    {"pieces", "10", "For `consistency`: pieces of fine-step runs", nullptr, &CampaignSystem::pieces, 1, 1000},
    {"piece_ms", "[128, 8]",
     "Length of a piece, or a list: the main length first, then others, which are in the names of their values", "128"},
    {"initial_states", "20",
     "States from which `consistency`, `violation`, `drift` and `grasp` start: the model's own and seeded ones around "
     "it",
     "1"},
    {"perturbation", "{joint_rate = 0.5}", "How far the other states lie around the model's own",
     "that of each width below"},
    {"push", "{velocity = 0.5, every_s = 3}", "For `transfer`: pushes during a run", "none"},
    {"grasp", R"({object = "capsule", hand = "palm"})", "For `grasp`: which object is held by which hand", "none"},
    {"worlds", "[1, 16, 256]",
     "For `batch`: how many worlds are stepped at once. They start around moments of the contender's own run, as "
     "`perturbation` says",
     "none"},
    {"solution", "\"slide-and-roll\"",
     "For `truth`: the certified solution of a motion with contacts, limits or dry friction, see "
     "[Solutions](#solutions), or a CSV file with the states of one",
     "the reference solution of smooth systems", &CampaignSystem::solution},
    {"family", "\"capsules\"", "For `scaling`: systems of one family differ only in size", nullptr,
     &CampaignSystem::family},
});

// Changes of the model, after it was read.
inline constexpr auto kVariantKeys = std::to_array<Key<ModelVariant>>({
    {"contacts", "false", "false leaves all contact pairs out", nullptr, &ModelVariant::contacts},
    {"gravity", "false", "false: no gravity", nullptr, &ModelVariant::gravity},
    {"smooth", "true", "Leaves out contact pairs, limits and dry friction", nullptr, &ModelVariant::smooth},
    {"above_ground_m", "0.05", "Height of the lowest shape of free bodies above a plane at the start", kAsInModel,
     &ModelVariant::above_ground_m},
    {"start_rates", "1", "Half width of seeded random joint rates at the start, rad/s or m/s", kAsInModel,
     &ModelVariant::start_rates},
    {"exclude", R"([["thigh", "shank"]])", "Pairs of bodies without contact with each other", "none"},
});

inline constexpr auto kGraspKeys = std::to_array<Key<GraspBodies>>({
    {"object", "\"capsule\"", "Body that is held", kRequired},
    {"hand", "\"palm\"", "Body that holds it", kRequired},
    {"drop_m", "0.1", "A larger slip is a drop", nullptr, &GraspBodies::drop_m},
});

inline constexpr auto kPushKeys = std::to_array<Key<Pushes>>({
    {"velocity", "0.5", "Velocity that a push adds, m/s; of a hinge rad/s", kRequired, &Pushes::velocity},
    {"every_s", "3", "One push in each interval of this length", nullptr, &Pushes::every_s},
    {"joint", "\"slider\"", "Hinge or slide that is pushed", "the free body", &Pushes::joint},
    {"seed", "1", "Seed of times and directions", "1"},
});

// Further keys of `control` follow from the kinds (controls/control.h), those of `perturbation` from its widths
// (measures/initial_states.h).
inline constexpr auto kControlKeys = std::to_array<Key<ControlSpec>>({
    {"kind", "\"sine\"", "Kind of the control", kRequired},
});
inline constexpr auto kFileControlKeys = std::to_array<Key<ControlSpec>>({
    {"path", "\"torques.csv\"", "`file`: CSV file of torques, from the campaign's folder", kRequired},
});
inline constexpr auto kPolicyControlKeys = std::to_array<Key<ControlSpec>>({
    {"config", "\"policy.toml\"", "`policy`: its configuration, from the campaign's folder", kRequired},
    {"network", "\"policy.onnx\"", "`policy`: its network in place of the configuration's", "the configuration's"},
});

inline constexpr auto kContenderKeys = std::to_array<Key<ReadElsewhere>>({
    {"name", "\"A\"", "Name of the contender", kRequired},
    {"base", "\"mujoco-euler\"", "Contender from which it is derived", kRequired},
    {"set", "{iterations = 50}", "Settings that differ from the base's", "none"},
});

// Further keys are what settings decide (engines/registry.h: setting_role_names()).
inline constexpr auto kSweepKeys = std::to_array<Key<ReadElsewhere>>({
    {"contenders", R"(["mujoco-*"])", "Contenders of the campaign whose settings vary, by name or pattern", kRequired},
    {"set", "{contact_timeconst = [0.005, 0.02]}", "Lists of values by the settings' own names", "none"},
    {"systems", R"(["grasp"])", "Systems in which the variants take part", "those of each contender"},
});

inline constexpr auto kRatioKeys = std::to_array<Key<ReadElsewhere>>({
    {"of", "\"jolt-f32-wasm\"", "Contender with the step time that is divided", kRequired},
    {"to", "\"jolt-f32\"", "Contender with the step time by which it is divided", kRequired},
});

// The names of the keys in the lists, for Section::allow().
template <typename... Lists>
std::vector<std::string> key_names(const Lists&... lists) {
  std::vector<std::string> names;
  const auto add = [&](const auto& list) {
    for (const auto& key : list) names.emplace_back(key.name);
  };
  (add(lists), ...);
  return names;
}

// Fills the members of the list's plain keys that the section has. Throws InputError.
template <typename List, typename Table>
void read_plain(const Section& section, const List& keys, Table& into) {
  for (const Key<Table>& key : keys) {
    std::visit(
        Overloaded{
            [](std::monostate) {}, [&](bool Table::* member) { into.*member = section.flag(key.name, into.*member); },
            [&](int Table::* member) { into.*member = section.count(key.name, into.*member, key.least, key.most); },
            [&](double Table::* member) { into.*member = section.positive(key.name, into.*member); },
            [&](std::string Table::* member) { into.*member = section.text(key.name).value_or(into.*member); }},
        key.member);
  }
}

// docs/files.md.
std::string campaign_keys_markdown();

}  // namespace assay
