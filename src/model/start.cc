#include "model/start.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "model/extent.h"
#include "model/kinematics.h"

namespace assay {
namespace {

std::string trimmed(const std::string& text) {
  const size_t begins = text.find_first_not_of(" \t\r");
  return begins == std::string::npos ? "" : text.substr(begins, text.find_last_not_of(" \t\r") - begins + 1);
}

Quat unit_quaternion(const double* q, const std::string& file, const std::string& body) {
  const Quat result(q[0], q[1], q[2], q[3]);
  if (result.norm() < 1e-6) {
    throw InputError(fmt::format("{}: the quaternion of body '{}' is zero; give w x y z of a rotation", file, body));
  }
  return result.normalized();
}

// How many numbers MuJoCo's qpos has.
size_t qpos_size(const Model& model) {
  size_t size = 0;
  for (const Body& body : model.bodies) {
    const size_t of_joint = body.ball >= 0 ? 4 : 1;
    size += body.is_free() ? 7 : of_joint;
  }
  return size;
}

void set_qpos(Model& model, const std::vector<double>& qpos, const std::string& file) {
  State& state = model.initial;
  const double* q = qpos.data();
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    BodyState& s = state.bodies[i];
    if (body.joint >= 0) {
      state.position[body.joint] = *q++;
    } else if (body.is_free()) {
      s.q_WB = unit_quaternion(q + 3, file, body.name);
      s.p_WBcm = Vec3(q[0], q[1], q[2]) + s.q_WB * body.p_BBcm;
      q += 7;
    } else {
      // the parent's pose is needed, and its body comes first
      const Quat relative = unit_quaternion(q, file, body.name);
      bodies_from_joints(model, state);
      const Quat q_WP = body.parent == kWorld ? Quat(Quat::Identity()) : state.bodies[body.parent].q_WB;
      s.q_WB = q_WP * body.X_PB.q * relative;
      q += 4;
    }
  }
}

}  // namespace

void start_from(Model& model, const std::string& text, const std::string& file) {
  State state = reference_state(model);
  state.position = model.initial.position;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    state.bodies[i].p_WBcm = model.initial.bodies[i].p_WBcm;
    state.bodies[i].q_WB = model.initial.bodies[i].q_WB;
  }
  model.initial = state;

  std::vector<double> numbers;
  bool named = false;
  std::istringstream lines(text);
  int number = 0;
  for (std::string raw; std::getline(lines, raw);) {
    ++number;
    std::string line = trimmed(raw.substr(0, raw.find('#')));
    if (const size_t equals = line.find('='); equals != std::string::npos) {
      named = true;
      const std::string name = trimmed(line.substr(0, equals));
      const auto value = parse_number(trimmed(line.substr(equals + 1)));
      if (!value) throw InputError(fmt::format("{}:{}: '{}' is not a number; write JOINT=VALUE", file, number, line));
      const auto joint = std::ranges::find(model.joints, name, &Joint::name);
      if (joint == model.joints.end()) {
        std::vector<std::string> names;
        names.reserve(model.joints.size());
        for (const Joint& j : model.joints) names.push_back(j.name);
        throw InputError(fmt::format("{}:{}: the model has no hinge or slide '{}'{}", file, number, name,
                                     did_you_mean(name, names)));
      }
      model.initial.position[joint - model.joints.begin()] = *value;
      continue;
    }
    std::ranges::replace(line, ',', ' ');
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      const auto value = parse_number(word);
      if (!value) {
        throw InputError(fmt::format("{}:{}: '{}' is not a finite number; give MuJoCo's qpos, or lines JOINT=VALUE",
                                     file, number, word));
      }
      numbers.push_back(*value);
    }
  }
  if (!numbers.empty() && named) {
    throw InputError(fmt::format("{}: it mixes numbers and lines JOINT=VALUE; use one of the two forms", file));
  }
  if (!named) {
    if (numbers.size() != qpos_size(model)) {
      throw InputError(
          fmt::format("{}: it has {} numbers, and the qpos of '{}' has {}; give all of them, or lines "
                      "JOINT=VALUE",
                      file, numbers.size(), model.name, qpos_size(model)));
    }
    set_qpos(model, numbers, file);
  }
  bodies_from_joints(model, model.initial);
}

