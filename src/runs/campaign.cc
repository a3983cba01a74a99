#include "runs/campaign.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>

#include <fmt/format.h>
#include <fnmatch.h>
#include <nlohmann/json.hpp>
#include <toml++/toml.h>

#include "base/errors.h"
#include "base/hash.h"
#include "base/paths.h"
#include "base/text.h"
#include "measures/mechanics.h"
#include "model/mjcf.h"
#include "reference/smooth.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::pair<Measure, std::string_view>, 8> kMeasures = {{
    {Measure::kRawSpeed, "raw_speed"},
    {Measure::kConsistency, "consistency"},
    {Measure::kTruth, "truth"},
    {Measure::kDrift, "drift"},
    {Measure::kViolation, "violation"},
    {Measure::kGrasp, "grasp"},
    {Measure::kAgreement, "agreement"},
    {Measure::kScaling, "scaling"},
}};

std::vector<std::string> measure_names() {
  std::vector<std::string> names;
  names.reserve(kMeasures.size());
  for (const auto& [measure, text] : kMeasures) names.emplace_back(text);
  return names;
}

std::string node_text(const toml::node& node) {
  std::ostringstream out;
  node.visit([&](const auto& value) {
    if constexpr (toml::is_table<decltype(value)>) {
      out << "a table";
    } else if constexpr (toml::is_array<decltype(value)>) {
      out << "a list";
    } else if constexpr (toml::is_string<decltype(value)>) {
      out << "'" << *value << "'";
    } else {
      out << value;
    }
  });
  return out.str();
}

// `a` is a whole number of `b`, up to the rounding of decimal fractions.
bool whole(double a, double b) {
  const double ratio = a / b;
  return std::abs(ratio - std::round(ratio)) <= 1e-9 * std::max(1.0, ratio) && ratio > 0.5;
}

bool same_timestep(double a, double b) { return std::abs(a - b) <= 1e-9 * b; }

std::string joined_ms(const std::vector<double>& timesteps) {
  std::vector<std::string> labels;
  labels.reserve(timesteps.size());
  for (const double timestep : timesteps) labels.push_back(timestep_label(timestep));
  return join(labels, ", ");
}

// One table of the file, with messages that say where in it something is wrong.
class Section {
 public:
  Section(const toml::table& table, std::string what, const std::string& source)
      : table_(table), what_(std::move(what)), source_(source) {}

  [[noreturn]] void fail(const toml::node* node, const std::string& sentence) const {
    const toml::node& at = node != nullptr ? *node : static_cast<const toml::node&>(table_);
    throw InputError(fmt::format("{}:{}: {}", source_, at.source().begin.line, sentence));
  }

  // Throws for a key that is none of `known`: nothing in the file is ignored.
  void allow(const std::vector<std::string>& known) const {
    for (const auto& [key, node] : table_) {
      const std::string name(key.str());
      if (std::ranges::find(known, name) == known.end()) {
        throw InputError(fmt::format("{}:{}: {} has no key '{}'{}", source_, key.source().begin.line, what_, name,
                                     did_you_mean(name, known)));
      }
    }
  }

  const toml::node* find(std::string_view key) const { return table_.get(key); }

  std::optional<std::string> text(std::string_view key) const {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    const auto value = node->value_exact<std::string>();
    if (!value || value->empty()) fail(node, fmt::format("'{}' is {}: give a text", key, node_text(*node)));
    return value;
  }

  std::string required_text(std::string_view key) const {
    const auto value = text(key);
    if (!value) fail(nullptr, fmt::format("{} has no '{}': give one", what_, key));
    return *value;
  }

  bool flag(std::string_view key, bool otherwise) const {
    const toml::node* node = find(key);
    if (node == nullptr) return otherwise;
    const auto value = node->value_exact<bool>();
    if (!value) fail(node, fmt::format("'{}' is {}: give true or false", key, node_text(*node)));
    return *value;
  }

  double positive(std::string_view key, double otherwise) const {
    const toml::node* node = find(key);
    return node == nullptr ? otherwise : positive(key, *node);
  }

