#include "match/parameters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "match/log.h"
#include "model/joint_inertia.h"
#include "model/kinematics.h"

namespace assay::match {
namespace {

constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
constexpr std::array<const char*, 6> kMoments = {"xx", "yy", "zz", "xy", "xz", "yz"};

// What a kind of parameter is of.
enum class Of { kJoint, kBody, kAll, kRole, kSetting };  // kRole: settings of the contender with a role

struct Kind {
  const char* name;
  ChangeKind change;
  Of of;
  std::span<const char* const> components = {};
  SettingRole role = SettingRole::kNone;
  const char* measured = "";  // what settings with the role are for
};

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all = {
      {"damping", ChangeKind::kDamping, Of::kJoint},
      {"dry_friction", ChangeKind::kDryFriction, Of::kJoint},
      {"armature", ChangeKind::kArmature, Of::kJoint},
      {"stiffness", ChangeKind::kStiffness, Of::kJoint},
      {"mass", ChangeKind::kMass, Of::kBody},
      {"centre", ChangeKind::kCentre, Of::kBody, kAxes},
      {"inertia", ChangeKind::kInertia, Of::kBody, kMoments},
      {"gravity", ChangeKind::kGravity, Of::kAll, kAxes},
      {"ground", ChangeKind::kGround, Of::kAll},
      {"encoder", ChangeKind::kEncoder, Of::kJoint},
      {"gear", ChangeKind::kGear, Of::kJoint},
      {"delay", ChangeKind::kDelay, Of::kAll},
      {"drive_stiffness", ChangeKind::kDriveStiffness, Of::kJoint},
      {"drive_damping", ChangeKind::kDriveDamping, Of::kJoint},
      {"friction", ChangeKind::kFriction, Of::kAll},
      {"softness", ChangeKind::kSet, Of::kRole, {}, SettingRole::kContactSoftness, "the softness of contacts"},
      {"restitution", ChangeKind::kSet, Of::kRole, {}, SettingRole::kContactRebound, "what an impact gives back"},
      {"set", ChangeKind::kSet, Of::kSetting},
  };
  return all;
}

// A request, taken apart.
struct Wanted {
  const Kind* kind = nullptr;
  int component = -1;   // -1: all of them
  std::string element;  // "": all of them
};

Wanted wanted_of(const FitRequest& request) {
  const std::string& text = request.parameter;
  const size_t colon = std::min(text.find(':'), text.size());
  std::string head = text.substr(0, colon);
  Wanted wanted;
  wanted.element = colon < text.size() ? text.substr(colon + 1) : "";
  const size_t dot = std::min(head.find('.'), head.size());
  const std::string component = dot < head.size() ? head.substr(dot + 1) : "";
  head.resize(dot);
  std::vector<std::string> names;
  for (const Kind& kind : kinds()) {
    names.emplace_back(kind.name);
    if (head == kind.name) wanted.kind = &kind;
  }
  if (wanted.kind == nullptr) {
    throw InputError(fmt::format("there is no parameter '{}' to fit{}", text, did_you_mean(head, names)));
  }
  if (!component.empty()) {
    const auto& components = wanted.kind->components;
    const auto found = std::ranges::find(components, component, [](const char* name) { return std::string(name); });
    if (found == components.end()) {
      const std::vector<std::string> all(components.begin(), components.end());
      throw InputError(fmt::format("the parameter '{}' has no component '{}': {}", text, component,
                                   all.empty() ? "leave it out" : "it has " + join(all, ", ")));
    }
    wanted.component = static_cast<int>(found - components.begin());
  }
  if (!wanted.element.empty() && wanted.kind->of == Of::kAll) {
    throw InputError(fmt::format("the parameter '{}' names '{}', and there is only one of it: write {}", text,
                                 wanted.element, head));
  }
  if (wanted.element.empty() && wanted.kind->of == Of::kSetting) {
    throw InputError("the parameter 'set' names no setting: write it as in set:contact_dampratio");
  }
  return wanted;
}

// How far the body's mass reaches from its centre, m.
double reach_of(const Body& body) {
  return body.is_massless() ? 0.01 : std::max(1e-4, std::sqrt(body.I_BBcm_B.trace() / (2 * body.mass)));
}

void number(Parameter& parameter, double nominal, double lower, double upper, double step) {
  parameter.nominal = nominal, parameter.lower = lower, parameter.upper = upper, parameter.step = step;
  parameter.log = false;
}
void factor(Parameter& parameter, double nominal, double most, double step) {
  parameter.nominal = nominal, parameter.lower = nominal / most, parameter.upper = nominal * most;
  parameter.step = step;
  parameter.log = true;
}

// A number that may not be negative and that the model may have at zero. `scale` is what would matter.
void not_negative(Parameter& parameter, double nominal, double scale) {
  const double most = std::max(scale, 4 * nominal);
  number(parameter, nominal, 0, most, std::max(0.1 * scale, 0.3 * nominal));
}

class Chooser {
 public:
  Chooser(const Model& model, const ResolvedContender& contender, const MotionScales& scales)
      : model_(model), contender_(contender), scales_(scales), inertia_(joint_inertia(model, model.initial)) {}

