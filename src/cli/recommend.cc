// `assay recommend`: the fastest contender and timestep within limits.
#include "cli/recommend.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/quantity.h"
#include "base/text.h"
#include "cli/commands.h"
#include "measures/measure.h"
#include "results/store/store.h"

namespace assay::cli {
namespace {

struct RecommendOptions : LimitOptions {
  std::vector<std::string> where;  // SYSTEM, or DIR SYSTEM
  bool json = false;
};

std::string results_dir(const std::vector<std::string>& where) {
  if (where.size() == 2) return where.front();
  return std::filesystem::exists("assay.sqlite") ? "." : "results";
}

// The name that stands for all systems together.
constexpr const char* kAll = "all";

// ---- what is asked ----------------------------------------------------------------------------------------------------

// A value of the system that can be limited, by its name or its measure's.
const ValueInfo& limitable(const SystemAnswers& answers, const std::string& name) {
  const std::string named = value_named(name, answers.values), own = named.empty() ? name : named;
  const auto known = std::ranges::find(answers.values, own, &ValueInfo::name);
  const std::string near = did_you_mean(name, answers.errors);
  if (known == answers.values.end()) {
    throw InputError(fmt::format("'{}' was not measured by '{}'{}", answers.system, name, near));
  }
  if (std::ranges::find(answers.errors, own) == answers.errors.end()) {
    throw InputError(fmt::format("'{}' cannot be limited: it is no error that was measured on '{}' (known: {})", own,
                                 answers.system, join(answers.errors, ", ")));
  }
  return *known;
}

}  // namespace

Question question_of(const LimitOptions& options, const SystemAnswers& answers) {
  Question question;
  const auto ask = [&](const std::string& what, const std::string& name, const std::string& text) {
    const ValueInfo& value = limitable(answers, name);
    const double largest = parse_quantity(what, text, value.unit);
    if (std::ranges::any_of(question.asked, [&](const Asked& asked) { return asked.value.name == value.name; })) {
      throw InputError(fmt::format("'{}' is limited twice: give one limit for it", value.name));
    }
    question.asked.push_back({value, largest, text});
    question.limits.largest.emplace_back(value.name, largest);
  };
  if (options.measure && !options.error) {
    throw InputError(fmt::format("--measure is '{}' without --error: add the largest error", *options.measure));
  }
  if (options.error && (options.measure || answers.mains.empty())) {
    ask("--error", options.measure.value_or(answers.main), *options.error);
  } else if (options.error) {
    for (const std::string& main : answers.mains) ask("--error", main, *options.error);
  }
  if (options.penetration) ask("--penetration", "penetration_max", *options.penetration);
  if (options.slip) ask("--slip", "grasp_slip", *options.slip);
  for (const std::string& limit : options.limits) {
    const size_t equals = limit.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw InputError(fmt::format("--limit is '{}': write NAME=QUANTITY, as in truth_error_max=1mm", limit));
    }
    ask("--limit " + limit.substr(0, equals), limit.substr(0, equals), limit.substr(equals + 1));
  }
  if (options.realtime) question.limits.realtime = parse_positive("--realtime", *options.realtime, "times real time");
  if (question.asked.empty() && !question.limits.realtime) {
    throw InputError("no limit was given: add --error, --penetration, --slip, --realtime or --limit");
  }
  return question;
}

std::string limits_text(const Question& question) {
  std::vector<std::string> parts;
  parts.reserve(question.asked.size() + 1);
  for (const Asked& asked : question.asked) {
    parts.push_back(fmt::format("{} within {}", asked.value.brief, asked.text));
  }
  if (question.limits.realtime)
    parts.push_back(fmt::format("at least {} real time", realtime_text(*question.limits.realtime)));
  return join(parts, ", ");
}

// ---- the answer -------------------------------------------------------------------------------------------------------

std::string place_text(const Point& point) {
  return fmt::format("{} at {} ms", point.contender, timestep_label(point.timestep_ms));
}

