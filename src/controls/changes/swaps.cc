#include "controls/changes/swaps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "controls/changes/joint_number.h"
#include "controls/hold.h"
#include "controls/policy_config.h"
#include "model/joint.h"

namespace assay {
namespace {

constexpr const char* kFriction = "friction model";
constexpr const char* kDampingLaw = "damping law";
constexpr const char* kSoftness = "contact softness";
constexpr const char* kIterations = "solver iterations";
constexpr const char* kPrecision = "precision";

// What settings that decide a convention are called in engines; others are causes of their own.
struct Convention {
  const char* setting;
  const char* cause;
};
constexpr std::array<Convention, 12> kConventions = {{{"cone", kFriction},
                                                      {"friction", kFriction},
                                                      {"friction_model", kFriction},
                                                      {"friction_directions", kFriction},
                                                      {"friction_direction", kFriction},
                                                      {"friction_every_iteration", kFriction},
                                                      {"pd", kDampingLaw},
                                                      {"euler_damping", kDampingLaw},
                                                      {"precision", kPrecision},
                                                      {"integrator", "integrator"},
                                                      {"gyroscopic", "gyroscopic torque"},
                                                      {"solver", "solver"}}};

// `contacts`: the robot has some; what makes them soft may act on joints, too.
std::string cause_of_setting(const Setting& setting, bool contacts) {
  if (setting.role == SettingRole::kIterations) return kIterations;
  if (setting.role == SettingRole::kContactSoftness && contacts) return kSoftness;
  const auto* found =
      std::ranges::find_if(kConventions, [&](const Convention& each) { return setting.name == each.setting; });
  return found == kConventions.end() ? "setting " + setting.name : found->cause;
}

bool is_of_contacts(const std::string& setting) {
  return std::ranges::any_of(std::array{"contact", "friction", "cone", "broadphase", "split_impulse", "collision"},
                             [&](const char* part) { return setting.find(part) != std::string::npos; });
}

RunChange setting_change(const std::string& name, const SettingValue& value) {
  return {ChangeKind::kSet, name, setting_text(value)};
}

// The values of a setting other than its own that are worth a run: all of a choice, the neighbours of a number whose
// role engines share.
std::vector<SettingValue> others_of(const Setting& setting, const SettingValue& own) {
  std::vector<SettingValue> others;
  for (const std::string& choice : setting.choices) {
    if (own != SettingValue(choice)) others.emplace_back(choice);
  }
  if (const bool* on = std::get_if<bool>(&own)) others.emplace_back(!*on);
  const auto put = [&](double number) {
    if ((setting.minimum && number < *setting.minimum) || (setting.maximum && number > *setting.maximum)) return;
    if (std::holds_alternative<double>(own)) {
      others.emplace_back(number);
    } else {
      others.emplace_back(std::llround(number));
    }
  };
  const double* number = std::get_if<double>(&own);
  const long long* count = std::get_if<long long>(&own);
  if (setting.role == SettingRole::kContactSoftness && number != nullptr) {
    put(*number / 2);
    put(*number * 2);
  }
  if (setting.role == SettingRole::kIterations && count != nullptr) put(4 * static_cast<double>(*count));
  return others;
}

class Collector {
 public:
  explicit Collector(const Pairing& pairing)
      : pairing_(pairing),
        model_(*pairing.model),
        recipe_a_(recipe_of(pairing.a)),
        recipe_b_(recipe_of(pairing.b)),
        same_engine_(recipe_a_.contender.engine == recipe_b_.contender.engine) {}

  Swaps take(const std::vector<SeenParameter>& seen) {
    parity(seen);
    features();
    contacts();
    controlled();
    numerics();
    if (same_engine_) differing_settings();
    settings(false);
    // in two of one engine, what one has and the other has not is found from either
    if (!same_engine_) settings(true);
    dampers();
    compliance();
    precision();
    return std::move(found_);
  }

 private:
  static const char* name(bool b) { return b ? "B" : "A"; }

  void add(bool in_b, const std::string& cause, const std::string& words, const std::string& advice,
           std::vector<RunChange> changes, bool many = false) {
    Swap swap{.cause = cause, .words = words, .advice = advice, .a = {}, .b = {}, .many = many};
    (in_b ? swap.b : swap.a) = std::move(changes);
    found_.swaps.push_back(std::move(swap));
  }
  void add_both(const std::string& cause, const std::string& words, const std::string& advice,
                const RunChange& change) {
    found_.swaps.push_back({.cause = cause, .words = words, .advice = advice, .a = {change}, .b = {change}});
  }