  // Those of one request.
  std::vector<Parameter> of(const Wanted& wanted, bool named) {
    std::vector<Parameter> found;
    const int components = std::max(1, static_cast<int>(wanted.kind->components.size()));
    const auto add = [&](const std::string& element, int index) {
      for (int c = 0; c < components; ++c) {
        if (wanted.component >= 0 && c != wanted.component) continue;
        Parameter parameter;
        parameter.kind = wanted.kind->change;
        parameter.element = element;
        parameter.component = c;
        parameter.name = wanted.kind->name;
        if (components > 1) parameter.name += fmt::format(".{}", wanted.kind->components[static_cast<size_t>(c)]);
        if (wanted.kind->of != Of::kAll) parameter.name += ":" + element;
        if (size(parameter, index)) found.push_back(std::move(parameter));
      }
    };
    switch (wanted.kind->of) {
      case Of::kAll:
      case Of::kSetting:
        add(wanted.element, -1);
        break;
      case Of::kRole: {
        const std::vector<std::string> settings = settings_of(*wanted.kind);
        for (const std::string& name : settings) {
          if (!wanted.element.empty() && wanted.element != name) continue;
          add(name, -1);
          // most engines have one
          if (settings.size() == 1 && !found.empty()) found.back().name = wanted.kind->name;
        }
        if (!wanted.element.empty() && std::ranges::find(settings, wanted.element) == settings.end()) {
          refuse(fmt::format("{} is not a setting of {} for it{}", wanted.element, contender_.name,
                             did_you_mean(wanted.element, settings)));
        }
        break;
      }
      case Of::kJoint:
        for (size_t j = 0; j < model_.joints.size(); ++j) {
          const std::string& name = model_.joints[j].name;
          if (wanted.element.empty() ? bool{scales_.logged[j]} : wanted.element == name) add(name, static_cast<int>(j));
        }
        break;
      case Of::kBody:
        for (size_t b = 0; b < model_.bodies.size(); ++b) {
          const Body& body = model_.bodies[b];
          if (body.is_massless()) continue;
          if (wanted.element.empty() || wanted.element == body.name) add(body.name, static_cast<int>(b));
        }
        break;
    }
    if (found.empty() && named && why_.empty()) why_ = missing(wanted);
    return found;
  }

  // Why the last request gave nothing.
  std::string take_why() { return std::exchange(why_, ""); }

 private:
  std::string missing(const Wanted& wanted) const {
    std::vector<std::string> names;
    if (wanted.kind->of == Of::kJoint) {
      for (const Joint& joint : model_.joints) names.push_back(joint.name);
      return fmt::format("the model '{}' has no hinge or slide '{}'{}", model_.name, wanted.element,
                         did_you_mean(wanted.element, names));
    }
    for (const Body& body : model_.bodies) names.push_back(body.name);
    return fmt::format("the model '{}' has no body '{}' with a mass{}", model_.name, wanted.element,
                       did_you_mean(wanted.element, names));
  }

