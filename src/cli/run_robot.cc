#include "cli/run_robot.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/paths.h"
#include "base/quantity.h"
#include "base/text.h"
#include "base/write_file.h"
#include "campaign/campaign.h"
#include "campaign/load_keys.h"
#include "check/findings_text.h"
#include "check/model_check.h"
#include "check/step_bounds.h"
#include "cli/answer.h"
#include "engines/describe.h"
#include "load/mjcf.h"
#include "results/results.h"
#include "results/store/store.h"
#include "results/transfer_text.h"
#include "run/coordinator/model_notes.h"
#include "run/coordinator/rerun.h"
#include "run/coordinator/set_up.h"
#include "run/search/programme.h"
#include "run/search/search.h"
#include "run/search/stance.h"

namespace assay::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kMinutes = 10;
// Of a search that was given no limits. The answer for the middle one is shown in full.
constexpr std::array<const char*, 3> kErrors = {"10mm", "1mm", "0.1mm"};
constexpr size_t kShownError = 1;

// ---- the programme ----------------------------------------------------------------------------------------------------

fs::path canonical_path(const std::string& path) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(fs::absolute(path, error), error);
  if (error) throw InputError(fmt::format("'{}' cannot be a path ({}): give another", path, error.message()));
  return whole;
}

// `file` from the folder `dir`, so that both can be moved together.
std::string relative_path(const std::string& file, const std::string& dir) {
  const std::string path = canonical_path(file).lexically_relative(canonical_path(dir)).string();
  return path.find('/') == std::string::npos ? "./" + path : path;
}

std::string default_out(const std::string& robot) { return fs::path(robot).stem().string() + "-results"; }

// Whether the programme `now` is that of `before` with contenders of further engines.
bool only_adds_contenders(const std::string& before, const std::string& now, const std::string& file) {
  const auto rest = [](const std::string& toml) {
    std::vector<std::string> lines;
    std::istringstream text(toml);
    for (std::string line; std::getline(text, line);) {
      if (!line.starts_with('#') && !line.starts_with("contenders = ")) lines.push_back(line);
    }
    return lines;
  };
  if (before == now || rest(before) != rest(now)) return false;
  const auto names = [&](const std::string& toml) {
    std::set<std::string> found;
    for (const CampaignContender& each : parse_campaign(toml, file).contenders) found.insert(each.resolved.name);
    return found;
  };
  try {
    const std::set<std::string> old = names(before), all = names(now);
    return old.size() < all.size() && std::ranges::includes(all, old);
  } catch (const InputError&) {
    return false;  // has_programme() says what is wrong with it
  }
}

// Whether the programme is there already, word for word. Throws InputError for another one.
bool has_programme(const std::string& dir, const std::string& file, const Programme& programme) {
  std::error_code error;
  if (!fs::exists(file, error)) return false;
  const std::string there = campaign_text(file);
  if (there == programme.toml) return true;
  // Earlier versions did not write it as a whole: a kill or a full disk left its beginning.
  if (programme.toml.starts_with(there) && !fs::exists(dir + "/assay.sqlite", error)) {
    message(fmt::format("'{}' is only the beginning of the programme, and nothing was measured yet: it is written anew",
                        file));
    return false;
  }
  if (only_adds_contenders(there, programme.toml, file)) {
    message(fmt::format("'{}': engines that were set up since take part, too", file));
    return false;
  }
  std::string hash;
  try {
    hash = parse_campaign(there, file).hash();
  } catch (const InputError& why) {
    throw InputError(fmt::format("{}; remove the file, or give another folder with --out", why.what()));
  }
  if (hash == parse_campaign(programme.toml, file).hash()) return false;
  throw InputError(
      fmt::format("'{}' is another programme: give another folder with --out, or go on with 'assay run "
                  "{} --out {}'",
                  file, file, dir));
}

// Writes the programme unless it is there, so that a search goes on.
void write_programme(const std::string& dir, const Programme& programme) {
  const std::string file = (fs::path(dir) / "campaign.toml").string();
  if (has_programme(dir, file, programme)) return;
  std::error_code error;
  fs::create_directories(dir, error);
  if (error) throw SystemError(fmt::format("cannot make the directory '{}': {}", dir, error.message()));
  write_file(file, programme.toml);
}

