// Verdicts of engines on a model's elements.
#include "check/verdicts.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <initializer_list>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <sys/mman.h>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "base/console.h"
#include "base/text.h"
#include "check/feedback.h"
#include "check/findings_text.h"
#include "engines/engine_files.h"
#include "isolate/activity.h"
#include "isolate/contained.h"
#include "isolate/processes.h"
#include "model/features.h"
#include "model/pair_groups.h"

namespace assay {
namespace {

bool alike(const std::vector<Limitation>& a, const std::vector<Limitation>& b) {
  return std::ranges::equal(a, b, [](const Limitation& x, const Limitation& y) {
    return x.fidelity == y.fidelity && x.element == y.element && x.how == y.how;
  });
}

// Everything that engines treat in one way, and the contenders that do so.
struct Statement {
  Fidelity fidelity = Fidelity::kExact;
  std::string what, how;
  std::vector<std::pair<std::string, std::vector<std::string>>> contenders;  // by engine
};

// "joint 'knee' armature" as what stands before the name, the name, and what stands after it.
struct ElementName {
  std::string before, name, after;

  explicit ElementName(const std::string& text) {
    const size_t opens = text.find(" '");
    size_t closes = opens == std::string::npos ? opens : text.find('\'', opens + 2);
    // a pair has two names: "a' and 'b"
    constexpr std::string_view kAnd = "' and '";
    if (closes != std::string::npos && text.compare(closes, kAnd.size(), kAnd) == 0) {
      closes = text.find('\'', closes + kAnd.size());
    }
    if (closes == std::string::npos) {
      before = text;
      return;
    }
    before = text.substr(0, opens);
    name = text.substr(opens + 2, closes - opens - 2);
    after = text.substr(closes + 1);
    after.erase(0, after.find_first_not_of(' '));
  }
};

// "armature of all 22 joints", "limit of 2 joints ('knee', 'hip')".
std::string elements_text(const ElementName& first, const std::vector<std::string>& names, const Model& model) {
  constexpr size_t kMostNames = 3;
  const size_t noun_begins = first.before.rfind(' ') + 1;  // 0 where there is one word
  const std::string noun = first.before.substr(noun_begins);
  const bool pair = first.before == "contact of";
  const bool sort_of_shape = first.after.starts_with('(');  // "geom 'foot' (box)"
  std::string text = first.after.empty() || sort_of_shape ? "" : first.after + " of ";
  if (!pair) text += first.before.substr(0, noun_begins);
  const bool all = noun == "joint" && names.size() == model.joints.size();
  std::string nouns = noun == "body" ? "bodies" : noun + "s";
  if (pair) nouns = "contact pairs";
  text += fmt::format("{}{} {}", all ? "all " : "", names.size(), nouns);
  if (sort_of_shape) text += " " + first.after;
  if (all) return text;
  std::vector<std::string> shown;
  for (size_t i = 0; i < std::min(names.size(), kMostNames); ++i) shown.push_back(fmt::format("'{}'", names[i]));
  if (names.size() > kMostNames) shown.push_back(fmt::format("{} more", names.size() - kMostNames));
  return text + fmt::format(" ({})", join(shown, ", "));
}

// Limitations of one verdict that differ in the element's name only.
struct LimitationGroup {
  Limitation first;
  ElementName parts;
  std::vector<const Limitation*> all;  // in their order
};

// In the order of their first ones; `group_of` has the number of each limitation's.
std::vector<LimitationGroup> groups_of(const std::vector<Limitation>& limitations, std::vector<size_t>& group_of) {
  std::vector<LimitationGroup> groups;
  std::unordered_map<std::string, size_t> numbers;
  for (const Limitation& limitation : limitations) {
    ElementName parts(limitation.element);
    std::string key =
        fmt::format("{}\n{}\n{}\n{}", static_cast<int>(limitation.fidelity), limitation.how, parts.before, parts.after);
    const auto [found, fresh] = numbers.try_emplace(std::move(key), groups.size());
    if (fresh) groups.push_back({limitation, std::move(parts), {}});
    groups[found->second].all.push_back(&limitation);
    group_of.push_back(found->second);
  }
  return groups;
}

// "joint 'knee' armature" of a group of one, "armature of 3 joints ('a', 'b', 'c')".
std::string group_text(const LimitationGroup& group, const Model& model) {
  const bool names_many = group.parts.before == "contacts of";
  if (group.all.size() == 1 || group.parts.name.empty() || names_many) return group.first.element;
  std::vector<std::string> names;
  names.reserve(group.all.size());
  for (const Limitation* limitation : group.all) names.push_back(ElementName(limitation->element).name);
  return elements_text(group.parts, names, model);
}

// Contenders that state the same share a statement.
std::vector<Statement> statements_of(const std::vector<EngineVerdict>& verdicts, const Model& model) {
  std::vector<Statement> statements;
  for (const EngineVerdict& verdict : verdicts) {
    std::vector<size_t> group_of;
    for (const LimitationGroup& group : groups_of(verdict.limitations, group_of)) {
      const Limitation& first = group.first;
      const std::string what = group_text(group, model);
      auto same = std::ranges::find_if(statements, [&](const Statement& statement) {
        return statement.fidelity == first.fidelity && statement.what == what && statement.how == first.how;
      });
      if (same == statements.end()) {
        same = statements.insert(same, {first.fidelity, what, first.how, {}});
      }
      auto& contenders = same->contenders;
      if (contenders.empty() || contenders.back().first != verdict.engine) contenders.push_back({verdict.engine, {}});
      auto& own = contenders.back().second;
      own.insert(own.end(), verdict.contenders.begin(), verdict.contenders.end());
    }
  }
  return statements;
}

// Some contenders of an engine, in as few words as name them: "all 12", "all but mujoco-rk4", their names.
std::string contenders_text(const std::vector<std::string>& contenders, const std::vector<std::string>& of_engine) {
  constexpr size_t kMostExceptions = 2;
  std::vector<std::string> others = of_engine;
  std::erase_if(others,
                [&](const std::string& name) { return std::ranges::find(contenders, name) != contenders.end(); });
  if (of_engine.size() == 1 || contenders.size() <= others.size() || others.size() > kMostExceptions) {
    return join(contenders, ", ");
  }
  return others.empty() ? fmt::format("all {}", of_engine.size()) : "all but " + join(others, ", ");
}

// ---- elements -------------------------------------------------------------------------------------------------------

constexpr const char *kHinges = "hinges", *kFree = "free bodies", *kLimits = "joint limits",
                     *kSprings = "springs and dampers", *kArmature = "armature", *kDryFriction = "dry friction",
                     *kContacts = "contact pairs", *kPlanes = "planes", *kActuators = "actuators";

// "joint 'knee'" of "joint 'knee' armature", "geom 'foot'" of "geom 'foot' (box)".
std::string label_of(const std::string& element) {
  const ElementName parts(element);
  const std::string noun = parts.before.substr(parts.before.rfind(' ') + 1);
  return fmt::format("{} '{}'", noun, parts.name);
}

bool has_word(const std::string& text, std::initializer_list<const char*> words) {
  return std::ranges::any_of(words, [&](const char* word) { return text.find(word) != std::string::npos; });
}

// "range" of a joint: which of its sorts a word of an adapter is about; empty for the joint itself.
std::string sort_of(const std::string& respect) {
  if (has_word(respect, {"range", "limit"})) return kLimits;
  if (has_word(respect, {"stiffness", "damping", "spring"})) return kSprings;
  if (has_word(respect, {"armature"})) return kArmature;
  if (has_word(respect, {"dry friction"})) return kDryFriction;
  return "";
}

// Elements by label, to find those that a limitation of an adapter is about.
class Index {
 public:
  explicit Index(const std::vector<ModelElement>& elements) : elements_(elements) {
    for (size_t e = 0; e < elements.size(); ++e) by_label_[elements[e].label].push_back(e);
  }