  // Unit, nominal value, bounds and step; false where there is no such parameter.
  bool size(Parameter& p, int index) {
    const auto at = static_cast<size_t>(std::max(index, 0));
    const auto joint = [&]() -> const Joint& { return model_.joints[at]; };
    const auto body = [&]() -> const Body& { return model_.bodies[at]; };
    const auto unit = [&](const char* hinge, const char* slide) { return joint().is_slide() ? slide : hinge; };
    switch (p.kind) {
      case ChangeKind::kDamping:
        p.unit = unit("N m s/rad", "N s/m");
        not_negative(p, joint().damping, scales_.torque[at] / scales_.speed[at]);
        return true;
      case ChangeKind::kDryFriction:
        p.unit = unit("N m", "N");
        not_negative(p, joint().dry_friction, 0.5 * scales_.torque[at]);
        return true;
      case ChangeKind::kArmature: {
        p.unit = unit("kg m^2", "kg");
        const auto row = static_cast<Eigen::Index>(at);
        not_negative(p, joint().armature, inertia_(row, row));
        return true;
      }
      case ChangeKind::kStiffness:
        p.unit = unit("N m/rad", "N/m");
        not_negative(p, joint().stiffness, scales_.torque[at]);
        return true;
      case ChangeKind::kMass:
        p.unit = "kg";
        factor(p, body().mass, 3, 0.2);
        return true;
      case ChangeKind::kCentre: {
        p.unit = "m";
        const double reach = reach_of(body());
        // of a link the centre is known worse than of a body that is thrown
        const double share = body().is_free() ? 0.3 : 1.0;
        number(p, 0, -share * reach, share * reach, 0.2 * share * reach);
        return true;
      }
      case ChangeKind::kInertia:
        p.unit = "";
        number(p, 0, p.component < 3 ? -0.7 : -0.5, p.component < 3 ? 0.7 : 0.5, 0.1);
        return true;
      case ChangeKind::kGravity: {
        p.unit = "m/s^2";
        const double g = std::max(model_.gravity.norm(), 1.0), own = model_.gravity[p.component];
        // a table is level within 2 degrees and a length right within 3 %; wider bounds only fit impacts
        number(p, own, own - (0.03 * g), own + (0.03 * g), 0.01 * g);
        return true;
      }
      case ChangeKind::kGround: {
        p.unit = "m";
        const bool any =
            std::ranges::any_of(model_.shapes, [](const Shape& s) { return s.body == kWorld && s.collides; });
        if (!any) return refuse(fmt::format("the model '{}' has no shape of the world", model_.name));
        double reach = 0.05;
        for (size_t b = 0; b < model_.bodies.size(); ++b) {
          if (scales_.flying[b]) reach = std::min(reach, reach_of(model_.bodies[b]));
        }
        number(p, 0, -0.2 * reach, 0.2 * reach, 0.03 * reach);
        return true;
      }
      case ChangeKind::kEncoder:
        p.unit = unit("rad", "m");
        number(p, 0, joint().is_slide() ? -0.01 : -0.2, joint().is_slide() ? 0.01 : 0.2,
               joint().is_slide() ? 1e-3 : 0.02);
        return true;
      case ChangeKind::kGear:
        if (!scales_.driven) return refuse("nothing drives the joints in these logs");
        p.unit = "";
        factor(p, 1, 4, 0.1);
        return true;
      case ChangeKind::kDelay:
        if (!scales_.driven) return refuse("nothing drives the joints in these logs");
        p.unit = "s";
        number(p, 0, -0.02, 0.02, 0.003);
        return true;
      case ChangeKind::kDriveStiffness:
      case ChangeKind::kDriveDamping:
        if (!scales_.drives) return refuse("the configuration has no drives ([drive] law = \"pd\")");
        p.unit = "";
        factor(p, 1, 10, 0.3);
        return true;
      case ChangeKind::kFriction: {
        p.unit = "";
        double largest = 0;
        for (const ContactPair& pair : model_.contacts) largest = std::max(largest, pair.friction);
        if (largest <= 0) return refuse(fmt::format("the model '{}' has no contacts with friction", model_.name));
        factor(p, largest, 5, 0.2);
        return true;
      }
      case ChangeKind::kSet:
        return size_setting(p);
      default:
        return false;
    }
  }

  // Names of the contender's settings with the kind's role.
  std::vector<std::string> settings_of(const Kind& kind) {
    std::vector<std::string> names;
    for (const Setting& each : contender_.engine->settings()) {
      if (each.role == kind.role) names.push_back(each.name);
    }
    if (names.empty()) refuse(fmt::format("{} has no setting for {}", contender_.name, kind.measured));
    return names;
  }