// ---- what is searched for ---------------------------------------------------------------------------------------------

// The values that --error limits: each system's error against the reference solution, else its self-consistency error.
std::vector<std::string> errors_of(const Campaign& campaign) {
  std::vector<std::string> values;
  for (const CampaignSystem& system : campaign.systems) {
    if (!system.has(Reads::kSolution) && !system.has(Reads::kPieces)) continue;
    const std::string_view value = system.has(Reads::kSolution) ? kTruthError : "consistency";
    if (std::ranges::find(values, value) == values.end()) values.emplace_back(value);
  }
  return values;
}

// A limit on what is not measured would end in no answer after the whole budget.
void check_limitable(const Campaign& campaign, const char* option, const std::string& given,
                     const std::string& of_value) {
  const auto measured = [&](const ValueInfo& value) {
    return std::ranges::any_of(campaign.systems, [&](const CampaignSystem& system) {
      return std::ranges::any_of(system.measures,
                                 [&](const Measure* measure) { return measure->name == value.measure; });
    });
  };
  const ValueInfo value = value_info(of_value);
  if (value.limit && measured(value)) return;
  std::vector<std::string> names;
  for (const ValueInfo& each : value_catalogue()) {
    if (each.limit && measured(each)) names.push_back(each.name);
  }
  throw InputError(fmt::format("{}: '{}' {}{}", option, given,
                               measured(value) ? "is no error and cannot be limited"
                                               : fmt::format("is not measured on any system of '{}'", campaign.name),
                               did_you_mean(given, names)));
}

Limits limits_of(const Campaign& campaign, const LimitOptions& options) {
  Limits limits;
  const auto add = [&](const std::string& what, const std::string& name, const std::string& text) {
    const bool twice = std::ranges::any_of(limits.largest, [&](const auto& other) { return other.first == name; });
    if (twice) throw InputError(fmt::format("'{}' is limited twice: give one limit for it", name));
    const ValueInfo value = value_info(name);
    limits.largest.emplace_back(name, parse_quantity(what, text, value.unit.empty() ? "m" : value.unit));
  };
  if (options.error && options.measure) {
    const std::string named = value_named(*options.measure);
    add("--error", named.empty() ? *options.measure : named, *options.error);
  } else if (options.error) {
    for (const std::string& value : errors_of(campaign)) add("--error", value, *options.error);
  }
  if (options.penetration) add("--penetration", "penetration_max", *options.penetration);
  if (options.slip) {
    check_limitable(campaign, "--slip", "grasp_slip", "grasp_slip");
    add("--slip", "grasp_slip", *options.slip);
  }
  for (const std::string& limit : options.limits) {
    const size_t equals = limit.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw InputError(fmt::format("--limit is '{}': write NAME=QUANTITY, as in truth_error_max=1mm", limit));
    }
    const std::string name = limit.substr(0, equals), named = value_named(name), own = named.empty() ? name : named;
    check_limitable(campaign, "--limit", name, own);
    add("--limit " + name, own, limit.substr(equals + 1));
  }
  if (options.realtime) limits.realtime = parse_positive("--realtime", *options.realtime, "times real time");
  return limits;
}

LimitOptions limits_in(const SearchTable& table) {
  LimitOptions options;
  const auto text = [&](const char* key) -> std::optional<std::string> {
    const auto found = table.limits.find(key);
    return found == table.limits.end() ? std::nullopt : std::optional(found->second);
  };
  options.error = text("error");
  options.penetration = text("penetration");
  options.slip = text("slip");
  options.realtime = text("realtime");
  options.limits = table.other_limits;
  return options;
}

// One set of limits, or one for each of the usual errors.
std::vector<LimitOptions> goals_of(const LimitOptions& options) {
  if (options.any()) return {options};
  std::vector<LimitOptions> goals;
  for (const char* error : kErrors) goals.emplace_back().error = error;
  return goals;
}

// ---- the answer -------------------------------------------------------------------------------------------------------