  // What one side of the pair does with a number of the robot, put into the other side's robot.
  void parity(const std::vector<SeenParameter>& seen) {
    constexpr std::array<std::pair<const char*, ChangeKind>, 7> kKnown = {{{"armature", ChangeKind::kArmature},
                                                                           {"damping", ChangeKind::kDamping},
                                                                           {"stiffness", ChangeKind::kStiffness},
                                                                           {"dry friction", ChangeKind::kDryFriction},
                                                                           {"mass", ChangeKind::kMass},
                                                                           {"inertia", ChangeKind::kInertia},
                                                                           {"torque", ChangeKind::kGear}}};
    for (const bool in_b : {false, true}) {
      for (const auto& [parameter, kind] : kKnown) {
        std::vector<RunChange> changes;
        std::vector<std::string> elements, alike;
        for (const SeenParameter& each : seen) {
          const bool both =
              each.parameter == "mass and inertia" && (kind == ChangeKind::kMass || kind == ChangeKind::kInertia);
          if (each.in_b != in_b || (each.parameter != parameter && !both)) continue;
          changes.push_back(change_of(kind, each));
          elements.push_back(each.element);
          alike.insert(alike.end(), each.alike.begin(), each.alike.end());
          if (both && kind == ChangeKind::kMass) changes.push_back(change_of(ChangeKind::kInertia, each));
        }
        if (changes.empty()) continue;
        const std::string where = join(elements, ", ");
        const std::string or_else = alike.empty() ? "" : fmt::format(" ({} would act the same)", join(alike, ", or "));
        add(!in_b, parameter, fmt::format("{} with {}'s {} of {}", name(!in_b), name(in_b), parameter, where),
            fmt::format("mend the {} of {} in {}: it is not the model's{}", parameter, where, name(in_b), or_else),
            changes);
      }
    }
  }
  RunChange change_of(ChangeKind kind, const SeenParameter& seen) const {
    double before = 1;
    each_joint(model_, [&](const auto& joint) {
      const double* number = joint_number(kind, joint);
      if (number != nullptr && joint.name == seen.element) before = *number;
    });
    const std::string value =
        before == 0 ? fmt::format("+{}", shortest(seen.change)) : shortest(std::max(0.0, 1 + seen.change));
    return {kind, seen.element, before != 0 && 1 + seen.change < 1e-3 ? "off" : value};
  }

  // Off in either, or times a number in A, which is that part of it in B.
  void feature(ChangeKind kind, const std::string& what, const std::vector<const char*>& factors) {
    for (const bool b : {false, true}) {
      add(b, what, fmt::format("{} without {}", name(b), what),
          fmt::format("{} acts as if it had no {}: give it what the model has, or take it out of {}", name(!b), what,
                      name(b)),
          {{kind, "", "off"}});
    }
    for (const char* factor : factors) {
      add(false, what, fmt::format("A with {} times its {}", factor, what),
          fmt::format("{} is not the same number in both: compare where each takes it from", what),
          {{kind, "", factor}});
    }
    add_both(what, fmt::format("both without {}", what), "", {kind, "", "off"});
  }

  void features() {
    if (any_joint(model_, [](const auto& j) { return j.armature != 0; }))
      feature(ChangeKind::kArmature, "armature", {});
    const bool damped = any_joint(model_, [](const auto& j) { return j.damping != 0; });
    const bool sprung = any_joint(model_, [](const auto& j) { return j.stiffness != 0; });
    if (damped) feature(ChangeKind::kDamping, "damping", {"0.5", "2"});
    if (sprung) feature(ChangeKind::kStiffness, "stiffness", {"0.5", "2"});
    if (any_joint(model_, [](const auto& j) { return j.dry_friction != 0; })) {
      feature(ChangeKind::kDryFriction, "dry friction", {"0.5", "2"});
    }
    if (any_joint(model_, [](const auto& j) { return j.limited; })) feature(ChangeKind::kLimits, "limits", {});
  }

