#include "controls/changes/change.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "controls/changes/joint_number.h"
#include "model/joint.h"

namespace assay {
namespace {

// What a kind takes behind its sign of equality.
enum class ValueForm {
  kOff,
  kNumber,
  kPositive,
  kInertia,
  kShift,
  kVector,
  kVectorOrNumber,
  kDelay,
  kDampers,
  kLaw,
  kText
};

struct KindInfo {
  const char* name;
  ValueForm form;
  bool of_element;  // whether one may be named
};

// In the order of the enumeration.
constexpr std::array<KindInfo, 25> kKinds = {{{"contacts", ValueForm::kOff, false},
                                              {"self_contacts", ValueForm::kOff, false},
                                              {"friction", ValueForm::kNumber, false},
                                              {"limits", ValueForm::kOff, true},
                                              {"armature", ValueForm::kNumber, true},
                                              {"damping", ValueForm::kNumber, true},
                                              {"stiffness", ValueForm::kNumber, true},
                                              {"dry_friction", ValueForm::kNumber, true},
                                              {"mass", ValueForm::kPositive, true},
                                              {"inertia", ValueForm::kInertia, true},
                                              {"centre", ValueForm::kVector, true},
                                              {"gravity", ValueForm::kVectorOrNumber, false},
                                              {"ground", ValueForm::kShift, false},
                                              {"encoder", ValueForm::kShift, true},
                                              {"dampers", ValueForm::kDampers, false},
                                              {"clamp", ValueForm::kOff, false},
                                              {"delay", ValueForm::kDelay, false},
                                              {"law", ValueForm::kLaw, false},
                                              {"gear", ValueForm::kNumber, true},
                                              {"drive_stiffness", ValueForm::kPositive, true},
                                              {"drive_damping", ValueForm::kPositive, true},
                                              {"order", ValueForm::kText, false},
                                              {"contender", ValueForm::kText, false},
                                              {"timestep", ValueForm::kPositive, false},
                                              {"set", ValueForm::kText, true}}};

const KindInfo& info(ChangeKind kind) { return kKinds.at(static_cast<size_t>(kind)); }

// Without the plus sign, which the parsers do not take.
std::string unsigned_text(const std::string& value) { return value.starts_with('+') ? value.substr(1) : value; }

// The numbers of a list; empty where it is none of exactly `count` numbers.
std::vector<double> number_list(const std::string& value, size_t count) {
  std::vector<double> numbers;
  for (size_t at = 0; at <= value.size();) {
    const size_t comma = std::min(value.find(',', at), value.size());
    const auto number = parse_number(unsigned_text(value.substr(at, comma - at)));
    if (!number) return {};
    numbers.push_back(*number);
    at = comma + 1;
  }
  return numbers.size() == count ? numbers : std::vector<double>();
}

Vec3 vector_of(const std::string& value) {
  const std::vector<double> numbers = number_list(value, 3);
  return numbers.empty() ? Vec3(Vec3::Zero()) : Vec3(numbers[0], numbers[1], numbers[2]);
}

// A delay that is a time, s.
std::optional<double> time_of(const std::string& value) {
  if (!value.ends_with("ms")) return std::nullopt;
  const auto number = parse_number(unsigned_text(value.substr(0, value.size() - 2)));
  return number ? std::optional(1e-3 * *number) : std::nullopt;
}

// What is wrong with the value; "" for nothing.
std::string complaint(ValueForm form, const std::string& value) {
  const auto number = parse_number(unsigned_text(value));
  switch (form) {
    case ValueForm::kOff:
      return value == "off" ? "" : "write off";
    case ValueForm::kNumber:
      return number || value == "off" ? "" : "give a factor, +X to add X, or off";
    case ValueForm::kPositive:
      return number && (*number > 0 || value.starts_with('+')) ? "" : "give a positive factor";
    case ValueForm::kInertia:
      if (value.find(',') == std::string::npos) return complaint(ValueForm::kPositive, value);
      return number_list(value, 6).empty() ? "give a positive factor, or XX,YY,ZZ,XY,XZ,YZ in kg m^2" : "";
    case ValueForm::kShift:
      return number ? "" : "give what is added, as in +0.01";
    case ValueForm::kVector:
      return number_list(value, 3).empty() ? "give three numbers, as in 0,0,0.01" : "";
    case ValueForm::kVectorOrNumber:
      if (value.find(',') == std::string::npos) return complaint(ValueForm::kNumber, value);
      return number_list(value, 3).empty() ? "give a factor, +X to add X, off, or three numbers, as in 0,0,-9.81" : "";
    case ValueForm::kDelay:
      return parse_integer(unsigned_text(value)) || time_of(value)
                 ? ""
                 : "give a whole number of control steps, or a time, as in 4ms";
    case ValueForm::kDampers:
      return value == "explicit" ? "" : "write explicit";
    case ValueForm::kLaw:
      return value == "explicit" || value == "engine" ? "" : "write explicit or engine";
    case ValueForm::kText:
      break;
  }
  return value.empty() ? "give a value" : "";
}

double changed_number(double before, const RunChange& change) {
  if (change.value == "off") return 0;
  const double number = parse_number(unsigned_text(change.value)).value_or(1);
  return change.value.starts_with('+') ? before + number : before * number;
}

[[noreturn]] void no_element(const RunChange& change, const Model& model, const char* what,
                             const std::vector<std::string>& names) {
  throw InputError(fmt::format("the change '{}' names '{}', and the model '{}' has no such {}{}", change_text(change),
                               change.element, model.name, what, did_you_mean(change.element, names)));
}

// Applies `work` to each hinge, slide and ball joint that the change means.
template <typename Work>
void for_joints(Model& model, const RunChange& change, const Work& work) {
  bool found = change.element.empty();
  std::vector<std::string> names;
  const auto take = [&](auto& joint) {
    names.push_back(joint.name);
    if (!change.element.empty() && joint.name != change.element) return;
    found = true;
    work(joint);
  };
  each_joint(model, take);
  if (!found) no_element(change, model, "joint", names);
}

template <typename Work>
void for_bodies(Model& model, const RunChange& change, const Work& work) {
  bool found = change.element.empty();
  std::vector<std::string> names;
  for (Body& body : model.bodies) {
    names.push_back(body.name);
    if (!change.element.empty() && body.name != change.element) continue;
    found = true;
    work(body);
  }
  if (!found) no_element(change, model, "body", names);
}

void set_inertia(Body& body, const RunChange& change) {
  const std::vector<double> numbers = number_list(change.value, 6);
  if (numbers.empty()) {
    body.I_BBcm_B *= changed_number(1, change);
  } else if (!body.is_massless()) {
    body.I_BBcm_B << numbers[0], numbers[3], numbers[4],  //
        numbers[3], numbers[1], numbers[5],               //
        numbers[4], numbers[5], numbers[2];
  }
}

double shift_of(const RunChange& change) { return parse_number(unsigned_text(change.value)).value_or(0); }

// Everything that is measured in the joint's coordinate moves with it, so that the joint is the same one.
void shift_reading(Joint& joint, double shift) {
  joint.reference += shift;
  joint.spring_reference += shift;
  joint.lower += shift;
  joint.upper += shift;
}

void apply(Model& model, const RunChange& change) {
  const auto moves = [&](int shape) { return model.shapes[static_cast<size_t>(shape)].body != kWorld; };
  switch (change.kind) {
    case ChangeKind::kContacts:
      model.contacts.clear();
      return;
    case ChangeKind::kSelfContacts:
      std::erase_if(model.contacts,
                    [&](const ContactPair& pair) { return moves(pair.shape_a) && moves(pair.shape_b); });
      return;
    case ChangeKind::kFriction:
      for (ContactPair& pair : model.contacts) pair.friction = std::max(0.0, changed_number(pair.friction, change));
      return;
    case ChangeKind::kLimits:
      for_joints(model, change, [](auto& joint) { joint.limited = false; });
      if (change.element.empty()) {
        for (Tendon& tendon : model.tendons) tendon.limited = false;
      }
      return;
    case ChangeKind::kArmature:
    case ChangeKind::kDamping:
    case ChangeKind::kStiffness:
    case ChangeKind::kDryFriction:
      for_joints(model, change, [&](auto& joint) {
        double& number = *joint_number(change.kind, joint);
        number = changed_number(number, change);
      });
      return;
    case ChangeKind::kMass:
      for_bodies(model, change, [&](Body& body) {
        if (!body.is_massless()) body.mass = changed_number(body.mass, change);
      });
      return;
    case ChangeKind::kInertia:
      for_bodies(model, change, [&](Body& body) { set_inertia(body, change); });
      return;
    case ChangeKind::kCentre:
      for_bodies(model, change, [&](Body& body) {
        if (!body.is_massless()) body.p_BBcm += vector_of(change.value);
      });
      return;
    case ChangeKind::kGravity:
      if (change.value.find(',') != std::string::npos) {
        model.gravity = vector_of(change.value);
      } else {
        model.gravity *= changed_number(1, change);
      }
      return;
    case ChangeKind::kGround:
      for (Shape& shape : model.shapes) {
        if (shape.body == kWorld) shape.X_BS.p.z() += shift_of(change);
      }
      return;
    case ChangeKind::kEncoder:
      for_joints(model, change, [&](auto& joint) {
        if constexpr (requires { joint.reference; }) shift_reading(joint, shift_of(change));
      });
      return;
    case ChangeKind::kDampers:  // the control gives them
      for (Joint& joint : model.joints) joint.stiffness = joint.damping = 0;
      return;
    case ChangeKind::kClamp:
    case ChangeKind::kDelay:
    case ChangeKind::kLaw:
    case ChangeKind::kGear:
    case ChangeKind::kDriveStiffness:
    case ChangeKind::kDriveDamping:
    case ChangeKind::kOrder:
    case ChangeKind::kContender:
    case ChangeKind::kTimestep:
    case ChangeKind::kSet:
      return;
  }
}

}  // namespace

std::string change_text(const RunChange& change) {
  return fmt::format("{}{}{}={}", info(change.kind).name, change.element.empty() ? "" : ":", change.element,
                     change.value);
}

RunChange parse_change(const std::string& text) {
  const size_t equals = text.rfind('=');
  if (equals == std::string::npos) {
    throw InputError(fmt::format("the change '{}' has no value: write it as in armature=off or gear:knee=-1", text));
  }
  const std::string left = text.substr(0, equals);
  const size_t colon = std::min(left.find(':'), left.size());
  const std::string name = left.substr(0, colon);
  std::vector<std::string> names;
  names.reserve(kKinds.size());
  for (const KindInfo& kind : kKinds) names.emplace_back(kind.name);
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) {
    throw InputError(fmt::format("there is no change '{}'{}", name, did_you_mean(name, names)));
  }
  RunChange change;
  change.kind = static_cast<ChangeKind>(found - names.begin());
  change.element = colon < left.size() ? left.substr(colon + 1) : "";
  change.value = text.substr(equals + 1);
  const KindInfo& kind = info(change.kind);
  if (!change.element.empty() && !kind.of_element) {
    throw InputError(fmt::format("the change '{}' names '{}': '{}' changes all at once; leave the name out", text,
                                 change.element, name));
  }
  if (change.element.empty() && change.kind == ChangeKind::kSet) {
    throw InputError(fmt::format("the change '{}' names no setting: write it as in set:iterations=50", text));
  }
  if (const std::string why = complaint(kind.form, change.value); !why.empty()) {
    throw InputError(fmt::format("the change '{}' has the value '{}': {}", text, change.value, why));
  }
  return change;
}