namespace {

std::string with_interval(const Interval& interval, const std::string& unit) {
  std::string text = quantity_text(interval.value, unit);
  if (interval.low == interval.high) return text;
  return fmt::format("{} ({} to {})", text, quantity_text(interval.low, unit), quantity_text(interval.high, unit));
}

// "<= 3 um" for an upper bound.
std::string worst_text(const Worst& worst, const std::string& unit) {
  return (worst.is_bound ? "<= " : "") + quantity_text(worst.value.value, unit);
}

// Several of them as one sentence's end.
std::string places_text(const SystemAnswers& answers, const std::vector<size_t>& candidates) {
  std::vector<std::string> places;
  places.reserve(candidates.size());
  for (const size_t i : candidates) places.push_back(place_text(answers.at(answers.candidates[i])));
  return join(places, ", ");
}

void add_candidates(const SystemAnswers& answers, const Question& question, const std::vector<size_t>& candidates,
                    Answer& answer) {
  constexpr size_t kMostErrors = 3;  // columns that fit
  std::vector<ValueInfo> errors;
  for (const Asked& asked : question.asked) {
    if (errors.size() < kMostErrors) errors.push_back(asked.value);
  }
  // An error of a motion with contacts says little without how deep the contacts give way, and whether they push back:
  // a soft one is easy to repeat.
  for (const char* name : {"penetration_max", "grasp_slip", "rebound"}) {
    const auto measured = std::ranges::find(answers.values, name, &ValueInfo::name);
    const bool shown = std::ranges::find(errors, name, &ValueInfo::name) != errors.end();
    if (measured != answers.values.end() && !shown && !errors.empty()) errors.push_back(*measured);
  }
  std::vector<std::string> headings = {"contender", "timestep", "real time"};
  for (const ValueInfo& value : errors) headings.push_back(value.brief);
  std::vector<std::vector<std::string>> rows;
  bool estimated = false;
  for (const size_t i : candidates) {
    const Candidate& candidate = answers.candidates[i];
    const Point& point = answers.at(candidate);
    estimated = estimated || !candidate.speed.timed;
    std::vector<std::string>& row = rows.emplace_back();
    row = {point.contender, timestep_label(point.timestep_ms) + " ms",
           (candidate.speed.timed ? "" : "~ ") + realtime_text(candidate.speed.factor.value)};
    for (const ValueInfo& value : errors) {
      const auto own = candidate.worst.find(value.name);
      row.push_back(own == candidate.worst.end() ? "" : worst_text(own->second, value.unit));
    }
  }
  if (estimated) answer.line("~ interpolated between timed timesteps");
  std::vector<size_t> right(headings.size() - 1);
  std::iota(right.begin(), right.end(), 1);
  answer.table(headings, rows, right);
}

// What a candidate has of the values that are limited.
std::string asked_text(const Candidate& candidate, const Question& question) {
  std::vector<std::string> parts;
  parts.reserve(question.asked.size() + 1);
  for (const Asked& asked : question.asked) {
    parts.push_back(
        fmt::format("{} {}", asked.value.brief, worst_text(candidate.worst.at(asked.value.name), asked.value.unit)));
  }
  if (question.limits.realtime) parts.push_back(realtime_text(candidate.speed.factor.value) + " real time");
  return join(parts, ", ");
}

// The values that are asked for, as far as they are known, and by how much they miss their limits.
std::string missed_text(const std::map<std::string, Worst>& worst, std::optional<double> speed,
                        const Question& question) {
  std::vector<std::string> parts;
  const auto beyond = [](double factor) {
    return factor > 1 && std::isfinite(factor) ? fmt::format(", {:.3g} times the limit", factor) : "";
  };
  for (const Asked& asked : question.asked) {
    const auto own = worst.find(asked.value.name);
    if (own == worst.end()) continue;
    parts.push_back(fmt::format("{} {}{}", asked.value.brief, worst_text(own->second, asked.value.unit),
                                beyond(own->second.value.value / asked.largest)));
  }
  if (question.limits.realtime && speed) {
    const double least = *question.limits.realtime;
    parts.push_back(fmt::format("{} real time{}", realtime_text(*speed),
                                *speed < least ? fmt::format(", {:.3g} of the least", *speed / least) : ""));
  }
  return join(parts, "; ");
}

// What is left out, by contender and reason.
struct LeftOut {
  std::string contender, why;
  std::vector<double> timesteps_ms;
  bool fails = false;
};

std::vector<LeftOut> left_out(const SystemAnswers& answers, const Question& question, const Recommendation& found) {
  std::vector<LeftOut> groups;
  const auto add = [&](const Point& point, const std::string& why, bool fails) {
    auto same = std::ranges::find_if(groups, [&](const LeftOut& group) {
      return group.contender == point.contender && (fails ? group.fails : group.why == why);
    });
    if (same == groups.end()) same = groups.insert(groups.end(), {point.contender, why, {}, fails});
    same->timesteps_ms.push_back(point.timestep_ms);
  };
  for (const Excluded& each : answers.excluded) {
    const Point& point = answers.points[each.point];
    add(point, each.why, !point.sound);
  }
  for (const Candidate& candidate : answers.candidates) {
    for (const Asked& asked : question.asked) {
      if (candidate.worst.contains(asked.value.name)) continue;
      add(answers.at(candidate), fmt::format("the {} was not measured", asked.value.brief), false);
    }
  }
  for (const size_t i : found.beyond) {
    const Candidate& candidate = answers.candidates[i];
    add(answers.at(candidate), "beyond the limits, and nearest to them here: " + asked_text(candidate, question),
        false);
  }
  for (LeftOut& group : groups) std::ranges::sort(group.timesteps_ms);
  std::ranges::stable_sort(groups, {}, &LeftOut::contender);
  return groups;
}

}  // namespace