  double positive(std::string_view key, const toml::node& node) const {
    std::optional<double> value;
    if (const auto text = node.value_exact<std::string>()) {
      value = parse_fraction(*text);
    } else if (!node.is_boolean()) {
      value = node.value<double>();
    }
    if (!value || !std::isfinite(*value) || *value <= 0) {
      fail(&node, fmt::format("'{}' has {}: give a positive number, or a fraction as text like \"1/64\"", key,
                              node_text(node)));
    }
    return *value;
  }

  int count(std::string_view key, int otherwise, int least, int most) const {
    const toml::node* node = find(key);
    if (node == nullptr) return otherwise;
    const auto value = node->value_exact<std::int64_t>();
    if (!value || *value < least || *value > most) {
      fail(node, fmt::format("'{}' is {}: give a whole number from {} to {}", key, node_text(*node), least, most));
    }
    return static_cast<int>(*value);
  }

  const toml::array& list(std::string_view key, const toml::node& node) const {
    const toml::array* array = node.as_array();
    if (array == nullptr || array->empty()) {
      fail(&node, fmt::format("'{}' is {}: give a list in brackets with at least one entry", key,
                              array != nullptr ? "empty" : node_text(node)));
    }
    return *array;
  }

  // Ascending, without repetitions.
  std::optional<std::vector<double>> timesteps(std::string_view key) const {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    std::set<double> sorted;
    for (const toml::node& entry : list(key, *node)) {
      if (!sorted.insert(positive(key, entry)).second) {
        fail(&entry, fmt::format("'{}' has {} twice: leave one out", key, node_text(entry)));
      }
    }
    return std::vector<double>(sorted.begin(), sorted.end());
  }

  std::optional<std::vector<Measure>> measures(std::string_view key) const {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    std::set<Measure> sorted;
    for (const toml::node& entry : list(key, *node)) {
      const std::string name = entry.value_or(std::string());
      const auto* found = std::ranges::find(kMeasures, name, &std::pair<Measure, std::string_view>::second);
      if (found == kMeasures.end()) {
        fail(&entry, fmt::format("there is no measure {}{}", node_text(entry), did_you_mean(name, measure_names())));
      }
      sorted.insert(found->first);
    }
    return std::vector<Measure>(sorted.begin(), sorted.end());
  }

  // Every [[key]] in the file.
  std::vector<Section> sections(std::string_view key) const {
    std::vector<Section> found;
    const toml::node* node = find(key);
    if (node == nullptr) return found;
    const toml::array* array = node->as_array();
    if (array == nullptr || !array->is_homogeneous(toml::node_type::table)) {
      fail(node, fmt::format("'{}' is {}: write each as a table under [[{}]]", key, node_text(*node), key));
    }
    found.reserve(array->size());
    for (const toml::node& entry : *array) found.emplace_back(*entry.as_table(), fmt::format("[[{}]]", key), source_);
    return found;
  }

  const toml::table& table() const { return table_; }
  const std::string& source() const { return source_; }

 private:
  const toml::table& table_;
  std::string what_;
  const std::string& source_;
};

// Adds where in the file it was to a message that something else made.
template <typename Work>
auto at_node(const Section& section, const toml::node* node, Work work) {
  try {
    return work();
  } catch (const InputError& error) {
    section.fail(node, error.what());
  }
}

// ---- contenders -----------------------------------------------------------------------------------------------------

// The family of an engine's contenders is the first word of its name: bullet-f64's are bullet-si-f64, bullet-mb, ...
std::string absent_reason(const std::string& contender, const Registry& registry) {
  const auto family = [](const std::string& name) { return name.substr(0, name.find('-')); };
  for (const AbsentEngine& absent : registry.absent()) {
    if (family(absent.name) == family(contender)) {
      return fmt::format("contender '{}' is left out: engine '{}' is absent: {}", contender, absent.name,
                         absent.reason);
    }
  }
  return "";
}

CampaignContender resolve(const Section& section, const toml::node* node, const std::string& name,
                          const std::string& base, const std::map<std::string, std::string>& overrides,
                          const Registry& registry) {
  CampaignContender contender;
  contender.overrides = overrides;
  const std::vector<std::string> known = registry.contender_names();
  if (std::ranges::find(known, base) == known.end()) {
    contender.absent = absent_reason(base, registry);
    if (contender.absent.empty()) {
      section.fail(node, fmt::format("there is no contender '{}'{}", base, did_you_mean(base, known)));
    }
    contender.resolved.name = name;
    contender.resolved.base = base;
    return contender;
  }
  // The base is known, so what can still be wrong is a setting.
  const toml::node* set = section.find("set");
  contender.resolved = at_node(section, set != nullptr ? set : node, [&] { return registry.resolve(base, overrides); });
  contender.resolved.name = name;
  contender.resolved.base = base;
  contender.plugin_hash = file_hash(registry.plugin_path(contender.resolved.engine->name()));
  return contender;
}

