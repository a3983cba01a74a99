#include "load/start.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "model/couplings.h"
#include "model/kinematics.h"
#include "model/shape.h"

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

using Range = std::pair<double, double>;
constexpr double kAny = std::numeric_limits<double>::infinity();

Range range_of(const Joint& joint) { return joint.limited ? Range(joint.lower, joint.upper) : Range(-kAny, kAny); }

double distance_to(const Range& range, double position) {
  return std::max({range.first - position, position - range.second, 0.0});
}

// A joint that a leader moves. Without another leader its position is `ratio` times the leader's plus `offset`.
struct Follower {
  size_t joint = 0;
  double ratio = 0, offset = 0;
  bool has_other_leader = false;
};

std::vector<std::vector<Follower>> followers_by_leader(const Model& model) {
  const std::vector<bool> leads = leaders(model);
  const auto positions_of_all = [&](const std::vector<double>& of_leaders) {
    std::vector<double> positions = of_leaders;
    std::vector<bool> settled = leads;
    follow(model, settled, positions);
    return positions;
  };
  const size_t count = model.joints.size();
  const std::vector<double> offsets = positions_of_all(std::vector<double>(count));
  std::vector<std::vector<Follower>> followers(count);
  std::vector<int> leaders_of(count);
  for (size_t leader = 0; leader < count; ++leader) {
    if (!leads[leader]) continue;
    std::vector<double> one(count);
    one[leader] = 1;
    const std::vector<double> moved = positions_of_all(one);
    for (size_t j = 0; j < count; ++j) {
      if (j == leader || moved[j] == offsets[j]) continue;
      followers[leader].push_back({j, moved[j] - offsets[j], offsets[j]});
      ++leaders_of[j];
    }
  }
  for (std::vector<Follower>& of_leader : followers) {
    for (Follower& follower : of_leader) follower.has_other_leader = leaders_of[follower.joint] > 1;
  }
  return followers;
}

// The part of the leader's range that keeps each follower in its own, as far as there is one.
Range narrowed(Range leader, const std::vector<Follower>& followers, const std::vector<Range>& ranges) {
  for (const Follower& follower : followers) {
    if (follower.has_other_leader) continue;
    const Range& own = ranges[follower.joint];
    const auto [lower, upper] =
        std::minmax({(own.first - follower.offset) / follower.ratio, (own.second - follower.offset) / follower.ratio});
    if (lower > leader.second || upper < leader.first) continue;
    leader = {std::max(leader.first, lower), std::min(leader.second, upper)};
  }
  return leader;
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
  std::vector<bool> named(model.joints.size());
  std::istringstream lines(text);
  int number = 0;
  for (std::string raw; std::getline(lines, raw);) {
    ++number;
    std::string line = trimmed(raw.substr(0, raw.find('#')));
    if (const size_t equals = line.find('='); equals != std::string::npos) {
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
      if (named[joint - model.joints.begin()]) {
        throw InputError(
            fmt::format("{}:{}: joint '{}' has a position already; remove one of the two", file, number, name));
      }
      model.initial.position[joint - model.joints.begin()] = *value;
      named[joint - model.joints.begin()] = true;
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
  const bool by_name = std::ranges::count(named, true) > 0;
  if (!numbers.empty() && by_name) {
    throw InputError(fmt::format("{}: it mixes numbers and lines JOINT=VALUE; use one of the two forms", file));
  }
  if (by_name) {
    follow(model, named, model.initial.position);
    for (size_t j = 0; j < model.joints.size(); ++j) {
      if (std::isfinite(model.initial.position[j])) continue;
      throw InputError(fmt::format("{}: couplings put joint '{}' at {}; give the position of the joint that leads it",
                                   file, model.joints[j].name, model.initial.position[j]));
    }
  } else {
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
  std::vector<Range> ranges;
  ranges.reserve(model.joints.size());
  for (const Joint& joint : model.joints) ranges.push_back(range_of(joint));
  const std::vector<double> as_written = model.initial.position;
  std::vector<double>& position = model.initial.position;
  const auto starts_beyond = [&](size_t joint) { return distance_to(ranges[joint], as_written[joint]) > kBeyond; };
  const std::vector<std::vector<Follower>> followers = followers_by_leader(model);
  std::vector<bool> settled(position.size(), true), beyond(position.size());
  std::vector<bool> follows(position.size());
  for (const std::vector<Follower>& of_leader : followers) {
    for (const Follower& follower : of_leader) follows[follower.joint] = true;
  }
  for (size_t j = 0; j < position.size(); ++j) {
    if (follows[j]) continue;
    const Range range = narrowed(ranges[j], followers[j], ranges);
    if (distance_to(range, position[j]) > kBeyond) {
      beyond[j] = true;
      position[j] = std::clamp(position[j], range.first, range.second);
    } else if (std::ranges::none_of(followers[j], starts_beyond, &Follower::joint)) {
      continue;
    }
    for (const Follower& follower : followers[j]) {
      settled[follower.joint] = false;
      beyond[follower.joint] = starts_beyond(follower.joint);
    }
  }
  follow(model, settled, position);
  std::vector<Clamped> clamped;
  for (size_t j = 0; j < position.size(); ++j) {
    if (beyond[j] && std::abs(position[j] - as_written[j]) > kBeyond) clamped.push_back({j, as_written[j]});
  }
  if (position != as_written) bodies_from_joints(model, model.initial);
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