void print_left_out(const SystemAnswers& answers, const Question& question, const Recommendation& found) {
  std::vector<LeftOut> groups = left_out(answers, question, found), single, shared;
  if (groups.empty()) return;
  print("\n" + heading("Not considered, or beyond the limits") + ":\n");
  // What is the same for several contenders stands once, and last.
  while (!groups.empty()) {
    LeftOut group = groups.front();
    const auto alike = [&](const LeftOut& other) {
      return !group.fails && !other.fails && other.why == group.why && other.timesteps_ms == group.timesteps_ms;
    };
    const auto count = std::ranges::count_if(groups, alike);
    if (count > 1) {
      std::erase_if(groups, alike);
      group.contender = counted(static_cast<size_t>(count), "contender");
    } else {
      groups.erase(groups.begin());
    }
    (count > 1 ? shared : single).push_back(std::move(group));
  }
  single.insert(single.end(), shared.begin(), shared.end());
  for (const LeftOut& group : single) {
    std::string steps;
    if (group.fails) {
      steps = fmt::format("from {} ms", timestep_label(group.timesteps_ms.front()));
    } else {
      std::vector<std::string> labels;
      labels.reserve(group.timesteps_ms.size());
      for (const double step : group.timesteps_ms) labels.push_back(timestep_label(step));
      steps = fmt::format("at {} ms", join(labels, ", "));
    }
    print(paragraph(fmt::format("  {} {}: {}", group.contender, steps, group.why), 4));
  }
}

