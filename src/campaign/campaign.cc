#include "campaign/campaign.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <toml++/toml.h>

#include "base/errors.h"
#include "base/hash.h"
#include "base/input_file.h"
#include "base/json.h"
#include "base/paths.h"
#include "base/run_bounds.h"
#include "base/text.h"
#include "base/toml_file.h"
#include "campaign/keys.h"
#include "campaign/load_keys.h"
#include "campaign/roster.h"
#include "campaign/section.h"
#include "campaign/solution_file.h"
#include "campaign/sweep.h"
#include "controls/policy_config.h"
#include "isolate/activity.h"
#include "load/mjcf.h"
#include "measures/accuracy.h"
#include "measures/batch.h"
#include "model/joint.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

// `a` is a whole number of `b`, up to the rounding of decimal fractions.
bool whole(double a, double b) {
  const double ratio = a / b;
  return std::abs(ratio - std::round(ratio)) <= 1e-9 * std::max(1.0, ratio) && ratio > 0.5;
}

std::string joined_ms(const std::vector<double>& timesteps) {
  std::vector<std::string> labels;
  labels.reserve(timesteps.size());
  for (const double timestep : timesteps) labels.push_back(timestep_label(timestep));
  return join(labels, ", ");
}

ControlSpec control_of(const Section& section, const Model& model) {
  ControlSpec spec;
  spec.kind = "passive";
  const toml::node* node = section.find("control");
  if (node == nullptr) return spec;
  if (const toml::table* table = node->as_table()) {
    const Section control(*table, "control", section.source());
    spec.kind = control.required_text("kind");
    std::vector<std::string> keys = spec.kind == "file"     ? key_names(kControlKeys, kFileControlKeys)
                                    : spec.kind == "policy" ? key_names(kControlKeys, kPolicyControlKeys)
                                                            : key_names(kControlKeys);
    for (const ControlPart& part : kControlParts) {
      if (spec.kind == part.kind) keys.emplace_back(part.name);
    }
    control.allow(keys);
    for (const ControlPart& part : kControlParts) {
      if (spec.kind != part.kind) continue;
      double& number = spec.*part.member;
      number = part.member == &ControlSpec::seed ? control.count(part.name, static_cast<int>(number), 0, 1'000'000'000)
                                                 : control.positive(part.name, number);
    }
    if (spec.kind == "file") {
      const std::string given = control.required_text("path");
      spec.file = section.path_from(given);
    }
    if (spec.kind == "policy") {
      spec.policy = section.path_from(control.required_text("config"));
      if (const auto network = control.text("network")) spec.network = section.path_from(*network);
    }
  } else {
    spec.kind = section.required_text("control");
  }
  at_node(section, node, [&] { return make_control(model, spec); });
  return spec;
}

GraspBodies grasp_of(const Section& section, const Model& model) {
  GraspBodies grasp;
  const toml::node* node = section.find("grasp");
  if (node == nullptr) return grasp;
  const toml::table* table = node->as_table();
  if (table == nullptr) {
    section.fail(node, fmt::format(R"('grasp' is {}: give {{object = "...", hand = "..."}})", node_text(*node)));
  }
  const Section bodies(*table, "grasp", section.source());
  bodies.allow(key_names(kGraspKeys));
  std::vector<std::string> names;
  names.reserve(model.bodies.size());
  for (const Body& body : model.bodies) names.push_back(body.name);
  for (const auto& [key, index] : {std::pair{"object", &grasp.object}, std::pair{"hand", &grasp.hand}}) {
    const std::string name = bodies.required_text(key);
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) {
      bodies.fail(bodies.find(key),
                  fmt::format("model '{}' has no moving body '{}'{}", model.name, name, did_you_mean(name, names)));
    }
    *index = static_cast<int>(found - names.begin());
  }
  if (grasp.object == grasp.hand) {
    bodies.fail(bodies.find("hand"), "object and hand are the same body: give the palm as the hand");
  }
  read_plain(bodies, kGraspKeys, grasp);
  return grasp;
}

// A solution that is a file.
void read_solution(const Section& section, CampaignSystem& system) {
  if (!system.solution.ends_with(".csv")) return;
  at_node(section, section.find("solution"), [&] {
    system.solution = section.path_from(system.solution);
    const std::string text = solution_text(system.solution);
    system.solution_hash = content_hash(text);
    system.solution_states =
        solution_from_text(system.model, text, system.solution,
                           sample_times(system.model.initial.time, system.duration_s, system.sample_ms));
  });
}

// What measures need of their system.
void check_measures(const Section& section, const CampaignSystem& system, const Control& control) {
  const MeasuredSystem asked = {
      system.model,      control.is_zero(), control.policy() != nullptr,  !system.family.empty(), system.grasp,
      system.duration_s, system.solution,   !system.solution_hash.empty()};
  if (!system.solution.empty() && !system.has(Reads::kSolution)) {
    section.fail(section.find("solution"),
                 fmt::format("system '{}' has a solution that nothing is compared with: add 'truth' to its measures, "
                             "or leave the solution out",
                             system.name));
  }
  for (const Measure* measure : system.measures) {
    const std::string obstacle = measure->obstacle == nullptr ? "" : measure->obstacle(asked);
    if (!obstacle.empty()) section.fail(section.find("measures"), fmt::format("system '{}' {}", system.name, obstacle));
  }
}