  bool size_setting(Parameter& p) {
    const std::vector<Setting> declared = contender_.engine->settings();
    const Setting* setting = nullptr;
    std::vector<std::string> names;
    for (const Setting& each : declared) {
      names.push_back(each.name);
      if (each.name == p.element) setting = &each;
    }
    if (setting == nullptr) {
      return refuse(
          fmt::format("{} has no setting '{}'{}", contender_.name, p.element, did_you_mean(p.element, names)));
    }
    const auto* own = std::get_if<double>(&contender_.settings.values.at(setting->name));
    if (own == nullptr)
      return refuse(fmt::format("the setting '{}' of {} is no real number", setting->name, contender_.name));
    if (const std::string condition = missing_condition(*setting, contender_.settings); !condition.empty()) {
      return refuse(fmt::format("the setting '{}' of {} acts only with {}", setting->name, contender_.name, condition));
    }
    p.element = setting->name;
    p.unit = setting->unit;
    if (*own > 0) {
      factor(p, *own, 20, 1);
    } else {
      const double most = setting->maximum.value_or(1);
      number(p, *own, setting->minimum.value_or(0), most, 0.2 * most);
    }
    p.lower = std::max(p.lower, setting->minimum.value_or(p.lower));
    p.upper = std::min(p.upper, setting->maximum.value_or(p.upper));
    return true;
  }

  bool refuse(std::string why) {
    why_ = std::move(why);
    return false;
  }

  const Model& model_;
  const ResolvedContender& contender_;
  const MotionScales& scales_;
  Eigen::MatrixXd inertia_;
  std::string why_;
};

// Bounds that somebody wrote may not pass what can be: a damping below 0, a setting beyond what the engine takes. Those
// of a role end there, because its settings have another range in each engine.
void check_bounds(const FitRequest& request, const Kind& kind, const ResolvedContender& contender, Parameter& p) {
  const auto refuse = [&](double bound, const std::string& why) {
    throw InputError(
        fmt::format("the bounds of '{}' have {}, and {}: give others", request.parameter, shortest(bound), why));
  };
  switch (p.kind) {
    case ChangeKind::kDamping:
    case ChangeKind::kDryFriction:
    case ChangeKind::kArmature:
    case ChangeKind::kStiffness:
    case ChangeKind::kFriction:
    case ChangeKind::kDriveStiffness:
    case ChangeKind::kDriveDamping:
      if (p.lower < 0) refuse(p.lower, "it cannot be negative");
      return;
    case ChangeKind::kMass:
      if (p.lower <= 0) refuse(p.lower, "a mass is above 0");
      return;
    case ChangeKind::kSet:
      for (const Setting& each : contender.engine->settings()) {
        if (each.name != p.element) continue;
        if (kind.of == Of::kRole) {
          p.lower = std::max(p.lower, each.minimum.value_or(p.lower));
          p.upper = std::min(p.upper, each.maximum.value_or(p.upper));
        }
        if (each.minimum && p.lower < *each.minimum) {
          refuse(p.lower, fmt::format("{} takes at least {}", contender.name, shortest(*each.minimum)));
        }
        if (each.maximum && p.upper > *each.maximum) {
          refuse(p.upper, fmt::format("{} takes at most {}", contender.name, shortest(*each.maximum)));
        }
      }
      return;
    default:
      return;
  }
}

// What is fitted where nobody says: of joints what drives and friction hide, of a thrown body what impacts show.
std::vector<FitRequest> default_requests(const Model& model, const MotionScales& scales) {
  std::vector<FitRequest> requests;
  const auto add = [&](const std::string& name) { requests.push_back({.parameter = name, .lower = {}, .upper = {}}); };
  const bool joints = std::ranges::any_of(scales.logged, [](bool b) { return b; });
  if (joints) {
    for (const char* name : {"damping", "dry_friction", "armature", "mass"}) add(name);
    if (scales.driven) add("delay");
    if (scales.drives) add("drive_stiffness"), add("drive_damping");
  }
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    if (!scales.flying[b]) continue;
    add("centre:" + model.bodies[b].name);
    add("inertia:" + model.bodies[b].name);
  }
  if (std::ranges::any_of(scales.flying, [](bool b) { return b; })) add("gravity");
  if (!model.contacts.empty()) {
    add("friction");
    add("softness");
    add("restitution");
    add("ground");
  }
  return requests;
}

}  // namespace