std::optional<Recommendation> answer_to(const LimitOptions& goal, const SystemAnswers& answers, Question& question,
                                        std::string& why) {
  SystemAnswers partial;
  std::vector<std::string> missing;
  for (const std::string& main : answers.mains) {
    const bool measured = std::ranges::find(answers.errors, main) != answers.errors.end();
    if (measured) partial.mains.push_back(main);
    if (!measured) missing.push_back(value_info(main).brief);
  }
  if (!missing.empty()) {
    why = answers.points.empty() ? "nothing was measured"
                                 : fmt::format("no contender's {} was measured", join(missing, " and "));
    if (partial.mains.empty()) return std::nullopt;
    partial.values = answers.values;
    partial.errors = answers.errors;
    partial.points = answers.points;
    try {
      question = question_of(goal, partial);
      why += ": " + nearest_text(partial, question, {});
    } catch (const InputError&) {  // NOLINT(bugprone-empty-catch): a limit on what was not measured either
    }
    return std::nullopt;
  }
  try {
    question = question_of(goal, answers);
  } catch (const InputError& error) {
    why = error.what();
    return std::nullopt;
  }
  Recommendation found = recommend(answers, question.limits);
  if (!found.best) {
    why = fmt::format("no contender that was measured has {}: {}", limits_text(question),
                      nearest_text(answers, question, found));
    return std::nullopt;
  }
  return found;
}

std::string names_text(const SystemAnswers& answers, const std::vector<size_t>& candidates) {
  std::vector<std::string> names;
  names.reserve(candidates.size());
  for (const size_t i : candidates) names.push_back(place_text(answers.at(answers.candidates[i])));
  return names.empty() ? "" : join(names, ", ");
}

// A line for each of the usual errors.
void add_goals(const std::vector<LimitOptions>& goals, const SystemAnswers& answers, Answer& answer) {
  std::vector<std::vector<std::string>> rows;
  for (const LimitOptions& goal : goals) {
    Question question;
    std::string why;
    const auto found = answer_to(goal, answers, question, why);
    if (!found) {
      rows.push_back({goal.error.value_or(""), "none yet", "", "", ""});
      continue;
    }
    const Candidate& best = answers.candidates[found->contenders.front()];
    const Point& point = answers.at(best);
    rows.push_back({goal.error.value_or(""), point.contender, timestep_label(point.timestep_ms) + " ms",
                    realtime_text(best.speed.factor.value), names_text(answers, found->alike)});
  }
  answer.part("The fastest for an error");
  answer.table({"error", "contender", "timestep", "real time", "not told apart"}, std::move(rows), {2, 3});
}

// What the engine does not carry over exactly for this robot in steps of that length.
void add_approximated(const Campaign& campaign, const std::string& contender, double timestep_ms, Answer& answer) {
  const auto own = std::ranges::find_if(campaign.contenders,
                                        [&](const CampaignContender& each) { return each.resolved.name == contender; });
  if (own == campaign.contenders.end() || own->resolved.engine == nullptr) return;
  Settings settings = own->resolved.settings;
  settings.timestep = timestep_ms / 1e3;
  std::vector<Limitation> limitations;
  for (const CampaignSystem& system : campaign.systems) {
    std::ranges::copy(own->resolved.engine->check(system.model, settings), std::back_inserter(limitations));
  }
  answer.part(fmt::format("What {} approximates in this robot", contender));
  const std::vector<std::string> lines = approximations(limitations);
  if (lines.empty()) answer.line("nothing: it carries over the whole model");
  for (const std::string& line : lines) answer.line(line);
}

// Contenders for one reason, in the order in which the reasons came.
class Reasons {
 public:
  void add(const std::string& contender, const std::string& reason) {
    auto own = std::ranges::find(groups_, reason, &std::pair<std::string, std::vector<std::string>>::first);
    if (own == groups_.end()) own = groups_.insert(groups_.end(), {reason, {}});
    own->second.push_back(contender);
  }
  bool empty() const { return groups_.empty(); }
  void write(Answer& answer) const {
    for (const auto& [reason, contenders] : groups_) answer.line(fmt::format("{}: {}", join(contenders, ", "), reason));
  }

 private:
  std::vector<std::pair<std::string, std::vector<std::string>>> groups_;
};