// A control that remembers has no pieces of runs, and its period is a whole number of every timestep.
void check_control(const Section& section, const CampaignSystem& system, const Control& control) {
  if (!control.has_memory()) return;
  for (const Reads reads : {Reads::kPieces, Reads::kSteps}) {
    const auto measure = std::ranges::find(system.measures, reads, &Measure::reads);
    if (measure == system.measures.end()) continue;
    section.fail(section.find("measures"),
                 fmt::format("'{}' starts in the middle of runs of system '{}', where a policy would not "
                             "remember what came before: leave it out of its measures",
                             (*measure)->name, system.name));
  }
  std::vector<double> timesteps = system.timesteps_ms;
  if (system.has(Reads::kRunPairs) || system.has(Reads::kFineRuns)) timesteps.push_back(system.reference_ms);
  for (const double timestep : timesteps) {
    at_node(section, section.find("timesteps_ms"), [&] { control.check_timestep(1e-3 * timestep); });
  }
}

struct Defaults {
  std::optional<std::vector<double>> timesteps_ms;
  std::optional<std::vector<const Measure*>> measures;
  double reference_ms = 1.0 / 64;
  std::optional<double> reference_single_ms;
  std::vector<int> contenders;
};

// piece_ms = 128, or a list of lengths.
void read_pieces(const Section& section, CampaignSystem& system) {
  const toml::node* node = section.find("piece_ms");
  if (node == nullptr || !node->is_array()) {
    system.piece_ms = section.positive("piece_ms", system.piece_ms);
    return;
  }
  std::vector<double> lengths;
  for (const toml::node& entry : section.list("piece_ms", *node)) {
    const double length = section.positive("piece_ms", entry);
    if (std::ranges::find(lengths, length) != lengths.end()) {
      section.fail(&entry, fmt::format("'piece_ms' has {} ms twice: leave one out", shortest(length)));
    }
    lengths.push_back(length);
  }
  if (lengths.empty()) section.fail(node, "'piece_ms' is empty: give the length of a piece in milliseconds");
  system.piece_ms = lengths.front();
  system.more_pieces_ms.assign(lengths.begin() + 1, lengths.end());
}

void read_initial_states(const Section& section, long long seed, CampaignSystem& system) {
  InitialStates& states = system.initial_states;
  states.count = section.count("initial_states", 1, 1, 1000);
  states.seed = static_cast<std::uint64_t>(seed);
  if (const toml::node* node = section.find("perturbation")) {
    const toml::table* table = node->as_table();
    if (table == nullptr) {
      section.fail(node, fmt::format("'perturbation' is {}: give {{joint_rate = 0.5}}", node_text(*node)));
    }
    const Section around(*table, "perturbation", section.source());
    std::vector<std::string> keys;
    keys.reserve(std::size(kPerturbationParts));
    for (const PerturbationPart& part : kPerturbationParts) keys.emplace_back(part.name);
    around.allow(keys);
    for (const PerturbationPart& part : kPerturbationParts) {
      const toml::node* width = around.find(part.name);
      if (width == nullptr) continue;
      const bool zero = width->value<double>() == 0.0;
      states.around.*part.member = zero ? 0 : around.positive(part.name, *width);
    }
    if (states.count == 1 && !system.has(Reads::kWorlds)) {
      section.fail(node, "'perturbation' without initial_states: give their number");
    }
  }
  if (states.count == 1 && !system.has(Reads::kWorlds)) return;
  if (const std::string obstacle = perturbation_obstacle(system.model); !obstacle.empty()) {
    const bool states_given = states.count > 1;
    section.fail(section.find(states_given ? "initial_states" : "measures"),
                 fmt::format("system '{}' {}: leave {} out", system.name, obstacle,
                             states_given ? "'initial_states'" : "'batch'"));
  }
  if (system.has(Reads::kPieces) && system.pieces < states.count) {
    section.fail(section.find("initial_states"),
                 fmt::format("{} pieces are fewer than {} initial states: give pieces = {} or more", system.pieces,
                             states.count, states.count));
  }
}