  // None for a limitation of the contender as a whole.
  std::vector<size_t> meant_by(const std::string& element) const {
    const ElementName parts(element);
    if (parts.name.empty()) {
      if (element == kPlanes) return of_sort(kPlanes);
      return has_word(element, {"contact", "friction"}) ? of_sort(kContacts) : std::vector<size_t>();
    }
    if (parts.before == "contact of" || parts.before == "contacts of") return pairs_like(parts, element);
    const std::string respect = parts.before + " " + parts.after;
    const std::string sort = sort_of(respect);
    std::vector<size_t> all = with_label(label_of(element)), found;
    std::ranges::copy_if(all, std::back_inserter(found), [&](size_t e) { return elements_[e].sort == sort; });
    // else a limitation of the element itself
    return found.empty() ? all : found;
  }

 private:
  std::vector<size_t> with_label(const std::string& label) const {
    const auto found = by_label_.find(label);
    return found == by_label_.end() ? std::vector<size_t>() : found->second;
  }
  // Without what an adapter adds to the name; of a group of pairs that is another than check's, those of its kinds.
  std::vector<size_t> pairs_like(const ElementName& parts, const std::string& element) const {
    std::vector<size_t> same = with_label(element.substr(0, element.find(", friction ")));
    if (!same.empty()) return same;
    const auto kinds_of = [](const std::string& text) {
      const size_t at = text.find(" pairs of ");
      return at == std::string::npos ? "" : text.substr(at);
    };
    const std::string kinds = kinds_of(parts.after.substr(0, parts.after.find(", friction ")));
    for (const size_t e : of_sort(kContacts)) {
      if (kinds_of(elements_[e].label) == kinds) same.push_back(e);
    }
    return same;
  }
  std::vector<size_t> of_sort(const char* sort) const {
    std::vector<size_t> found;
    for (size_t e = 0; e < elements_.size(); ++e) {
      if (elements_[e].sort == sort) found.push_back(e);
    }
    return found;
  }

