// `assay simulate`: one run of one contender as a table of states.
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <unistd.h>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/paths.h"
#include "base/text.h"
#include "cli/child.h"
#include "cli/cli.h"
#include "cli/csv.h"
#include "cli/output_file.h"
#include "cli/state_rows.h"
#include "controls/control.h"
#include "controls/work.h"
#include "engines/registry.h"
#include "measures/plausible.h"
#include "model/mjcf.h"

namespace assay::cli {
namespace {

using Clock = std::chrono::steady_clock;

struct Options {
  std::string model, engine, timestep, duration, out;
  std::optional<std::string> sample;
  std::string contacts = "on", gravity = "on", control = "actuators";
  std::vector<std::string> set;
  bool drop_unsupported = false;
};

// Everything that is known before the first step.
struct Job {
  Model model;
  std::unique_ptr<Control> control;
  ResolvedContender contender;
  double timestep_ms = 0;
  double duration_s = 0;
  long long steps_per_sample = 1;
  long long steps = 0;  // a whole number of samples
};

constexpr double kMostSteps = 1e15;

// `whole` as a number of `part`s, when it is a whole one to rounding.
std::optional<long long> whole_number_of(double whole, double part) {
  const double ratio = whole / part;
  const double nearest = std::round(ratio);
  if (nearest < 1 || nearest > kMostSteps || std::abs(ratio - nearest) > 1e-9 * nearest) return std::nullopt;
  return std::llround(nearest);
}

// "4 or 6": the multiples of `part` on both sides of `whole`.
std::string neighbours(double whole, double part) {
  const double below = std::floor(whole / part);
  const std::string above = fmt::format("{:.12g}", (below + 1) * part);
  return below < 1 ? above : fmt::format("{:.12g} or {}", below * part, above);
}

Job prepare(const Options& options) {
  Job job;
  job.timestep_ms = parse_positive("--timestep", options.timestep, "milliseconds");
  job.duration_s = parse_positive("--duration", options.duration, "seconds");
  const std::string sample = options.sample.value_or(options.timestep);
  const double sample_ms = parse_positive("--sample", sample, "milliseconds");
  if (const double steps = job.duration_s * 1000 / job.timestep_ms; steps > kMostSteps) {
    throw InputError(fmt::format("--duration is {} s, which takes {:.3g} timesteps of {} ms: use at most {:.3g} s",
                                 options.duration, steps, options.timestep, kMostSteps * job.timestep_ms / 1000));
  }
  const auto per_sample = whole_number_of(sample_ms, job.timestep_ms);
  if (!per_sample) {
    throw InputError(fmt::format("--sample is {} ms, which is no whole number of timesteps of {} ms: use {}", sample,
                                 options.timestep, neighbours(sample_ms, job.timestep_ms)));
  }
  job.steps_per_sample = *per_sample;
  const auto samples = whole_number_of(job.duration_s * 1000, sample_ms);
  if (!samples) {
    throw InputError(fmt::format("--duration is {} s, which is no whole number of {} of {} ms: use {}",
                                 options.duration, options.sample ? "samples" : "timesteps", sample,
                                 neighbours(job.duration_s, sample_ms / 1000)));
  }
  job.steps = *samples * job.steps_per_sample;

  const bool contacts = parse_switch("--contacts", options.contacts);
  const bool gravity = parse_switch("--gravity", options.gravity);
  const ControlSpec control = parse_control(options.control);
  job.contender = Registry::instance().resolve(options.engine, parse_settings(options.set));
  job.contender.settings.timestep = job.timestep_ms / 1000;
  job.model = load_model(find_model(options.model), {.drop_unsupported = options.drop_unsupported});
  if (!contacts) job.model = without_contacts(std::move(job.model));
  if (!gravity) job.model = without_gravity(std::move(job.model));
  job.control = make_control(job.model, control);
  return job;
}

// Refuses what the engine refuses and says what it only approximates.
void check_fidelity(const Job& job) {
  const std::vector<Limitation> findings = job.contender.engine->check(job.model, job.contender.settings);
  for (const Limitation& finding : findings) {
    if (finding.fidelity == Fidelity::kRefused) {
      throw InputError(
          fmt::format("{} refuses {} of '{}': {}", job.contender.name, finding.element, job.model.name, finding.how));
    }
  }
  for (const std::string& note : job.model.notes) message(fmt::format("note: {}", note));
  for (const Limitation& finding : findings) {
    if (finding.fidelity == Fidelity::kApproximated) {
      message(fmt::format("note: {} approximates {}: {}", job.contender.name, finding.element, finding.how));
    }
  }
}

// How far the run is, on standard error: one line rewritten on a terminal, a plain line now and then elsewhere.
class ProgressLine {
 public:
  ProgressLine(const Job& job) : job_(job), terminal_(isatty(STDERR_FILENO) != 0) {}