namespace {

// ---- the same as JSON -------------------------------------------------------------------------------------------------

Json interval_json(const Interval& of) { return {{"value", of.value}, {"low", of.low}, {"high", of.high}}; }

Json candidate_json(const SystemAnswers& answers, const Question& question, size_t index) {
  const Candidate& candidate = answers.candidates[index];
  const Point& point = answers.at(candidate);
  Json worst = Json::object();
  for (const auto& [name, of] : candidate.worst) {
    worst[name] = interval_json(of.value);
    worst[name]["at_ms"] = of.at_ms;
    if (of.is_bound) worst[name]["bound"] = true;
  }
  Json settings = Json::array();
  for (const SettingChange& change : answers.changes.at(point.contender)) {
    settings.push_back({{"setting", change.setting},
                        {"value", change.value},
                        {"default", change.otherwise.empty() ? Json(nullptr) : Json(change.otherwise)},
                        {"unit", change.unit},
                        {"meaning", change.meaning}});
  }
  const std::string first = question.asked.empty() ? answers.main : question.asked.front().value.name;
  Json exceeds = nullptr;
  if (const auto beyond = first_exceeded(answers, candidate, question.limits)) {
    exceeds = {{"timestep_ms", beyond->timestep_ms}, {"value", beyond->value}, {"worst", beyond->worst.value.value}};
  }
  return {{"contender", point.contender},
          {"timestep_ms", point.timestep_ms},
          {"realtime_factor", interval_json(candidate.speed.factor)},
          {"error", worst.contains(first) ? interval_json(candidate.worst.at(first).value) : Json(nullptr)},
          {"varies", point.varies},
          {"settings", std::move(settings)},
          {"timed", candidate.speed.timed},
          {"between_ms", {candidate.speed.below_ms, candidate.speed.above_ms}},
          {"coverage", candidate.speed.coverage ? Json(*candidate.speed.coverage) : Json(nullptr)},
          {"worst", std::move(worst)},
          {"exceeds", std::move(exceeds)},
          {"margin", candidate.margin},
          {"end_of_grid", candidate.end_of_grid.empty() ? Json(nullptr) : Json(candidate.end_of_grid)}};
}

Json answer_json(const SystemAnswers& answers, const Question& question, const Recommendation& found) {
  const auto list = [&](const std::vector<size_t>& indices) {
    Json all = Json::array();
    for (const size_t i : indices) all.push_back(candidate_json(answers, question, i));
    return all;
  };
  const auto one = [&](const std::optional<size_t>& index) {
    return index ? candidate_json(answers, question, *index) : Json(nullptr);
  };
  Json limits = Json::array(), excluded = Json::array();
  for (const Asked& asked : question.asked) {
    limits.push_back({{"value", asked.value.name}, {"unit", asked.value.unit}, {"largest", asked.largest}});
  }
  for (const LeftOut& group : left_out(answers, question, found)) {
    excluded.push_back({{"contender", group.contender}, {"timesteps_ms", group.timesteps_ms}, {"why", group.why}});
  }
  const Asked* first = question.asked.empty() ? nullptr : &question.asked.front();
  const std::string name = first == nullptr ? answers.main : first->value.name;
  std::vector<size_t> front;
  if (const auto members = answers.fronts.find(name); members != answers.fronts.end()) {
    for (const FrontMember& member : members->second) {
      const auto at = std::ranges::find(answers.candidates, member.point, &Candidate::point);
      front.push_back(static_cast<size_t>(at - answers.candidates.begin()));
    }
  }
  return {{"system", answers.system},
          {"measure", name},
          {"unit", first == nullptr ? Json(nullptr) : Json(first->value.unit)},
          {"error", first == nullptr ? Json(nullptr) : Json(first->largest)},
          {"limits", std::move(limits)},
          {"realtime", question.limits.realtime ? Json(*question.limits.realtime) : Json(nullptr)},
          {"recommended", one(found.best)},
          {"certain", one(found.certain)},
          {"nearest", one(found.nearest)},
          {"not_told_apart", list(found.alike)},
          {"contenders", list(found.contenders)},
          {"front", list(front)},
          {"excluded", std::move(excluded)}};
}

// ---- the command ------------------------------------------------------------------------------------------------------

SystemAnswers answers_in(const std::string& dir, const std::string& system) {
  const Store store = Store::open(dir);
  const Results results(store);
  const bool named = std::ranges::find(results.systems(), system) != results.systems().end();
  if (system == kAll && !named) return answers_together(results, results.systems(), kAll);
  if (!named) {
    throw InputError(fmt::format("'{}' has no system '{}'{}", dir, system, did_you_mean(system, results.systems())));
  }
  return answers_of(results, system);
}

}  // namespace