  const std::vector<ModelElement>& elements_;
  std::map<std::string, std::vector<size_t>> by_label_;
};

// The limitations of check() that say what Capabilities::features say, which come first: how many there are. They treat
// the elements as the features, because their texts do not name the respect ("joint 'knee'").
size_t apply_features(const Capabilities& capabilities, const std::vector<ModelElement>& elements,
                      const std::vector<Limitation>& limitations, std::vector<Fidelity>& of_element) {
  std::vector<Fidelity> treatment = of_element;
  size_t count = 0;
  for (size_t e = 0; e < elements.size(); ++e) {
    const std::optional<Feature> feature = elements[e].feature;
    if (!feature) continue;
    const FeatureSupport* support = capabilities.support(*feature);
    treatment[e] = support == nullptr ? Fidelity::kRefused : support->fidelity;
    if (treatment[e] == Fidelity::kExact) continue;
    if (count == limitations.size() || !limitations[count].element.starts_with(elements[e].label)) return 0;
    ++count;
  }
  of_element = std::move(treatment);
  return count;
}

// Elements of one sort that every contender treats alike.
struct AlikeElements {
  std::string sort;
  std::vector<size_t> elements;
};

std::vector<AlikeElements> alike_elements(const std::vector<EngineVerdict>& verdicts,
                                          const std::vector<ModelElement>& elements) {
  std::vector<AlikeElements> groups;
  std::map<std::pair<std::string, std::vector<Fidelity>>, size_t> group_of;
  for (size_t e = 0; e < elements.size(); ++e) {
    std::vector<Fidelity> treatment;
    treatment.reserve(verdicts.size());
    for (const EngineVerdict& verdict : verdicts) treatment.push_back(verdict.of_element[e]);
    const auto [found, fresh] = group_of.try_emplace({elements[e].sort, std::move(treatment)}, groups.size());
    if (fresh) groups.push_back({elements[e].sort, {}});
    groups[found->second].elements.push_back(e);
  }
  return groups;
}

// "12", "12-40", of the model's own file; empty where no line is known.
std::string lines_text(const AlikeElements& group, const std::vector<ModelElement>& elements, const FileFacts& facts) {
  int first = 0, last = 0;
  for (const size_t e : group.elements) {
    const int line = facts.line_of(elements[e].label);
    if (line == 0 || !facts.file_of(elements[e].label).empty()) continue;
    if (first == 0 || line < first) first = line;
    last = std::max(last, line);
  }
  if (first == 0) return "";
  return first == last ? std::to_string(first) : fmt::format("{}-{}", first, last);
}

}  // namespace

Fidelity EngineVerdict::worst() const {
  Fidelity worst = Fidelity::kExact;
  for (const Limitation& limitation : limitations) worst = std::max(worst, limitation.fidelity);
  return worst;
}

std::string EngineVerdict::count(Fidelity fidelity) const {
  size_t items = 0;
  for (const Limitation& limitation : limitations) {
    if (limitation.fidelity == fidelity) items += pairs_in(limitation.element);
  }
  return items == 0 ? "" : std::to_string(items);
}

std::vector<ModelElement> elements_of(const Model& model) {
  std::vector<ModelElement> elements;
  const auto add = [&](bool there, std::string sort, std::string label, std::optional<Feature> feature = {}) {
    if (there) elements.push_back({std::move(sort), std::move(label), feature});
    if (there) elements.back().count = pairs_in(elements.back().label);
  };
  for (const Body& body : model.bodies) add(body.is_free(), kFree, fmt::format("body '{}'", body.name));
  for (const auto& [sort, has] :
       {std::pair<const char*, bool (*)(const Joint&)>{kHinges, [](const Joint& j) { return !j.is_slide(); }},
        {kLimits, [](const Joint& j) { return j.limited; }},
        {kSprings, [](const Joint& j) { return j.has_spring(); }},
        {kArmature, [](const Joint& j) { return j.armature != 0; }}}) {
    for (const Joint& joint : model.joints) add(has(joint), sort, fmt::format("joint '{}'", joint.name));
  }
  for (const FeatureUse& use : features_of(model)) {
    const bool of_pair = use.feature == Feature::kTorsionalFriction || use.feature == Feature::kRollingFriction;
    const bool dry = use.feature == Feature::kDryFriction;
    add(true, dry ? kDryFriction : feature_name(use.feature), of_pair ? use.element : label_of(use.element),
        use.feature);
  }
  for (const auto& [sort, type] : {std::pair{"spheres", ShapeType::kSphere}, std::pair{"capsules", ShapeType::kCapsule},
                                   std::pair{kPlanes, ShapeType::kPlane}}) {
    for (const Shape& shape : model.shapes) {
      add(shape.collides && shape.type == type, sort, fmt::format("geom '{}'", shape.name));
    }
  }
  PairGroups pairs(model);
  for (const ContactPair& pair : model.contacts) pairs.add(pair);
  for (std::string& label : pairs.elements()) add(true, kContacts, std::move(label));
  for (const Actuator& actuator : model.actuators) add(true, kActuators, fmt::format("actuator '{}'", actuator.name));
  return elements;
}

namespace {

std::vector<Limitation> asked(const ResolvedContender& contender, const Model& model) {
  const Activity asking(fmt::format("asking {} what it does with '{}'", contender.name, model.name));
  return contender.engine->check(model, contender.settings);
}

// What processes that may die have found out, as long as there is room: whatever they do to it, reading it is safe.
class SharedAnswers {
 public:
  SharedAnswers() {
    void* memory = ::mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory != MAP_FAILED) memory_ = static_cast<char*>(memory);
  }
  ~SharedAnswers() {
    if (memory_ != nullptr) ::munmap(memory_, kBytes);
  }
  SharedAnswers(const SharedAnswers&) = delete;
  SharedAnswers& operator=(const SharedAnswers&) = delete;

