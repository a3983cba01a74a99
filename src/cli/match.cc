// `assay match`: which contender, with which parameters, moves as the robot was measured to.
#include "match/match.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <thread>

#include <fmt/format.h>

#include "base/console.h"
#include "base/errors.h"
#include "base/option_values.h"
#include "base/paths.h"
#include "base/text.h"
#include "cli/answer.h"
#include "cli/commands.h"
#include "cli/model_options.h"
#include "engines/engine_files.h"
#include "engines/registry.h"
#include "isolate/contained.h"
#include "load/mjcf.h"
#include "match/folder.h"
#include "match/like.h"
#include "report/match_page.h"

namespace assay::cli {
namespace {

struct MatchOptions {
  ModelOptions model;
  std::vector<std::string> logs, contenders, fit;
  std::string config, like, out;
  std::optional<std::string> timestep, jobs, budget, seed;
  bool check = false, json = false;
};

// NAME or NAME=LOWER,UPPER of --fit.
match::FitRequest fit_request(const std::string& text) {
  match::FitRequest request{.parameter = text.substr(0, text.find('=')), .lower = {}, .upper = {}};
  const size_t equals = text.find('=');
  if (equals == std::string::npos) return request;
  const std::string bounds = text.substr(equals + 1);
  const size_t comma = bounds.find(',');
  if (comma != std::string::npos) {
    request.lower = parse_number(bounds.substr(0, comma));
    request.upper = parse_number(bounds.substr(comma + 1));
  }
  if (!request.lower || !request.upper) {
    throw InputError(fmt::format("--fit {} gives no bounds: write them as in damping=0,0.5", text));
  }
  return request;
}

// But for the motion of --like.
match::MatchQuestion question_of(const MatchOptions& options) {
  if (options.logs.empty() && options.like.empty()) {
    throw InputError(
        "--log FILE is missing: it names measured motion; or give --like CONTENDER to fit to another contender");
  }
  if (!options.logs.empty() && !options.like.empty()) {
    throw InputError("--log and --like exclude each other: fit to measured motion, or to that of a contender");
  }
  match::MatchQuestion question;
  question.spec = {
      .path = find_model(options.model.model), .hash = "", .load = load_options(options.model), .variant = {}};
  question.model = load_model(question.spec.path, question.spec.load);
  question.spec.hash = question.model.hash;
  question.config = match::read_match_config(options.config);
  if (!options.fit.empty()) {
    question.config.fit.clear();
    for (const std::string& text : options.fit) question.config.fit.push_back(fit_request(text));
  }
  if (options.seed)
    question.config.seed = static_cast<std::uint64_t>(parse_count("--seed", *options.seed, 0, 1'000'000'000));
  question.like = options.like;
  if (options.like.empty()) {
    question.logs = match::read_logs(options.logs, question.model, question.config);
    question.check = match::check_logs(question.model, question.config, question.logs);
  } else {
    static_cast<void>(Registry::instance().resolve(options.like));
  }
  question.contenders = options.contenders;
  for (const std::string& name : question.contenders) {
    static_cast<void>(Registry::instance().resolve(name));
    if (std::ranges::count(question.contenders, name) > 1) {
      throw InputError(fmt::format("--contenders has '{}' twice: leave one out", name));
    }
  }
  if (options.timestep) question.timestep_ms = parse_positive("--timestep", *options.timestep, "milliseconds");
  if (options.budget) question.budget = parse_count("--budget", *options.budget, 10, 1'000'000);
  question.jobs = options.jobs ? parse_count("--jobs", *options.jobs, 1, 1024)
                               : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  question.out = options.out;
  return question;
}

// The motion of --like in place of logs.
void take_motion(match::MatchQuestion& question) {
  question.logs = match::motions_like(question.spec, question.model,
                                      {question.like, question.timestep_ms, question.config.seed, question.jobs});
  if (!question.model.joints.empty()) question.config.law = match::DriveLaw::kTorque;
  question.config.torque_median = 1;  // there are no glitches
  match::check_names(question.logs, question.config);
  question.check = match::check_logs(question.model, question.config, question.logs);
}

// Where the logs leave nothing to be fitted, what is wrong with them is the reason.
void refuse_hopeless(const match::MatchQuestion& question) {
  match::check_question(question, /*parameters_alone=*/true);
  try {
    match::check_question(question);
  } catch (const InputError& error) {
    const std::vector<match::LogFinding>& findings = question.check.findings;
    const auto wrong = std::ranges::find_if(findings, [](const match::LogFinding& finding) {
      return finding.severity == match::FindingSeverity::kWrong && finding.kind != "windows";
    });
    if (wrong == findings.end()) throw;
    throw InputError(fmt::format("{} ({})", error.what(), match::finding_text(*wrong)));
  }
}

int run_match(const MatchOptions& options) {
  if (!options.check && options.out.empty()) {
    throw InputError("--out DIR is missing: it names the folder of what is found; --check looks at the logs alone");
  }
  const auto read = [&] { return question_of(options); };
  rehearse(
      fmt::format("reading '{}' and its logs", options.model.model), [&] { static_cast<void>(read()); },
      model_caches());
  match::MatchQuestion question = read();
  if (!question.like.empty()) take_motion(question);
  if (question.contenders.empty()) {
    for (const Engine* engine : Registry::instance().engines()) {
      const std::vector<Contender> contenders = engine->contenders();
      if (contenders.empty() || engine->name() == "null" || contenders.front().name == question.like) continue;
      question.contenders.push_back(contenders.front().name);
      if (options.check) break;  // one does, to look at what is to be fitted
    }
  }
  if (options.check) {
    match::check_question(question, /*parameters_alone=*/true);
    if (options.json) {
      print_json(match::check_json(question.check));
    } else {
      print(match::check_answer(question.check));
    }
    return kDone;
  }
  refuse_hopeless(question);
  for (const match::LogFinding& finding : question.check.findings) {
    if (finding.severity != match::FindingSeverity::kWrong && finding.kind != "copy") continue;
    question.warnings.push_back(match::finding_text(finding));
    message("warning: " + question.warnings.back());
  }
  match::begin_folder(question);
  ProgressLine progress;
  const match::MatchAnswer answer = match::match(
      question,
      [&](const std::string& text) {
        if (progress.due()) progress.show(fmt::format("{}: {}", question.model.name, text));
      },
      [&](const match::MatchAnswer& so_far) { match::write_answer(question, so_far); });
  progress.clear();
  for (const std::string& note : match::write_answer(question, answer)) message(note);
  if (options.json) {
    print_json(match::match_json(question, answer));
  } else {
    print(match::match_text(question, answer));
  }
  const std::string page = write_match_report(options.out);
  if (!options.json) print(paragraph("report: " + page, 2));
  return kDone;
}

}  // namespace

void add_match(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "match", "Fit contenders to measured motion, and say which one moves as the robot does",
      {{"assay match pendulum.xml --log pendulum_*.csv --contenders mujoco-euler,dart --out matched", "joints"},
       {"assay match cube.xml --log tosses.csv.xz --config match.toml --out matched", "a thrown body"},
       {"assay match pendulum.xml --log pendulum.csv --check", "what the logs can tell"},
       {"assay match my_robot.xml --like mujoco-euler --contenders dart,ode-quick --out like",
        "which parameters make other engines move as MuJoCo does"}});
  const auto options = std::make_shared<MatchOptions>();
  command->add_option("--log", options->logs, "Measured motion, CSV or .npz; several may be given")
      ->type_name("FILE...");
  command
      ->add_option("--like", options->like,
                   "Fit to this contender in place of logs: motions from drawn starts, joints under random torques")
      ->type_name("CONTENDER");
  command->add_option("--config", options->config, "What the columns are, what drives, what is held out and fitted")
      ->type_name("FILE");
  command->add_option("--contenders", options->contenders, "Contenders (default: the first one of each engine)")
      ->delimiter(',')
      ->type_name("NAME,...");
  command
      ->add_option("--fit", options->fit,
                   "Parameters, as in damping, mass:upper or friction=0.05,1 with bounds; may be repeated")
      ->type_name("PARAMETER")
      ->allow_extra_args(false);
  command->add_flag("--check", options->check, "Only say what the logs can tell")->disable_flag_override();
  command->add_option("--timestep", options->timestep, "Timestep in milliseconds, also as a fraction (default: 1)")
      ->type_name("MS");
  command->add_option("--budget", options->budget, "Candidates that a fit may try, the same for all (default: 1500)")
      ->type_name("N");
  command->add_option("--seed", options->seed, "Of all that is drawn (default: 1)")->type_name("N");
  command->add_option("--jobs", options->jobs, "Simulations at a time (default: one a core)")->type_name("N");
  command->add_option("--out", options->out, "Folder of what is found; the same command goes on where it stopped")
      ->type_name("DIR");
  command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  add_model_options(*command, options->model);
  command->callback([&action, options] { action = [options] { return run_match(*options); }; });
}

}  // namespace assay::cli