double Parameter::coordinate(double value) const {
  return log ? std::log(value / nominal) / step : (value - nominal) / step;
}

double Parameter::value(double coordinate) const {
  const double found = log ? nominal * std::exp(step * coordinate) : nominal + step * coordinate;
  return std::clamp(found, lower, upper);
}

MotionScales motion_scales(const Model& model, const std::vector<MeasuredLog>& logs, const MatchConfig& config) {
  MotionScales scales;
  const size_t joints = model.joints.size();
  scales.torque.assign(joints, 0), scales.speed.assign(joints, 0);
  scales.logged.assign(joints, false), scales.flying.assign(model.bodies.size(), false);
  const DriveLaw law = drive_law(logs, config);
  scales.driven = law != DriveLaw::kNone;
  scales.drives = law == DriveLaw::kPd;
  for (const MeasuredLog& log : logs) {
    for (const MeasuredJoint& measured : log.joints) {
      const auto j = static_cast<size_t>(measured.joint);
      scales.logged[j] = true;
      double squares = 0;
      const double time = log.time.back() - log.time.front();
      for (size_t i = 1; i < log.samples(); ++i) {
        const double dt = log.time[i] - log.time[i - 1], dq = measured.position[i] - measured.position[i - 1];
        squares += dq * dq / dt;
      }
      if (time > 0) scales.speed[j] = std::max(scales.speed[j], std::sqrt(squares / time));
      double sum = 0;
      for (const double torque : measured.torque) sum += torque * torque;
      if (!measured.torque.empty()) {
        scales.torque[j] = std::max(scales.torque[j], std::sqrt(sum / static_cast<double>(measured.torque.size())));
      }
    }
    for (const MeasuredBody& measured : log.bodies) {
      const auto b = static_cast<size_t>(measured.body);
      scales.flying[b] = model.bodies[b].is_free();
    }
  }
  // gravity's largest torque: the weight of all that hangs on the joint at the distance of its centre
  const State state = reference_state(model);
  for (size_t j = 0; j < joints; ++j) {
    const JointFrames frames = joint_frames(model, state, static_cast<int>(j));
    double weight = 0;
    for (size_t b = 0; b < model.bodies.size(); ++b) {
      for (int up = static_cast<int>(b); up != kWorld; up = model.bodies[static_cast<size_t>(up)].parent) {
        if (up != model.joints[j].body) continue;
        const double arm = model.joints[j].is_slide() ? 1 : (state.bodies[b].p_WBcm - frames.p_WJ_child).norm();
        weight += model.bodies[b].mass * arm * model.gravity.norm();
      }
    }
    scales.torque[j] = std::max({scales.torque[j], weight, 1e-6});
    scales.speed[j] = std::max(scales.speed[j], 0.1);
  }
  return scales;
}

std::vector<Parameter> choose_parameters(const Model& model, const ResolvedContender& contender,
                                         const std::vector<FitRequest>& requests, const MotionScales& scales,
                                         std::vector<std::string>& notes) {
  Chooser chooser(model, contender, scales);
  std::vector<Parameter> chosen;
  const bool own = std::ranges::none_of(requests, &FitRequest::fit);
  std::vector<FitRequest> all = own ? default_requests(model, scales) : std::vector<FitRequest>();
  all.insert(all.end(), requests.begin(), requests.end());
  for (const FitRequest& request : all) {
    const Wanted wanted = wanted_of(request);
    const std::vector<Parameter> found = chooser.of(wanted, !wanted.element.empty());
    if (const std::string why = chooser.take_why(); !why.empty() && found.empty() && request.fit) {
      if (!wanted.element.empty() && wanted.kind->of != Of::kSetting) {
        throw InputError(fmt::format("'{}' cannot be fitted: {}", request.parameter, why));
      }
      notes.push_back(fmt::format("'{}' is not fitted: {}", request.parameter, why));
    }
    for (Parameter parameter : found) {
      std::erase_if(chosen, [&](const Parameter& each) { return each.name == parameter.name; });
      if (!request.fit) continue;
      if (request.lower) parameter.lower = *request.lower;
      if (request.upper) parameter.upper = *request.upper;
      if (request.lower || request.upper) check_bounds(request, *wanted.kind, contender, parameter);
      if (parameter.log && parameter.lower <= 0) parameter.log = false, parameter.step *= parameter.nominal;
      if (parameter.lower >= parameter.upper) {
        throw InputError(fmt::format("the bounds of '{}' are {} and {}: the first has to be less", request.parameter,
                                     shortest(parameter.lower), shortest(parameter.upper)));
      }
      const double width = parameter.coordinate(parameter.upper) - parameter.coordinate(parameter.lower);
      if (width < 4) parameter.step *= width / 4;
      chosen.push_back(std::move(parameter));
    }
  }
  return chosen;
}