// Contenders that have no point within the limits, with their first failure. Those in `undecided` are named elsewhere,
// unless they failed.
void add_failures(const SystemAnswers& answers, const Question& question, const Recommendation& found,
                  const SearchSummary& done, Answer& answer) {
  std::set<std::string> named;
  for (const size_t i : found.contenders) named.insert(answers.at(answers.candidates[i]).contender);
  Reasons failed, over;
  for (const std::string& each : done.failed_gate) {
    const std::string contender = each.substr(0, each.find(' '));
    failed.add(contender, "does not pass the conformance suite" + each.substr(contender.size()));
    named.insert(contender);
  }
  for (const Point& point : answers.points) {
    if (point.sound || named.contains(point.contender)) continue;
    failed.add(point.contender, fmt::format("fails from {} ms {}", timestep_label(point.fails_ms), point.why));
    named.insert(point.contender);
  }
  named.insert(done.undecided.begin(), done.undecided.end());
  for (const Point& point : answers.points) {
    if (!named.insert(point.contender).second) continue;
    const auto worst = std::ranges::find_if(question.asked, [&](const Asked& asked) {
      const auto own = point.worst.find(asked.value.name);
      return own != point.worst.end() && own->second.value.value > asked.largest;
    });
    over.add(point.contender,
             worst == question.asked.end()
                 ? std::string("within the limits where measured, and slower")
                 : fmt::format("{} of {} at {} ms, and too slow at smaller timesteps", worst->value.brief,
                               quantity_text(point.worst.at(worst->value.name).value.value, worst->value.unit),
                               timestep_label(point.timestep_ms)));
  }
  if (failed.empty() && over.empty()) return;
  answer.part("What did not qualify, and why");
  failed.write(answer);
  over.write(answer);
}

void print_next(const Campaign& campaign, const std::string& dir, const std::optional<std::string>& contender) {
  const std::string& first = campaign.systems.front().name;
  print("\n" + heading("To run next") + ":\n");
  const auto line = [](const std::string& command, const std::string& what) {
    print(paragraph(fmt::format("  {}  # {}", command, what), 4));
  };
  line(fmt::format("assay recommend {} all --error 0.5mm --realtime 10", dir), "other limits, without measuring again");
  if (contender) {
    line(fmt::format("assay snapshot {} {} --contender {} --time 1 --out robot.png", dir, first, *contender),
         "a picture of the run");
  }
  line(fmt::format("assay run {} --out {}-again", (fs::path(dir) / "campaign.toml").string(), dir),
       "the same programme again, or as you have changed it");
}

// How much was measured, and what could still change the answer.
void add_certainty(const SearchSummary& done, Answer& answer) {
  constexpr size_t kNamed = 8;
  answer.part("How sure this is");
  answer.line(fmt::format("{} of {} cells were measured in {}, {} of processor time", done.measured, done.cells,
                          duration_label(done.wall_s), duration_label(done.cpu_s)));
  if (done.undecided.empty()) {
    answer.line("no other contender can still win: each is slower, failed or exceeds a limit");
  } else {
    const size_t shown = done.undecided.size() > kNamed + 2 ? kNamed : done.undecided.size();
    std::vector<std::string> names(done.undecided.begin(), done.undecided.begin() + static_cast<std::ptrdiff_t>(shown));
    if (shown < done.undecided.size()) names.push_back(fmt::format("{} more", done.undecided.size() - shown));
    answer.line(
        fmt::format("the budget ended before these were decided, at this or a larger timestep, and they may be "
                    "faster: {}; the same command goes on, also with more --minutes",
                    join(names, ", ")));
  }
  for (const std::string& each : done.without_truth) answer.line("no reference solution on " + each);
}

// For the report's page.
void keep_answer(const std::string& dir, const Answer& answer) {
  open_to_write(dir).set_manifest({{"answer", dump_json(answer.json())}});
}