  void put(const std::string& name, const std::vector<Limitation>& limitations) {
    std::string bytes;
    append(bytes, name);
    append(bytes, limitations.size());
    for (const Limitation& limitation : limitations) {
      append(bytes, static_cast<size_t>(limitation.fidelity));
      append(bytes, limitation.element);
      append(bytes, limitation.how);
    }
    size_t used = 0;
    if (memory_ == nullptr) return;
    std::memcpy(&used, memory_, sizeof used);
    if (bytes.size() > kBytes - sizeof used - std::min(used, kBytes - sizeof used)) return;
    std::memcpy(memory_ + sizeof used + used, bytes.data(), bytes.size());
    used += bytes.size();
    std::memcpy(memory_, &used, sizeof used);  // last: a half answer is none
  }

  std::map<std::string, std::vector<Limitation>> all() const {
    std::map<std::string, std::vector<Limitation>> answers;
    if (memory_ == nullptr) return answers;
    size_t used = 0;
    std::memcpy(&used, memory_, sizeof used);
    std::string_view rest(memory_ + sizeof used, std::min(used, kBytes - sizeof used));
    while (!rest.empty()) {
      std::string name;
      size_t count = 0;
      if (!take(rest, name) || !take(rest, count)) return answers;
      std::vector<Limitation> limitations;
      for (size_t i = 0; i < count; ++i) {
        size_t fidelity = 0;
        Limitation limitation;
        if (!take(rest, fidelity) || fidelity > static_cast<size_t>(Fidelity::kRefused)) return answers;
        if (!take(rest, limitation.element) || !take(rest, limitation.how)) return answers;
        limitation.fidelity = static_cast<Fidelity>(fidelity);
        limitations.push_back(std::move(limitation));
      }
      answers.insert_or_assign(name, std::move(limitations));
    }
    return answers;
  }

