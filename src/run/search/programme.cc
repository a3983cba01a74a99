#include "run/search/programme.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <fnmatch.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/terminal.h"
#include "base/text.h"
#include "check/overlaps.h"
#include "controls/hold.h"
#include "controls/policy_config.h"
#include "engines/builds.h"
#include "measures/initial_states.h"
#include "measures/reference/smooth.h"
#include "model/shape.h"
#include "model/variant.h"
#include "run/search/stance.h"

namespace assay {
namespace {

constexpr double kDropHeight = 0.05;  // m
constexpr double kStartRates = 1;     // rad/s, m/s

// "joint 'knee' armature" without its names, and the first of them with what stands between it and the others:
// "contact of 'foot' and 'shin'" is a contact, "foot and shin".
std::pair<std::string, std::string> kind_and_name(const std::string& element) {
  const size_t opens = element.find(" '");
  const size_t first = opens == std::string::npos ? opens : element.find('\'', opens + 2);
  if (first == std::string::npos) return {element, ""};
  const size_t closes = element.rfind('\'');
  std::string name = element.substr(opens + 2, closes - opens - 2);
  std::erase(name, '\'');
  std::string kind = element.substr(0, opens);
  if (kind.ends_with(" of") && closes != first) kind.resize(kind.size() - 3);
  return {kind + element.substr(closes + 1), name};
}

// The refusals of one contender: each kind of element once. "" when it takes the model.
std::string refusal_text(const std::vector<Limitation>& limitations) {
  struct Kind {
    std::string kind, first, how;
    int count = 0;
  };
  std::vector<Kind> kinds;
  for (const Limitation& limitation : limitations) {
    if (limitation.fidelity != Fidelity::kRefused) continue;
    const auto [kind, name] = kind_and_name(limitation.element);
    auto same = std::ranges::find_if(
        kinds, [&, kind = kind](const Kind& other) { return other.kind == kind && other.how == limitation.how; });
    if (same == kinds.end()) same = kinds.insert(kinds.end(), {kind, name, limitation.how, 0});
    ++same->count;
  }
  std::vector<std::string> parts;
  parts.reserve(kinds.size());
  for (const Kind& kind : kinds) {
    std::string where;
    if (kind.count > 1) where = fmt::format(" ({} times, first {})", kind.count, kind.first);
    if (kind.count == 1 && !kind.first.empty()) where = " of " + kind.first;
    parts.push_back(fmt::format("refuses {}{}: {}", kind.kind, where, kind.how));
  }
  return join(parts, "; ");
}

void add_contenders(const Model& model, const std::vector<std::string>& patterns, const Registry& registry,
                    Programme& programme) {
  std::vector<std::string> known = registry.contender_names();
  for (const std::string& pattern : patterns) {
    if (build_of(pattern) == kBaseline) continue;
    registry.resolve(pattern);  // says what is wrong with it
    known.push_back(pattern);
  }
  const auto matches = [](const std::string& pattern, const std::string& name) {
    return ::fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
  };
  for (const std::string& pattern : patterns) {
    if (std::ranges::none_of(known, [&](const std::string& name) { return matches(pattern, name); })) {
      throw InputError(fmt::format("--contenders has '{}', which no contender of the installed engines matches{}",
                                   pattern, did_you_mean(pattern, known)));
    }
  }
  for (const std::string& name : known) {
    const auto has_name = [&](const std::string& pattern) { return matches(pattern, name); };
    if (!patterns.empty() && std::ranges::none_of(patterns, has_name)) continue;
    const ResolvedContender contender = registry.resolve(name);
    if (contender.engine->capabilities(contender.settings).order <= 0) continue;  // the one that does nothing
    const std::string text = refusal_text(contender.engine->check(model, contender.settings));
    if (text.empty()) {
      programme.contenders.push_back(name);
      continue;
    }
    const std::string engine = contender.engine->name();
    auto same = std::ranges::find_if(
        programme.refusals, [&](const Refusal& refusal) { return refusal.engine == engine && refusal.text == text; });
    if (same == programme.refusals.end()) {
      same = programme.refusals.insert(programme.refusals.end(), {engine, {}, text});
    }
    same->contenders.push_back(name);
  }
}

std::string list_text(const std::vector<std::string>& texts) {
  std::string list = "[\n";
  std::string line = " ";
  for (const std::string& text : texts) {
    const std::string entry = " " + toml_text(text) + ",";
    if (line.size() + entry.size() > 110) {
      list += line + "\n";
      line = " ";
    }
    line += entry;
  }
  return list + line + "\n]";
}

std::string control_line(const ControlSpec& spec) {
  std::string table;
  for (const ControlPart& part : kControlParts) {
    if (spec.kind == part.kind && spec.*part.member != ControlSpec().*part.member) {
      table += fmt::format(", {} = {}", part.name, shortest(spec.*part.member));
    }
  }
  if (spec.kind == "file") table += ", path = " + toml_text(spec.file);
  if (spec.kind == "policy") table += ", config = " + toml_text(spec.policy);
  if (!spec.network.empty()) table += ", network = " + toml_text(spec.network);
  if (table.empty()) return fmt::format("control = {}", toml_text(spec.kind));
  return fmt::format("control = {{kind = {}{}}}", toml_text(spec.kind), table);
}

struct SystemText {
  std::string name, why;
  std::vector<std::string> lines;
};

// Pairs of the robot's own bodies whose shapes overlap at the start.
struct Overlapping {
  std::vector<BodyPair> pairs;  // the deepest first
  double depth = 0;             // m, of the deepest
};

Overlapping overlapping(const Model& model) {
  constexpr double kLeast = 5e-4;  // m
  // What is fixed to the world belongs to a robot on a fixed base.
  const auto robot_of = [&](int body) {
    const int root = body == kWorld ? kWorld : root_of(model, body);
    return root == kWorld || !model.bodies[static_cast<size_t>(root)].is_free() ? kWorld : root;
  };
  const auto name = [&](int body) { return body == kWorld ? "world" : model.bodies[static_cast<size_t>(body)].name; };
  Overlapping found;
  for (const Overlap& overlap : overlaps(model, model.initial, kLeast)) {
    const ContactPair& pair = model.contacts[static_cast<size_t>(overlap.pair)];
    const Shape& a = model.shapes[static_cast<size_t>(pair.shape_a)];
    const Shape& b = model.shapes[static_cast<size_t>(pair.shape_b)];
    if (is_ground(a) || is_ground(b) || robot_of(a.body) != robot_of(b.body)) continue;
    const BodyPair bodies = {name(a.body), name(b.body)};
    const auto same = [&](const BodyPair& other) {
      return other == bodies || (other.a == bodies.b && other.b == bodies.a);
    };
    if (std::ranges::none_of(found.pairs, same)) found.pairs.push_back(bodies);
    found.depth = std::max(found.depth, overlap.depth);
  }
  return found;
}

// "exclude = [...]", some pairs a line.
std::string exclude_text(const std::vector<BodyPair>& pairs) {
  std::string list = "exclude = [\n";
  for (const BodyPair& pair : pairs) list += fmt::format("  [{}, {}],\n", toml_text(pair.a), toml_text(pair.b));
  return list + "]";
}

std::vector<SystemText> systems_of(const Model& model, const ProgrammeOptions& options) {
  const bool moves = !model.joints.empty();
  const bool is_free = has_free_base(model);
  const bool floats = is_free || has_free_slide(model);
  const bool drops = floats && can_land(model);
  // A height field or an obstacle may lie below: then it falls from where its file puts it.
  const bool raised = drops && is_free && std::isfinite(height_above_ground(model));
  std::vector<SystemText> systems;

  SystemText& work = systems.emplace_back();
  ControlSpec control;
  control.kind = moves ? "hold" : "passive";
  if (options.control) control = *options.control;
  // Throws where the model cannot have it. A file's path counts from the campaign, and the caller has read it.
  if (control.file.empty()) make_control(model, control);
  std::string driven = fmt::format("with the control '{}'", control.kind);
  if (control.kind == "hold") driven = "held at its start pose by a PD";
  if (control.kind == "passive") driven = "without torques";
  if (!control.file.empty()) driven = fmt::format("with the torques of '{}'", control.file);
  work.name = drops ? "drop" : control.kind;
  std::string where = "stands on its fixed base";
  if (floats) where = "is free in space, without gravity";
  if (drops) where = "falls onto the ground from where its file puts it";
  if (raised) where = fmt::format("falls {} cm onto the ground", 100 * kDropHeight);
  work.why = fmt::format("{}: the robot {}, {}", work.name, where, driven);
  if (raised) work.lines.push_back(fmt::format("above_ground_m = {}", shortest(kDropHeight)));
  if (floats && !drops) work.lines.emplace_back("gravity = false");
  if (const Overlapping overlap = overlapping(model); !overlap.pairs.empty()) {
    const BodyPair& first = overlap.pairs.front();
    work.why += fmt::format(
        "; contacts of {} with each other are left out, because their shapes overlap at the start, which would drive "
        "them apart (the deepest: {} and {}, {:.3g} mm; see 'exclude')",
        overlap.pairs.size() == 1 ? "a pair of its bodies"
                                  : fmt::format("{} pairs of its bodies", overlap.pairs.size()),
        first.a, first.b, 1e3 * overlap.depth);
    work.lines.push_back(exclude_text(overlap.pairs));
  }
  work.lines.push_back(control_line(control));
  // a free body that meets nothing has nothing to violate
  const bool violates = moves || !model.contacts.empty();
  work.lines.insert(work.lines.end(), {violates ? R"(measures = ["raw_speed", "consistency", "violation"])"
                                                : R"(measures = ["raw_speed", "consistency"])",
                                       "duration_s = 1.024", "pieces = 6", "piece_ms = 64"});

  if (moves && (drops || control.kind != "random")) {
    SystemText& random = systems.emplace_back();
    random.name = "random";
    random.why = "random: no contacts, seeded random torques at every joint";
    random.lines = {"contacts = false", R"(control = "random")"};
    if (floats) random.lines.emplace_back("gravity = false");
    random.lines.insert(random.lines.end(), {R"(measures = ["consistency", "violation"])", "duration_s = 0.512",
                                             "pieces = 4", "piece_ms = 64"});
  }
  const Model smooth = variant_of(model, {.smooth = true, .start_rates = kStartRates});
  if (smooth_obstacle(smooth).empty()) {
    SystemText& swing = systems.emplace_back();
    swing.name = "swing";
    swing.why =
        "swing: no contacts, limits, dry friction and torques, random joint rates at the start; compared with "
        "the reference solution";
    swing.lines = {"smooth = true", fmt::format("start_rates = {}", shortest(kStartRates)), "measures = [\"truth\"]",
                   "duration_s = 0.256"};
  }
  return systems;
}

// The timesteps at which a policy is tried, ascending: about that of training, or parts of its control period.
std::vector<double> policy_timesteps(const Control& control, const std::vector<double>& given) {
  if (!given.empty()) {
    std::vector<double> sorted = given;
    std::ranges::sort(sorted);
    for (const double timestep_ms : sorted) control.check_timestep(1e-3 * timestep_ms);
    return sorted;
  }
  const PolicyConfig& policy = *control.policy();
  const double trained_ms = 1e3 * policy.train_timestep_s, period_ms = 1e3 * policy.period_s;
  const std::array<double, 3> tried = trained_ms > 0
                                          ? std::array<double, 3>{trained_ms / 2, trained_ms, 2 * trained_ms}
                                          : std::array<double, 3>{period_ms / 20, period_ms / 10, period_ms / 4};
  std::vector<double> timesteps;
  for (const double timestep_ms : tried) {
    try {
      control.check_timestep(1e-3 * timestep_ms);
      timesteps.push_back(timestep_ms);
    } catch (const InputError&) {  // NOLINT(bugprone-empty-catch): no whole number of it is a control step
    }
  }
  return timesteps;
}

// Under a policy: all contenders at some timesteps from perturbed starts.
std::string policy_text(const Model& model, const Control& control, const ProgrammeOptions& options,
                        Programme& programme) {
  const PolicyConfig& policy = *control.policy();
  const double period_ms = 1e3 * policy.period_s;
  const double duration_s = std::max(1.0, std::round(options.duration_s / policy.period_s)) * policy.period_s;
  const bool perturbed = options.states > 1 && perturbation_obstacle(model).empty();
  programme.systems.push_back(fmt::format("policy: {} for {} s{}", control.description(), shortest(duration_s),
                                          perturbed ? fmt::format(", from {} perturbed starts", options.states) : ""));
  if (const Pushes& pushes = options.pushes; pushes.any()) {
    programme.systems.back() +=
        fmt::format(", with a push of {} {} every {} s", shortest(pushes.velocity),
                    pushes.joint.empty() ? "m/s" : fmt::format("of '{}'", pushes.joint), shortest(pushes.every_s));
  }
  std::vector<std::string> timesteps;
  const std::vector<double> numbers = policy_timesteps(control, options.timesteps_ms);
  timesteps.reserve(numbers.size());
  for (const double timestep_ms : numbers) timesteps.push_back(shortest(timestep_ms));
  const double reference_ms = policy.train_timestep_s > 0 ? 1e3 * policy.train_timestep_s : numbers.front();
  std::string toml = fmt::format("timesteps_ms = [{}]\nreference_ms = {}\ntime_limit_s = 120\n", join(timesteps, ", "),
                                 shortest(reference_ms));
  toml += fmt::format("\n[[system]]\nname = \"policy\"\nmodel = {}\n", toml_text(options.model));
  for (const std::string& line : options.model_lines) toml += line + "\n";
  toml += control_line(options.control.value_or(ControlSpec{})) + "\nmeasures = [\"transfer\"]\n";
  toml += fmt::format("duration_s = {}\nsample_ms = {}\n", shortest(duration_s), shortest(period_ms));
  if (perturbed) toml += fmt::format("initial_states = {}\n", options.states);
  if (const Pushes& pushes = options.pushes; pushes.any()) {
    toml +=
        fmt::format("push = {{velocity = {}, every_s = {}{}}}\n", shortest(pushes.velocity), shortest(pushes.every_s),
                    pushes.joint.empty() ? "" : fmt::format(", joint = {}", toml_text(pushes.joint)));
  }
  return toml;
}

}  // namespace

Programme programme_for(const Model& model, const ProgrammeOptions& options, const Registry& registry) {
  Programme programme;
  Model equipped = model;
  if (options.policy != nullptr) options.policy->equip(equipped);
  add_contenders(equipped, options.patterns, registry, programme);
  if (programme.contenders.empty()) {
    throw InputError(
        fmt::format("no installed engine takes '{}': see 'assay check {}' for the reasons", model.name, model.source));
  }
  const Control* policy = options.policy;
  std::vector<SystemText> systems;
  if (policy == nullptr) systems = systems_of(model, options);
  std::string& toml = programme.toml;
  toml = fmt::format("# Written by: {}\n# Change it and run it again: assay run THIS_FILE --out ANOTHER_FOLDER\n#\n",
                     printable(options.command));
  for (const std::string& note : options.notes) toml += fmt::format("# {}\n", printable(note));
  for (const std::string& note : model.notes) toml += fmt::format("# note on the model: {}\n", printable(note));
  for (const SystemText& system : systems) {
    toml += fmt::format("# {}\n", printable(system.why));
    programme.systems.push_back(system.why);
  }
  for (const Refusal& refusal : programme.refusals) {
    toml += fmt::format("# left out, because {} {}: {}\n", refusal.engine, printable(refusal.text),
                        join(refusal.contenders, ", "));
  }
  const std::string robot = printable(model.name);
  toml += fmt::format(
      "name = {}\ntitle = {}\n", toml_text(robot),
      toml_text(policy != nullptr ? fmt::format("{}: which engines its policy transfers to", robot)
                                  : fmt::format("{}: which engine, which settings, which timestep", robot)));
  toml += fmt::format("contenders = {}\n", list_text(programme.contenders));
  if (policy != nullptr) {
    toml += policy_text(model, *policy, options, programme);
    return programme;
  }
  toml += "# A search tries the first and the last only where the others leave its answer at an edge.\n";
  toml += "timesteps_ms = [\"1/8\", \"1/4\", \"1/2\", 1, 2, 4, 8, 16, 32]\nreference_ms = \"1/16\"\n";
  toml += "time_limit_s = 60\n";
  toml += "\n[timing]\nrounds = 6\nprocesses = 6\nbatch_ms = 20\nwindows = 16\nwarmup = 3\n";
  toml += fmt::format("\n# Without this table all cells are measured.\n[search]\nminutes = {}\n",
                      shortest(options.minutes));
  for (const auto& [name, limit] : options.limits) toml += fmt::format("{} = {}\n", name, toml_text(limit));
  if (!options.other_limits.empty()) toml += fmt::format("limits = {}\n", list_text(options.other_limits));
  for (const SystemText& system : systems) {
    toml += fmt::format("\n[[system]]\nname = {}\nmodel = {}\n", toml_text(system.name), toml_text(options.model));
    for (const std::string& line : options.model_lines) toml += line + "\n";
    for (const std::string& line : system.lines) toml += line + "\n";
  }
  return programme;
}

}  // namespace assay
