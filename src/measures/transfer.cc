#include "measures/transfer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>

#include "measures/agreement.h"
#include "measures/measure.h"
#include "model/joint.h"
#include "model/shape.h"

namespace assay {
namespace {

struct Sum {
  double total = 0;
  long long count = 0;
  void add(double value) {
    total += value;
    ++count;
  }
  std::optional<double> mean() const {
    return count == 0 ? std::nullopt : std::optional(total / static_cast<double>(count));
  }
};

bool has_fallen(const Model& model, const State& start, const State& state, const TransferTask& task) {
  const bool outside = std::ranges::any_of(task.joints, [&](const TransferTask::JointRange& range) {
    const double position = state.position[static_cast<size_t>(range.joint)];
    return position < range.low || position > range.high;
  });
  if (outside || task.base < 0) return outside;
  const auto base = static_cast<size_t>(task.base);
  const BodyState& body = state.bodies[base];
  const double height = (body.p_WBcm - body.q_WB * model.bodies[base].p_BBcm).z();
  const Vec3 up = body.q_WB * Vec3::UnitZ(), up_then = start.bodies[base].q_WB * Vec3::UnitZ();
  const double tilt = std::atan2(up.cross(up_then).norm(), up.dot(up_then));
  return height < task.fallen_height || tilt > task.fallen_tilt;
}

// Forward, left and turning of the base, in its heading.
Vec3 heading_velocity(const Model& model, const State& state, int base) {
  const BodyState& body = state.bodies[static_cast<size_t>(base)];
  const Vec3 p_BcmB_W = -(body.q_WB * model.bodies[static_cast<size_t>(base)].p_BBcm);
  const Vec3 velocity = body.v_WBcm + body.w_WB.cross(p_BcmB_W);
  const Vec3 forward = body.q_WB * Vec3::UnitX();
  const double yaw = std::atan2(forward.y(), forward.x());
  return {std::cos(yaw) * velocity.x() + std::sin(yaw) * velocity.y(),
          -std::sin(yaw) * velocity.x() + std::cos(yaw) * velocity.y(), body.w_WB.z()};
}

// Where a shape comes nearest to the ground: its own point, the ground's normal there, and the distance.
struct Nearest {
  Vec3 point, normal;
  double distance = 0;  // m; negative within the ground
};

// Of any shape over a plane, and of a sphere over spheres and capsules. Nothing of other pairs, which have no closed
// form.
std::optional<Nearest> nearest(const Model& model, const State& state, const Shape& ground, const Shape& shape) {
  const Pose X_WS = shape_pose(model, state, shape);
  if (is_plane(ground)) {
    const Vec3 normal = ground.X_BS.q * Vec3::UnitZ();
    const Vec3 lowest = X_WS.p - reach(model, shape, X_WS.q.conjugate() * Vec3(-normal)) * normal;
    return Nearest{lowest, normal, normal.dot(lowest - ground.X_BS.p)};
  }
  const auto half = half_segment(ground);
  if (!half || half_segment(shape) != 0.0) return std::nullopt;
  const Vec3 axis = ground.X_BS.q * Vec3::UnitZ(), from = X_WS.p - ground.X_BS.p;
  const Vec3 across = from - std::clamp(axis.dot(from), -*half, *half) * axis;
  if (across.norm() == 0) return std::nullopt;  // centre on centre
  const Vec3 normal = across.normalized();
  return Nearest{X_WS.p - shape.radius * normal, normal, across.norm() - ground.radius - shape.radius};
}

// Calls `visit` with each shape that touches the ground: the pair's place, the body, its lowest point, the ground's
// normal.
template <typename Visit>
void each_touch(const Model& model, const State& state, const Visit& visit) {
  for (size_t i = 0; i < model.contacts.size(); ++i) {
    const ContactPair& pair = model.contacts[i];
    const Shape* ground = &model.shapes[static_cast<size_t>(pair.shape_a)];
    const Shape* shape = &model.shapes[static_cast<size_t>(pair.shape_b)];
    if (ground->body != kWorld) std::swap(ground, shape);
    if (ground->body != kWorld || is_ground(*shape) || shape->body == kWorld) continue;
    const auto found = nearest(model, state, *ground, *shape);
    if (!found || found->distance > kTouching) continue;
    visit(i, state.bodies[static_cast<size_t>(shape->body)], found->point, found->normal);
  }
}

// Speeds of the shapes that touch the ground, along it.
void add_slips(const Model& model, const State& state, Sum& slips) {
  each_touch(model, state, [&](size_t /*pair*/, const BodyState& body, const Vec3& lowest, const Vec3& normal) {
    const Vec3 velocity = body.v_WBcm + body.w_WB.cross(lowest - body.p_WBcm);
    slips.add((velocity - normal.dot(velocity) * normal).norm());
  });
}

std::set<size_t> touches(const Model& model, const State& state) {
  std::set<size_t> pairs;
  each_touch(model, state, [&](size_t pair, const BodyState& /*body*/, const Vec3& /*lowest*/, const Vec3& /*normal*/) {
    pairs.insert(pair);
  });
  return pairs;
}

// The joint that moves bodies apart the most, -1 where a free base does.
int parting_joint(const Model& model, const State& a, const State& b) {
  int joint = -1;
  double most = 0;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    if (model.bodies[i].is_free()) most = std::max(most, (a.bodies[i].p_WBcm - b.bodies[i].p_WBcm).norm());
  }
  for (size_t i = 0; i < model.joints.size(); ++i) {
    const double apart = reach_of_unit(model, b, model.joints[i]) * std::abs(a.position[i] - b.position[i]);
    if (apart > most) {
      most = apart;
      joint = static_cast<int>(i);
    }
  }
  return joint;
}

}  // namespace