// Runs of one contender of each engine on the first system, for the report's replays: those that the search had no
// reason to keep. They take seconds.
void keep_pictures(const std::string& dir, const Campaign& campaign, const std::optional<std::string>& best) {
  constexpr size_t kMost = 6;
  constexpr double kTimestep = 1;  // ms
  Store store = open_to_write(dir);
  const std::string& system = campaign.systems.front().name;
  std::vector<std::string> contenders;
  std::set<std::string> engines;
  if (best) contenders.push_back(*best);
  for (const CampaignContender& each : campaign.contenders) {
    if (each.resolved.engine == nullptr) continue;
    const std::string engine = each.resolved.engine->name();
    const bool is_best = best == each.resolved.name;
    if (is_best) engines.insert(engine);
  }
  for (const CampaignContender& each : campaign.contenders) {
    if (each.resolved.engine == nullptr || contenders.size() >= kMost) continue;
    if (engines.insert(each.resolved.engine->name()).second) contenders.push_back(each.resolved.name);
  }
  try {
    if (fits_samples(store, system, kTimestep)) keep_runs(store, system, contenders, kTimestep);
  } catch (const InputError& error) {  // a budget that ended before anything was measured
    message(fmt::format("no replays of other engines: {}", error.what()));
  }
}

void add_refusals(const std::vector<Refusal>& refusals, Answer& answer) {
  if (refusals.empty()) return;
  answer.part("Engines that refuse this robot");
  for (const Refusal& refusal : refusals) {
    answer.line(fmt::format("{}: {} ({})", refusal.engine, refusal.text, join(refusal.contenders, ", ")));
  }
}

// Those that a set-up would add. Their results join those that are there.
void add_not_asked(const RunRequest& request, Answer& answer) {
  const std::vector<AbsentEngine>& absent = Registry::instance().absent();
  if (absent.empty()) return;
  answer.part("Engines that were not asked");
  const std::vector<AbsentEngine> engines = obtainable(absent);
  if (engines.empty()) {  // no clone's set-up helps here
    std::vector<std::string> names;
    for (const AbsentEngine& engine : absent) names.push_back(engine.name);
    answer.line(fmt::format("not here: {}; 'assay engines' says how to get each", join(names, ", ")));
    return;
  }
  answer.line(fmt::format("not set up here: {}", obtainable_text(engines)));
  answer.line(fmt::format("to ask them, too: {} && ./{}", set_up_command(engines), request.command));
}

int search_and_answer(const RunRequest& request, const Campaign& campaign, const std::vector<Refusal>& refusals) {
  const SearchTable table = campaign.search.value_or(SearchTable());
  const LimitOptions limits = limits_in(table);
  const std::vector<LimitOptions> goals = goals_of(limits);
  SearchOptions options;
  options.run = run_options(request);
  options.budget_s = 60 * table.minutes;
  for (const LimitOptions& goal : goals) options.goals.push_back(limits_of(campaign, goal));
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

  Answer answer;
  std::optional<std::string> best;
  double best_timestep_ms = 0;
  bool any = false;
  {
    const Store store = Store::open(request.out);
    const Results results(store);
    SystemAnswers answers = answers_together(results, results.systems(), campaign.name);
    answers.mains = errors_of(campaign);  // also those that no contender has yet
    Question question;
    std::string why;
    const auto found = answer_to(goals.size() > 1 ? goals[kShownError] : goals.front(), answers, question, why);
    if (found) {
      add_best(answers, question, *found, answer);
      const Point& point = answers.at(answers.candidates[found->contenders.front()]);
      best = point.contender;
      best_timestep_ms = point.timestep_ms;
    } else {
      answer.part(campaign.name + ": no recommendation");
      answer.line(why);
    }
    any = found.has_value();
    if (goals.size() > 1) {
      add_goals(goals, answers, answer);
      for (const LimitOptions& goal : goals) {
        Question other;
        any = any || answer_to(goal, answers, other, why).has_value();
      }
    }
    add_certainty(done, answer);
    if (best) add_approximated(campaign, *best, best_timestep_ms, answer);
    add_failures(answers, question, found.value_or(Recommendation()), done, answer);
  }
  add_refusals(refusals, answer);
  add_not_asked(request, answer);
  answer.print();
  print("\n");
  keep_answer(request.out, answer);
  keep_pictures(request.out, campaign, best);
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
  if (ending == ".urdf" || ending == ".xml" || ending == ".mjcf" || ending == ".xacro") return true;
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
  write_programme(run.out, programme);
  const std::string toml = (fs::path(run.out) / "campaign.toml").string();
  const Campaign campaign = load_campaign(toml);
  for (const LimitOptions& goal : goals_of(limits)) limits_of(campaign, goal);  // their errors come before all else
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
    answer.print();
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
  answer.print();
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