std::vector<RunChange> parse_changes(const std::vector<std::string>& texts) {
  std::vector<RunChange> changes;
  changes.reserve(texts.size());
  for (const std::string& text : texts) changes.push_back(parse_change(text));
  return changes;
}

std::vector<std::string> change_texts(const std::vector<RunChange>& changes) {
  std::vector<std::string> texts;
  texts.reserve(changes.size());
  for (const RunChange& change : changes) texts.push_back(change_text(change));
  return texts;
}

bool is_of_contender(const RunChange& change) { return change.kind >= ChangeKind::kContender; }

const RunChange* last_change(const std::vector<RunChange>& changes, ChangeKind kind) {
  const RunChange* last = nullptr;
  for (const RunChange& change : changes) {
    if (change.kind == kind) last = &change;
  }
  return last;
}

int delay_of(const std::vector<RunChange>& changes) {
  long long sum = 0;
  for (const RunChange& change : changes) {
    if (change.kind == ChangeKind::kDelay) sum += parse_integer(unsigned_text(change.value)).value_or(0);
  }
  return static_cast<int>(std::clamp(sum, -1'000'000LL, 1'000'000LL));
}

double delay_s_of(const std::vector<RunChange>& changes) {
  double sum = 0;
  for (const RunChange& change : changes) {
    if (change.kind == ChangeKind::kDelay) sum += time_of(change.value).value_or(0);
  }
  return sum;
}

std::vector<double> joint_factors(const Model& model, ChangeKind kind, const std::vector<RunChange>& changes) {
  std::vector<double> factors(model.joints.size(), 1.0);
  std::vector<std::string> names;
  names.reserve(model.joints.size());
  for (const Joint& joint : model.joints) names.push_back(joint.name);
  for (const RunChange& change : changes) {
    if (change.kind != kind) continue;
    if (!change.element.empty() && std::ranges::find(names, change.element) == names.end()) {
      no_element(change, model, "hinge or slide", names);
    }
    for (size_t j = 0; j < factors.size(); ++j) {
      if (change.element.empty() || change.element == names[j]) factors[j] *= changed_number(1, change);
    }
  }
  return factors;
}

Model changed_model(Model model, const std::vector<RunChange>& changes) {
  if (changes.empty()) return model;
  for (const RunChange& change : changes) {
    if (change.kind != ChangeKind::kDampers) apply(model, change);
  }
  if (const RunChange* dampers = last_change(changes, ChangeKind::kDampers)) apply(model, *dampers);
  model.hash = model_hash(model);
  return model;
}

}  // namespace assay