 private:
  static constexpr size_t kBytes = size_t{32} << 20;

  static void append(std::string& bytes, size_t number) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
  }
  static void append(std::string& bytes, const std::string& text) {
    append(bytes, text.size());
    bytes += text;
  }
  static bool take(std::string_view& rest, size_t& number) {
    if (rest.size() < sizeof number) return false;
    std::memcpy(&number, rest.data(), sizeof number);
    rest.remove_prefix(sizeof number);
    return true;
  }
  static bool take(std::string_view& rest, std::string& text) {
    size_t size = 0;
    if (!take(rest, size) || rest.size() < size) return false;
    text = rest.substr(0, size);
    rest.remove_prefix(size);
    return true;
  }

  char* memory_ = nullptr;  // the number of bytes of answers, then they
};

// Contenders whose engines do not survive the question, and why: they refuse the model. One process asks all of them,
// and only where it dies each is asked in its own. What the others answer comes with it.
std::map<std::string, std::string> not_survived(const Model& model,
                                                std::map<std::string, std::vector<Limitation>>& answers) {
  const Registry& registry = Registry::instance();
  const std::vector<std::string> names = registry.contender_names();
  SharedAnswers shared;
  const auto why_not = [&](const std::vector<std::string>& some) -> std::string {
    try {
      rehearse(
          "asking the engines",
          [&] {
            for (const std::string& name : some) shared.put(name, asked(registry.resolve(name), model));
          },
          model_caches());
    } catch (const EndedFromOutside&) {
      throw;
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  };
  std::map<std::string, std::string> reasons;
  if (!why_not(names).empty()) {
    for (const std::string& name : names) {
      if (const std::string why = why_not({name}); !why.empty()) reasons.emplace(name, why);
    }
  }
  answers = shared.all();
  return reasons;
}

}  // namespace

