#include "match/like.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "controls/control.h"
#include "match/evaluator.h"
#include "measures/initial_states.h"
#include "model/kinematics.h"
#include "run/coordinator/pool.h"

namespace assay::match {
namespace {

constexpr double kSampleS = 5e-3;
constexpr double kLimitS = 120;  // of the motions that a worker makes at once

struct Plan {
  int motions = 6;
  double seconds = 4;
  Perturbation around;
};

// A body by itself is thrown: at rest it says nothing.
Plan plan_of(const Model& model) {
  Plan plan;
  if (!model.joints.empty()) return plan;
  plan.motions = 24, plan.seconds = 1;
  plan.around.rotation = 0.5, plan.around.velocity = 1, plan.around.spin = 6;
  return plan;
}

MatchDrive drive_of(const Model& model, const std::vector<double>& times, std::uint64_t seed) {
  MatchDrive drive;
  if (model.joints.empty()) return drive;
  ControlSpec spec;
  spec.kind = "random", spec.seed = static_cast<double>(seed);
  const auto control = make_control(model, spec);
  drive.times = times;
  drive.torques.resize(model.joints.size()), drive.targets.resize(model.joints.size());
  drive.stiffness.resize(model.joints.size()), drive.damping.resize(model.joints.size());
  State state = model.initial;
  std::vector<double> torques(model.joints.size());
  for (const double time : times) {
    state.time = time;
    control->torques(state, torques);
    for (size_t j = 0; j < torques.size(); ++j) drive.torques[j].push_back(torques[j]);
  }
  return drive;
}

MatchFlight flight_of(const Model& model, int body, const State& start) {
  const BodyState& state = start.bodies[static_cast<size_t>(body)];
  const Pose pose = body_pose(model.bodies[static_cast<size_t>(body)], state);
  MatchFlight flight;
  flight.body = body;
  flight.times = {0};  // one sample is at rest: its velocities stand behind it
  flight.positions = {pose.p.x(), pose.p.y(), pose.p.z()};
  flight.rotations = {pose.q.w(), pose.q.x(), pose.q.y(), pose.q.z()};
  const Vec3 &v = state.v_WBcm, &w = state.w_WB;
  flight.offset = {0, 0, 0, v.x(), v.y(), v.z(), 0, 0, 0, w.x(), w.y(), w.z()};
  return flight;
}

}  // namespace

std::vector<MeasuredLog> motions_like(const ModelSpec& spec, const Model& model, const Like& like) {
  std::vector<int> free;
  for (int b = 0; b < std::ssize(model.bodies); ++b) {
    if (model.bodies[static_cast<size_t>(b)].is_free()) free.push_back(b);
  }
  if (free.empty() && model.joints.empty()) {
    throw InputError(
        fmt::format("nothing of '{}' moves by a hinge, a slide or freely: --like has nothing to fit to", model.name));
  }
  const Plan plan = plan_of(model);
  const auto samples = static_cast<size_t>(std::llround(plan.seconds / kSampleS)) + 1;
  std::vector<double> times;
  for (size_t i = 0; i < samples; ++i) times.push_back(kSampleS * static_cast<double>(i));

  MatchJob job;
  job.subject.model = spec;
  job.subject.contender = {like.contender, like.contender, {}};
  job.timestep_ms = like.timestep_ms;
  const InitialStates states{plan.motions + 1, like.seed, plan.around};
  for (int i = 0; i < plan.motions; ++i) {
    State start = initial_state(model, states, i + 1);
    MatchWindow window;
    if (model.joints.empty()) {
      for (const int body : free) {
        double& up = start.bodies[static_cast<size_t>(body)].v_WBcm.z();
        up = 1 + std::abs(up);
      }
    } else {
      window.drive = i;
      job.drives.push_back(drive_of(model, times, like.seed + static_cast<std::uint64_t>(i)));
    }
    window.times = times;
    window.position = start.position, window.velocity = start.velocity;
    window.position.resize(model.joints.size()), window.velocity.resize(model.joints.size());
    for (const int body : free) window.flights.push_back(flight_of(model, body, start));
    job.windows.push_back(std::move(window));
  }
  const std::vector<MatchDrive> drives = job.drives;
  std::vector<size_t> all;
  for (size_t i = 0; i < job.windows.size(); ++i) all.push_back(i);
  const Interrupts interrupts;
  const auto runs = Evaluator(std::move(job), like.jobs, kLimitS, interrupts).simulate({Candidate()}, all).front();

  std::vector<MeasuredLog> logs;
  for (size_t i = 0; i < runs.size(); ++i) {
    const size_t row = model.joints.size() + 7 * free.size();
    if (runs[i].ending.outcome == Outcome::kUnsupported) throw UnsupportedError(runs[i].ending.reason);
    if (runs[i].ending.outcome != Outcome::kOk || runs[i].samples.size() != row * samples) {
      throw EngineError(fmt::format("{} does not come to the end of motion {} of {:g} s: {}; choose another --timestep",
                                    like.contender, i + 1, plan.seconds, runs[i].ending.reason));
    }
    MeasuredLog log;
    log.name = fmt::format("{}/{}", like.contender, i + 1);
    log.source = like.contender;
    log.time = times;
    log.rows = {{times.front(), times.back()}};
    for (size_t s = 0; s < samples; ++s) log.line.push_back(s + 1);
    const auto at = [&](size_t sample, size_t column) { return runs[i].samples[sample * row + column]; };
    for (size_t j = 0; j < model.joints.size(); ++j) {
      MeasuredJoint joint;
      joint.joint = static_cast<int>(j);
      for (size_t s = 0; s < samples; ++s) joint.position.push_back(at(s, j));
      joint.torque = drives[i].torques[j];
      log.joints.push_back(std::move(joint));
    }
    for (size_t f = 0; f < free.size(); ++f) {
      MeasuredBody body;
      body.body = free[f];
      const size_t p = model.joints.size() + 7 * f;
      for (size_t s = 0; s < samples; ++s) {
        body.p_WB.emplace_back(at(s, p), at(s, p + 1), at(s, p + 2));
        Quat q(at(s, p + 3), at(s, p + 4), at(s, p + 5), at(s, p + 6));
        if (!body.q_WB.empty() && q.dot(body.q_WB.back()) < 0) q.coeffs() = -q.coeffs();
        body.q_WB.push_back(q);
      }
      log.bodies.push_back(std::move(body));
    }
    logs.push_back(std::move(log));
  }
  return logs;
}

}  // namespace assay::match
