// What drives the joints.
#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "base/text.h"
#include "check/pairing/align.h"
#include "check/pairing/drafts.h"

namespace assay::pairing {
namespace {

std::set<int> joints_of(const Actuator& actuator) {
  std::set<int> joints;
  for (const JointTerm& term : actuator.terms) joints.insert(term.joint);
  return joints;
}

const char* unit_of_force(const Model& model, const Actuator& actuator) {
  return model.joints[static_cast<size_t>(actuator.terms[0].joint)].is_slide() ? "N" : "Nm";
}

// The largest force with which actuators of its own can drive a joint, Nm or N; infinite without a bound.
double effort(const Model& model, int joint) {
  double sum = 0;
  for (const Actuator& actuator : model.actuators) {
    if (actuator.terms.size() != 1 || actuator.terms[0].joint != joint) continue;
    double most = std::numeric_limits<double>::infinity();
    if (actuator.force_limited) most = std::max(std::abs(actuator.force_lower), std::abs(actuator.force_upper));
    if (actuator.control_limited && !actuator.has_feedback() && !actuator.has_activation()) {
      const double control = std::max(std::abs(actuator.control_lower), std::abs(actuator.control_upper));
      most = std::min(most, std::abs(actuator.gain) * control);
    }
    sum += std::abs(actuator.terms[0].coefficient) * most;
  }
  return sum;
}

bool drives(const Model& model, int joint) {
  return std::ranges::any_of(model.actuators,
                             [joint](const Actuator& actuator) { return joints_of(actuator).contains(joint); });
}

// Efforts alone, where one file has no drives.
void compare_efforts(const Aligned& models, Comparison& out, std::vector<Draft>& drafts) {
  std::vector<std::string> driven_once;
  for (size_t j = 0; j < models.a.joints.size(); ++j) {
    const Joint& joint = models.a.joints[j];
    const auto index = static_cast<int>(j);
    const bool in_a = drives(models.a, index), in_b = drives(models.b, index);
    if (in_a != in_b) driven_once.push_back(fmt::format("'{}' (in {})", joint.name, in_a ? "A" : "B"));
    if (!in_a || !in_b) continue;
    const double a = effort(models.a, index), b = effort(models.b, index);
    if (std::isinf(a) && std::isinf(b)) continue;
    const char* unit = joint.is_slide() ? "N" : "Nm";
    Draft draft{
        .difference = {.element = fmt::format("joint '{}'", joint.name), .parameter = "effort limit", .unit = unit}};
    if (std::isinf(a) || std::isinf(b)) {
      // one has none: most often the file leaves it open
      out.format_findings.push_back(
          {draft.difference.element,
           fmt::format("an effort limit of {:.5g} {} in {} alone", std::min(a, b), unit, std::isinf(b) ? "A" : "B")});
      continue;
    }
    if (!differ(a, b)) continue;
    draft.difference.a = a, draft.difference.b = b;
    draft.difference.words = instead(a, b, unit);
    draft.difference.effect = relative(a, b);
    drafts.push_back(std::move(draft));
  }
  if (!driven_once.empty()) {
    out.format_findings.push_back(
        {counted(driven_once.size(), "joint"), "driven in one file alone: " + join(driven_once, ", ")});
  }
}

}  // namespace

std::vector<int> match_actuators(const Model& a, const Model& b,
                                 const std::vector<std::pair<std::string, std::string>>& map) {
  std::vector<int> b_of(a.actuators.size(), -1);
  std::vector<bool> taken(b.actuators.size());
  const auto match_where = [&](const auto& fits) {
    for (size_t i = 0; i < a.actuators.size(); ++i) {
      for (size_t j = 0; j < b.actuators.size() && b_of[i] < 0; ++j) {
        if (!taken[j] && fits(a.actuators[i], b.actuators[j])) b_of[i] = static_cast<int>(j), taken[j] = true;
      }
    }
  };
  const auto same_joints = [](const Actuator& x, const Actuator& y) { return joints_of(x) == joints_of(y); };
  const auto same_law = [](const Actuator& x, const Actuator& y) {
    return (x.bias[1] != 0) == (y.bias[1] != 0) && (x.bias[2] != 0) == (y.bias[2] != 0) && x.activation == y.activation;
  };
  match_where([&](const Actuator& x, const Actuator& y) {
    return std::ranges::find(map, std::pair(x.name, y.name)) != map.end();
  });
  match_where([&](const Actuator& x, const Actuator& y) { return x.name == y.name && same_joints(x, y); });
  match_where([&](const Actuator& x, const Actuator& y) { return same_joints(x, y) && same_law(x, y); });
  match_where(same_joints);
  return b_of;
}

void compare_actuators(const Side& side_a, const Side& side_b, const Aligned& models,
                       const std::vector<std::pair<std::string, std::string>>& map, Comparison& out,
                       std::vector<Draft>& drafts) {
  if (!side_a.format.drives || !side_b.format.drives) {
    if (side_a.format.drives || side_b.format.drives) {
      out.format_findings.push_back(
          {"drives", fmt::format("{} has none, so that gains are not compared",
                                 side_a.format.drives ? side_b.format.name : side_a.format.name)});
    }
    compare_efforts(models, out, drafts);
    return;
  }
  const std::vector<int> b_of = match_actuators(models.a, models.b, map);
  std::vector<bool> taken(models.b.actuators.size());
  for (size_t i = 0; i < b_of.size(); ++i) {
    const Actuator& a = models.a.actuators[i];
    const std::string element = fmt::format("actuator '{}'", a.name);
    if (b_of[i] < 0) {
      out.findings.push_back({element, "only in A"});
      continue;
    }
    taken[static_cast<size_t>(b_of[i])] = true;
    const Actuator& b = models.b.actuators[static_cast<size_t>(b_of[i])];
    const bool given = std::ranges::find(map, std::pair(a.name, b.name)) != map.end();
    out.matches.push_back({"actuator", a.name, b.name,
                           given              ? How::kMap
                           : a.name == b.name ? How::kName
                                              : How::kStructure});
    const auto add = [&](const char* parameter, double of_a, double of_b, const std::string& unit, double scale = 0) {
      if (!differ(of_a, of_b)) return;
      Difference d{.element = element, .parameter = parameter, .unit = unit, .a = of_a, .b = of_b};
      d.words = instead(of_a, of_b, unit);
      d.effect = scale > 0 ? std::abs(of_b - of_a) / scale : relative(of_a, of_b);
      drafts.push_back({.difference = d});
    };
    const char* force = unit_of_force(models.a, a);
    for (const JointTerm& term : a.terms) {
      const auto other = std::ranges::find(b.terms, term.joint, &JointTerm::joint);
      if (other != b.terms.end()) add("gear", term.coefficient, other->coefficient, "");
    }
    const auto is_position = [](const Actuator& x) { return x.bias[1] != 0 && !differ(x.gain, -x.bias[1]); };
    const auto is_velocity = [](const Actuator& x) {
      return x.bias[1] == 0 && x.bias[2] != 0 && !differ(x.gain, -x.bias[2]);
    };
    const bool is_slide = force == std::string("N");
    if (is_position(a) && is_position(b)) {
      add("position gain (kp)", a.gain, b.gain, is_slide ? "N/m" : "Nm/rad");
      add("velocity gain (kv)", -a.bias[2], -b.bias[2], is_slide ? "N s/m" : "Nm s/rad");
    } else if (is_velocity(a) && is_velocity(b)) {
      add("velocity gain (kv)", a.gain, b.gain, is_slide ? "N s/m" : "Nm s/rad");
    } else {
      add("gain", a.gain, b.gain, "");
      add("feedback of position", a.bias[1], b.bias[1], is_slide ? "N/m" : "Nm/rad");
      add("feedback of velocity", a.bias[2], b.bias[2], is_slide ? "N s/m" : "Nm s/rad");
    }
    add("constant force", a.bias[0], b.bias[0], force);
    const auto range = [&](const char* what, bool in_a, bool in_b, double lower_a, double upper_a, double lower_b,
                           double upper_b, const std::string& unit) {
      if (in_a != in_b) {
        Difference d{.element = element, .parameter = what, .unit = unit};
        const auto text = [&](bool limited, double lower, double upper) {
          return limited ? fmt::format("{:.5g} to {:.5g}{}{}", lower, upper, unit.empty() ? "" : " ", unit) : "none";
        };
        d.words = fmt::format("{} instead of {}", text(in_b, lower_b, upper_b), text(in_a, lower_a, upper_a));
        d.effect = 1;
        drafts.push_back({.difference = d});
      } else if (in_a) {
        const double scale = std::max(std::abs(lower_a), std::abs(upper_a));
        add(fmt::format("{}, lower", what).c_str(), lower_a, lower_b, unit, scale);
        add(fmt::format("{}, upper", what).c_str(), upper_a, upper_b, unit, scale);
      }
    };
    range("force range", a.force_limited, b.force_limited, a.force_lower, a.force_upper, b.force_lower, b.force_upper,
          force);
    range("control range", a.control_limited, b.control_limited, a.control_lower, a.control_upper, b.control_lower,
          b.control_upper, "");
    if (a.activation != b.activation) {
      Difference d{.element = element, .parameter = "activation", .words = "of another kind", .effect = 1};
      drafts.push_back({.difference = d});
    } else if (a.activation == ActivationType::kFilter) {
      add("time constant", a.time_constant, b.time_constant, "s");
    }
    if (a.has_activation() && b.has_activation()) {
      range("activation range", a.activation_limited, b.activation_limited, a.activation_lower, a.activation_upper,
            b.activation_lower, b.activation_upper, "");
    }
  }
  for (size_t j = 0; j < taken.size(); ++j) {
    if (!taken[j]) out.findings.push_back({fmt::format("actuator '{}'", models.b.actuators[j].name), "only in B"});
  }
}

}  // namespace assay::pairing