std::vector<EngineVerdict> verdicts_on(const Model& model, const std::vector<ModelElement>& elements,
                                       const StepBounds& bounds) {
  const Registry& registry = Registry::instance();
  std::map<std::string, std::vector<Limitation>> answers;
  const std::map<std::string, std::string> dead = not_survived(model, answers);
  const Index index(elements);
  std::vector<EngineVerdict> verdicts;
  for (const std::string& name : registry.contender_names()) {
    const ResolvedContender contender = registry.resolve(name);
    const auto end = dead.find(name);
    const auto answer = answers.find(name);
    std::vector<Limitation> limitations;
    if (end != dead.end()) {
      limitations = {{Fidelity::kRefused, "the model", end->second}};
    } else {
      limitations = answer != answers.end() ? answer->second : asked(contender, model);
    }
    const Capabilities capabilities = contender.engine->capabilities(contender.settings);
    std::ranges::move(feedback_limitations(model, capabilities), std::back_inserter(limitations));
    add_feedback_bound(limitations, bounds);
    std::erase_if(limitations, [](const Limitation& limitation) { return limitation.fidelity == Fidelity::kExact; });
    const auto same = std::ranges::find_if(verdicts, [&](const EngineVerdict& verdict) {
      return verdict.engine == contender.engine->name() && alike(verdict.limitations, limitations);
    });
    if (same != verdicts.end()) {
      same->contenders.push_back(name);
      continue;
    }
    EngineVerdict verdict = {contender.engine->name(),
                             {name},
                             std::move(limitations),
                             std::vector<Fidelity>(elements.size(), Fidelity::kExact)};
    const size_t of_features = apply_features(capabilities, elements, verdict.limitations, verdict.of_element);
    for (size_t i = of_features; i < verdict.limitations.size(); ++i) {
      const Limitation& limitation = verdict.limitations[i];
      const std::vector<size_t> meant = index.meant_by(limitation.element);
      verdict.as_a_whole = verdict.as_a_whole || meant.empty();
      for (const size_t e : meant) {
        verdict.of_element[e] = std::max(verdict.of_element[e], limitation.fidelity);
      }
    }
    verdicts.push_back(std::move(verdict));
  }
  return verdicts;
}

// ---- JSON -----------------------------------------------------------------------------------------------------------

namespace {

// From here on alike items are one entry of JSON with their number and the first of them.
constexpr size_t kMostListed = 50, kExamples = 10;

size_t count_of(const std::vector<const Limitation*>& limitations) {
  size_t count = 0;
  for (const Limitation* limitation : limitations) count += pairs_in(limitation->element);
  return count;
}

}  // namespace

std::string verdicts_json_text(const std::vector<EngineVerdict>& verdicts, const FileFacts& facts, const Model& model,
                               int depth) {
  // the same elements and sentences come for every engine
  std::unordered_map<std::string, std::string> quoted, places;
  const auto quote = [&quoted](const std::string& text) -> const std::string& {
    const auto [place, is_new] = quoted.try_emplace(text);
    if (is_new) place->second = json_text(text, 0);
    return place->second;
  };
  const auto gap = [depth](int more) { return "\n" + std::string(static_cast<size_t>(depth + more), ' '); };
  const std::string object = gap(6), member = gap(8);
  // both members of a place: the line, and the included file that it is of
  const auto place_of = [&](const std::string& element) -> const std::string& {
    const auto [place, is_new] = places.try_emplace(element);
    if (!is_new) return place->second;
    const std::string file = facts.file_of(element);
    place->second =
        fmt::format(R"({0}"line": {1},{0}"file": {2})", member, json_text(line_json(facts.line_of(element)), 0),
                    file.empty() ? "null" : json_text(file, 0));
    return place->second;
  };
  std::string text = "[";
  const auto put = [&text](std::initializer_list<std::string_view> parts) {
    for (const std::string_view part : parts) text += part;
  };
  for (const EngineVerdict& verdict : verdicts) {
    text += fmt::format(R"({0}{1}{{{2}"engine": {3},{2}"contenders": {4},{2}"verdict": {5},{2}"findings": [)",
                        text.size() > 1 ? "," : "", gap(2), gap(4), quote(verdict.engine),
                        json_text(verdict.contenders, depth + 4), quote(std::string(fidelity_text(verdict.worst()))));
    std::string_view before;
    const auto begin = [&](const Limitation& limitation, const std::string& element, size_t count) {
      put({before,
           object,
           "{",
           member,
           R"("fidelity": )",
           quote(std::string(fidelity_text(limitation.fidelity))),
           ",",
           member,
           R"("element": )",
           quote(element),
           ",",
           member,
           R"("count": )",
           std::to_string(count),
           ",",
           member,
           R"("how": )",
           quote(limitation.how),
           ",",
           place_of(limitation.element)});
      before = ",";
    };
    std::vector<size_t> group_of;
    const std::vector<LimitationGroup> groups = groups_of(verdict.limitations, group_of);
    for (size_t i = 0; i < verdict.limitations.size(); ++i) {
      const Limitation& limitation = verdict.limitations[i];
      const LimitationGroup& group = groups[group_of[i]];
      const bool listed = group.all.size() <= kMostListed;
      if (!listed && group.all.front() != &limitation) continue;
      if (listed) {
        begin(limitation, limitation.element, pairs_in(limitation.element));
      } else {
        begin(limitation, group_text(group, model), count_of(group.all));
        std::vector<std::string> examples;
        for (size_t e = 0; e < kExamples; ++e) examples.push_back(group.all[e]->element);
        put({",", member, R"("examples": )", json_text(examples, depth + 8)});
      }
      put({object, "}"});
    }
    put({verdict.limitations.empty() ? "" : gap(4), "]", gap(2), "}"});
  }
  put({verdicts.empty() ? "" : gap(0), "]"});
  return text;
}

