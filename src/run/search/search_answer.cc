#include "run/search/search_answer.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/quantity.h"
#include "base/text.h"
#include "engines/describe.h"
#include "results/results.h"
#include "run/coordinator/rerun.h"
#include "run/search/goals.h"

namespace assay {
namespace {

// The answer to one goal, or why there is none.
struct GoalAnswer {
  Question question;
  std::optional<Recommendation> found;
  std::string why;
};

GoalAnswer answer_to(const LimitOptions& goal, const SystemAnswers& answers) {
  GoalAnswer own;
  SystemAnswers partial;
  std::vector<std::string> missing;
  for (const std::string& main : answers.mains) {
    const bool measured = std::ranges::find(answers.errors, main) != answers.errors.end();
    if (measured) partial.mains.push_back(main);
    if (!measured) missing.push_back(value_info(main).brief);
  }
  for (const UsualLimit& usual : answers.usual) {
    if ((usual.option == "slip" ? goal.slip : goal.penetration) == kAnyQuantity) continue;
    if (std::ranges::find(answers.errors, usual.value) != answers.errors.end()) {
      partial.usual.push_back(usual);
    } else {
      missing.push_back(value_info(usual.value).brief);
    }
  }
  if (!missing.empty()) {
    own.why = answers.points.empty() ? "nothing was measured"
                                     : fmt::format("no contender's {} was measured", join(missing, " and "));
    if (partial.mains.empty()) return own;
    partial.values = answers.values;
    partial.errors = answers.errors;
    partial.points = answers.points;
    partial.start_overlap = answers.start_overlap;
    try {
      own.question = question_of(goal, partial);
      own.why += ": " + nearest_text(partial, own.question, {});
    } catch (const InputError&) {  // NOLINT(bugprone-empty-catch): a limit on what was not measured either
    }
    return own;
  }
  try {
    own.question = question_of(goal, answers);
  } catch (const InputError& error) {
    own.why = error.what();
    return own;
  }
  Recommendation found = recommend(answers, own.question.limits);
  if (found.best) {
    own.found = std::move(found);
  } else {
    own.why = fmt::format("no contender that was measured has {}: {}", limits_text(own.question),
                          nearest_text(answers, own.question, found));
  }
  return own;
}

// A line for each of the goals.
void add_goals(const std::vector<LimitOptions>& goals, const std::vector<GoalAnswer>& found,
               const SystemAnswers& answers, Answer& answer) {
  std::vector<std::vector<std::string>> rows;
  std::vector<Edge> edges;
  for (size_t i = 0; i < goals.size(); ++i) {
    const std::string error = goals[i].error.value_or("");
    if (!found[i].found) {
      rows.push_back({error, "none yet", "", "", ""});
      continue;
    }
    const Candidate& best = answers.candidates[found[i].found->contenders.front()];
    const Point& point = answers.at(best);
    edges.push_back(edge_of(answers, best, found[i].question.limits));
    rows.push_back({error, point.contender, timestep_label(point.timestep_ms) + " ms" + edge_mark(edges.back()),
                    realtime_text(best.speed.factor.value), places_text(answers, found[i].found->alike)});
  }
  answer.part("The fastest for an error");
  const auto own = std::ranges::find_if(found, [](const GoalAnswer& each) { return !each.question.asked.empty(); });
  if (own != found.end()) {
    std::vector<std::string> others;  // limits that all of them share
    for (const Asked& asked : own->question.asked) {
      if (!usual_option(asked.value.name).empty()) others.push_back(limit_of(asked));
    }
    if (!others.empty()) answer.line("each with " + join(others, ", "));
  }
  for (const std::string& line : mark_lines(edges)) answer.line(line);
  for (size_t i = 0; i < goals.size(); ++i) {
    if (!found[i].found && i != kShownGoal) answer.remark(goals[i].error.value_or(""), found[i].why);
  }
  answer.table({"error", "contender", "timestep", "real time", "not told apart"}, std::move(rows), {2, 3});
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
  for (const Missing& each : done.without_truth) answer.remark("no reference solution on " + each.name, each.why);
}

// What the engine does not carry over exactly for this robot in steps of that length.
void add_approximated(const Campaign& campaign, const Point& best, Answer& answer) {
  const auto own = std::ranges::find_if(
      campaign.contenders, [&](const CampaignContender& each) { return each.resolved.name == best.contender; });
  if (own == campaign.contenders.end() || own->resolved.engine == nullptr) return;
  Settings settings = own->resolved.settings;
  settings.timestep = best.timestep_ms / 1e3;
  std::vector<Limitation> limitations;
  for (const CampaignSystem& system : campaign.systems) {
    std::ranges::copy(own->resolved.engine->check(system.model, settings), std::back_inserter(limitations));
  }
  answer.part(fmt::format("What {} approximates in this robot", best.contender), /*evidence=*/true);
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
    for (const auto& [reason, contenders] : groups_) answer.remark(join(contenders, ", "), reason);
  }

