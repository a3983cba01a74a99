#include "explain/question.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <thread>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/option_values.h"
#include "base/paths.h"
#include "base/text.h"
#include "controls/policy_config.h"
#include "isolate/activity.h"
#include "load/mjcf.h"
#include "run/coordinator/rerun.h"
#include "run/coordinator/subject.h"

namespace assay {
namespace {

constexpr int kStarts = 10;
constexpr double kSeconds = 2, kPolicySeconds = 4;
constexpr double kTimestepMs = 1;
constexpr double kSamples = 200;  // about so many of a run

// The one system of the results, or the one that is asked for.
std::string system_asked(const Store& store, const std::optional<std::string>& asked) {
  std::vector<std::string> names;
  for (const SystemRow& row : store.systems()) names.push_back(row.name);
  if (names.empty()) {
    throw InputError(fmt::format("the results in '{}' have no robot: measure one with 'assay run'", store.dir()));
  }
  if (!asked && names.size() == 1) return names.front();
  if (!asked) {
    throw InputError(fmt::format("the results in '{}' have {} systems: choose one with --system ({})", store.dir(),
                                 names.size(), join(names, ", ")));
  }
  if (std::ranges::find(names, *asked) != names.end()) return *asked;
  throw InputError(
      fmt::format("the results in '{}' have no system '{}'{}", store.dir(), *asked, did_you_mean(*asked, names)));
}

double timestep_measured(const Store& store, const CampaignSystem& system, const std::optional<std::string>& asked) {
  if (asked) return parse_positive("--timestep", *asked, "milliseconds");
  std::set<double> measured;
  for (const Cell& cell : store.cells()) {
    if (cell.system == system.name) measured.insert(cell.timestep_ms);
  }
  if (measured.size() == 1) return *measured.begin();
  const bool policy = system.control.kind == "policy";
  for (const double timestep_ms : measured) {  // the one of training
    if (policy && same_timestep(timestep_ms, system.reference_ms)) return timestep_ms;
  }
  std::vector<std::string> texts;
  texts.reserve(measured.size());
  for (const double timestep_ms : measured) texts.push_back(timestep_label(timestep_ms));
  throw InputError(fmt::format("the results in '{}' have {} of '{}'{}: choose a timestep with --timestep", store.dir(),
                               measured.empty() ? "no runs" : "several timesteps", system.name,
                               texts.empty() ? "" : fmt::format(" ({} ms)", join(texts, ", "))));
}

Side side_measured(const Store& store, const std::string& name) {
  const CampaignContender contender = stored_contender(store, name);
  return {.name = "", .contender = contender.resolved.base, .overrides = contender.overrides, .changes = {}};
}

void from_results(const ExplainRequest& request, ExplainQuestion& question, double& seconds) {
  if (request.control_given) {
    throw InputError(
        fmt::format("'{}' holds results, whose control is used: leave --control and --policy out", request.model));
  }
  if (!request.load_option.empty()) {
    throw InputError(fmt::format("'{}' holds results, whose model is read as it was: leave {} out", request.model,
                                 request.load_option));
  }
  const Store store = Store::open(request.model);
  CampaignSystem system = stored_system(store, system_asked(store, request.system));
  question.timestep_ms = timestep_measured(store, system, request.timestep);
  question.a = side_measured(store, request.a);
  question.b = side_measured(store, request.b);
  question.spec = model_spec(system);
  question.model = std::move(system.model);
  question.control_spec = system.control;
  question.states = system.initial_states;
  seconds = std::min(seconds, system.duration_s);
}

void from_model(const ExplainRequest& request, ExplainQuestion& question) {
  if (request.system) {
    throw InputError(
        fmt::format("--system {} chooses in results, and '{}' is no folder", *request.system, request.model));
  }
  question.spec = {.path = find_model(request.model), .hash = "", .load = request.load, .variant = {}};
  question.model = load_model(question.spec.path, request.load);
  question.spec.hash = question.model.hash;
  question.control_spec = request.control;
  question.a.contender = request.a;
  question.b.contender = request.b;
  if (request.timestep) question.timestep_ms = parse_positive("--timestep", *request.timestep, "milliseconds");
}

// Samples at about 200 moments of the run, between which every timestep fits.
void sample(const Pairing& pairing, double seconds, ExplainQuestion& question) {
  const double per_sample = std::max(1.0, std::round(1000 * seconds / question.timestep_ms / kSamples));
  question.sample_ms = per_sample * question.timestep_ms;
  question.samples = std::llround(1000 * seconds / question.sample_ms);
  if (question.samples < 2) {
    throw InputError(fmt::format("--seconds is {} s, which is less than two timesteps of {} ms: give more",
                                 shortest(seconds), timestep_label(question.timestep_ms)));
  }
  for (const Side* side : {&pairing.a, &pairing.b}) {
    const Recipe recipe = recipe_of(*side);
    const double ratio = question.sample_ms / (question.timestep_ms * recipe.timestep_factor);
    if (std::abs(ratio - std::round(ratio)) > 1e-9 * ratio || ratio < 1) {
      throw InputError(
          fmt::format("the change 'timestep={}' of {} makes a timestep of which {} ms are no whole number: use 0.5 or "
                      "another part by a whole number",
                      shortest(recipe.timestep_factor), side->name, shortest(question.sample_ms)));
    }
  }
}

// What a side runs has to be possible before anything runs.
void check_side(const ExplainQuestion& question, const Side& side) {
  const Recipe recipe = recipe_of(side);
  const auto control = changed_control(question.model, question.control_spec, recipe.changes);
  Model model = changed_model(question.model, recipe.changes);
  Settings settings = recipe.contender.settings;
  settings.timestep = 1e-3 * question.timestep_ms * recipe.timestep_factor;
  control->check_timestep(settings.timestep);
  control->equip(model);
  const Activity asking(fmt::format("asking {} what it does with '{}'", side.contender, model.name));
  for (const Limitation& limitation : recipe.contender.engine->check(model, settings)) {
    if (limitation.fidelity != Fidelity::kRefused) continue;
    throw InputError(
        fmt::format("{} refuses {} of '{}': {}", side.contender, limitation.element, model.name, limitation.how));
  }
}

}  // namespace

bool holds_results(const std::string& given) {
  std::error_code error;
  return std::filesystem::is_directory(given, error);
}

RunPlan ExplainQuestion::plan() const {
  return {.model = spec,
          .control = control_spec,
          .duration_s = seconds(),
          .timestep_ms = timestep_ms,
          .sample_ms = sample_ms,
          .states = states,
          .policy = control->policy() != nullptr,
          .jobs = jobs};
}

ExplainQuestion explain_question(const ExplainRequest& request) {
  ExplainQuestion question;
  double seconds = request.policy_given || holds_results(request.model) ? kPolicySeconds : kSeconds;
  if (holds_results(request.model)) {
    from_results(request, question, seconds);
  } else {
    from_model(request, question);
  }
  if (question.model.bodies.empty()) throw InputError(fmt::format("nothing moves in '{}'", question.model.name));
  if (request.seconds) seconds = parse_positive("--seconds", *request.seconds, "seconds");
  question.a.name = "A";
  question.b.name = "B";
  for (const auto& [side, texts] : {std::pair(&question.a, &request.changes_a), {&question.b, &request.changes_b}}) {
    side->changes = parse_changes(*texts);
  }
  question.control = make_control(question.model, question.control_spec);
  if (question.timestep_ms == 0) {
    const PolicyConfig* policy = question.control->policy();
    const bool trained = policy != nullptr && policy->train_timestep_s > 0;
    question.timestep_ms = trained ? 1e3 * policy->train_timestep_s : kTimestepMs;
  }
  for (const Side* side : {&question.a, &question.b}) check_side(question, *side);
  const std::string obstacle = perturbation_obstacle(question.model);
  question.starts = obstacle.empty() ? kStarts : 1;
  if (request.seeds) question.starts = parse_count("--seeds", *request.seeds, 1, 1000);
  if (!obstacle.empty() && question.starts > 1) {
    throw InputError(fmt::format("'{}' {}: give --seeds 1", question.model.name, obstacle));
  }
  const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  question.jobs = request.jobs ? parse_count("--jobs", *request.jobs, 1, 4096) : cores;
  sample(question.pairing(), seconds, question);
  return question;
}

}  // namespace assay