Json elements_json(const std::vector<EngineVerdict>& verdicts, const std::vector<ModelElement>& elements,
                   const FileFacts& facts) {
  Json listed = Json::array();
  for (const AlikeElements& group : alike_elements(verdicts, elements)) {
    Json members = Json::array(), treatment = Json::array();
    size_t count = 0;
    for (const size_t e : group.elements) {
      count += elements[e].count;
      if (members.size() == kMostListed) continue;
      const std::string file = facts.file_of(elements[e].label);
      members.push_back({{"element", elements[e].label},
                         {"line", line_json(facts.line_of(elements[e].label))},
                         {"file", file.empty() ? Json(nullptr) : Json(file)}});
    }
    for (const EngineVerdict& verdict : verdicts) {
      treatment.push_back({{"engine", verdict.engine},
                           {"contenders", verdict.contenders},
                           {"fidelity", fidelity_text(verdict.of_element[group.elements.front()])}});
    }
    listed.push_back({{"sort", group.sort}, {"count", count}, {"elements", members}, {"engines", treatment}});
  }
  return listed;
}

// ---- for people -----------------------------------------------------------------------------------------------------

namespace {

std::map<std::string, std::vector<std::string>> contenders_of_engines(const std::vector<EngineVerdict>& verdicts) {
  std::map<std::string, std::vector<std::string>> of_engine;
  for (const EngineVerdict& verdict : verdicts) {
    auto& names = of_engine[verdict.engine];
    names.insert(names.end(), verdict.contenders.begin(), verdict.contenders.end());
  }
  return of_engine;
}

// The same for a table, where print_statements() has the names.
std::string brief(const std::vector<std::string>& contenders, const std::vector<std::string>& of_engine) {
  constexpr size_t kMost = 3;
  std::string text = contenders_text(contenders, of_engine);
  if (contenders.size() <= kMost || text.starts_with("all ")) return text;
  return fmt::format("{} and {} more", contenders.front(), contenders.size() - 1);
}

}  // namespace

std::string verdicts_text(const std::vector<EngineVerdict>& verdicts) {
  std::string out;
  const auto of_engine = contenders_of_engines(verdicts);
  std::vector<std::string> exact;  // engines; one line says it of all
  std::vector<std::vector<std::string>> rows;
  rows.reserve(verdicts.size());
  for (const EngineVerdict& verdict : verdicts) {
    if (verdict.worst() == Fidelity::kExact && verdict.contenders.size() == of_engine.at(verdict.engine).size()) {
      exact.push_back(verdict.engine);
      continue;
    }
    rows.push_back({verdict.engine, status(fidelity_text(verdict.worst())), verdict.count(Fidelity::kRefused),
                    verdict.count(Fidelity::kApproximated), brief(verdict.contenders, of_engine.at(verdict.engine))});
  }
  if (!exact.empty()) {
    out += "\n" + paragraph(fmt::format("{} in all contenders of {}", status(fidelity_text(Fidelity::kExact)),
                                        join(exact, ", ")),
                            2);
  }
  if (!rows.empty()) out += "\n" + table({"engine", "verdict", "refused", "approximated", "contenders"}, rows, {2, 3});
  return out;
}