 private:
  std::vector<std::pair<std::string, std::vector<std::string>>> groups_;
};

// Contenders that have no point within the limits, with their first failure. Those in `undecided` are named elsewhere,
// unless they failed.
void add_failures(const SystemAnswers& answers, const GoalAnswer& shown, const SearchSummary& done, Answer& answer) {
  std::set<std::string> named;
  for (const size_t i : shown.found.value_or(Recommendation()).contenders) {
    named.insert(answers.at(answers.candidates[i]).contender);
  }
  Reasons failed, over;
  for (const Missing& each : done.failed_gate) {
    failed.add(each.name, fmt::format("does not pass the conformance suite ({})", each.why));
    named.insert(each.name);
  }
  for (const Point& point : answers.points) {
    if (point.sound || named.contains(point.contender)) continue;
    failed.add(point.contender, fmt::format("fails from {} ms {}", timestep_label(point.fails_ms), point.why));
    named.insert(point.contender);
  }
  named.insert(done.undecided.begin(), done.undecided.end());
  const std::vector<Asked>& asked = shown.question.asked;
  for (const Point& point : answers.points) {
    if (!named.insert(point.contender).second) continue;
    const auto worst = std::ranges::find_if(asked, [&](const Asked& each) {
      const auto own = point.worst.find(each.value.name);
      return own != point.worst.end() && own->second.value.value > each.largest;
    });
    over.add(point.contender,
             worst == asked.end()
                 ? std::string("within the limits where measured, and slower")
                 : fmt::format("{} of {} at {} ms, and too slow at smaller timesteps", worst->value.brief,
                               quantity_text(point.worst.at(worst->value.name).value.value, worst->value.unit),
                               timestep_label(point.timestep_ms)));
  }
  if (failed.empty() && over.empty()) return;
  answer.part("What did not qualify, and why", /*evidence=*/true);
  failed.write(answer);
  over.write(answer);
}

}  // namespace

SearchAnswer answer_of_search(const Store& store, const Campaign& campaign, const std::vector<LimitOptions>& goals,
                              const SearchSummary& done) {
  const Results results(store);
  SystemAnswers answers = answers_together(results, results.systems(), campaign.name);
  answers.mains = errors_of(campaign);  // also those that no contender has yet, as of contacts
  for (const UsualLimit& usual : usual_limits(campaign)) {
    if (std::ranges::find(answers.usual, usual.option, &UsualLimit::option) == answers.usual.end()) {
      answers.usual.push_back(usual);
    }
  }
  std::vector<GoalAnswer> found;
  found.reserve(goals.size());
  for (const LimitOptions& goal : goals) found.push_back(answer_to(goal, answers));
  const GoalAnswer& shown = found[goals.size() > 1 ? kShownGoal : 0];
  SearchAnswer made;
  made.any = std::ranges::any_of(found, [](const GoalAnswer& each) { return each.found.has_value(); });
  const Point* best = nullptr;
  if (shown.found) {
    add_best(answers, shown.question, *shown.found, made.answer);
    best = &answers.at(answers.candidates[shown.found->contenders.front()]);
    made.best = best->contender;
  } else {
    made.answer.part(campaign.name + ": no recommendation");
    made.answer.line(shown.why);
  }
  if (goals.size() > 1) add_goals(goals, found, answers, made.answer);
  add_certainty(done, made.answer);
  add_grounds(answers, shown.question, made.answer);
  if (best != nullptr) add_approximated(campaign, *best, made.answer);
  add_failures(answers, shown, done, made.answer);
  return made;
}

void add_refusals(const std::vector<Refusal>& refusals, Answer& answer) {
  if (refusals.empty()) return;
  answer.part("Engines that refuse this robot", /*evidence=*/true);
  for (const Refusal& refusal : refusals) {
    answer.remark(refusal.engine, fmt::format("{} ({})", refusal.text, join(refusal.contenders, ", ")));
  }
}

void keep_answer(Store& store, const Answer& answer) {
  store.set_manifest({{kAnswerEntry, dump_json(parts_json(answer.parts()))}});
}

void keep_pictures(Store& store, const Campaign& campaign, const std::optional<std::string>& best) {
  constexpr size_t kMost = 6;
  constexpr double kTimestep = 1;  // ms
  const std::string& system = campaign.systems.front().name;
  std::vector<std::string> contenders;
  std::set<std::string> engines;
  const auto add = [&](bool is_best) {
    for (const CampaignContender& each : campaign.contenders) {
      const ResolvedContender& own = each.resolved;
      if (own.engine == nullptr || contenders.size() >= kMost || (is_best && best != own.name)) continue;
      if (engines.insert(own.engine->name()).second) contenders.push_back(own.name);
    }
  };
  add(true);
  add(false);
  if (fits_samples(store, system, kTimestep)) keep_runs(store, system, contenders, kTimestep);
}

}  // namespace assay