  // Where no setting does it.
  void dampers() {
    if (!model_.has_springs()) return;
    for (const bool b : {false, true}) {
      add(b, kDampingLaw, fmt::format("{} with explicit springs and dampers", name(b)),
          fmt::format("make the joints' springs and dampers torques of the step's start in {}", name(b)),
          {{ChangeKind::kDampers, "", "explicit"}});
    }
    add_both(kDampingLaw, "both with explicit springs and dampers",
             "make the joints' springs and dampers torques of the step's start in both",
             {ChangeKind::kDampers, "", "explicit"});
  }

  void contacts() {
    if (model_.contacts.empty()) return;
    feature(ChangeKind::kContacts, "contacts", {});
    const auto moves = [&](int shape) { return model_.shapes[static_cast<size_t>(shape)].body != kWorld; };
    const auto is_own = [&](const ContactPair& pair) { return moves(pair.shape_a) && moves(pair.shape_b); };
    if (std::ranges::any_of(model_.contacts, is_own))
      feature(ChangeKind::kSelfContacts, "contacts between its bodies", {});
    feature(ChangeKind::kFriction, "contact friction", {"0.5", "2"});
  }

  // Joints that the control drives.
  std::vector<size_t> driven() const {
    std::vector<size_t> joints;
    if (const PolicyConfig* policy = pairing_.control->policy()) {
      for (const int joint : policy->joints) joints.push_back(static_cast<size_t>(joint));
      return joints;
    }
    const std::string& kind = pairing_.spec.kind;
    const bool limited = kind == "actuators" || kind == "hold" || kind == "random";
    const std::vector<double> limits = effort_limits(model_);
    for (size_t j = 0; j < limits.size(); ++j) {
      if (!limited || limits[j] > 0) joints.push_back(j);
    }
    return joints;
  }

  bool clamped() const {
    if (const PolicyConfig* policy = pairing_.control->policy()) {
      return std::ranges::any_of(policy->effort_limit, [](double limit) { return std::isfinite(limit); });
    }
    if (pairing_.spec.kind == "hold") {
      return std::ranges::any_of(effort_limits(model_), [](double limit) { return std::isfinite(limit); });
    }
    return pairing_.spec.kind == "actuators" && std::ranges::any_of(model_.actuators, [](const Actuator& a) {
             return a.control_limited || a.force_limited;
           });
  }

  void controlled() {
    if (pairing_.control->is_zero()) return;
    const PolicyConfig* policy = pairing_.control->policy();
    for (const bool b : {false, true}) {
      const int own = (policy != nullptr ? policy->delay : 0) + delay_of((b ? pairing_.b : pairing_.a).changes);
      add(b, "control delay", fmt::format("{} with torques one control step later", name(b)),
          fmt::format("{} acts one control step later: raise the delay of {}, or lower that of {}", name(!b), name(b),
                      name(!b)),
          {{ChangeKind::kDelay, "", "1"}});
      if (own > 0) {
        add(b, "control delay", fmt::format("{} with torques one control step earlier", name(b)),
            fmt::format("{} acts one control step earlier: lower the delay of {}", name(!b), name(b)),
            {{ChangeKind::kDelay, "", "-1"}});
      }
      if (clamped()) {
        add(b, "torque clamp", fmt::format("{} without torque limits", name(b)),
            fmt::format("{} acts as if it had no torque limits: give it those of the model", name(!b)),
            {{ChangeKind::kClamp, "", "off"}});
      }
    }
    if (policy != nullptr && policy->type != ActionType::kEffort) {
      const char* other = policy->engine_drives ? "explicit" : "engine";
      for (const bool b : {false, true}) {
        add(b, "drive law", fmt::format("{} with law = \"{}\"", name(b), other),
            fmt::format("set law = \"{}\" for {}, or the other one's law for both", other, name(b)),
            {{ChangeKind::kLaw, "", other}});
      }
      add_both("drive law", fmt::format("both with law = \"{}\"", other),
               fmt::format("set law = \"{}\" in [pd]", other), {ChangeKind::kLaw, "", other});
    }
    signs_and_order();
  }