std::string elements_table(const std::vector<EngineVerdict>& verdicts, const std::vector<ModelElement>& elements,
                           const FileFacts& facts) {
  std::string out;
  std::vector<EngineVerdict> counted_ones;
  std::ranges::copy_if(verdicts, std::back_inserter(counted_ones),
                       [](const EngineVerdict& v) { return !v.as_a_whole; });
  const auto of_engine = contenders_of_engines(counted_ones);
  std::vector<AlikeElements> shown;
  std::map<std::vector<std::string>, size_t> row_of;
  bool partly = false;
  for (const AlikeElements& group : alike_elements(counted_ones, elements)) {
    size_t exact = 0;
    std::map<Fidelity, std::vector<std::string>> engines;
    for (const auto& [engine, contenders] : of_engine) {
      std::map<Fidelity, size_t> counts;
      for (const EngineVerdict& verdict : counted_ones) {
        if (verdict.engine == engine) counts[verdict.of_element[group.elements.front()]] += verdict.contenders.size();
      }
      if (counts[Fidelity::kExact] > 0) ++exact;
      for (const auto& [fidelity, count] : counts) {
        if (count == 0) continue;
        engines[fidelity].push_back(count == contenders.size() ? engine : engine + "*");
        if (fidelity != Fidelity::kExact && count != contenders.size()) partly = true;
      }
    }
    const bool by_all = engines[Fidelity::kApproximated].empty() && engines[Fidelity::kRefused].empty();
    const std::string exactly = by_all ? "all" : fmt::format("{} of {}", exact, of_engine.size());
    std::vector<std::string> treatment = {group.sort, exactly, join(engines[Fidelity::kApproximated], ", "),
                                          join(engines[Fidelity::kRefused], ", ")};
    // groups whose difference lies within "some of its contenders" are one row
    const auto [found, fresh] = row_of.try_emplace(std::move(treatment), shown.size());
    if (fresh) shown.push_back({group.sort, {}});
    auto& members = shown[found->second].elements;
    members.insert(members.end(), group.elements.begin(), group.elements.end());
  }
  std::vector<std::vector<std::string>> rows(shown.size());
  for (const auto& [treatment, row] : row_of) {
    size_t count = 0;
    for (const size_t e : shown[row].elements) count += elements[e].count;
    rows[row] = {treatment[0], std::to_string(count), lines_text(shown[row], elements, facts),
                 treatment[1], treatment[2],          treatment[3]};
  }
  out += "\n" + table({"elements", "number", "lines", "exact", "approximated by", "refused by"}, rows, {1, 2, 3});
  if (partly) out += paragraph("* by some of its contenders");
  return out;
}

std::string statements_text(const std::vector<EngineVerdict>& verdicts, const Model& model) {
  std::string out;
  const auto of_engine = contenders_of_engines(verdicts);
  const std::vector<Statement> statements = statements_of(verdicts, model);
  for (const Fidelity fidelity : {Fidelity::kRefused, Fidelity::kApproximated}) {
    bool first = true;
    for (const Statement& statement : statements) {
      if (statement.fidelity != fidelity) continue;
      if (std::exchange(first, false)) out += "\n" + status(fidelity_text(fidelity)) + "\n";
      out += paragraph(fmt::format("  {}: {}", statement.what, statement.how), 4);
      std::vector<std::string> parts;
      for (const auto& [engine, contenders] : statement.contenders) {
        const std::string names = contenders_text(contenders, of_engine.at(engine));
        parts.push_back(names.starts_with("all ") ? fmt::format("{} ({})", engine, names) : names);
      }
      out += paragraph("    " + join(parts, ", "), 4);
    }
  }
  return out;
}

}  // namespace assay