std::vector<Clamped> start_within_limits(Model& model) {
  constexpr double kBeyond = 1e-3;  // rad, m
  using Range = std::pair<double, double>;
  constexpr double kAny = std::numeric_limits<double>::infinity();
  std::vector<Range> ranges;
  ranges.reserve(model.joints.size());
  for (const Joint& joint : model.joints) {
    ranges.push_back(joint.limited ? Range(joint.lower, joint.upper) : Range(-kAny, kAny));
  }
  // A joint that one other moves narrows that one's range, unless no position satisfies both.
  for (const Coupling& coupling : model.couplings) {
    const Range own = ranges[static_cast<size_t>(coupling.joint)];
    ranges[static_cast<size_t>(coupling.joint)] = {-kAny, kAny};
    if (coupling.terms.size() != 1) continue;
    const JointTerm& term = coupling.terms.front();
    Range& leader = ranges[static_cast<size_t>(term.joint)];
    const auto [lower, upper] = std::minmax(
        {(own.first - coupling.offset) / term.coefficient, (own.second - coupling.offset) / term.coefficient});
    if (lower <= leader.second && upper >= leader.first) {
      leader = {std::max(leader.first, lower), std::min(leader.second, upper)};
    }
  }
  std::vector<double>& position = model.initial.position;
  std::vector<Clamped> clamped;
  for (size_t j = 0; j < position.size(); ++j) {
    const double within = std::clamp(position[j], ranges[j].first, ranges[j].second);
    if (std::abs(within - position[j]) <= kBeyond) continue;
    clamped.push_back({j, position[j]});
    position[j] = within;
  }
  if (clamped.empty()) return clamped;
  for (const Coupling& coupling : model.couplings) {
    position[static_cast<size_t>(coupling.joint)] = coupling.offset + sum_of_terms(coupling.terms, position);
  }
  bodies_from_joints(model, model.initial);
  return clamped;
}

std::vector<double> lowest_points(const Model& model) {
  std::vector<double> lowest(model.bodies.size() + 1, std::numeric_limits<double>::infinity());
  for (const Shape& shape : model.shapes) {
    if ((!shape.collides && shape.body != kWorld) || is_ground(shape)) continue;
    const Pose X_WS = shape_pose(model, model.initial, shape);
    double& own = shape.body == kWorld ? lowest.back() : lowest[shape.body];
    own = std::min(own, X_WS.p.z() - reach(model, shape, X_WS.q.conjugate() * -Vec3::UnitZ()));
  }
  return lowest;
}

double lowest_point(const Model& model) {
  const double lowest = std::ranges::min(lowest_points(model));
  return std::isfinite(lowest) ? lowest : 0;
}

void put_under(Model& model, const std::string& name) {
  const auto plane = std::ranges::find(model.shapes, name, &Shape::name);
  plane->X_BS.p.z() = lowest_point(model);
}

void remove_planes(Model& model) {
  std::vector<int> kept(model.shapes.size(), -1);
  std::vector<Shape> shapes;
  for (size_t i = 0; i < model.shapes.size(); ++i) {
    if (model.shapes[i].type == ShapeType::kPlane) continue;
    kept[i] = static_cast<int>(shapes.size());
    shapes.push_back(model.shapes[i]);
    shapes.back().collides = false;
  }
  std::vector<ContactPair> contacts;
  for (ContactPair pair : model.contacts) {
    pair.shape_a = kept[pair.shape_a];
    pair.shape_b = kept[pair.shape_b];
    if (pair.shape_a < 0 || pair.shape_b < 0) continue;
    shapes[pair.shape_a].collides = shapes[pair.shape_b].collides = true;
    contacts.push_back(pair);
  }
  model.shapes = std::move(shapes);
  model.contacts = std::move(contacts);
}

}  // namespace assay