  void signs_and_order() {
    constexpr size_t kFew = 6, kMost = 32;  // joints
    const std::vector<size_t> joints = driven();
    for (size_t i = 0; i < joints.size() && i < kMost; ++i) {
      const std::string& joint = model_.joints[joints[i]].name;
      add(true, "gear", fmt::format("B with the torque of '{}' reversed", joint),
          fmt::format("the torque of '{}' has another sign in one of them: mend its gear", joint),
          {{ChangeKind::kGear, joint, "-1"}}, true);
    }
    const auto exchange = [&](size_t a, size_t b) {
      const std::string &first = model_.joints[a].name, &second = model_.joints[b].name;
      if (first.find(',') != std::string::npos || second.find(',') != std::string::npos) return;
      add(true, "joint order", fmt::format("B with the torques of '{}' and '{}' exchanged", first, second),
          fmt::format("'{}' and '{}' are in another order in one of them: mend the list of joints", first, second),
          {{ChangeKind::kOrder, "", fmt::format("{},{}", first, second)}}, true);
    };
    if (model_.joints.size() <= kFew) {
      // one that is not driven may get the torque of another
      for (size_t a = 0; a < model_.joints.size(); ++a) {
        for (size_t b = a + 1; b < model_.joints.size(); ++b) exchange(a, b);
      }
    } else {
      for (size_t i = 0; i + 1 < joints.size() && i < kMost; ++i) exchange(joints[i], joints[i + 1]);
    }
    if (model_.joints.size() < 3) return;
    add(true, "joint order", "B with all torques in the reverse order of joints",
        "the joints are in the reverse order in one of them: mend the list of joints",
        {{ChangeKind::kOrder, "", "reversed"}});
  }

  void numerics() {
    for (const bool b : {false, true}) {
      const double ms = pairing_.timestep_ms * (b ? recipe_b_ : recipe_a_).timestep_factor / 2;
      add(b, kTimestepCause, fmt::format("{} at half the timestep", name(b)),
          fmt::format("use a timestep of {} ms in {}", timestep_label(ms), name(b)),
          {{ChangeKind::kTimestep, "", "0.5"}});
    }
    add_both(kTimestepCause, "both at half the timestep", "use half the timestep", {ChangeKind::kTimestep, "", "0.5"});
  }

  bool is_tried(const Setting& setting, const Settings& all) const {
    return missing_condition(setting, all).empty() && (!is_of_contacts(setting.name) || !model_.contacts.empty());
  }

  // In two of one engine, each setting that they have not in common.
  void differing_settings() {
    const Settings &a = recipe_a_.contender.settings, &b = recipe_b_.contender.settings;
    for (const Setting& setting : recipe_a_.contender.engine->settings()) {
      const SettingValue &of_a = a.values.at(setting.name), &of_b = b.values.at(setting.name);
      if (of_a == of_b) continue;
      const std::string cause = cause_of_setting(setting, !model_.contacts.empty());
      for (const bool in_b : {true, false}) {
        const SettingValue& other = in_b ? of_a : of_b;
        const std::string text = fmt::format("{}={}", setting.name, setting_text(other));
        add(in_b, cause, fmt::format("{} with {}, as {}", name(in_b), text, name(!in_b)),
            fmt::format("set {} in {}, as in {}", text, name(in_b), name(!in_b)),
            {setting_change(setting.name, other)});
      }
    }
  }

  void settings(bool in_b) {
    const ResolvedContender& contender = (in_b ? recipe_b_ : recipe_a_).contender;
    bool friction = false, softness = false;
    for (const Setting& setting : contender.engine->settings()) {
      const std::string cause = cause_of_setting(setting, !model_.contacts.empty());
      friction = friction || cause == kFriction;
      softness = softness || cause == kSoftness;
      if (!is_tried(setting, contender.settings)) continue;
      for (const SettingValue& value : others_of(setting, contender.settings.values.at(setting.name))) {
        const std::string text = fmt::format("{}={}", setting.name, setting_text(value));
        add(in_b, cause, fmt::format("{} with {}", name(in_b), text), fmt::format("set {} in {}", text, name(in_b)),
            {setting_change(setting.name, value)});
      }
    }
    if (model_.contacts.empty()) return;
    if (!friction) no(kFriction, fmt::format("{} has no setting for it", contender.name));
    if (!softness) no(kSoftness, fmt::format("{} has no setting for it", contender.name));
  }