Transfer transfer(const Model& model, const std::vector<State>& states, const TransferTask& task, bool ended_early) {
  assert(!states.empty());
  Transfer found;
  Sum velocity, turning, slips;
  const double start_s = states.front().time;
  found.up_s = states.back().time - start_s;
  for (const State& state : states) {
    if (has_fallen(model, states.front(), state, task)) {
      found.fell_at = found.up_s = state.time - start_s;
      break;
    }
    if (task.base >= 0 && !task.command.empty()) {
      const Vec3 is = heading_velocity(model, state, task.base);
      velocity.add(std::hypot(is.x() - task.command[0], is.y() - task.command[1]));
      turning.add(std::abs(is.z() - task.command[2]));
    }
    add_slips(model, state, slips);
  }
  if (!found.fell_at && ended_early) found.fell_at = found.up_s;
  found.velocity_error = velocity.mean();
  found.turning_error = turning.mean();
  found.foot_slip = slips.mean();
  return found;
}

std::optional<FirstParting> first_parting(const Model& model, const std::vector<State>& run,
                                          const std::vector<State>& other) {
  assert(!run.empty() && run.size() == other.size());
  std::vector<double> time;
  time.reserve(run.size());
  for (const State& state : run) time.push_back(state.time - run.front().time);
  std::optional<FirstParting> first;
  std::vector<double> apart(run.size());
  for (size_t body = 0; body < model.bodies.size(); ++body) {
    for (size_t i = 0; i < run.size(); ++i) {
      apart[i] = (run[i].bodies[body].p_WBcm - other[i].bodies[body].p_WBcm).norm();
    }
    const auto parted = parting_time(time, apart);
    if (parted && (!first || *parted < first->time_s)) first = {*parted, static_cast<int>(body), -1, false};
  }
  if (!first) return std::nullopt;
  const auto at = static_cast<size_t>(std::ranges::lower_bound(time, first->time_s) - time.begin());
  const size_t sample = std::min(at, run.size() - 1);
  first->joint = parting_joint(model, run[sample], other[sample]);
  for (const size_t i : {sample, sample > 0 ? sample - 1 : sample}) {
    first->contact = first->contact || touches(model, run[i]) != touches(model, other[i]);
  }
  return first;
}