std::map<std::string, std::string> overrides_of(const Section& section) {
  std::map<std::string, std::string> overrides;
  const toml::node* node = section.find("set");
  if (node == nullptr) return overrides;
  const toml::table* table = node->as_table();
  if (table == nullptr) section.fail(node, fmt::format("'set' is {}: give {{key = value, ...}}", node_text(*node)));
  for (const auto& [key, value] : *table) {
    std::string text;
    if (const auto* boolean = value.as_boolean()) {
      text = boolean->get() ? "on" : "off";
    } else if (const auto* integer = value.as_integer()) {
      text = std::to_string(integer->get());
    } else if (const auto* number = value.as_floating_point()) {
      text = shortest(number->get());
    } else if (const auto* string = value.as_string()) {
      text = string->get();
    } else {
      section.fail(&value, fmt::format("setting '{}' is {}: give one value", std::string_view(key), node_text(value)));
    }
    overrides[std::string(key.str())] = text;
  }
  return overrides;
}

// The contenders that `pattern` (of a shell: * and ?) names, in the engines' order, without those that are taken and
// those that do not even claim to move anything, as the harness's does.
std::vector<std::string> matching(const std::string& pattern, const std::set<std::string>& taken,
                                  const Registry& registry) {
  std::vector<std::string> names;
  for (const std::string& name : registry.contender_names()) {
    if (taken.contains(name) || ::fnmatch(pattern.c_str(), name.c_str(), 0) != 0) continue;
    const ResolvedContender contender = registry.resolve(name);
    if (contender.engine->capabilities(contender.settings).order > 0) names.push_back(name);
  }
  return names;
}

// Who takes part in the campaign, each once, in the order in which the file names them.
class Roster {
 public:
  Roster(const Section& root, const Registry& registry) : registry_(registry) {
    for (const Section& section : root.sections("contender")) {
      section.allow({"name", "base", "set"});
      const std::string name = section.required_text("name");
      if (!derived_.emplace(name, section).second) {
        section.fail(section.find("name"), fmt::format("there are two contenders '{}': rename one", name));
      }
      in_order_.push_back(name);
    }
  }

  // Those that the section's list names, as indices into contenders().
  std::vector<int> listed(const Section& section, const toml::node& node) {
    std::vector<int> found;
    std::set<std::string> taken;
    for (const toml::node& entry : section.list("contenders", node)) {
      const auto name = entry.value_exact<std::string>();
      if (!name) section.fail(&entry, fmt::format("'contenders' has {}: give a contender's name", node_text(entry)));
      if (name->find_first_of("*?") != std::string::npos) {
        const std::vector<std::string> names = matching(*name, taken, registry_);
        if (names.empty()) {
          section.fail(&entry,
                       fmt::format("'{}' matches no further contender: see 'assay engines' for their names", *name));
        }
        for (const std::string& each : names) found.push_back(index(section, &entry, each));
        taken.insert(names.begin(), names.end());
        continue;
      }
      if (!taken.insert(*name).second) {
        section.fail(&entry, fmt::format("contender '{}' is there twice: leave one out, or derive one under another "
                                         "name with [[contender]]",
                                         *name));
      }
      found.push_back(index(section, &entry, *name));
    }
    return found;
  }

  // Tables under [[contender]] whose names are in none of `lists`.
  std::vector<int> unlisted(const std::vector<Section>& lists) {
    std::set<std::string> named;
    for (const Section& section : lists) {
      const toml::node* node = section.find("contenders");
      if (node == nullptr || !node->is_array()) continue;
      for (const toml::node& entry : *node->as_array()) named.insert(entry.value_or(std::string()));
    }
    std::vector<int> found;
    for (const std::string& name : in_order_) {
      if (!named.contains(name)) found.push_back(index(derived_.at(name), nullptr, name));
    }
    return found;
  }

  std::vector<CampaignContender> contenders() && { return std::move(contenders_); }