  // Contacts as springs of the same stiffness and damping.
  void compliance() {
    if (model_.contacts.empty()) return;
    constexpr double kPoints = 4, kDepth = 1e-3;  // m, of a robot at rest on so many points
    const double mass = std::max(model_.total_mass(), 1e-6);
    const auto rounded = [](double number) { return parse_number(fmt::format("{:.2g}", number)).value_or(number); };
    const double stiffness = rounded(mass * 9.81 / (kPoints * kDepth));
    const double damping = rounded(2 * std::sqrt(stiffness * mass / kPoints));
    std::array<std::vector<RunChange>, 2> changes;
    for (const bool b : {false, true}) {
      const ResolvedContender& contender = (b ? recipe_b_ : recipe_a_).contender;
      const std::vector<Setting> declared = contender.engine->settings();
      for (const auto& [role, value] :
           {std::pair(SettingRole::kContactStiffness, stiffness), std::pair(SettingRole::kContactDamping, damping)}) {
        const Setting* setting = setting_with_role(declared, role);
        if (setting == nullptr || !missing_condition(*setting, contender.settings).empty()) {
          no(kSoftness,
             fmt::format("{} has no contacts of a given stiffness, with which to match the other's", contender.name));
          return;
        }
        changes.at(b ? 1 : 0).push_back(setting_change(setting->name, value));
      }
    }
    found_.swaps.push_back(
        {.cause = kSoftness,
         .words = fmt::format("both with contacts of {} N/m and {} N s/m", shortest(stiffness), shortest(damping)),
         .advice =
             fmt::format("set contact_stiffness={} contact_damping={} in both", shortest(stiffness), shortest(damping)),
         .a = changes[0],
         .b = changes[1]});
  }

  void precision() {
    for (const bool b : {false, true}) {
      const Recipe& recipe = b ? recipe_b_ : recipe_a_;
      const bool is_setting = recipe.contender.settings.values.contains("precision");
      if (is_setting) continue;
      const std::string sibling = other_precision(recipe.contender.base);
      const Side side = b ? pairing_.b : pairing_.a;
      const RunChange change{ChangeKind::kContender, "", sibling};
      try {
        if (sibling.empty()) throw InputError("");
        static_cast<void>(recipe_of(side.with({change})));
      } catch (const InputError&) {
        no(kPrecision, fmt::format("{} has no sibling in the other precision", recipe.contender.name));
        continue;
      }
      add(b, kPrecision, fmt::format("{} as {}", name(b), sibling), fmt::format("take {} for {}", sibling, name(b)),
          {change});
    }
  }

  static std::string other_precision(const std::string& contender) {
    for (const auto& [from, to] : {std::pair<std::string, std::string>("f32", "f64"), {"f64", "f32"}}) {
      const size_t at = contender.find(from);
      if (at == std::string::npos) continue;
      std::string other = contender;
      other.replace(at, from.size(), to);
      if (Registry::instance().has(other)) return other;
    }
    return "";
  }

  void no(const std::string& cause, const std::string& why) {
    const bool known = std::ranges::any_of(found_.not_possible,
                                           [&](const NoSwap& each) { return each.cause == cause && each.why == why; });
    if (!known) found_.not_possible.push_back({cause, why});
  }

  const Pairing& pairing_;
  const Model& model_;
  Recipe recipe_a_, recipe_b_;
  bool same_engine_;
  Swaps found_;
};

}  // namespace

Side Side::with(const std::vector<RunChange>& more) const {
  Side side = *this;
  side.changes.insert(side.changes.end(), more.begin(), more.end());
  return side;
}

Recipe recipe_of(const Side& side) {
  Recipe recipe;
  std::string base = side.contender;
  recipe.overrides = side.overrides;
  for (const RunChange& change : side.changes) {
    if (change.kind == ChangeKind::kContender) base = change.value;
    if (change.kind == ChangeKind::kSet) recipe.overrides[change.element] = change.value;
    if (change.kind == ChangeKind::kTimestep) recipe.timestep_factor *= parse_number(change.value).value_or(1);
    if (!is_of_contender(change)) recipe.changes.push_back(change);
  }
  recipe.contender = Registry::instance().resolve(base, recipe.overrides);
  return recipe;
}

Swaps swaps_for(const Pairing& pairing, const std::vector<SeenParameter>& seen) {
  return Collector(pairing).take(seen);
}

}  // namespace assay
