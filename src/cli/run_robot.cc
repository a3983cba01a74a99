#include "cli/run_robot.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/paths.h"
#include "base/text.h"
#include "campaign/campaign.h"
#include "campaign/load_keys.h"
#include "check/findings_text.h"
#include "check/model_check.h"
#include "check/step_bounds.h"
#include "cli/answer.h"
#include "engines/registry.h"
#include "load/mjcf.h"
#include "load/usd.h"
#include "results/transfer_text.h"
#include "run/coordinator/model_notes.h"
#include "run/coordinator/set_up.h"
#include "run/search/goals.h"
#include "run/search/programme.h"
#include "run/search/programme_file.h"
#include "run/search/search.h"
#include "run/search/search_answer.h"
#include "run/search/stance.h"

namespace assay::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kMinutes = 10;

std::string default_out(const std::string& robot) { return fs::path(robot).stem().string() + "-results"; }

void print_next(const Campaign& campaign, const std::string& dir, const std::optional<std::string>& contender) {
  const std::string& first = campaign.systems.front().name;
  print("\n" + heading("To run next") + ":\n");
  const auto line = [](const std::string& command, const std::string& what) {
    print(paragraph(fmt::format("  {}  # {}", command, what), 4));
  };
  line(fmt::format("assay recommend {} all --error 0.5mm --realtime 10", dir), "other limits, without measuring again");
  if (contender) {
    line(fmt::format("assay draw {} {} --contender {} --time 1 --out robot.png", dir, first, *contender),
         "a picture of the run");
  }
  line(fmt::format("assay run {} --out {}-again", (fs::path(dir) / "campaign.toml").string(), dir),
       "the same programme again, or as you have changed it");
}

// Those that a set-up would add. Their results join those that are there.
void add_not_asked(const RunRequest& request, Answer& answer) {
  const std::vector<AbsentEngine>& absent = Registry::instance().absent();
  if (absent.empty()) return;
  answer.part("Engines that were not asked", /*evidence=*/true);
  const std::vector<AbsentEngine> engines = obtainable(absent);
  if (engines.empty()) {  // no clone's set-up helps here
    std::vector<std::string> names;
    for (const AbsentEngine& engine : absent) names.push_back(engine.name);
    answer.remark("not here", join(names, ", ") + "; 'assay list engines' says how to get each");
    return;
  }
  answer.remark("not set up here", obtainable_text(engines));
  answer.remark("to ask them, too", fmt::format("{} && ./{}", set_up_command(engines), request.command));
}

int search_and_answer(const RunRequest& request, const Campaign& campaign, const std::vector<Refusal>& refusals) {
  const SearchTable table = campaign.search.value_or(SearchTable());
  const std::vector<LimitOptions> goals = goals_of(limits_in(table));
  SearchOptions options;
  options.run = run_options(request);
  options.budget_s = 60 * table.minutes;
  for (const LimitOptions& goal : goals) options.goals.push_back(question_of(campaign, goal).limits);
  ProgressLine progress;
  const auto events = json_progress(request) ? make_json_progress(stderr) : nullptr;
  options.tell = [&](const std::string& sentence) {
    if (events == nullptr) {
      progress.show(sentence);
    } else {
      events->phase(sentence);
    }
  };
  const SearchSummary done = search(campaign, options);
  progress.clear();
  if (done.interrupted) {
    message(fmt::format("stopped by {}: what was measured is stored in '{}'; '{}' goes on", strsignal(done.signal),
                        request.out, request.command));
    return kFailed;
  }
  auto [answer, best, any] = answer_of_search(Store::open(request.out), campaign, goals, done);
  add_refusals(refusals, answer);
  add_not_asked(request, answer);
  print(answer);
  print("\n");
  {
    Store store = open_to_write(request.out);
    keep_answer(store, answer);
    try {
      keep_pictures(store, campaign, best);
    } catch (const InputError& error) {  // a budget that ended before anything was measured
      message(fmt::format("no replays of other engines: {}", error.what()));
    }
  }
  write_report_of(request.out);
  print_next(campaign, request.out, best);
  return any ? kDone : kFailed;
}

// What a run under a policy measures.
void ask_policy(const RobotRequest& request, ProgrammeOptions& options) {
  if (request.minutes || request.limits.any()) {
    throw InputError(
        "--minutes and limits are for the search for the best contender: a run under a policy measures all of them, "
        "see --seeds, --seconds and --timesteps");
  }
  if (request.seeds) options.states = parse_count("--seeds", *request.seeds, 1, 1000);
  if (request.seconds) options.duration_s = parse_positive("--seconds", *request.seconds, "seconds");
  if (request.push) options.pushes.velocity = parse_positive("--push", *request.push, "m/s, of a hinge rad/s");
  if (request.push_every) options.pushes.every_s = parse_positive("--push-every", *request.push_every, "seconds");
  if (request.push_joint) options.pushes.joint = *request.push_joint;
  if (!request.push && (request.push_every || request.push_joint)) {
    throw InputError("--push-every and --push-joint are of pushes: give --push with their velocity");
  }
  for (const std::string& text : request.timesteps) {
    options.timesteps_ms.push_back(parse_positive("--timesteps", text, "milliseconds"));
  }
}

}  // namespace