std::string nearest_text(const SystemAnswers& answers, const Question& question, const Recommendation& found) {
  if (found.nearest) {
    const Candidate& candidate = answers.candidates[*found.nearest];
    const Point& point = answers.at(candidate);
    return fmt::format("the nearest is {} with {}", place_text(point),
                       missed_text(point.worst, candidate.speed.factor.value, question));
  }
  // what was begun
  const Point* nearest = nullptr;
  std::pair<size_t, double> least;  // values that are missing, largest factor
  for (const Point& point : answers.points) {
    std::pair<size_t, double> own;
    for (const Asked& asked : question.asked) {
      const auto worst = point.worst.find(asked.value.name);
      if (worst == point.worst.end()) {
        ++own.first;
      } else {
        own.second = std::max(own.second, worst->second.value.value / asked.largest);
      }
    }
    if (!point.sound || own.first == question.asked.size() || (nearest != nullptr && own >= least)) continue;
    nearest = &point;
    least = own;
  }
  if (nearest == nullptr) return "no point is sound and has any of these values";
  std::vector<std::string> missing;
  for (const Asked& asked : question.asked) {
    if (!nearest->worst.contains(asked.value.name)) missing.push_back(asked.value.brief);
  }
  if (!nearest->speed) missing.emplace_back("speed");
  std::optional<double> factor;
  if (nearest->speed) factor = nearest->speed->factor.value;
  return fmt::format("the nearest is {} with {}{}", place_text(*nearest), missed_text(nearest->worst, factor, question),
                     missing.empty() ? "" : fmt::format("; not measured there: {}", join(missing, ", ")));
}

void add_best(const SystemAnswers& answers, const Question& question, const Recommendation& found, Answer& answer) {
  const Candidate& best = answers.candidates[found.contenders.front()];
  const Point& point = answers.at(best);
  answer.part(
      fmt::format("{}: {}, {} real time", answers.system, place_text(point), realtime_text(best.speed.factor.value)));
  answer.line("asked:  " + limits_text(question));
  const std::vector<SettingChange>& changes = answers.changes.at(point.contender);
  if (changes.empty()) answer.line("settings:  the adapter's defaults");
  for (const SettingChange& change : changes) answer.line("setting:  " + change_text(change));
  answer.line(fmt::format("speed:  {}, {}", with_interval(best.speed.factor, "1"),
                          best.speed.timed
                              ? "timed at this timestep"
                              : fmt::format("interpolated between {} and {} ms", timestep_label(best.speed.below_ms),
                                            timestep_label(best.speed.above_ms))));
  if (const std::string note = caveat(best.speed); !note.empty()) answer.line("        " + note);
  for (const Asked& asked : question.asked) {
    const Worst& worst = best.worst.at(asked.value.name);
    answer.line(
        fmt::format("{}:  {}{}", asked.value.brief,
                    worst.is_bound ? worst_text(worst, asked.value.unit) + " (near the floor of its fine-step run)"
                                   : with_interval(worst.value, asked.value.unit),
                    same_timestep(worst.at_ms, point.timestep_ms)
                        ? ""
                        : fmt::format(", at {} ms, the largest up to this timestep", timestep_label(worst.at_ms))));
  }
  if (point.held) {
    answer.line(fmt::format("grasp:  held from every initial state; at 95 % from at least {:.0f} % of such states",
                            100 * point.held->low));
  }
  if (const auto beyond = first_exceeded(answers, best, question.limits)) {
    const ValueInfo& value =
        std::ranges::find(question.asked, beyond->value, [](const Asked& asked) { return asked.value.name; })->value;
    answer.line(fmt::format("margin: {} {} at {} times this step ({} ms), above the limit; {}", value.brief,
                            worst_text(beyond->worst, value.unit),
                            shortest(std::round(100 * beyond->timestep_ms / point.timestep_ms) / 100),
                            timestep_label(beyond->timestep_ms), best.margin));
  } else {
    answer.line("margin: " + best.margin);
  }
  if (!found.alike.empty()) answer.line("not told apart by speed: " + places_text(answers, found.alike));
  if (found.certain != found.best) {
    answer.line(fmt::format(
        "its 95 % interval reaches beyond the limit; {}",
        found.certain
            ? fmt::format("the fastest that stays within as a whole: {}, {}", places_text(answers, {*found.certain}),
                          realtime_text(answers.candidates[*found.certain].speed.factor.value))
            : "no contender stays within as a whole"));
  }
  const auto truth = best.worst.find(value_named("truth", answers.values));
  const bool limits_truth = std::ranges::any_of(
      question.asked, [](const Asked& asked) { return reads(asked.value.measure, Reads::kSolution); });
  if (!question.asked.empty() && question.asked.front().value.name == "consistency" && !limits_truth &&
      truth != best.worst.end()) {
    answer.line(
        fmt::format("self-consistency is not accuracy: its error against the reference solution is {}; "
                    "--measure truth limits that one",
                    quantity_text(truth->second.value.value, "m")));
  }
  answer.part("Each contender at its fastest within the limits");
  add_candidates(answers, question, found.contenders, answer);
}

