// `assay run`: measures a campaign, or searches for the best contender for a robot; or resumes either.
#include <filesystem>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/external_files.h"
#include "base/paths.h"
#include "base/text.h"
#include "campaign/campaign.h"
#include "cli/campaign_run.h"
#include "cli/commands.h"
#include "cli/run_robot.h"
#include "engines/batch.h"
#include "engines/engine_files.h"
#include "engines/registry.h"
#include "isolate/activity.h"
#include "isolate/contained.h"
#include "load/mjcf.h"
#include "run/coordinator/set_up.h"

namespace assay::cli {
namespace {

struct RunOptions : RobotRequest {
  bool full = false;
  const CLI::App* command = nullptr;
};

// An option of a robot's run that a campaign's file has in its own table.
void refuse_for_campaign(const char* option, bool given) {
  if (given) {
    throw InputError(
        fmt::format("{} is for a robot's file: a campaign has it in its own tables, [search] and [[system]]", option));
  }
}

// The command that goes on with what was begun: all options but those of one call.
std::string resuming(const RunOptions& options) {
  const std::vector<std::string> words =
      given_words(*options.command, "", {"--jobs", "--references", "--retry", "--progress"});
  return fmt::format("assay run {}{}{}", options.run.campaign, words.empty() ? "" : " ", join(words, " "));
}

// The user's files, and what every contender says of a model.
void rehearse_robot(const std::string& robot, const LoadOptions& how, const std::optional<ControlSpec>& control) {
  rehearse(
      fmt::format("reading '{}'", robot),
      [&] {
        const LoadReport report = inspect_model(find_model(robot), how);
        const Registry& registry = Registry::instance();
        for (const std::string& name : registry.contender_names()) {
          const ResolvedContender contender = registry.resolve(name);
          const Activity asking(fmt::format("asking {} what it does with '{}'", name, robot));
          static_cast<void>(contender.engine->capabilities(contender.settings));
          if (report.model) static_cast<void>(contender.engine->check(*report.model, contender.settings));
        }
        if (!report.model || !control) return;
        const Activity trying("trying the control");
        make_control(*report.model, *control)->rehearse();
      },
      model_caches());
}

int run(RunOptions options) {
  static_cast<void>(json_progress(options.run));  // refused before anything is read
  if (options.run.device) require_device(*options.run.device);
  options.run.command = resuming(options);
  if (options.model.load.allow_external_files) agree_to_external_files();
  if (is_robot(options.run.campaign)) {
    if (options.run.set_up) obtain_releases(options.contenders);
    rehearse_robot(options.run.campaign, load_options(options.model), control_given(options.control, options.policy));
    if (options.full || options.run.shard || options.run.cells || options.run.device ||
        !options.run.windows_of.empty()) {
      throw InputError(
          "--full, --shard, --cells, --device and --windows-of are for campaigns: a robot's run measures what can "
          "still win; its "
          "campaign.toml can be run with them");
    }
    return options.like_real.empty() ? run_robot(options) : run_like_real(options);
  }
  refuse_for_campaign("--like-real", !options.like_real.empty());
  refuse_for_campaign("--minutes", options.minutes.has_value());
  refuse_for_campaign("--control", options.control.has_value());
  refuse_for_campaign("--policy", options.policy.any());
  refuse_for_campaign("--seeds, --seconds and --timesteps",
                      options.seeds || options.seconds || !options.timesteps.empty());
  refuse_for_campaign("--push", options.push || options.push_every || options.push_joint);
  LoadOptions reading = load_options(options.model);
  reading.allow_external_files = false;  // no setting of the campaign, but the user's agreement to one
  refuse_for_campaign("how a model is read", reading != LoadOptions());
  refuse_for_campaign("--contenders", !options.contenders.empty());
  refuse_for_campaign("--plan", options.plan_only);
  refuse_for_campaign("a limit", options.limits.any() || options.limits.measure);
  if (options.run.out.empty())
    throw InputError("--out is required, and it is missing or empty: see 'assay run --help'");
  rehearse_campaign(options.run.campaign);
  if (options.run.set_up) obtain_engines(load_campaign(find_campaign(options.run.campaign)));
  const bool searched = !options.full && !options.run.device && !options.run.shard && !options.run.cells &&
                        load_campaign(find_campaign(options.run.campaign)).search.has_value();
  if (searched) return run_searched(options.run);
  return run_and_summarize(options.run) ? kDone : kFailed;
}

}  // namespace

void add_run(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "run", "Find the best contender for a robot, or measure a campaign",
      {{"assay run my_robot.urdf", "which engine, which settings, which timestep: ten minutes, then the answer"},
       {"assay run my_robot.xml --minutes 3 --error 1mm --penetration 2mm --realtime 5", "several limits at once"},
       {"assay run my_robot.xml --control torques.csv --out pushed", "under torques of your own: time,joint,..."},
       {"assay run my_robot.xml --policy-config policy.toml", "in which engines its policy works as in training"},
       {"assay run campaigns/quick.toml --out results", "after Ctrl-C or a kill the same command resumes"},
       {"assay run paper --out part2 --shard 2/8", "the second of eight parts, for 'assay merge'"}});
  const auto options = std::make_shared<RunOptions>();
  options->command = command;
  RunRequest& request = options->run;
  command
      ->add_option("ROBOT|CAMPAIGN", request.campaign,
                   "URDF or MJCF file, or a system's name; or a campaign's TOML file, or the name of one in campaigns/")
      ->required()
      ->type_name("");
  command
      ->add_option("--out", request.out,
                   "Results directory; created if missing (default for a robot: its file's name and -results)")
      ->type_name("DIR");
  command->add_option("--minutes", options->minutes, "Budget of a robot's run (default: 10)")->type_name("M");
  command
      ->add_option(
          "--control", options->control,
          "Torques of a robot's run: passive, hold, sine, random, actuators, or a CSV file of torques over time "
          "(default: hold at the start pose)")
      ->type_name("CONTROL");
  add_policy_options(*command, options->policy);
  command->add_option("--seeds", options->seeds, "Perturbed starts of a run under a policy (default: 20)")
      ->type_name("N");
  command->add_option("--seconds", options->seconds, "Length of each of its runs (default: 10)")->type_name("S");
  command
      ->add_option("--push", options->push,
                   "Push its free base by this velocity, in random directions at random times (m/s; of a hinge rad/s)")
      ->type_name("VELOCITY");
  command->add_option("--push-every", options->push_every, "One push in each interval of this length (default: 3)")
      ->type_name("S");
  command->add_option("--push-joint", options->push_joint, "Push this hinge or slide in place of the base")
      ->type_name("JOINT");
  command
      ->add_option("--timesteps", options->timesteps,
                   "Its timesteps in ms: 1,2,5 (default: half of that of training, that itself and its double)")
      ->type_name("MS")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      ->add_option(
          "--contenders", options->contenders,
          "Contenders that take part in a robot's run, by name or pattern, as in 'mujoco-*' (default: all that "
          "take the robot)")
      ->type_name("NAME")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      ->add_option(
          "--like-real", options->like_real,
          "Ask which contender is the fastest that moves as measured: folder of 'assay match'; --error is then "
          "of held-out motion, 5% of the body's size or 2deg (default: as good as the best)")
      ->type_name("DIR");
  command
      ->add_flag("--plan", options->plan_only,
                 "Only write a robot's campaign, to be changed and run: what would be measured, and how")
      ->disable_flag_override();
  add_limits(*command, options->limits);
  add_load_options(*command, options->model);
  command->add_option("--jobs", request.jobs, "Accuracy workers at a time (default: one per core)")->type_name("N");
  command
      ->add_option("--shard", request.shard,
                   "Measure only part I of N of the campaign; 'auto' or 'auto/N' takes the part from the scheduler's "
                   "environment (docs/operations.md)")
      ->type_name("I/N");
  command
      ->add_option(
          "--cells", request.cells,
          "Measure only 'accuracy' cells, which may share a machine, or 'timing' cells, which need one of their own; "
          "'runs' makes what both read, into --references, 'after-runs' are the accuracy cells where that was done")
      ->type_name("KIND");
  command
      ->add_option("--device", request.device,
                   "Where engines that step many worlds together do so, for the measure 'batch' (default: cpu)")
      ->type_name("cpu|cuda:N");
  command
      ->add_flag("--retry", request.retry,
                 "Measure again what is stored as crashed or timed out, or is damaged in the database")
      ->disable_flag_override();
  command
      ->add_option("--windows-of", request.windows_of,
                   "Time the same parts of each run as the results DIR did, so that 'assay compare' compares all times")
      ->type_name("DIR");
  command->add_flag("--full", options->full, "Measure every cell of a campaign that has a table [search]")
      ->disable_flag_override();
  add_references(*command, request);
  add_set_up(*command, request);
  add_progress(*command, request);
  command->callback([&action, options] { action = [options] { return run(*options); }; });
}

}  // namespace assay::cli