bool is_robot(const std::string& given) {
  const std::string ending = fs::path(given).extension().string();
  if (ending == ".toml") return false;
  if (ending == ".urdf" || ending == ".xml" || ending == ".mjcf" || ending == ".sdf" || ending == ".world" ||
      ending == ".xacro" || is_usd(given)) {
    return true;
  }
  if (given.starts_with("robots:")) return true;
  std::error_code error;
  if (fs::is_regular_file(given, error)) {
    std::ifstream file(given);
    char first = 0;
    return file >> first && first == '<';
  }
  const auto has = [&](const std::vector<std::string>& names) {
    return std::ranges::find(names, given) != names.end();
  };
  return !has(campaign_names()) && has(system_names());
}

// What `assay check` finds in the file, before minutes are spent: what to mend in full, what to know by its titles.
void print_check(const std::string& file, const std::string& given, const LoadOptions& how) {
  FileFacts facts;
  const LoadReport report = inspect_model(file, how, &facts);
  if (!report.model) return;
  const StepBounds bounds = step_bounds(*report.model, report.model->initial);
  std::vector<Finding> findings = check_model(*report.model, facts, bounds);
  std::vector<std::string> known;
  for (const Finding& finding : findings) {
    if (finding.level == Level::kKnow) known.push_back(finding.title);
  }
  std::erase_if(findings, [](const Finding& finding) { return finding.level == Level::kKnow; });
  if (findings.empty()) print(paragraph(fmt::format("'{}' has nothing to mend", given), 2));
  print(findings_text(findings, report.problems));
  print(bounds_text(bounds, facts));
  if (!known.empty()) {
    print(paragraph(fmt::format("to know ('assay check {}' has it in full): {}", given, join(known, "; ")), 2));
  }
  print("\n");
}

int run_robot(const RobotRequest& request) {
  RunRequest run = request.run;
  if (run.out.empty()) run.out = default_out(run.campaign);
  const std::string file = find_model(run.campaign);
  const auto [how, model, notes] = stand(file, load_options(request.model));
  ProgrammeOptions options;
  options.model_lines = load_lines(how, [&](const std::string& path) { return relative_path(path, run.out); });
  options.notes = notes;
  const std::vector<std::string> ours = system_names();
  const bool by_name = std::ranges::find(ours, run.campaign) != ours.end();
  options.model = by_name || run.campaign.starts_with("robots:") ? run.campaign : relative_path(file, run.out);
  options.minutes = request.minutes ? parse_positive("--minutes", *request.minutes, "minutes") : kMinutes;
  const LimitOptions& limits = request.limits;
  if (limits.measure) {
    throw InputError("--measure is for 'assay recommend': the programme limits every error that it measures");
  }
  for (const auto& [key, text] : {std::pair("error", limits.error),
                                  {"penetration", limits.penetration},
                                  {"slip", limits.slip},
                                  {"realtime", limits.realtime}}) {
    if (text) options.limits[key] = *text;
  }
  options.other_limits = limits.limits;
  options.patterns = request.contenders;
  std::unique_ptr<Control> given;
  if (auto control = control_given(request.control, request.policy)) {
    given = make_control(model, *control);  // its errors name the files as given
    for (std::string* path : {&control->file, &control->policy, &control->network}) {
      if (!path->empty()) *path = relative_path(*path, run.out);
    }
    options.control = std::move(control);
  }
  const bool policy = given != nullptr && given->policy() != nullptr;
  if (policy) {
    options.policy = given.get();
    ask_policy(request, options);
    if (const std::string obstacle = options.pushes.any() ? push_obstacle(model, options.pushes) : "";
        !obstacle.empty()) {
      throw InputError(
          fmt::format("--push: '{}' {}{}", model.name, obstacle, request.push_joint ? "" : " with --push-joint"));
    }
  } else if (request.push || request.push_every || request.push_joint) {
    throw InputError("--push, --push-every and --push-joint are for a run under a policy: give --policy-config");
  } else if (request.seeds || request.seconds || !request.timesteps.empty()) {
    throw InputError("--seeds, --seconds and --timesteps are for a run under a policy: give --policy-config");
  }
  options.command = run.command;
  const Programme programme = programme_for(model, options);
  const std::string toml = write_programme(run.out, programme, message);
  const Campaign campaign = load_campaign(toml);
  for (const LimitOptions& goal : goals_of(limits)) question_of(campaign, goal);  // their errors come before all else
  print_check(file, request.run.campaign, how);
  for (const std::string& note : model.notes) print(paragraph("note: " + note, 2));
  print(paragraph("programme: " + toml, 2));
  for (const std::string& decided : options.notes) print(paragraph("  " + decided, 4));
  for (const std::string& system : programme.systems) print(paragraph("  " + system, 4));
  print("\n");
  if (request.plan_only) {
    Answer answer;
    add_refusals(programme.refusals, answer);
    answer.part("To measure it");
    answer.line(fmt::format("assay run {} --out {}", toml, run.out));
    print(answer);
    return kDone;
  }
  flush_output();
  if (!policy) return search_and_answer(run, campaign, programme.refusals);
  run.campaign = toml;
  if (!run_and_summarize(run)) return kFailed;
  print("\n");
  for (const TransferMatrix& matrix : transfer_matrices(run.out)) print(transfer_text(matrix));
  Answer answer;
  add_refusals(programme.refusals, answer);
  print(answer);
  write_report_of(run.out);
  return kDone;
}

int run_searched(const RunRequest& request) {
  const Campaign campaign = load_campaign(find_campaign(request.campaign));
  const auto events = json_progress(request) ? make_json_progress(stderr) : nullptr;
  for (const std::string& note : model_notes(campaign)) {
    if (events == nullptr) {
      message("note: " + note);
    } else {
      events->message("note: " + note);
    }
  }
  return search_and_answer(request, campaign, {});
}

}  // namespace assay::cli