 private:
  int index(const Section& section, const toml::node* node, const std::string& name) {
    const auto [at, is_new] = index_.emplace(name, static_cast<int>(contenders_.size()));
    if (!is_new) return at->second;
    const auto found = derived_.find(name);
    if (found == derived_.end()) {
      contenders_.push_back(resolve(section, node, name, name, {}, registry_));
    } else {
      const Section& own = found->second;
      contenders_.push_back(
          resolve(own, own.find("base"), name, own.required_text("base"), overrides_of(own), registry_));
    }
    return at->second;
  }

  const Registry& registry_;
  std::map<std::string, Section> derived_;  // by name
  std::vector<std::string> in_order_;       // of the file
  std::map<std::string, int> index_;
  std::vector<CampaignContender> contenders_;
};

// ---- systems --------------------------------------------------------------------------------------------------------

ControlSpec control_of(const Section& section, const Model& model) {
  ControlSpec spec;
  spec.kind = "passive";
  const toml::node* node = section.find("control");
  if (node == nullptr) return spec;
  if (const toml::table* table = node->as_table()) {
    const Section control(*table, "control", section.source());
    control.allow({"kind", "amplitude", "frequency", "phase_step"});
    spec.kind = control.required_text("kind");
    for (const auto& [key, member] :
         {std::pair{"amplitude", &ControlSpec::amplitude}, std::pair{"frequency", &ControlSpec::frequency},
          std::pair{"phase_step", &ControlSpec::phase_step}}) {
      spec.*member = control.positive(key, spec.*member);
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
  bodies.allow({"object", "hand", "drop_m"});
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
  grasp.drop_m = bodies.positive("drop_m", grasp.drop_m);
  return grasp;
}

// What a measure needs of its system.
void check_measures(const Section& section, const CampaignSystem& system, bool passive) {
  const toml::node* where = section.find("measures");
  if (system.has(Measure::kTruth)) {
    const std::string obstacle = smooth_obstacle(system.model);
    if (!obstacle.empty() || !passive) {
      section.fail(where, fmt::format("system '{}' cannot be measured against the truth, which needs a smooth, passive "
                                      "motion: {}; leave 'truth' out of its measures",
                                      system.name, obstacle.empty() ? "its control is not passive" : obstacle));
    }
  }
  if (system.has(Measure::kDrift) && !conserved_quantities(system.model, !passive).any()) {
    section.fail(where, fmt::format("system '{}' conserves neither energy nor momentum: leave 'drift' out of its "
                                    "measures",
                                    system.name));
  }
  if (system.has(Measure::kViolation) && system.model.hinges.empty() && system.model.contacts.empty()) {
    section.fail(where, fmt::format("system '{}' has neither joints nor contacts to violate: leave 'violation' out of "
                                    "its measures",
                                    system.name));
  }
  if (system.has(Measure::kGrasp) && system.grasp.object < 0) {
    section.fail(where, fmt::format("system '{}' does not say who is to stay in whose hand: give grasp = {{object = "
                                    "\"...\", hand = \"...\"}}, names of bodies",
                                    system.name));
  }
  if (system.has(Measure::kScaling) && system.family.empty()) {
    section.fail(where, fmt::format("system '{}' does not say which systems it is compared with in size: give each of "
                                    "them the same family = \"...\"",
                                    system.name));
  }
}

struct Defaults {
  std::optional<std::vector<double>> timesteps_ms;
  std::optional<std::vector<Measure>> measures;
  double reference_ms = 1.0 / 64;
  std::vector<int> contenders;
};

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
  const bool pieces = system.has(Measure::kConsistency);
  if (pieces && (!whole(system.piece_ms, system.sample_ms) || system.piece_ms > system.duration_s * 1000 * 1.000001)) {
    section.fail(
        section.find("piece_ms"),
        fmt::format("piece_ms = {} is not a whole number of samples of {} ms within the duration of {} s: give "
                    "a multiple of {}",
                    shortest(system.piece_ms), timestep_label(system.sample_ms), shortest(system.duration_s),
                    timestep_label(system.sample_ms)));
  }
  if (system.timesteps_ms.front() < system.reference_ms * (1 - 1e-9)) {
    section.fail(section.find("reference_ms"),
                 fmt::format("the timestep {} ms is smaller than the reference's, {} ms: the reference has to be the "
                             "finest",
                             timestep_label(system.timesteps_ms.front()), timestep_label(system.reference_ms)));
  }
}

CampaignSystem system_of(const Section& section, const Defaults& defaults, Roster& roster) {
  section.allow({"name", "model", "duration_s", "sample_ms", "pieces", "piece_ms", "control", "contacts", "gravity",
                 "measures", "timesteps_ms", "timing_ms", "reference_ms", "grasp", "family", "contenders",
                 "violation_ms"});
  CampaignSystem system;
  system.name = section.required_text("name");
  const toml::node* model_node = section.find("model") != nullptr ? section.find("model") : section.find("name");
  std::string model = section.text("model").value_or(system.name);
  // A path counts from the campaign's folder, so that a campaign can be moved with its models.
  if (const fs::path beside = fs::path(section.source()).parent_path() / model;
      model.find('/') != std::string::npos && fs::path(model).is_relative() && fs::exists(beside)) {
    model = beside.string();
  }
  at_node(section, model_node, [&] {
    system.model_path = fs::absolute(find_model(model)).string();
    system.model = load_model(system.model_path);
  });
  system.contacts = section.flag("contacts", true);
  system.gravity = section.flag("gravity", true);
  if (!system.contacts) system.model = without_contacts(std::move(system.model));
  if (!system.gravity) system.model = without_gravity(std::move(system.model));

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
  system.sample_ms = section.positive("sample_ms", system.timesteps_ms.back());
  if (section.find("duration_s") == nullptr) {
    section.fail(nullptr,
                 fmt::format("system '{}' has no 'duration_s': give the run's length in seconds", system.name));
  }
  system.duration_s = section.positive("duration_s", 0);
  system.pieces = section.count("pieces", system.pieces, 1, 1000);
  system.piece_ms = section.positive("piece_ms", system.piece_ms);
  check_grid(section, system);
  if (system.has(Measure::kConsistency) && !whole(system.timesteps_ms.front(), system.reference_ms)) {
    section.fail(section.find("reference_ms"), "the smallest timestep is not a whole number of the reference's");
  }
  // The restart floor is the error at the reference's own timestep.
  if (system.has(Measure::kConsistency) && system.timesteps_ms.front() > system.reference_ms * (1 + 1e-9)) {
    system.timesteps_ms.insert(system.timesteps_ms.begin(), system.reference_ms);
  }
  system.timing_ms = section.timesteps("timing_ms").value_or(system.timesteps_ms);
  system.violation_ms = section.timesteps("violation_ms").value_or(system.timesteps_ms);
  for (const double timestep : system.violation_ms) {
    if (std::ranges::any_of(system.timesteps_ms, [&](double each) { return same_timestep(each, timestep); })) continue;
    section.fail(section.find("violation_ms"), fmt::format("'violation_ms' has {} ms, which is none of the system's "
                                                           "timesteps: {} ms",
                                                           timestep_label(timestep), joined_ms(system.timesteps_ms)));
  }
  system.control = control_of(section, system.model);

  const bool passive = make_control(system.model, system.control)->is_zero();
  system.grasp = grasp_of(section, system.model);
  system.family = section.text("family").value_or("");
  const toml::node* contenders = section.find("contenders");
  system.contenders = contenders != nullptr ? roster.listed(section, *contenders) : defaults.contenders;
  std::ranges::sort(system.contenders);  // the campaign's order
  if (system.contenders.empty()) {
    section.fail(nullptr,
                 fmt::format("system '{}' has no contenders: give contenders = [\"...\"], here or for the whole "
                             "campaign",
                             system.name));
  }
  check_measures(section, system, passive);
  return system;
}

nlohmann::json content_of(const CampaignSystem& system) {
  std::vector<std::string> measures;
  measures.reserve(system.measures.size());
  for (const Measure measure : system.measures) measures.emplace_back(measure_text(measure));
  nlohmann::json content = {{"name", system.name},
                            {"model", system.model.hash},
                            {"duration_s", system.duration_s},
                            {"sample_ms", system.sample_ms},
                            {"pieces", system.pieces},
                            {"piece_ms", system.piece_ms},
                            {"control", make_control(system.model, system.control)->description()},
                            {"measures", measures},
                            {"timesteps_ms", system.timesteps_ms},
                            {"timing_ms", system.timing_ms},
                            {"reference_ms", system.reference_ms}};
  if (system.grasp.object >= 0) content["grasp"] = {system.grasp.object, system.grasp.hand, system.grasp.drop_m};
  if (!system.family.empty()) content["family"] = system.family;
  if (system.violation_ms.size() < system.timesteps_ms.size()) content["violation_ms"] = system.violation_ms;
  return content;
}

std::map<std::string, std::string> ratios_of(const Section& root, const std::vector<CampaignContender>& contenders) {
  std::vector<std::string> known;
  known.reserve(contenders.size());
  for (const CampaignContender& each : contenders) known.push_back(each.resolved.name);
  std::map<std::string, std::string> ratios;
  for (const Section& section : root.sections("ratio")) {
    section.allow({"of", "to"});
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

bool CampaignSystem::has(Measure measure) const { return std::ranges::find(measures, measure) != measures.end(); }

std::string_view measure_text(Measure measure) {
  return std::ranges::find(kMeasures, measure, &std::pair<Measure, std::string_view>::first)->second;
}

std::string CampaignContender::content() const {
  if (resolved.engine == nullptr) return "absent";
  nlohmann::json settings = nlohmann::json::object();
  for (const auto& [key, value] : resolved.settings.values) settings[key] = setting_text(value);
  return nlohmann::json{{"engine", resolved.engine->name()},
                        {"version", resolved.engine->build().version},
                        {"plugin", plugin_hash},
                        {"settings", settings}}
      .dump();
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
  content["timing"] = {timing.rounds, timing.batch_ms, timing.states, timing.warmup, timing.processes};
  content["time_limit_s"] = time_limit_s;
  content["seed"] = seed;
  return content_hash(content.dump());
}

Campaign parse_campaign(const std::string& toml_text, const std::string& source, const Registry& registry) {
  toml::table table;
  try {
    table = toml::parse(toml_text, source);
  } catch (const toml::parse_error& error) {
    throw InputError(
        fmt::format("{}:{}: this is not TOML: {}", source, error.source().begin.line, error.description()));
  }
  const Section root(table, "a campaign", source);
  root.allow({"name", "title", "contenders", "timesteps_ms", "reference_ms", "measures", "time_limit_s", "seed",
              "timing", "system", "contender", "ratio"});
  Campaign campaign;
  campaign.source = source;
  campaign.name = root.required_text("name");
  campaign.title = root.text("title").value_or(campaign.name);
  campaign.time_limit_s = root.positive("time_limit_s", campaign.time_limit_s);
  campaign.seed = root.count("seed", 1, 0, 1'000'000'000);
  if (const toml::node* node = root.find("timing")) {
    if (!node->is_table())
      root.fail(node, fmt::format("'timing' is {}: write it as a table [timing]", node_text(*node)));
    const Section timing(*node->as_table(), "[timing]", source);
    timing.allow({"rounds", "batch_ms", "states", "warmup", "processes"});
    campaign.timing.rounds = timing.count("rounds", campaign.timing.rounds, 1, 100000);
    campaign.timing.batch_ms = timing.positive("batch_ms", campaign.timing.batch_ms);
    campaign.timing.states = timing.count("states", campaign.timing.states, 1, 1000);
    campaign.timing.warmup = timing.count("warmup", campaign.timing.warmup, 0, 100000);
    campaign.timing.processes = timing.count("processes", campaign.timing.processes, 1, 100);
  }
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
  for (const Section& section : systems) {
    campaign.systems.push_back(system_of(section, defaults, roster));
    const std::string& name = campaign.systems.back().name;
    if (std::ranges::count(campaign.systems, name, &CampaignSystem::name) > 1) {
      section.fail(section.find("name"),
                   fmt::format("there are two systems '{}': rename one and give its model", name));
    }
  }
  campaign.contenders = std::move(roster).contenders();
  campaign.ratios = ratios_of(root, campaign.contenders);
  return campaign;
}

Campaign load_campaign(const std::string& path, const Registry& registry) {
  std::ifstream file(path);
  std::ostringstream text;
  if (!(file && text << file.rdbuf())) {
    throw InputError(fmt::format("campaign '{}' cannot be read: check the path", path));
  }
  return parse_campaign(text.str(), path, registry);
}

}  // namespace assay
