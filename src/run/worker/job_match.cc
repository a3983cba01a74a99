// Sessions that simulate measured motion: windows of logs, each from its own first state, for one candidate after the
// other.
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "controls/changes/change.h"
#include "controls/log_drive.h"
#include "engines/springs.h"
#include "measures/first_state.h"
#include "model/kinematics.h"
#include "run/worker/failures.h"
#include "run/worker/job_parts.h"
#include "run/worker/stepper.h"

namespace assay::jobs {
namespace {

constexpr size_t kFlightOffset = 12;  // numbers

Vec3 three(const std::vector<double>& numbers, size_t at) { return {numbers[at], numbers[at + 1], numbers[at + 2]}; }

FlightSamples samples_of(const MatchFlight& flight) {
  FlightSamples samples;
  samples.times = flight.times;
  if (flight.times.empty() || flight.positions.size() != 3 * flight.times.size() ||
      flight.rotations.size() != 4 * flight.times.size()) {
    throw SystemError("a window was sent with poses of another number than its times");
  }
  for (size_t i = 0; i < flight.times.size(); ++i) {
    samples.p_WB.push_back(three(flight.positions, 3 * i));
    const double* q = &flight.rotations[4 * i];
    samples.q_WB.push_back(Quat(q[0], q[1], q[2], q[3]).normalized());
  }
  return samples;
}

class MatchSession {
 public:
  explicit MatchSession(const MatchJob& job)
      : job_(job), model_(model_of(job.subject.model)), timestep_s_(1e-3 * job.timestep_ms) {
    contender_of(job.subject.contender);  // for its plugin, and the confinement
    model_.actuators.clear();             // the log says what drives
    model_.control0.clear();
    for (const MatchWindow& window : job_.windows) check(window);
    for (const MatchWindow& window : job_.windows) {
      flights_.emplace_back();
      for (const MatchFlight& flight : window.flights) flights_.back().push_back(samples_of(flight));
    }
  }

  MatchSimulated simulate(const MatchCommand& command) {
    std::vector<RunChange> changes = parse_changes(job_.subject.changes);
    for (const RunChange& change : parse_changes(command.changes)) changes.push_back(change);
    Subject subject;
    subject.model = changed_model(model_, changes);
    ContenderSpec contender = job_.subject.contender;
    for (const auto& [name, value] : command.settings) contender.overrides[name] = value;
    subject.contender = contender_of(contender);
    subject.capabilities = subject.contender.engine->capabilities(subject.contender.settings);
    const std::vector<double> gear = joint_factors(model_, ChangeKind::kGear, changes);
    const std::vector<double> stiffness = joint_factors(model_, ChangeKind::kDriveStiffness, changes);
    const std::vector<double> damping = joint_factors(model_, ChangeKind::kDriveDamping, changes);
    const double delay_s = delay_s_of(changes);

    MatchSimulated simulated;
    if (!command.offsets.empty() && command.offsets.size() != command.windows.size()) {
      throw SystemError("a session was sent offsets of another number than its windows");
    }
    for (size_t w = 0; w < command.windows.size(); ++w) {
      const int index = command.windows[w];
      const auto at = static_cast<size_t>(index);
      if (index < 0 || at >= job_.windows.size())
        throw SystemError("a session was sent a window that it does not have");
      MatchWindow window = job_.windows[at];
      if (!command.offsets.empty()) move_start(window, command.offsets[w]);
      LogDrive drive;
      if (window.drive >= 0) {
        const MatchDrive& logged = job_.drives[static_cast<size_t>(window.drive)];
        drive = {logged.times,   logged.torques, logged.targets, logged.stiffness,
                 logged.damping, gear,           window.start_s, delay_s};
        for (size_t j = 0; j < drive.stiffness.size(); ++j) drive.stiffness[j] *= stiffness[j];
        for (size_t j = 0; j < drive.damping.size(); ++j) drive.damping[j] *= damping[j];
      }
      subject.control = log_control(drive);
      subject.free_running = subject.control->is_zero() && !adapter_adds_torques(subject.model, subject.capabilities);
      MatchRun run;
      try {
        if (simulated.runs.empty()) check_supported(subject, timestep_s_);
        take(subject, window, flights_[at], run, simulated.engine_s);
      } catch (const EngineError& error) {
        run.ending = ended_by(error, Outcome::kDiverged);
      }
      simulated.runs.push_back(std::move(run));
    }
    return simulated;
  }