  void at(long long step) {
    const Clock::time_point now = Clock::now();
    const std::chrono::duration<double> since_last = now - last_;
    if (since_last.count() < (terminal_ ? 0.2 : 30)) return;
    last_ = now;
    const std::chrono::duration<double> elapsed = now - start_;
    const double share = static_cast<double>(step) / static_cast<double>(job_.steps);
    const double left_s = elapsed.count() * (1 - share) / share;
    const std::string line =
        fmt::format("{} on {}: {:.0f} % ({:.6g} of {:.6g} s), {} left", job_.contender.name, job_.model.name,
                    100 * share, share * job_.duration_s, job_.duration_s, duration_label(left_s));
    if (terminal_) {
      fmt::print(stderr, "\r\x1b[K{}", line);
      std::fflush(stderr);
      shown_ = true;
    } else {
      message(line);
    }
  }

  void clear() {
    if (shown_) fmt::print(stderr, "\r\x1b[K");
    shown_ = false;
  }

 private:
  const Job& job_;
  bool terminal_;
  bool shown_ = false;
  Clock::time_point start_ = Clock::now(), last_ = start_;
};

// Within a catch block: what was thrown, whatever its type.
std::string caught_text() {
  try {
    throw;
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "an exception of a type that is no std::exception";
  }
}

// Steps the engine to the end, to its failure or to an interruption. Every sample is in the file before the next
// begins.
int run(const Job& job, OutputFile& file) {
  const Model& model = job.model;
  const auto simulation = job.contender.engine->create(model, model.initial, job.contender.settings);
  const Control& control = *job.control;
  const Plausibility plausibility(model, model.initial, job.duration_s, largest_work(model, control, job.duration_s));
  const bool feedback = control.input() != ControlInput::kNothing;
  std::vector<double> torques(model.hinges.size());
  std::vector<std::string> names;
  names.reserve(model.bodies.size());
  for (const Body& body : model.bodies) names.push_back(csv_field(body.name));

  State state;
  fmt::memory_buffer text;
  const auto seconds = [&](long long step) {
    return step == job.steps ? job.duration_s : static_cast<double>(step) * job.timestep_ms / 1000;
  };
  const auto write_sample = [&](long long step) {
    text.clear();
    // The sample's nominal time: what an engine adds up is off by its roundings.
    append_state_rows(names, seconds(step), state, text);
    file.write({text.data(), text.size()});
  };

  file.write(kStateHeader);
  simulation->read_state(state);
  write_sample(0);
  ProgressLine progress(job);
  control.torques(state, torques);
  std::string divergence, impossible;
  for (long long step = 0; step < job.steps;) {
    try {
      const long long sample_end = step + job.steps_per_sample;
      while (step < sample_end && divergence.empty() && !interrupted()) {
        if (feedback) control.torques(state, torques);
        simulation->step(torques);
        ++step;
        if (!feedback && step < sample_end) continue;
        simulation->read_state(state);
        divergence = plausibility.divergence(state);
      }
    } catch (...) {
      progress.clear();
      file.finish();
      throw EngineError(fmt::format("{} failed at {:.6g} s: {}; the samples before are kept in '{}'",
                                    job.contender.name, seconds(step), caught_text(), file.path()));
    }
    if (!divergence.empty()) {
      progress.clear();
      file.finish();
      throw EngineError(
          fmt::format("{} diverged at {:.6g} s ({}): the samples before are kept in '{}', try a smaller --timestep",
                      job.contender.name, seconds(step), divergence, file.path()));
    }
    if (interrupted()) {
      progress.clear();
      message(fmt::format("interrupted at {:.6g} of {:.6g} s: the samples up to there are in {}", seconds(step),
                          job.duration_s, file.whereabouts()));
      return kFailed;
    }
    write_sample(step);
    if (impossible.empty()) {
      impossible = plausibility.impossibility(state);
      if (!impossible.empty()) impossible = fmt::format("at {:.6g} s: {}", seconds(step), impossible);
    }
    progress.at(step);
  }
  progress.clear();
  file.finish();
  if (!impossible.empty()) message(fmt::format("note: the run is no possible motion of the model: {}", impossible));
  return kDone;
}

int simulate(const Options& options) {
  const Job job = prepare(options);
  check_fidelity(job);
  OutputFile file(options.out);
  // an engine may end its process in an orderly way too
  bool came_to_end = false;
  const ChildEnd end = run_in_child(
      [&](const Send& send) {
        const int status = guarded([&] { return run(job, file); });
        send("end");
        return status;
      },
      [&](const std::string&) { came_to_end = true; });
  if (came_to_end) return end.status;
  const std::string what =
      end.signal != 0 ? fmt::format("crashed with {}", end.signal_text()) : "ended its process without being asked";
  throw EngineError(fmt::format(
      "{} {} on '{}': {}", job.contender.name, what, job.model.name,
      file.empty() ? "it did not take a step" : fmt::format("the samples before are in {}", file.whereabouts())));
}

}  // namespace

void add_simulate(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "simulate", "Run one model on one contender and write its states as CSV",
      {{"assay simulate planar-chain --engine mujoco-rk4 --timestep 1 --duration 5 --out chain.csv",
        "5 s at 1 ms, every step"},
       {"assay simulate my_robot.xml --engine bullet-si-f64 --timestep 1/4 --duration 2 --sample 10 --out run.csv",
        "a sample each 10 ms"},
       {"assay simulate capsules-27 --engine ode-quick --set iterations=20 --gravity off --timestep 2 --duration 1 "
        "--out -",
        "other settings, to standard output"}});
  const auto options = std::make_shared<Options>();
  command->add_option("MODEL", options->model, "MJCF or URDF file, or a system's name")->required()->type_name("");
  command->add_option("--engine", options->engine, "Contender, one of 'assay engines'")
      ->required()
      ->type_name("CONTENDER");
  command->add_option("--timestep", options->timestep, "Timestep in ms: 1, 0.5, 1/64")->required()->type_name("MS");
  command->add_option("--duration", options->duration, "Length of the run in s, a whole number of samples")
      ->required()
      ->type_name("S");
  command
      ->add_option("--sample", options->sample,
                   "Time between samples in ms, a whole number of timesteps (default: one)")
      ->type_name("MS");
  command->add_option("--contacts", options->contacts, "off: no two shapes touch (default: on)")->type_name("on|off");
  command->add_option("--gravity", options->gravity, "off: no gravity (default: on)")->type_name("on|off");
  command
      ->add_option("--control", options->control,
                   "passive, actuators (the model's own, the default) or a sine of torque at every hinge: "
                   "sine,amplitude=NM,frequency=HZ,phase_step=RAD")
      ->type_name("CONTROL");
  command->add_option("--set", options->set, "Setting of the engine that differs from the contender's; may be repeated")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  command
      ->add_flag("--drop-unsupported", options->drop_unsupported,
                 "Leave out shapes that are no sphere, capsule or plane instead of refusing the model")
      ->disable_flag_override();
  command->add_option("--out", options->out, "CSV file to write; '-' is standard output")
      ->required()
      ->type_name("FILE");
  command->callback([&action, options] { action = [options] { return simulate(*options); }; });
}

}  // namespace assay::cli
