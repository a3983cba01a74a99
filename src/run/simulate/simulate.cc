#include "run/simulate/simulate.h"

#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <unistd.h>

#include <fmt/format.h>

#include "base/console.h"
#include "base/csv.h"
#include "base/errors.h"
#include "base/exit_status.h"
#include "base/output_file.h"
#include "base/text.h"
#include "controls/policy.h"
#include "controls/work.h"
#include "engines/engine_files.h"
#include "isolate/activity.h"
#include "isolate/contained.h"
#include "isolate/guarded_child.h"
#include "isolate/interruption.h"
#include "isolate/processes.h"
#include "isolate/sandbox.h"
#include "measures/plausible.h"
#include "model/state_faults.h"
#include "results/store/state_rows.h"

namespace assay {
namespace {

using RunClock = std::chrono::steady_clock;

std::string progress_text(const SimulateJob& job, long long step, std::chrono::duration<double> elapsed) {
  const double share = static_cast<double>(step) / static_cast<double>(job.steps);
  return fmt::format("{} on {}: {:.0f} % ({:.6g} of {:.6g} s), {} left", job.contender.name, job.model.name,
                     100 * share, share * job.duration_s, job.duration_s,
                     duration_label(elapsed.count() * (1 - share) / share));
}

// Within a catch block: what was thrown, whatever its type.
std::string caught_text() {
  try {
    throw;
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "an exception that is not a std::exception";
  }
}

// The simulation at its start. What an engine throws says with which contender.
std::unique_ptr<Simulation> created(const SimulateJob& job) {
  try {
    return job.contender.engine->create(job.model, job.model.initial, job.contender.settings);
  } catch (const InputError&) {
    throw;  // of a setting, with how to mend it
  } catch (...) {
    throw EngineError(fmt::format("{} failed before its first step: {}", job.contender.name, caught_text()));
  }
}

// Steps the engine to the end, to its failure or to an interruption. Every sample is in the file before the next
// begins; `finish` gives it its name at the end.
int step_through(const SimulateJob& job, bool time, OutputFile& file, const std::function<void()>& finish) {
  const Model& model = job.model;
  const auto simulation = created(job);
  const Control& control = *job.control;
  const auto driven = control.start(1e-3 * job.timestep_ms);
  const Plausibility plausibility(model, model.initial, job.duration_s, largest_work(model, control, job.duration_s));
  const bool feedback = !job.engine_drives && control.input() != ControlInput::kNothing;
  std::vector<double> torques(model.joints.size());
  std::vector<std::string> names;
  names.reserve(model.bodies.size());
  const bool shown = is_terminal(file.path());
  for (const Body& body : model.bodies) names.push_back(csv_field(shown ? printable(body.name) : body.name));

  State state;
  fmt::memory_buffer text;
  const auto seconds = [&](long long step) {
    return step == job.steps ? job.duration_s : static_cast<double>(step) * job.timestep_ms / 1000;
  };
  const auto write_sample = [&](long long step) {
    text.clear();
    // the nominal time, because an engine's own sum of timesteps has rounding errors
    append_state_rows(names, seconds(step), state, text);
    file.write({text.data(), text.size()});
  };

  // A state of another size or time has no place in the table; one whose values cannot be has diverged.
  const auto read_state = [&](long long step) {
    simulation->read_state(state);
    const std::string shape = state_shape_fault(state, model.bodies.size(), model.joints.size());
    if (!shape.empty()) throw std::runtime_error(fmt::format("the engine gave {}", shape));
    const std::string value = state_value_fault(state, &model);
    if (!value.empty()) return fmt::format("{} gave {}", job.contender.name, value);
    const std::string moment = state_time_fault(state, model.initial.time, job.contender.settings.timestep, step);
    if (!moment.empty()) throw std::runtime_error(fmt::format("the engine gave {}", moment));
    return std::string();
  };
  if (const std::string fault = read_state(0); !fault.empty()) throw EngineError(fault);
  file.write(kStateHeader);
  write_sample(0);
  ProgressLine progress;
  const RunClock::time_point start = RunClock::now();
  if (!feedback && !job.engine_drives) driven->torques(state, torques);
  std::string divergence, impossible;
  RunClock::duration engine{};
  for (long long step = 0; step < job.steps;) {
    try {
      const long long sample_end = step + job.steps_per_sample;
      while (step < sample_end && divergence.empty() && !interrupted()) {
        if (feedback) driven->torques(state, torques);
        simulation->set_torques(torques);
        const RunClock::time_point before = RunClock::now();
        simulation->advance(1);
        engine += RunClock::now() - before;
        ++step;
        if (!feedback && step < sample_end) continue;
        divergence = read_state(step);
        if (divergence.empty()) divergence = plausibility.divergence(state);
      }
    } catch (const PolicyError& error) {
      progress.clear();
      finish();
      throw EngineError(fmt::format("the run stopped at {:.6g} s: {}; the earlier samples are in '{}'", seconds(step),
                                    error.what(), file.path()));
    } catch (...) {
      progress.clear();
      finish();
      throw EngineError(fmt::format("{} failed at {:.6g} s: {}; the earlier samples are in '{}'", job.contender.name,
                                    seconds(step), caught_text(), file.path()));
    }
    if (!divergence.empty()) {
      progress.clear();
      finish();
      throw EngineError(
          fmt::format("{} diverged at {:.6g} s ({}): the earlier samples are in '{}'; try a smaller --timestep",
                      job.contender.name, seconds(step), divergence, file.path()));
    }
    if (interrupted()) {
      progress.clear();
      message(fmt::format("interrupted at {:.6g} of {:.6g} s: the earlier samples are in {}", seconds(step),
                          job.duration_s, file.whereabouts()));
      return exits::kFailed;
    }
    write_sample(step);
    if (impossible.empty()) {
      impossible = plausibility.impossibility(state);
      if (!impossible.empty()) impossible = fmt::format("at {:.6g} s: {}", seconds(step), impossible);
    }
    if (progress.due()) progress.show(progress_text(job, step, RunClock::now() - start));
  }
  progress.clear();
  finish();
  if (!impossible.empty())
    message(fmt::format("note: the motion is physically impossible for this model: {}", impossible));
  if (time) {
    const double seconds_inside = std::chrono::duration<double>(engine).count();
    message(fmt::format("inside engine steps: {:.6f} s in {} steps, {:.4f} us a step", seconds_inside, job.steps,
                        1e6 * seconds_inside / static_cast<double>(job.steps)));
    if (const ControlAccount account = driven->account(); account.policy_steps > 0) {
      message(fmt::format("inside the policy: {:.6f} s in {} control steps, {:.4f} us a control step", account.policy_s,
                          account.policy_steps, 1e6 * account.policy_s / static_cast<double>(account.policy_steps)));
    }
  }
  return exits::kDone;
}

}  // namespace

int simulate(const SimulateRequest& request, const std::string& out, bool time) {
  rehearse(
      fmt::format("reading '{}'", request.model),
      [&] {
        const SimulateJob job = prepare(request);
        const Activity asking(fmt::format("asking {} what it does with '{}'", job.contender.name, job.model.name));
        static_cast<void>(job.contender.engine->check(job.model, job.contender.settings));
        const Activity trying("trying the control");
        job.control->rehearse();
      },
      model_caches());
  const SimulateJob job = prepare(request);
  check_fidelity(job);
  OutputFile file(out);
  constexpr const char* kFinish = "finish";
  // an engine may also end its process in an orderly way
  bool came_to_end = false;
  const ChildEnd end = run_in_child(
      [&](const Send& send) {
        // what the engine prints is not part of the table
        fflush(stdout);
        ::dup2(STDERR_FILENO, STDOUT_FILENO);
        // the file is open: it is given its name outside
        enter_sandbox({.readable = engine_files(), .writable = engine_caches()});
        const int status = guarded([&] { return step_through(job, time, file, [&] { send(kFinish); }); });
        send("end");
        return status;
      },
      [&](const std::string& line) {
        if (line == kFinish) file.finish();
        came_to_end = line != kFinish;
      });
  if (came_to_end) return end.status;
  const std::string left =
      file.empty() ? "it did not take a step" : fmt::format("the earlier samples are in {}", file.whereabouts());
  if (interrupted()) throw SystemError("interrupted: " + left);
  if (end.from_outside()) {
    throw EndedFromOutside(fmt::format("{} on '{}' ({})", job.contender.name, job.model.name, left), end.signal);
  }
  const std::string what =
      end.signal != 0 ? fmt::format("crashed with {}", end.signal_text()) : "ended its process early";
  throw EngineError(fmt::format("{} {} on '{}': {}", job.contender.name, what, job.model.name, left));
}

}  // namespace assay
