// `assay simulate`: one run of one contender as a table of states.
#include "run/simulate/simulate.h"

#include <memory>
#include <optional>

#include "cli/commands.h"
#include "cli/control_options.h"
#include "cli/model_options.h"

namespace assay::cli {
namespace {

struct SimulateOptions {
  SimulateRequest request;
  ModelOptions model;
  std::optional<std::string> control;  // default: actuators
  PolicyOptions policy;
  std::string out;
  bool time = false;
};

int run_simulate(const SimulateOptions& options) {
  SimulateRequest request = options.request;
  request.model = options.model.model;
  request.load = load_options(options.model);
  request.control = control_given(options.control, options.policy).value_or(ControlSpec());
  return simulate(request, options.out, options.time);
}

}  // namespace

void add_simulate(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "simulate", "Run one model on one contender and write its states as CSV",
      {{"assay simulate planar-chain --engine mujoco-rk4 --timestep 1 --duration 5 --out chain.csv",
        "5 s at 1 ms, every step"},
       {"assay simulate my_robot.xml --engine bullet-si-f64 --timestep 1/4 --duration 2 --sample 10 --out run.csv",
        "one sample every 10 ms"},
       {"assay simulate capsules-27 --engine ode-quick --set iterations=20 --gravity off --timestep 2 --duration 1 "
        "--out -",
        "with other settings, to standard output"}});
  const auto options = std::make_shared<SimulateOptions>();
  add_model_options(*command, options->model);
  command->add_option("--engine", options->request.contender, "Contender, as listed by 'assay list engines'")
      ->required()
      ->type_name("CONTENDER");
  command->add_option("--timestep", options->request.timestep, "Timestep in ms: 1, 0.5, 1/64")
      ->required()
      ->type_name("MS");
  command->add_option("--duration", options->request.duration, "Length of the run in s, a whole number of samples")
      ->required()
      ->type_name("S");
  command
      ->add_option("--sample", options->request.sample,
                   "Time between samples in ms, a whole number of timesteps (default: one)")
      ->type_name("MS");
  command->add_option("--contacts", options->request.contacts, "off removes all contacts (default: on)")
      ->type_name("on|off");
  command->add_option("--gravity", options->request.gravity, "off removes gravity (default: on)")->type_name("on|off");
  command
      ->add_option("--control", options->control,
                   "passive; actuators: the model's own (default); hold: a PD at the start pose, "
                   "hold,natural_frequency=HZ (default: 0, which is 10 Hz); random: seeded torques at every joint, "
                   "random,motion=RAD,seed=N; a sine of torque at every hinge: "
                   "sine,amplitude=NM,frequency=HZ,phase_step=RAD; or a CSV file of torques: time,JOINT,...")
      ->type_name("CONTROL");
  add_policy_options(*command, options->policy);
  command->add_option("--set", options->request.settings, "Overrides a setting of the contender; may be repeated")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  command->add_flag("--time", options->time, "Also print the time inside the engine's own step calls");
  command->add_option("--out", options->out, "CSV file to write; '-' is standard output")
      ->required()
      ->type_name("FILE");
  command->callback([&action, options] { action = [options] { return run_simulate(*options); }; });
}

}  // namespace assay::cli