Mat3 inertia_of(const Body& body, double mass_factor, const std::array<double, 6>& c) {
  // second moment of mass about the centre, S = tr(I)/2 - I; S = L L' with L lower triangular
  const Mat3 S = 0.5 * body.I_BBcm_B.trace() * Mat3::Identity() - body.I_BBcm_B;
  const Mat3 root = S.llt().matrixL();
  Mat3 U;
  U << std::exp(c[0]), c[3], c[4],  //
      0, std::exp(c[1]), c[5],      //
      0, 0, std::exp(c[2]);
  const Mat3 moved = mass_factor * (root * U * U.transpose() * root.transpose());
  return moved.trace() * Mat3::Identity() - moved;
}

Candidate candidate_of(const Model& model, const std::vector<Parameter>& parameters, std::span<const double> values) {
  Candidate candidate;
  const auto change = [&](ChangeKind kind, const std::string& element, std::string value) {
    candidate.changes.push_back({kind, element, std::move(value)});
  };
  const auto exact = [](double number) { return fmt::format("{}", number); };
  // several numbers of one change are gathered
  std::map<std::string, double> mass_factors;
  std::map<std::string, std::array<double, 6>> inertias;
  std::map<std::string, Vec3> centres;
  std::optional<Vec3> gravity;
  for (size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& p = parameters[i];
    const double value = values[i];
    switch (p.kind) {
      case ChangeKind::kMass:
        mass_factors[p.element] = value / p.nominal;
        change(p.kind, p.element, exact(value / p.nominal));
        break;
      case ChangeKind::kInertia:
        inertias[p.element][static_cast<size_t>(p.component)] = value;
        break;
      case ChangeKind::kCentre:
        centres.try_emplace(p.element, Vec3::Zero()).first->second[p.component] = value;
        break;
      case ChangeKind::kGravity:
        if (!gravity) gravity = model.gravity;
        (*gravity)[p.component] = value;
        break;
      case ChangeKind::kGround:
      case ChangeKind::kEncoder:
        change(p.kind, p.element, "+" + exact(value));
        break;
      case ChangeKind::kDelay:
        change(p.kind, "", exact(1e3 * value) + "ms");
        break;
      case ChangeKind::kSet:
        candidate.settings[p.element] = exact(value);
        break;
      case ChangeKind::kGear:
      case ChangeKind::kDriveStiffness:
      case ChangeKind::kDriveDamping:
        change(p.kind, p.element, exact(value));
        break;
      case ChangeKind::kFriction:
        change(p.kind, "", exact(value / p.nominal));
        break;
      default:  // joints' numbers, whatever the model has
        change(p.kind, p.element, "off");
        change(p.kind, p.element, "+" + exact(value));
    }
  }
  for (const auto& [element, centre] : centres) {
    change(ChangeKind::kCentre, element, fmt::format("{},{},{}", centre.x(), centre.y(), centre.z()));
  }
  // a mass that changes takes its inertia along
  for (const auto& [element, unused] : mass_factors) inertias.try_emplace(element);
  for (const auto& [element, coordinates] : inertias) {
    const auto body = std::ranges::find(model.bodies, element, &Body::name);
    const auto mass = mass_factors.find(element);
    const Mat3 I = inertia_of(*body, mass == mass_factors.end() ? 1 : mass->second, coordinates);
    change(ChangeKind::kInertia, element,
           fmt::format("{},{},{},{},{},{}", I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)));
  }
  if (gravity) change(ChangeKind::kGravity, "", fmt::format("{},{},{}", gravity->x(), gravity->y(), gravity->z()));
  return candidate;
}

}  // namespace assay::match