 private:
  void check(const MatchWindow& window) const {
    const auto joints = model_.joints.size();
    const bool fits = window.position.size() == joints && window.velocity.size() == joints && !window.times.empty() &&
                      std::ranges::is_sorted(window.times) && window.drive < std::ssize(job_.drives);
    const bool bodies = std::ranges::all_of(window.flights, [&](const MatchFlight& flight) {
      return flight.body >= 0 && flight.body < std::ssize(model_.bodies) &&
             (flight.offset.empty() || flight.offset.size() == kFlightOffset);
    });
    if (!fits || !bodies) throw SystemError("a session was sent a window of another model");
  }

  static void move_start(MatchWindow& window, const std::vector<double>& offset) {
    const size_t joints = window.position.size();
    if (offset.size() != 2 * joints) throw SystemError("a session was sent an offset of another number of joints");
    for (size_t j = 0; j < joints; ++j) window.position[j] += offset[j], window.velocity[j] += offset[joints + j];
  }

  static State start_of(const Model& model, const MatchWindow& window, const std::vector<FlightSamples>& flights) {
    State start = model.initial;
    start.time = 0;
    start.position = window.position;
    start.velocity = window.velocity;
    for (size_t i = 0; i < flights.size(); ++i) {
      const auto body = static_cast<size_t>(window.flights[i].body);
      BodyState& state = start.bodies[body];
      state = first_flight(flights[i], model.bodies[body], model.gravity).state;
      const std::vector<double>& offset = window.flights[i].offset;
      if (offset.empty()) continue;
      state.p_WBcm += three(offset, 0);
      state.v_WBcm += three(offset, 3);
      const Vec3 turn = three(offset, 6);
      if (turn.norm() > 0) state.q_WB = Quat(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * state.q_WB;
      state.w_WB += three(offset, 9);
    }
    bodies_from_joints(model, start);
    return start;
  }

  // The samples between states of two steps: positions in a straight line or, of joints, by their rates too.
  static void add_sample(const Model& model, const MatchWindow& window, const State& before, const State& after,
                         double time, std::vector<double>& out) {
    const double h = after.time - before.time, s = h > 0 ? std::clamp((time - before.time) / h, 0.0, 1.0) : 1;
    for (size_t j = 0; j < after.position.size(); ++j) {
      const double p0 = before.position[j], p1 = after.position[j];
      const double m0 = h * before.velocity[j], m1 = h * after.velocity[j];
      out.push_back(p0 + s * (m0 + s * (3 * (p1 - p0) - 2 * m0 - m1 + s * (2 * (p0 - p1) + m0 + m1))));
    }
    for (const MatchFlight& flight : window.flights) {
      const auto body = static_cast<size_t>(flight.body);
      const BodyState &a = before.bodies[body], &b = after.bodies[body];
      BodyState between;
      between.p_WBcm = a.p_WBcm + s * (b.p_WBcm - a.p_WBcm);
      between.q_WB = a.q_WB.slerp(s, b.q_WB);
      const Pose pose = body_pose(model.bodies[body], between);
      out.insert(out.end(), {pose.p.x(), pose.p.y(), pose.p.z(), pose.q.w(), pose.q.x(), pose.q.y(), pose.q.z()});
    }
  }

  void take(const Subject& subject, const MatchWindow& window, const std::vector<FlightSamples>& flights, MatchRun& run,
            double& engine_s) const {
    Stepper stepper(subject, start_of(subject.model, window, flights), timestep_s_);
    State before = stepper.read();
    // times of a simulation are sums of its steps
    const double rounding = 1e-3 * timestep_s_;
    try {
      for (const double time : window.times) {
        const auto steps = static_cast<long long>(std::ceil((time - rounding - stepper.state().time) / timestep_s_));
        if (steps > 1) {
          stepper.advance(steps - 1);
          stepper.read();
        }
        if (steps > 0) {
          before = stepper.state();
          stepper.advance(1);
          stepper.read();
        }
        add_sample(subject.model, window, before, stepper.state(), time, run.samples);
      }
    } catch (const EngineError& error) {
      run.ending = {Outcome::kDiverged, fmt::format("after {:.4g} s: {}", before.time, error.what())};
    }
    engine_s += stepper.engine_s();
  }

  const MatchJob& job_;
  Model model_;
  std::vector<std::vector<FlightSamples>> flights_;  // of each window
  double timestep_s_;
};

}  // namespace

JobDone do_job(const MatchJob& job, const Report& report, const Next& next) {
  MatchSession session(job);
  report(SessionReady{});
  while (const auto command = next()) {
    const auto* candidate = std::get_if<MatchCommand>(&*command);
    if (candidate == nullptr) throw SystemError("a session of measured motion was sent a command of another job");
    report(session.simulate(*candidate));
  }
  return {};
}

}  // namespace assay::jobs