namespace {

std::string transfer_obstacle(const MeasuredSystem& system) {
  return system.has_policy ? ""
                           : "has no policy, whose runs 'transfer' judges: give control = {kind = \"policy\", config = "
                             "\"policy.toml\"}";
}

constexpr FirstParting kNoParting = {.time_s = 0, .body = -1, .joint = -1, .contact = false};

// FirstParting as samples: a number for each initial state.
std::vector<SampleSeries> parting_samples(double time_s, const FirstParting& first) {
  return {{kPartingTimes, {time_s}},
          {kPartingBodies, {static_cast<double>(first.body)}},
          {kPartingJoints, {static_cast<double>(first.joint)}},
          {kPartingContacts, {first.contact ? 1.0 : 0.0}}};
}

// A run that diverges has fallen then.
Measured transfer_values(const MeasuredRun& run) {
  const std::vector<State>& states = run.states;
  const Transfer found = transfer(run.model, states, *run.task, run.diverged);
  std::vector<Value> values;
  const auto add = [&](const char* name, const char* unit, const std::optional<double>& value) {
    if (value) values.push_back({name, unit, value});
  };
  add("fall_rate", "1", found.fell_at ? 1.0 : 0.0);
  add("time_up", "s", found.up_s);
  add("velocity_error", "m/s", found.velocity_error);
  add("turning_error", "rad/s", found.turning_error);
  add("foot_slip", "m/s", found.foot_slip);
  const double ran_s = states.back().time - states.front().time;
  if (ran_s > 0) add("joint_power", "W", run.work_J / ran_s);
  if (run.policy_steps > 0) add("policy_time", "us", 1e6 * run.policy_s / static_cast<double>(run.policy_steps));
  if (run.other == nullptr || run.other->size() <= 1) {
    return {std::move(values), parting_samples(kNotCompared, kNoParting)};
  }
  std::vector<double> time;
  const size_t count = std::min(states.size(), run.other->size());
  time.reserve(count);
  for (size_t i = 0; i < count; ++i) time.push_back(states[i].time - states.front().time);
  const auto beginning = [&](const std::vector<State>& of) {
    return std::vector<State>(of.begin(), of.begin() + static_cast<std::ptrdiff_t>(count));
  };
  const std::vector<State> own = beginning(states), other = beginning(*run.other);
  const auto parted = parting_time(time, distances(own, other));
  // a run that failed has parted then
  add("policy_parting_time", "s", parted.value_or(count < states.size() ? run.duration_s : time.back()));
  const auto first = first_parting(run.model, own, other);
  return {std::move(values), parting_samples(first ? first->time_s : kNeverParted, first.value_or(kNoParting))};
}

}  // namespace

Measure transfer_measure() {
  using namespace rows;
  return {
      .name = "transfer",
      .reads = Reads::kRunPairs,
      .version = 3,  // touches of the world's spheres and capsules
      .values =
          {{"fall_rate", "1", "Fall rate", "fall rate", kLow, kNo, kLimit,
            "share of the runs under a policy in which the robot fell, or the engine failed", 7, kShare},
           {"time_up", "s", "Time until a fall", "time up", kHigh, kNo, kNo,
            "time until the robot fell under its policy, or the run's length", 7, kMeanOfAll},
           {"velocity_error", "m/s", "Velocity error", "velocity error", kLow, kNo, kLimit,
            "mean distance of the base's planar velocity from the commanded one, in its heading, while the robot is up",
            7, kMeanOfAll},
           {"turning_error", "rad/s", "Turning error", "turning error", kLow, kNo, kLimit,
            "mean distance of the base's rate about the vertical from the commanded one while the robot is up", 7,
            kMeanOfAll},
           {"foot_slip", "m/s", "Foot slip", "foot slip", kLow, kNo, kLimit,
            "mean speed along the ground of the shapes' points that touch it, while the robot is up", 7, kMeanOfAll},
           {"joint_power", "W", "Joint power", "joint power", kNone, kNo, kNo,
            "mean over the run of the sum over joints of |torque x rate|, of the torques that the policy asked for", 7,
            kMeanOfAll},
           {"policy_time", "us", "Policy time", "policy time", kNone, kNo, kNo,
            "wall time of a control step of the policy, outside the engine's clock, beside other workers", 7,
            kMeanOfAll},
           {"policy_parting_time", "s", "Separation time from training", "separation from training", kHigh, kNo, kNo,
            "time until the run is more than 1 mm from that of the contender that the policy was trained in", 7,
            kMeanOfAll}},
      .obstacle = transfer_obstacle,
      .of_run = transfer_values,
      .of_failed_runs = true,
      .without_run = parting_samples(kNotCompared, kNoParting)};
}

}  // namespace assay
