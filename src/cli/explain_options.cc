#include "cli/explain_options.h"

#include <fmt/format.h>

#include "cli/cli.h"
#include "engines/engine_files.h"
#include "engines/facts.h"
#include "isolate/contained.h"

namespace assay::cli {

void add_robot(CLI::App& command, ExplainOptions& options, const std::string& robot) {
  options.command = &command;
  command.add_option(robot, options.model.model, "MJCF, URDF or USD file, a system's name, or a results directory")
      ->required()
      ->type_name("");
}

void add_run_options(CLI::App& command, ExplainOptions& options) {
  ExplainRequest& request = options.request;
  command
      .add_option("--control", options.control,
                  "passive, sine, actuators, hold, random, or a CSV file of torques (default: actuators)")
      ->type_name("CONTROL");
  add_policy_options(command, options.policy);
  command
      .add_option("--timestep", request.timestep,
                  "Timestep in milliseconds, also as a fraction (default: the policy's of training, else 1)")
      ->type_name("MS");
  command.add_option("--seconds", request.seconds, "Length of a run (default: 2, under a policy 4)")->type_name("S");
  command.add_option("--seeds", request.seeds, "Perturbed starts (default: 10)")->type_name("N");
  command.add_option("--system", request.system, "Of results with several systems, the one")->type_name("NAME");
  command.add_option("--jobs", request.jobs, "Runs at a time (default: one a core)")->type_name("N");
}

ExplainRequest request_of(const ExplainOptions& options) {
  ExplainRequest request = options.request;
  request.model = options.model.model;
  request.load = load_options(options.model);
  const std::vector<std::string> words = given_words(*options.command, kModelGroup);
  if (!words.empty()) request.load_option = words.front();
  request.policy_given = options.policy.any();
  request.control_given = options.control || request.policy_given;
  // of results it is refused in a sentence of its own
  if (!holds_results(request.model)) {
    request.control = control_given(options.control, options.policy).value_or(ControlSpec());
  }
  return request;
}

ExplainQuestion read_question(const ExplainRequest& request) {
  rehearse(
      fmt::format("reading '{}'", request.model),
      [&] {
        const ExplainQuestion question = explain_question(request);
        question.control->rehearse();
      },
      model_caches());
  ExplainQuestion question = explain_question(request);
  tell_notes(question.model);
  return question;
}

}  // namespace assay::cli