// push = {velocity = 0.5, every_s = 3, joint = "slider", seed = 1}
void read_pushes(const Section& section, CampaignSystem& system) {
  const toml::node* node = section.find("push");
  if (node == nullptr) return;
  const toml::table* table = node->as_table();
  if (table == nullptr) {
    section.fail(node, fmt::format("'push' is {}: give {{velocity = 0.5, every_s = 3}}", node_text(*node)));
  }
  const Section push(*table, "push", section.source());
  push.allow(key_names(kPushKeys));
  if (push.find("velocity") == nullptr)
    section.fail(node, "'push' has no velocity: give it in m/s, of a hinge in rad/s");
  read_plain(push, kPushKeys, system.pushes);
  system.pushes.seed = static_cast<std::uint64_t>(push.count("seed", 1, 0, 1'000'000'000));
  if (const std::string obstacle = push_obstacle(system.model, system.pushes); !obstacle.empty()) {
    section.fail(node, fmt::format("system '{}' {}", system.name, obstacle));
  }
  for (const Measure* measure : system.measures) {
    if (measure->reads == Reads::kRunPairs) continue;
    section.fail(node,
                 fmt::format("'push' is for runs that 'transfer' judges, but system '{}' measures '{}', too: leave "
                             "one of them out",
                             system.name, measure->name));
  }
}

// worlds = [1, 16, 256]
void read_worlds(const Section& section, CampaignSystem& system) {
  constexpr int kMostWorlds = 65536, kLeastSteps = 2 * kBatchMoments;
  const toml::node* node = section.find("worlds");
  const bool batch = system.has(Reads::kWorlds);
  if (node == nullptr) {
    if (!batch) return;
    section.fail(
        section.find("measures"),
        fmt::format("system '{}' does not say how many worlds 'batch' steps: give worlds = [1, 16, 256]", system.name));
  }
  if (!batch) {
    section.fail(node,
                 fmt::format("'worlds' is for the measure 'batch', which system '{}' does not have: add it to its "
                             "measures or leave 'worlds' out",
                             system.name));
  }
  for (const toml::node& entry : section.list("worlds", *node)) {
    const auto count = entry.value_exact<std::int64_t>();
    if (!count || *count < 1 || *count > kMostWorlds) {
      section.fail(&entry,
                   fmt::format("'worlds' has {}: give whole numbers from 1 to {}", node_text(entry), kMostWorlds));
    }
    if (std::ranges::find(system.worlds, static_cast<int>(*count)) != system.worlds.end()) {
      section.fail(&entry, fmt::format("'worlds' has {} twice: leave one out", *count));
    }
    system.worlds.push_back(static_cast<int>(*count));
  }
  if (system.worlds.empty()) section.fail(node, "'worlds' is empty: give numbers of worlds, as in [1, 16, 256]");
  std::ranges::sort(system.worlds);
  const double longest = system.timing_ms.back();
  if (1000 * system.duration_s < kLeastSteps * longest) {
    section.fail(section.find("duration_s"),
                 fmt::format("duration_s = {} has fewer than {} steps of {} ms, over which the worlds of 'batch' are "
                             "spread: give at least {} s",
                             shortest(system.duration_s), kLeastSteps, timestep_label(longest),
                             shortest(1e-3 * kLeastSteps * longest)));
  }
}

// Of measures with a key of their own for timesteps: "violation_ms".
void read_own_timesteps(const Section& section, CampaignSystem& system) {
  for (const Measure& measure : measures()) {
    if (measure.timesteps_key.empty()) continue;
    const std::string key(measure.timesteps_key);
    const std::vector<double> own = section.timesteps(key).value_or(system.timesteps_ms);
    for (const double timestep : own) {
      if (std::ranges::any_of(system.timesteps_ms, [&](double each) { return same_timestep(each, timestep); }))
        continue;
      section.fail(section.find(key), fmt::format("'{}' has {} ms, which is none of the system's timesteps: {} ms", key,
                                                  timestep_label(timestep), joined_ms(system.timesteps_ms)));
    }
    system.own_timesteps_ms[key] = own;
  }
}

// A run whose states fit into no memory, or whose steps nobody can wait for, is a slip of the file.
void check_size(const Section& section, const CampaignSystem& system) {
  constexpr double kMostBytes = 4e9, kBodyBytes = 13 * sizeof(double);
  const toml::node* where = section.find("duration_s");
  const double finest_ms = std::min(system.reference_ms, system.timesteps_ms.front());
  if (const std::string obstacle = duration_obstacle(system.duration_s, finest_ms); !obstacle.empty()) {
    section.fail(where, fmt::format("duration_s = {}: {}", shortest(system.duration_s), obstacle));
  }
  const double samples = 1000 * system.duration_s / system.grid_ms();
  const double state_bytes = kBodyBytes * static_cast<double>(system.model.bodies.size() + 1);
  if (samples * state_bytes > kMostBytes) {
    section.fail(where,
                 fmt::format("duration_s = {} takes {:.3g} samples of {} ms, which are {:.3g} GB: give at most "
                             "{:.3g} s, or a longer sample_ms",
                             shortest(system.duration_s), samples, timestep_label(system.grid_ms()),
                             1e-9 * samples * state_bytes, system.duration_s * kMostBytes / (samples * state_bytes)));
  }
}

// Each of these has to be a whole number of the next, or a run could not be sampled where it is compared.
void check_grid(const Section& section, const CampaignSystem& system) {
  if (!whole(system.duration_s * 1000, system.sample_ms)) {
    section.fail(
        section.find("duration_s"),
        fmt::format("duration_s = {} is not a whole number of samples of {} ms: give a multiple of {} s",
                    shortest(system.duration_s), timestep_label(system.sample_ms), shortest(system.sample_ms / 1000)));
  }
  for (const double timestep : system.timesteps_ms) {
    if (!whole(system.sample_ms, timestep)) {
      section.fail(section.find("sample_ms"), fmt::format("samples of {} ms are not a whole number of timesteps of {} "
                                                          "ms: change one (timesteps are {} ms)",
                                                          timestep_label(system.sample_ms), timestep_label(timestep),
                                                          joined_ms(system.timesteps_ms)));
    }
  }
  if (!whole(system.sample_ms, system.reference_ms)) {
    section.fail(section.find("reference_ms"),
                 fmt::format("samples of {} ms are not a whole number of the reference's timestep of {} ms: change one",
                             timestep_label(system.sample_ms), timestep_label(system.reference_ms)));
  }
  const bool pieces = system.has(Reads::kPieces);
  const double grid_ms = system.grid_ms();
  for (const double length : pieces ? system.more_pieces_ms : std::vector<double>()) {
    const bool fits = (whole(length, system.sample_ms) || whole(system.sample_ms, length)) && whole(length, grid_ms) &&
                      whole(system.sample_ms, grid_ms) && whole(grid_ms, system.reference_ms) &&
                      whole(grid_ms, system.reference_single_ms) && length <= system.duration_s * 1000 * 1.000001;
    if (fits) continue;
    section.fail(section.find("piece_ms"),
                 fmt::format("pieces of {} ms do not fit samples of {} ms, reference timesteps of {} and {} ms and the "
                             "duration of {} s: give multiples or whole parts of the samples",
                             shortest(length), timestep_label(system.sample_ms), timestep_label(system.reference_ms),
                             timestep_label(system.reference_single_ms), shortest(system.duration_s)));
  }
  if (!whole(system.reference_single_ms, system.reference_ms) || !whole(system.sample_ms, system.reference_single_ms)) {
    section.fail(section.find("reference_single_ms"),
                 fmt::format("reference_single_ms = {} is no whole number of reference_ms = {}, of which samples of {} "
                             "ms are whole numbers: change one",
                             timestep_label(system.reference_single_ms), timestep_label(system.reference_ms),
                             timestep_label(system.sample_ms)));
  }
  if (pieces && (!whole(system.piece_ms, system.sample_ms) || system.piece_ms > system.duration_s * 1000 * 1.000001)) {
    section.fail(
        section.find("piece_ms"),
        fmt::format("piece_ms = {} is not a whole number of samples of {} ms within the duration of {} s: give "
                    "a multiple of {}",
                    shortest(system.piece_ms), timestep_label(system.sample_ms), shortest(system.duration_s),
                    timestep_label(system.sample_ms)));
  }
  // That of 'transfer' is the run in which the policy was trained, and need not be the finest.
  const bool only_transfer =
      std::ranges::all_of(system.measures, [](const Measure* measure) { return measure->reads == Reads::kRunPairs; });
  if (!only_transfer && system.timesteps_ms.front() < system.reference_ms * (1 - 1e-9)) {
    section.fail(section.find("reference_ms"),
                 fmt::format("the timestep {} ms is smaller than the reference's, {} ms: the reference has to be the "
                             "finest",
                             timestep_label(system.timesteps_ms.front()), timestep_label(system.reference_ms)));
  }
}

// exclude = [["a", "b"], ...]: pairs of bodies.
std::vector<BodyPair> excluded(const Section& section) {
  std::vector<BodyPair> pairs;
  const toml::node* node = section.find("exclude");
  if (node == nullptr) return pairs;
  for (const toml::node& entry : section.list("exclude", *node)) {
    const toml::array* pair = entry.as_array();
    std::vector<std::string> names;
    for (size_t i = 0; pair != nullptr && i < pair->size(); ++i) {
      if (const auto name = pair->get(i)->value_exact<std::string>()) names.push_back(*name);
    }
    if (names.size() != 2 || pair->size() != 2) {
      section.fail(&entry, fmt::format(R"('exclude' has {}: give pairs of bodies, as in [["thigh", "shank"]])",
                                       node_text(entry)));
    }
    pairs.push_back({names[0], names[1]});
  }
  return pairs;
}

CampaignSystem system_of(const Section& section, const Defaults& defaults, long long seed, Roster& roster) {
  std::vector<std::string> keys = key_names(kSystemKeys, kVariantKeys);
  for (std::string& key : load_key_names()) keys.push_back(std::move(key));
  section.allow(keys);
  CampaignSystem system;
  system.name = section.required_text("name");
  read_plain(section, kSystemKeys, system);
  const toml::node* model_node = section.find("model") != nullptr ? section.find("model") : section.find("name");
  std::string model = section.text("model").value_or(system.name);
  system.load = load_options_of(section);
  system.model_name = model;
  // A path counts from the campaign's folder, so that a campaign can be moved with its models.
  std::error_code error;
  if (const fs::path beside = fs::path(section.source()).parent_path() / model;
      model.find('/') != std::string::npos && fs::path(model).is_relative() && fs::exists(beside, error)) {
    model = beside.string();
  }
  at_node(section, model_node, [&] {
    system.model_path = fs::absolute(find_model(model)).string();
    system.model = load_model(system.model_path, system.load);
  });
  ModelVariant& variant = system.variant;
  read_plain(section, kVariantKeys, variant);
  variant.exclude = excluded(section);
  at_node(section, section.find("exclude"), [&] { system.model = variant_of(std::move(system.model), variant); });

  const auto timesteps = section.timesteps("timesteps_ms");
  if (!timesteps && !defaults.timesteps_ms) {
    section.fail(nullptr, fmt::format("system '{}' has no timesteps: give timesteps_ms = [1, ...], here or for the "
                                      "whole campaign",
                                      system.name));
  }
  system.timesteps_ms = timesteps ? *timesteps : *defaults.timesteps_ms;
  const auto measures = section.measures("measures");
  if (!measures && !defaults.measures) {
    section.fail(nullptr, fmt::format("system '{}' has no measures: give measures = [...]{}, here or for the whole "
                                      "campaign",
                                      system.name, did_you_mean("", measure_names())));
  }
  system.measures = measures ? *measures : *defaults.measures;
  system.reference_ms = section.positive("reference_ms", defaults.reference_ms);
  system.reference_single_ms =
      section.positive("reference_single_ms", std::max(defaults.reference_single_ms.value_or(0), system.reference_ms));
  system.sample_ms = section.positive("sample_ms", system.timesteps_ms.back());
  if (section.find("duration_s") == nullptr) {
    section.fail(nullptr,
                 fmt::format("system '{}' has no 'duration_s': give the run's length in seconds", system.name));
  }
  system.duration_s = section.positive("duration_s", 0);
  read_pieces(section, system);
  read_initial_states(section, seed, system);
  read_pushes(section, system);
  system.push_sample_ms = system.sample_ms;
  check_size(section, system);
  check_grid(section, system);
  if (system.has(Reads::kPieces) && !whole(system.timesteps_ms.front(), system.reference_ms)) {
    section.fail(section.find("reference_ms"), "the smallest timestep is not a whole number of the reference's");
  }
  // The restart floor is the error at the reference's own timestep.
  if (system.has(Reads::kPieces) && system.timesteps_ms.front() > system.reference_ms * (1 + 1e-9)) {
    system.timesteps_ms.insert(system.timesteps_ms.begin(), system.reference_ms);
  }
  if (system.has(Reads::kPieces) && std::ranges::none_of(system.timesteps_ms, [&](double each) {
        return same_timestep(each, system.reference_single_ms);
      })) {
    section.fail(section.find("reference_single_ms"),
                 fmt::format("reference_single_ms = {} is none of the system's timesteps: {} ms",
                             timestep_label(system.reference_single_ms), joined_ms(system.timesteps_ms)));
  }
  system.timing_ms = section.timesteps("timing_ms").value_or(system.timesteps_ms);
  read_worlds(section, system);
  read_own_timesteps(section, system);
  system.control = control_of(section, system.model);

  const auto control = make_control(system.model, system.control);
  system.grasp = grasp_of(section, system.model);
  const toml::node* contenders = section.find("contenders");
  system.contenders = contenders != nullptr ? roster.listed(section, *contenders) : defaults.contenders;
  std::ranges::sort(system.contenders);  // the campaign's order
  if (system.contenders.empty()) {
    section.fail(nullptr,
                 fmt::format("system '{}' has no contenders: give contenders = [\"...\"], here or for the whole "
                             "campaign",
                             system.name));
  }
  read_solution(section, system);
  check_measures(section, system, *control);
  check_control(section, system, *control);
  return system;
}

TimingOptions timing_of(const Section& section) {
  section.allow(key_names(kTimingKeys));
  TimingOptions timing;
  read_plain(section, kTimingKeys, timing);
  if (const toml::node* node = section.find("states")) {
    const auto text = node->value_exact<std::string>();
    if (!text || (*text != "own" && *text != "common")) {
      section.fail(node,
                   fmt::format("'states' is {}: give \"own\" or \"common\"; how many windows of the run are timed "
                               "is 'windows'",
                               node_text(*node)));
    }
    timing.common_states = *text == "common";
  }
  if (!timing.common_states && section.find("states_of") != nullptr) {
    section.fail(section.find("states_of"), "'states_of' has no effect without states = \"common\": add it");
  }
  return timing;
}

int contender_index(const Section& section, const toml::node* node, const Campaign& campaign, const std::string& name) {
  std::vector<std::string> known;
  known.reserve(campaign.contenders.size());
  for (const CampaignContender& each : campaign.contenders) known.push_back(each.resolved.name);
  const auto found = std::ranges::find(known, name);
  if (found == known.end()) {
    section.fail(node, fmt::format("'{}' is no contender of this campaign{}", name, did_you_mean(name, known)));
  }
  return static_cast<int>(found - known.begin());
}

// A twin is timed wherever its contender is.
void add_twins(const Section& section, Campaign& campaign) {
  const toml::node* node = section.find("twins");
  if (node == nullptr) return;
  for (const toml::node& entry : section.list("twins", *node)) {
    const auto name = entry.value_exact<std::string>();
    if (!name) section.fail(&entry, fmt::format("'twins' has {}: give a contender's name", node_text(entry)));
    const int index = contender_index(section, &entry, campaign, *name);
    CampaignContender twin = campaign.contenders[static_cast<size_t>(index)];
    twin.resolved.name += "-twin";
    twin.twin = true;
    const auto taken = [&](const CampaignContender& each) { return each.resolved.name == twin.resolved.name; };
    if (std::ranges::any_of(campaign.contenders, taken)) {
      section.fail(&entry, fmt::format("there is a contender '{}' already: name each twin once", twin.resolved.name));
    }
    for (CampaignSystem& system : campaign.systems) {
      if (std::ranges::find(system.contenders, index) == system.contenders.end()) continue;
      system.contenders.push_back(static_cast<int>(campaign.contenders.size()));
    }
    campaign.contenders.push_back(std::move(twin));
  }
}

Coordinates coordinates_of(const CampaignContender& contender) {
  return contender.resolved.engine->capabilities(contender.resolved.settings).coordinates;
}

// The contender that the system's policy was trained in, if it takes part: else a note.
void find_trained_in(Campaign& campaign, CampaignSystem& system) {
  if (!system.has(Reads::kRunPairs)) return;
  const auto control = make_control(system.model, system.control);
  const std::string& trained_in = control->policy()->trained_in;
  for (const int index : system.contenders) {
    const CampaignContender& contender = campaign.contenders[static_cast<size_t>(index)];
    if (contender.absent.empty() && contender.resolved.name == trained_in) system.trained_in = index;
  }
  if (system.trained_in >= 0 || trained_in.empty()) return;
  campaign.notes.push_back(
      fmt::format("{}: its policy was trained in '{}', which does not take part, so that no run is "
                  "compared with the training; add it to the contenders",
                  system.name, trained_in));
}

// Whose states all timings of the system start from. Joints come apart in maximal coordinates, and joint coordinates
// cannot express that.
void choose_states(const Section& section, const Campaign& campaign, CampaignSystem& system) {
  if (!campaign.timing.common_states || !system.has(Reads::kSteps)) return;
  const auto of = [&](int index) -> const CampaignContender& {
    return campaign.contenders[static_cast<size_t>(index)];
  };
  const auto present = [&](int index) { return of(index).absent.empty(); };
  const toml::node* node = section.find("states_of");
  if (const auto name = section.text("states_of")) {
    system.states_of = contender_index(section, node, campaign, *name);
    if (std::ranges::find(system.contenders, system.states_of) == system.contenders.end() ||
        !present(system.states_of)) {
      section.fail(node, fmt::format("'{}' does not take part in system '{}', so there are no states of it: give "
                                     "another contender",
                                     *name, system.name));
    }
  } else {
    for (const int index : system.contenders) {
      if (!present(index)) continue;
      if (system.states_of < 0) system.states_of = index;
      if (coordinates_of(of(index)) != Coordinates::kJoint) continue;
      system.states_of = index;
      break;
    }
  }
  const bool joints = joint_count(system.model) > 0;
  if (system.states_of < 0 || !joints || coordinates_of(of(system.states_of)) == Coordinates::kJoint) return;
  for (const int index : system.contenders) {
    if (!present(index) || coordinates_of(of(index)) != Coordinates::kJoint) continue;
    section.fail(
        node != nullptr ? node : section.find("states"),
        fmt::format("'{}' cannot start from the states of '{}' on '{}': there joints come apart, and its joint "
                    "coordinates cannot express that; give states_of = a contender in joint coordinates",
                    of(index).resolved.name, of(system.states_of).resolved.name, system.name));
  }
}

nlohmann::json content_of(const CampaignSystem& system) {
  nlohmann::json content = system_content(system);
  content["name"] = system.name;
  content["model"] = system.model.hash;
  if (system.grasp.object >= 0) content["grasp"] = {system.grasp.object, system.grasp.hand, system.grasp.drop_m};
  if (system.initial_states.count > 1 || !system.worlds.empty())
    content["initial_states"] = initial_states_content(system.initial_states);
  for (const auto& [key, timesteps] : system.own_timesteps_ms) {
    if (timesteps.size() < system.timesteps_ms.size()) content[key] = timesteps;
  }
  return content;
}

SearchTable search_of(const Section& root, const toml::node& node) {
  const toml::table* table = node.as_table();
  if (table == nullptr) root.fail(&node, "'search' is no table: write [search]");
  const Section section(*table, "[search]", root.source());
  section.allow(key_names(kSearchKeys, kSearchLimits));
  SearchTable search;
  read_plain(section, kSearchKeys, search);
  for (const Key<SearchTable>& key : kSearchLimits) {
    if (auto text = section.text(key.name)) search.limits[key.name] = *std::move(text);
  }
  if (const toml::node* limits = section.find("limits")) {
    for (const toml::node& entry : section.list("limits", *limits)) {
      const auto limit = entry.value_exact<std::string>();
      if (!limit) section.fail(&entry, fmt::format("'limits' has {}: give \"NAME=QUANTITY\"", node_text(entry)));
      search.other_limits.push_back(*limit);
    }
  }
  return search;
}

std::map<std::string, std::string> ratios_of(const Section& root, const std::vector<CampaignContender>& contenders) {
  std::vector<std::string> known;
  known.reserve(contenders.size());
  for (const CampaignContender& each : contenders) known.push_back(each.resolved.name);
  std::map<std::string, std::string> ratios;
  for (const Section& section : root.sections("ratio")) {
    section.allow(key_names(kRatioKeys));
    for (const char* key : {"of", "to"}) {
      const std::string name = section.required_text(key);
      if (std::ranges::find(known, name) != known.end()) continue;
      section.fail(section.find(key), fmt::format("'{}' is '{}', which is no contender of the campaign{}", key, name,
                                                  did_you_mean(name, known)));
    }
    const std::string of = section.required_text("of");
    if (!ratios.emplace(of, section.required_text("to")).second) {
      section.fail(section.find("of"), fmt::format("there are two ratios of '{}': leave one out", of));
    }
  }
  return ratios;
}

}  // namespace

bool CampaignSystem::has(Reads reads) const {
  return std::ranges::find(measures, reads, &Measure::reads) != measures.end();
}

const std::vector<double>& CampaignSystem::timesteps_of(const Measure& measure) const {
  if (is_timed(measure.reads)) return timing_ms;
  const auto own = own_timesteps_ms.find(measure.timesteps_key);
  return own == own_timesteps_ms.end() ? timesteps_ms : own->second;
}

double CampaignSystem::reference_of(const CampaignContender& contender) const {
  const ResolvedContender& resolved = contender.resolved;
  if (resolved.engine == nullptr) return reference_ms;
  const Capabilities can = resolved.engine->capabilities(resolved.settings);
  const double asked_ms = can.precision == Precision::kSingle ? reference_single_ms : reference_ms;
  // no finer than where the engine loses slow motions: the next timestep of the system from which samples can be taken
  const double finest_ms = 1e3 * can.finest_timestep * (1 - 1e-9);
  if (asked_ms >= finest_ms) return asked_ms;
  const auto usable = std::ranges::find_if(
      timesteps_ms, [&](double timestep) { return timestep >= finest_ms && whole(grid_ms(), timestep); });
  return usable == timesteps_ms.end() ? asked_ms : *usable;
}

int CampaignSystem::shown_state() const { return initial_states.count > 1 && !has(Reads::kFineRuns) ? 1 : 0; }

double CampaignSystem::grid_ms() const {
  double grid = sample_ms;
  for (const double length : more_pieces_ms) grid = std::min(grid, length);
  return has(Reads::kPieces) ? grid : sample_ms;
}

std::string solution_content(const CampaignSystem& system) {
  return system.solution_hash.empty() ? system.solution : "file " + system.solution_hash;
}

nlohmann::json system_content(const CampaignSystem& system) {
  std::vector<std::string> measures;
  measures.reserve(system.measures.size());
  for (const Measure* measure : system.measures) measures.emplace_back(measure->name);
  nlohmann::json content = {{"duration_s", system.duration_s},
                            {"sample_ms", system.sample_ms},
                            {"pieces", system.pieces},
                            {"piece_ms", system.piece_ms},
                            {"control", make_control(system.model, system.control)->description()},
                            {"measures", measures},
                            {"timesteps_ms", system.timesteps_ms},
                            {"timing_ms", system.timing_ms},
                            {"reference_ms", system.reference_ms}};
  if (!system.family.empty()) content["family"] = system.family;
  if (!system.solution.empty()) content["solution"] = solution_content(system);
  if (!system.worlds.empty()) content["worlds"] = system.worlds;
  if (!system.more_pieces_ms.empty()) content["more_pieces_ms"] = system.more_pieces_ms;
  if (system.pushes.any()) content["push"] = pushes_content(system.pushes);
  if (system.reference_single_ms != system.reference_ms) content["reference_single_ms"] = system.reference_single_ms;
  return content;
}

nlohmann::json initial_states_content(const InitialStates& states) {
  nlohmann::json content = {{"count", states.count}, {"seed", states.seed}};
  for (const PerturbationPart& part : kPerturbationParts) content[part.name] = states.around.*part.member;
  return content;
}

nlohmann::json pushes_content(const Pushes& pushes) {
  if (!pushes.any()) return nullptr;
  return {{"velocity", pushes.velocity}, {"every_s", pushes.every_s}, {"joint", pushes.joint}, {"seed", pushes.seed}};
}

std::string CampaignContender::content() const {
  if (resolved.engine == nullptr) return "absent";
  nlohmann::json settings = nlohmann::json::object();
  for (const auto& [key, value] : resolved.settings.values) settings[key] = setting_text(value);
  return dump_json(nlohmann::json{{"engine", resolved.engine->name()},
                                  {"version", resolved.engine->build().version},
                                  {"plugin", plugin_hash},
                                  {"settings", settings}});
}

std::string Campaign::hash() const {
  nlohmann::json content;
  content["systems"] = nlohmann::json::array();
  for (const CampaignSystem& system : systems) {
    content["systems"].push_back(content_of(system));
    if (system.contenders.size() == contenders.size()) continue;
    nlohmann::json& names = content["systems"].back()["contenders"];
    for (const int index : system.contenders) names.push_back(contenders[static_cast<size_t>(index)].resolved.name);
  }
  content["contenders"] = nlohmann::json::array();
  for (const CampaignContender& contender : contenders) {
    content["contenders"].push_back({contender.resolved.name, contender.content()});
  }
  content["timing"] = {timing.rounds,  timing.processes, timing.batch_ms,
                       timing.windows, timing.warmup,    timing.common_states};
  content["time_limit_s"] = time_limit_s;
  content["seed"] = seed;
  return content_hash(dump_json(content));
}

Campaign parse_campaign(const std::string& toml_text, const std::string& source, const Registry& registry) {
  std::optional<Activity> reading(std::in_place, fmt::format("reading the campaign '{}'", source));
  const toml::table table = toml_table(toml_text, source);
  reading.reset();  // a model's limits are its own
  const Section root(table, "a campaign", source);
  std::vector<std::string> keys = key_names(kCampaignKeys);
  keys.insert(keys.end(), {"timing", "system", "contender", "ratio", "search", "sweep"});
  root.allow(keys);
  Campaign campaign;
  campaign.source = source;
  campaign.name = root.required_text("name");
  campaign.title = root.text("title").value_or(campaign.name);
  read_plain(root, kCampaignKeys, campaign);
  if (campaign.time_limit_s < kLeastTimeLimitS || campaign.time_limit_s > kMostTimeLimitS) {
    root.fail(root.find("time_limit_s"),
              fmt::format("'time_limit_s' is {}: give at least {} and at most {} seconds for one cell",
                          shortest(campaign.time_limit_s), shortest(kLeastTimeLimitS), shortest(kMostTimeLimitS)));
  }
  campaign.seed = root.count("seed", 1, 0, 1'000'000'000);
  if (const toml::node* node = root.find("timing")) {
    if (!node->is_table())
      root.fail(node, fmt::format("'timing' is {}: write it as a table [timing]", node_text(*node)));
    campaign.timing = timing_of(Section(*node->as_table(), "[timing]", source));
  }
  if (const toml::node* node = root.find("search")) campaign.search = search_of(root, *node);
  const std::vector<Section> systems = root.sections("system");
  if (systems.empty()) root.fail(nullptr, "the campaign has no systems: give each as a table under [[system]]");
  Roster roster(root, registry);
  Defaults defaults;
  if (const toml::node* node = root.find("contenders")) defaults.contenders = roster.listed(root, *node);
  std::vector<Section> lists = systems;
  lists.push_back(root);
  const std::vector<int> everywhere = roster.unlisted(lists);
  defaults.contenders.insert(defaults.contenders.end(), everywhere.begin(), everywhere.end());
  defaults.timesteps_ms = root.timesteps("timesteps_ms");
  defaults.measures = root.measures("measures");
  defaults.reference_ms = root.positive("reference_ms", defaults.reference_ms);
  if (root.find("reference_single_ms") != nullptr)
    defaults.reference_single_ms = root.positive("reference_single_ms", 1);
  for (const Section& section : systems) {
    campaign.systems.push_back(system_of(section, defaults, campaign.seed, roster));
    const std::string& name = campaign.systems.back().name;
    if (std::ranges::count(campaign.systems, name, &CampaignSystem::name) > 1) {
      section.fail(section.find("name"),
                   fmt::format("there are two systems '{}': rename one and give its model", name));
    }
  }
  campaign.notes = roster.notes();
  campaign.contenders = std::move(roster).contenders();
  reading.emplace(fmt::format("reading the sweeps of the campaign '{}'", source));
  add_variants(root, registry, campaign);
  reading.reset();
  if (const toml::node* node = root.find("timing")) {
    const Section timing(*node->as_table(), "[timing]", source);
    add_twins(timing, campaign);
    for (CampaignSystem& system : campaign.systems) choose_states(timing, campaign, system);
  }
  for (CampaignSystem& system : campaign.systems) find_trained_in(campaign, system);
  campaign.ratios = ratios_of(root, campaign.contenders);
  return campaign;
}

std::string campaign_text(const std::string& path) {
  constexpr std::uintmax_t kMostBytes = std::uintmax_t{4} << 20;
  const Activity reading(fmt::format("reading the campaign '{}'", path));
  return input_text(path, "campaign", "a TOML file", kMostBytes);
}

Campaign load_campaign(const std::string& path, const Registry& registry) {
  return parse_campaign(campaign_text(path), path, registry);
}

}  // namespace assay