namespace {

int recommend_to(const RecommendOptions& options) {
  const SystemAnswers answers = answers_in(results_dir(options.where), options.where.back());
  const Question question = question_of(options, answers);
  const Recommendation found = recommend(answers, question.limits);
  if (options.json) {
    print_json(answer_json(answers, question, found));
    return found.best ? kDone : kFailed;
  }
  if (!found.best) {
    message(fmt::format("no contender on {} has {}: {}", answers.system, limits_text(question),
                        nearest_text(answers, question, found)));
    return kFailed;
  }
  Answer answer;
  add_best(answers, question, found, answer);
  answer.print();
  print_left_out(answers, question, found);
  return kDone;
}

}  // namespace

void add_limits(CLI::App& command, LimitOptions& options) {
  command.add_option("--error", options.error, "The largest error, with its unit: 1mm, 0.5deg, 2%")->type_name("E");
  command
      .add_option("--measure", options.measure,
                  "Measure or value that --error limits (default: truth where it was measured, else consistency)")
      ->type_name("NAME");
  command.add_option("--penetration", options.penetration, "The largest penetration: 2mm")->type_name("E");
  command.add_option("--slip", options.slip, "The largest slip of a grasped object: 5mm")->type_name("E");
  command.add_option("--realtime", options.realtime, "The least realtime factor: 5")->type_name("FACTOR");
  command.add_option("--limit", options.limits, "The largest of any error, by its value's name")
      ->type_name("NAME=E")
      ->allow_extra_args(false);
}

void add_recommend(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "recommend", "Recommend the fastest contender and timestep within limits",
      {{"assay recommend results humanoid --error 1mm", "by the reference solution, else by self-consistency"},
       {"assay recommend results planar-chain --error 1mm --measure consistency --realtime 5", "by self-consistency"},
       {"assay recommend results grasp --error 1mm --penetration 2mm --slip 5mm", "several limits at once"},
       {"assay recommend results planar-chain --limit energy_drift_relative=0.1%", "any measured error"}});
  const auto options = std::make_shared<RecommendOptions>();
  command
      ->add_option("SYSTEM", options->where,
                   "System, or 'all' for all of them at once, after the results directory (default: results, or here)")
      ->required()
      ->expected(1, 2)
      ->type_name("[DIR] SYSTEM");
  add_limits(*command, *options);
  command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  command->callback([&action, options] { action = [options] { return recommend_to(*options); }; });
}

}  // namespace assay::cli
