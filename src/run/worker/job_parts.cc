#include "run/worker/job_parts.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>

#include <fmt/format.h>

#include "base/errors.h"
#include "controls/changes/change.h"
#include "controls/engine_actuators.h"
#include "controls/work.h"
#include "engines/springs.h"
#include "load/mjcf.h"
#include "measures/plausible.h"
#include "run/worker/confinement.h"

namespace assay::jobs {

double cpu_seconds() {
  timespec time{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

ResolvedContender contender_of(const ContenderSpec& contender) {
  confine_engine();
  ResolvedContender resolved = Registry::instance().resolve(contender.base, contender.overrides);
  resolved.name = contender.name;
  return resolved;
}

Model model_of(const ModelSpec& spec) {
  Model model = variant_of(load_model(spec.path, spec.load), spec.variant);
  if (model.hash != spec.hash) {
    throw InputError(fmt::format("'{}' has changed since the campaign was read: start it again", spec.path));
  }
  return model;
}

Subject subject_of(const SubjectSpec& spec) {
  Subject subject;
  subject.model = model_of(spec.model);
  const std::vector<RunChange> changes = parse_changes(spec.changes);
  subject.control = changed_control(subject.model, spec.control, changes);
  if (!changes.empty()) {
    subject.unchanged = subject.model;
    subject.model = changed_model(std::move(subject.model), changes);
  }
  subject.contender = contender_of(spec.contender);
  subject.capabilities = subject.contender.engine->capabilities(subject.contender.settings);
  subject.engine_drives = equip_for(subject.capabilities.actuators, *subject.control, subject.model);
  subject.free_running = (subject.engine_drives || subject.control->is_zero()) &&
                         !adapter_adds_torques(subject.model, subject.capabilities);
  subject.states = spec.states;
  subject.pushes = spec.pushes;
  return subject;
}

void check_supported(const Subject& subject, double timestep_s) {
  if (!subject.control->is_zero() && !subject.capabilities.torques) {
    throw UnsupportedError("the engine takes no joint torques");
  }
  Settings settings = subject.contender.settings;
  settings.timestep = timestep_s;
  subject.contender.engine->require_supported(subject.model, settings);
}

JobDone job_done(std::vector<CellResult> cells, double engine_s) {
  return {.cells = std::move(cells), .engine_s = engine_s, .cpu_s = cpu_seconds()};
}

namespace {

// Of a sample's steps the contacts of this many, evenly spread, are read: all of them where a step is not far shorter
// than a sample. Impacts last a step, so one look a sample would leave them to chance.
constexpr long long kLooks = 16;

// Takes the steps between two samples and adds the contacts of some.
class ContactLooks {
 public:
  ContactLooks(const Subject& subject, double timestep_s)
      : sums_(subject.model, timestep_s, subject.capabilities.contact_forces == ContactForces::kAll) {}

  // `share` of a sample's looks are due.
  void advance(Stepper& stepper, long long steps, double share) {
    const long long looks = std::min(steps, static_cast<long long>(std::ceil(share * kLooks)));
    long long done = 0;
    for (long long look = 1; look <= looks; ++look) {
      const long long end = steps * look / looks;
      if (end - 1 > done) stepper.advance(end - 1 - done);
      before_ = stepper.read();
      stepper.advance(1);
      done = end;
      stepper.read_contacts(found_);
      points_.clear();
      for (const ContactForce& contact : found_) {
        points_.push_back({contact.shape_a, contact.shape_b, contact.p_W, contact.n_W, contact.gap, contact.impulse_W});
      }
      if (!points_.empty()) sums_.add(before_, stepper.read(), points_);
    }
  }

  std::optional<ContactResiduals> residuals() const { return sums_.residuals(); }

 private:
  ContactSums sums_;
  State before_;
  std::vector<ContactForce> found_;
  std::vector<ContactPoint> points_;
};

}  // namespace

Run run_sampled(const Subject& subject, const State& start, double timestep_ms, long long samples, long long per_sample,
                const Looks& asked, const std::vector<Push>& pushes) {
  const long long steps = per_sample;
  const double timestep_s = 1e-3 * timestep_ms;
  const double duration_s = timestep_s * static_cast<double>(samples * steps);
  const double work = largest_work(subject.model, *subject.control, duration_s);
  std::optional<Plausibility> plausibility;
  const Arithmetic arithmetic = arithmetic_of(subject.capabilities, timestep_s);
  plausibility.emplace(subject.model, start, duration_s, work, arithmetic);
  auto push = pushes.begin();
  Run run;
  Stepper stepper(subject, start, timestep_s);
  run.trajectory.states.reserve(static_cast<size_t>(samples) + 1);
  run.trajectory.states.push_back(stepper.read());
  std::optional<ContactLooks> looks;
  if (asked.contacts && stepper.keep_contacts()) looks.emplace(subject, timestep_s);
  std::optional<Watch> watch;
  if (asked.between) watch.emplace(subject.model, stepper.state(), *asked.between);
  const long long block = watch || asked.instants ? std::min(steps, watch_steps(timestep_ms)) : steps;
  if (asked.instants) run.instants.push_back(stepper.state());
  std::string impossible;
  for (long long sample = 1; sample <= samples; ++sample) {
    const double time = start.time + timestep_s * static_cast<double>(sample * steps);
    std::string why;
    const State& state = stepper.state();
    for (long long done = 0; done < steps && why.empty(); done += block) {
      const long long now = std::min(block, steps - done);
      const double cpu_before = cpu_seconds(), engine_before = stepper.engine_s();
      try {
        if (looks) {
          looks->advance(stepper, now, static_cast<double>(now) / static_cast<double>(steps));
        } else {
          stepper.advance(now);
        }
      } catch (const EngineError& error) {
        why = error.what();
      }
      // With torques at each step, or contacts that are read, only the wall clock is cheap enough to measure the
      // engine's part.
      const double cpu_s = cpu_seconds() - cpu_before;
      const bool only_steps = subject.free_running && !looks;
      run.engine_s += only_steps ? cpu_s : std::min(cpu_s, stepper.engine_s() - engine_before);
      try {
        if (why.empty()) stepper.read();
      } catch (const EngineError& error) {
        why = error.what();
      }
      if (why.empty()) why = plausibility->divergence(state);
      if (why.empty() && watch) watch->look(state);
      if (why.empty() && asked.instants) run.instants.push_back(state);
    }
    if (!why.empty()) {
      run.ending = {Outcome::kDiverged, fmt::format("by {:.4g} s: {}", time, why)};
      break;
    }
    if (impossible.empty()) {
      impossible = plausibility->impossibility(state);
      if (!impossible.empty()) impossible = fmt::format("at {:.4g} s: {}", time, impossible);
    }
    run.trajectory.states.push_back(state);
    if (push == pushes.end() || sample == samples || push->time_s > time - start.time + 0.5 * timestep_s) continue;
    try {
      const State from = pushed(subject.model, state, subject.pushes, *push++);
      // a push brings energy with it
      plausibility.emplace(subject.model, from, duration_s - (time - start.time), work, arithmetic);
      stepper.restart(from);
    } catch (const EngineError& error) {
      run.ending = {Outcome::kDiverged, fmt::format("by {:.4g} s, after a push: {}", time, error.what())};
      break;
    }
  }
  run.account = stepper.account();
  if (run.ending.outcome == Outcome::kOk && !impossible.empty()) run.ending = {Outcome::kUnstable, impossible};
  if (looks) run.contacts = looks->residuals();
  if (watch) run.watched = watch->watched(asked.seed);
  return run;
}

namespace {

// The coordinator examined the file a moment ago. The next start computes it again.
[[noreturn]] void refuse(const std::string& dir, const std::string& address, const std::string& fault) {
  std::error_code error;
  std::filesystem::remove(trajectory_path(dir, address), error);
  throw SystemError(fmt::format("the trajectory '{}' {} and was removed: start the same command again",
                                trajectory_path(dir, address), fault));
}

}  // namespace

void save_watched(const std::string& dir, const std::string& address, const Watched& watched) {
  State numbers;
  numbers.bodies.resize(1);  // a file of states without bodies is a damaged one
  numbers.position = watched.numbers();
  numbers.velocity.resize(numbers.position.size());
  save(dir, address, {{numbers}});
}

std::optional<Watched> load_watched(const std::string& dir, const std::string& address) {
  const auto kept = read_trajectory(dir, address);
  if (!kept || kept->states.size() != 1) return std::nullopt;
  return Watched::of(kept->states.front().position);
}

void save(const std::string& dir, const std::string& address, const Trajectory& trajectory) {
  if (!has_trajectory(dir, address)) write_trajectory(dir, address, trajectory);
}

Trajectory load(const std::string& dir, const std::string& address) {
  std::string fault = trajectory_fault(dir, address);
  auto trajectory = read_trajectory(dir, address);
  if (fault.empty() && !trajectory) fault = "is missing";
  if (fault.empty() && trajectory && trajectory->states.empty()) fault = "has no states";
  if (!fault.empty() || !trajectory) refuse(dir, address, fault);
  return *std::move(trajectory);
}

Trajectory load(const std::string& dir, const std::string& address, size_t bodies, size_t joints) {
  Trajectory trajectory = load(dir, address);
  const std::string fault = state_shape_fault(trajectory.states.front(), bodies, joints);
  if (!fault.empty()) refuse(dir, address, "is another system's (it has " + fault + ")");
  return trajectory;
}

Trajectory load(const std::string& dir, const std::string& address, const Model& model, long long states) {
  Trajectory trajectory = load(dir, address, model.bodies.size(), model.joints.size());
  if (states > 0 && std::ssize(trajectory.states) != states) {
    refuse(dir, address, fmt::format("has {} states and not {}", trajectory.states.size(), states));
  }
  return trajectory;
}

}  // namespace assay::jobs
