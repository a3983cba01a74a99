// `assay bisect`: which release of an engine changed what a robot does, how much, and by which mechanism.
#include "bisect/bisect.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <tuple>

#include <fmt/format.h>
#include <tinyxml2.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/option_values.h"
#include "base/output_file.h"
#include "base/quantity.h"
#include "base/text.h"
#include "base/write_file.h"
#include "bisect/probes.h"
#include "bisect/releases.h"
#include "cli/answer.h"
#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/explain_options.h"
#include "engines/builds.h"
#include "engines/registry.h"
#include "engines/releases.h"
#include "explain/robots.h"
#include "measures/statistics.h"
#include "run/cluster/program.h"
#include "run/coordinator/set_up.h"

namespace assay::cli {
namespace {

constexpr int kRestoringStarts = 3;
constexpr int kSpeedRounds = 15;
constexpr int kMostProbeLines = 12;

struct BisectOptions : ExplainOptions {
  std::optional<std::string> engine, contender, from, to, repeat, out, junit;
  std::vector<std::string> settings;
  bool quick = false, speed = false, markdown = false, no_set_up = false;
};

// One of what is compared, in order: a release, or a repetition of one.
struct Stage {
  std::string release;
  Side side;
};

// What is said of one change.
struct Explained {
  ReleaseChange change;
  Apart size;
  bool rounding = false;
  std::vector<ProbeChange> probes;
  std::string no_probes;
  std::vector<Restoring> restored;
  std::optional<Interval> slower;  // the newer's time of a step over the older's
};

// The time of a step in one release, µs, and over that of the release that ran before it.
struct StepTime {
  size_t stage = 0;
  Interval us;
  std::optional<Interval> ratio;
};

std::string distance_text(double gap) { return gap == 0 ? "0" : gap < 1e-9 ? "< 1 nm" : quantity_text(gap, "m"); }

// ---- what is compared ---------------------------------------------------------------------------------------------------

// The contender in its newest release, and its engine.
ResolvedContender contender_asked(const BisectOptions& options) {
  const Registry& registry = Registry::instance();
  std::string name = options.contender.value_or("");
  if (name.empty() && options.engine) {
    const auto engine = std::ranges::find(registry.engines(), *options.engine, &Engine::name);
    std::vector<std::string> with;
    for (const Engine* each : registry.engines()) {
      if (!releases_of(each->name()).empty()) with.push_back(each->name());
    }
    if (engine == registry.engines().end() || releases_of(*options.engine).empty()) {
      throw InputError(fmt::format("--engine is '{}', of which there are no releases: engines with releases are {}",
                                   *options.engine, join(with, ", ")));
    }
    name = (*engine)->contenders().front().name;
  }
  if (name.empty()) throw InputError("which engine's releases? Give --engine mujoco, or --contender mujoco-rk4");
  if (options.contender && build_of(name) != kBaseline) {
    throw InputError(fmt::format("--contender is '{}': give '{}', and its releases with --from and --to", name,
                                 without_build(name)));
  }
  ResolvedContender contender = registry.resolve(without_build(name), parse_settings(options.settings));
  const std::string engine = contender.engine->name();
  if (releases_of(engine).empty()) {
    throw InputError(fmt::format("--contender {} is of {}, of which there are no releases", name, engine));
  }
  if (options.engine && *options.engine != engine) {
    throw InputError(
        fmt::format("--contender {} is of {} and not of {}: leave --engine out", name, engine, *options.engine));
  }
  return contender;
}

size_t place_of(const std::vector<std::string>& known, const std::string& option, const std::string& release,
                const std::string& engine) {
  const auto found = std::ranges::find(known, release);
  if (found == known.end()) {
    throw InputError(
        fmt::format("{} is '{}', and {} has no such release: it has {}", option, release, engine, join(known, ", ")));
  }
  return static_cast<size_t>(found - known.begin());
}

std::vector<std::string> releases_asked(const BisectOptions& options, const std::string& engine) {
  const std::vector<std::string> known = releases_of(engine);
  const size_t from = options.from ? place_of(known, "--from", *options.from, engine) : 0;
  const size_t to = options.to ? place_of(known, "--to", *options.to, engine) : known.size() - 1;
  if (from > to)
    throw InputError(fmt::format("--from {} is newer than --to {}: exchange them", known[from], known[to]));
  std::vector<std::string> asked(known.begin() + static_cast<std::ptrdiff_t>(from),
                                 known.begin() + static_cast<std::ptrdiff_t>(to) + 1);
  if (options.repeat) {
    const int count = parse_count("--repeat", *options.repeat, 2, 1000);
    if (asked.size() > 1) throw InputError("--repeat is of one release: give it with --from and --to, both the same");
    asked.assign(static_cast<size_t>(count), asked.front());
  } else if (asked.size() < 2) {
    throw InputError(fmt::format(
        "--from and --to are both {}: give two releases, or --repeat 20 for repetitions of one", asked.front()));
  }
  return asked;
}

// ---- the answer ---------------------------------------------------------------------------------------------------------

std::string group_text(const std::vector<Stage>& stages, const ReleaseGroup& group) {
  const std::string &first = stages[group.first].release, &last = stages[group.last].release;
  return group.first == group.last ? first : first + " to " + last;
}

Json interval_json(const Interval& of) { return {{"value", of.value}, {"low", of.low}, {"high", of.high}}; }

Json values_json(const ReleaseValues& values) {
  Json json = {{"energy_J", values.energy},           {"contacts", values.contacts},
               {"penetration_m", values.penetration}, {"joint_error_m", values.joint_error},
               {"limit_rad", values.limit},           {"falls", nullptr},
               {"velocity_error_m_per_s", nullptr},   {"turning_error_rad_per_s", nullptr}};
  if (values.falls) json["falls"] = *values.falls;
  if (values.velocity_error) json["velocity_error_m_per_s"] = *values.velocity_error;
  if (values.turning_error) json["turning_error_rad_per_s"] = *values.turning_error;
  return json;
}

Json change_json(const std::string& engine, const std::vector<Stage>& stages, const Explained& of,
                 const std::vector<MeasuredRelease>& measured) {
  Json probes = Json::array(), restored = Json::array();
  for (const ProbeChange& each : of.probes) {
    probes.push_back({{"probe", each.before.probe},
                      {"condition", each.before.condition},
                      {"quantity", each.before.quantity},
                      {"unit", each.before.unit},
                      {"before", each.before.value},
                      {"after", each.after}});
  }
  for (const Restoring& each : of.restored) {
    restored.push_back({{"setting", each.setting}, {"left_m", each.left}, {"same_bits", each.same_bits}});
  }
  Json json = {{"before", stages[of.change.before].release},
               {"after", stages[of.change.after].release},
               {"distance_m", of.size.mean},
               {"largest_m", of.size.largest},
               {"rounding", of.rounding},
               {"values_before", values_json(measured[of.change.before].values)},
               {"values_after", values_json(measured[of.change.after].values)},
               {"probes", probes},
               {"no_probes", of.no_probes},
               {"restoring", restored},
               {"changelog", changelog_of(engine, stages[of.change.after].release)},
               {"step_time_ratio", nullptr}};
  if (of.slower) json["step_time_ratio"] = interval_json(*of.slower);
  return json;
}

void add_groups(const std::vector<Stage>& stages, const ReleaseCourse& course,
                const std::vector<MeasuredRelease>& measured, Answer& answer) {
  std::vector<std::string> names = {"releases", "number", "energy at the end (J)", "touching pairs", "penetration"};
  const ReleaseValues& first = measured[course.groups.front().first].values;  // all have what one has
  if (first.falls) names.emplace_back("falls");
  if (first.velocity_error) names.emplace_back("velocity error (m/s)");
  names.emplace_back("");
  std::vector<std::vector<std::string>> rows;
  for (const ReleaseGroup& group : course.groups) {
    const ReleaseValues& values = measured[group.first].values;
    std::vector<std::string> row = {group_text(stages, group), fmt::format("{}", group.last - group.first + 1),
                                    fmt::format("{:.6g}", values.energy), fmt::format("{:.3g}", values.contacts),
                                    distance_text(values.penetration)};
    if (first.falls) row.push_back(fmt::format("{:.0f} %", 100 * values.falls.value_or(0)));
    if (first.velocity_error) {
      row.push_back(values.velocity_error ? fmt::format("{:.3g}", *values.velocity_error) : "–");
    }
    row.emplace_back(group.inferred ? "ends alike, not all run" : "same bits");
    rows.push_back(std::move(row));
  }
  std::vector<size_t> numbers;
  for (size_t i = 1; i + 1 < names.size(); ++i) {
    if (i != 4) numbers.push_back(i);
  }
  answer.table(std::move(names), std::move(rows), std::move(numbers));
}

// The command that compares the two releases further, under the same run and settings.
std::string explain_command(const BisectOptions& options, const ResolvedContender& contender, const std::string& before,
                            const std::string& after) {
  std::vector<std::string> words = {"assay", "explain", shell_word(options.model.model),
                                    in_build(contender.base, before), in_build(contender.base, after)};
  for (const char* side : {"--change-a", "--change-b"}) {
    for (const std::string& setting : options.settings) words.insert(words.end(), {side, shell_word("set:" + setting)});
  }
  const std::vector<std::string> same =
      given_words(*options.command, "",
                  {"--engine", "--contender", "--from", "--to", "--quick", "--set", "--speed", "--repeat", "--out",
                   "--no-set-up", "--json", "--markdown", "--junit"});
  words.insert(words.end(), same.begin(), same.end());
  return join(words, " ");
}

void add_change(const BisectOptions& options, const ResolvedContender& contender, const std::vector<Stage>& stages,
                const Explained& of, const std::vector<MeasuredRelease>& measured, Answer& answer) {
  const std::string &before = stages[of.change.before].release, &after = stages[of.change.after].release;
  const ReleaseValues &was = measured[of.change.before].values, &is = measured[of.change.after].values;
  answer.part(fmt::format("{} to {}: {}", before, after, of.rounding ? "rounding" : "the motion changed"));
  answer.fact("motion", fmt::format("bodies {} apart in the mean until they are {} apart, one of them {} at most",
                                    distance_text(of.size.mean), quantity_text(kFarMetres, "m", 2),
                                    distance_text(of.size.largest)));
  if (!of.rounding) {
    answer.fact("energy at the end", fmt::format("{:.6g} to {:.6g} J", was.energy, is.energy));
    if (was.contacts > 0 || is.contacts > 0) {
      answer.fact("touching pairs", fmt::format("{:.3g} to {:.3g} in the mean", was.contacts, is.contacts));
      answer.fact("penetration",
                  fmt::format("{} to {}", distance_text(was.penetration), distance_text(is.penetration)));
    }
    if (was.limit > 0 || is.limit > 0) {
      answer.fact("beyond limits", fmt::format("{:.3g} to {:.3g} rad", was.limit, is.limit));
    }
    for (const auto& [name, unit, old, young] :
         {std::tuple("velocity error", "m/s", was.velocity_error, is.velocity_error),
          std::tuple("turning error", "rad/s", was.turning_error, is.turning_error)}) {
      if (old && young) answer.fact(name, fmt::format("{:.3g} to {:.3g} {}", *old, *young, unit));
    }
    if (was.falls && is.falls) {
      answer.fact("falls", fmt::format("{:.0f} % to {:.0f} % of the runs", 100 * *was.falls, 100 * *is.falls));
    }
  }
  if (of.slower) {
    answer.fact("time of a step",
                fmt::format("times {:.3f} [{:.3f}, {:.3f}]", of.slower->value, of.slower->low, of.slower->high));
  } else if (options.speed) {
    answer.fact("time of a step", "not measured in both");
  }
  if (!of.no_probes.empty()) answer.fact("mechanism", of.no_probes);
  for (size_t i = 0; i < of.probes.size() && i < kMostProbeLines; ++i) {
    answer.fact(i == 0 ? "mechanism" : "", probe_change_text(of.probes[i]));
  }
  if (of.probes.size() > kMostProbeLines) {
    answer.fact("", fmt::format("and {} more (--json)", of.probes.size() - kMostProbeLines));
  } else if (of.probes.empty() && of.no_probes.empty()) {
    answer.fact("mechanism", "no probe differs");
  }
  for (size_t i = 0; i < of.restored.size() && i < 3; ++i) {
    const Restoring& each = of.restored[i];
    answer.fact(i == 0 ? "as before" : "",
                fmt::format("with --set {} in {} {} is left{}", each.setting, after, distance_text(each.left),
                            each.same_bits ? ": the same bits" : ""));
  }
  if (!of.rounding && of.restored.empty()) answer.fact("as before", "no setting alone brings half of it back");
  if (const std::string place = changelog_of(contender.engine->name(), after); !place.empty()) {
    answer.fact("changelog", place);
  }
  if (!of.rounding) {
    answer.fact("further", explain_command(options, contender, before, after));
  }
}

// One test for each step from one release that ran to the next: it fails where the motion changed by more than
// rounding.
std::string junit_text(const std::string& robot, const std::vector<Stage>& stages,
                       const std::vector<MeasuredRelease>& measured, const std::vector<Explained>& explained) {
  tinyxml2::XMLPrinter xml;
  xml.PushHeader(false, true);
  xml.OpenElement("testsuite");
  xml.PushAttribute("name", ("assay bisect " + robot).c_str());
  std::optional<size_t> before;
  for (size_t i = 0; i < stages.size(); ++i) {
    const std::string& failure = measured[i].result.failure;
    if (!before && failure.empty()) {
      before = i;
      continue;
    }
    xml.OpenElement("testcase");
    xml.PushAttribute("classname", robot.c_str());
    const std::string from = before ? stages[*before].release : "nothing";
    xml.PushAttribute("name", fmt::format("{} to {}", from, stages[i].release).c_str());
    if (!failure.empty()) {
      xml.OpenElement("skipped");
      xml.PushAttribute("message", failure.c_str());
      xml.CloseElement();
    } else {
      for (const Explained& of : explained) {
        if (of.rounding || of.change.after <= *before || of.change.after > i) continue;
        xml.OpenElement("failure");
        xml.PushAttribute("message", fmt::format("the motion changed by {} in the mean, {} at most",
                                                 distance_text(of.size.mean), distance_text(of.size.largest))
                                         .c_str());
        for (const ProbeChange& each : of.probes) xml.PushText((probe_change_text(each) + "\n").c_str());
        xml.CloseElement();
      }
      before = i;
    }
    xml.CloseElement();
  }
  xml.CloseElement();
  return xml.CStr();
}

// The newer's time of a step over the older's, by looks of the same round; nothing where one of them failed.
std::optional<Interval> ratio_of(const std::vector<double>& older, const std::vector<double>& newer) {
  if (older.empty() || older.size() != newer.size()) return std::nullopt;
  std::vector<double> ratios;
  for (size_t i = 0; i < older.size(); ++i) ratios.push_back(newer[i] / older[i]);
  return bootstrap_median(ratios, 1);
}

// By stage; those without a time have none.
std::vector<StepTime> step_times(const std::vector<std::vector<double>>& times) {
  std::vector<StepTime> found;
  for (size_t i = 0; i < times.size(); ++i) {
    if (times[i].empty()) continue;
    StepTime time{i, bootstrap_median(times[i], 1), std::nullopt};
    if (!found.empty()) time.ratio = ratio_of(times[found.back().stage], times[i]);
    found.push_back(time);
  }
  return found;
}

Json step_times_json(const std::vector<Stage>& stages, const std::vector<StepTime>& times) {
  Json json = Json::array();
  for (const StepTime& time : times) {
    json.push_back({{"release", stages[time.stage].release},
                    {"step_us", interval_json(time.us)},
                    {"to_the_one_before", time.ratio ? interval_json(*time.ratio) : Json(nullptr)}});
  }
  return json;
}

// Faster or slower is what the interval of the ratio says.
void add_step_times(const std::vector<Stage>& stages, const std::vector<StepTime>& times, Answer& answer) {
  std::vector<std::vector<std::string>> rows;
  for (const StepTime& time : times) {
    std::string ratio = "–", verdict;
    if (time.ratio) {
      ratio = fmt::format("{:.3f} [{:.3f}, {:.3f}]", time.ratio->value, time.ratio->low, time.ratio->high);
      verdict = time.ratio->low > 1 ? "slower" : time.ratio->high < 1 ? "faster" : "";
    }
    rows.push_back({stages[time.stage].release,
                    fmt::format("{:.4g} [{:.4g}, {:.4g}]", time.us.value, time.us.low, time.us.high), ratio, verdict});
  }
  answer.part("time of a step");
  answer.line(
      fmt::format("median of {} looks at whole runs, all releases in turns, with 95 % intervals", kSpeedRounds));
  answer.table({"release", "µs", "over the release before", ""}, std::move(rows), {1, 2});
}

// ---- the command --------------------------------------------------------------------------------------------------------

int run_bisect(const BisectOptions& options) {
  ExplainRequest request = request_of(options);
  const ResolvedContender contender = contender_asked(options);
  const std::string engine = contender.engine->name();
  const std::vector<std::string> asked = releases_asked(options, engine);
  // all of them: with --quick only those that halving needs would do, but which these are is known too late
  if (!options.no_set_up) {
    std::vector<std::string> named;
    for (const std::string& release : asked) named.push_back(in_build(contender.base, release));
    obtain_releases(named);
  }
  request.a = request.b = contender.base;
  const ExplainQuestion question = read_question(request);
  const auto samples = static_cast<size_t>(question.samples) + 1;
  const double tolerance = rounding_gap(question);

  std::vector<Stage> stages;
  for (const std::string& release : asked) {
    Side side = question.a;
    side.name = release;
    side.contender = in_build(without_build(side.contender), release);
    for (const auto& [name, value] : parse_settings(options.settings)) side.overrides[name] = value;
    stages.push_back({release, side});
  }
  ProgressLine progress;
  std::string doing = "releases";
  const auto tell_progress = [&](size_t done, size_t of) {
    if (progress.due()) progress.show(fmt::format("{}: {}, {} of {} runs", question.model.name, doing, done, of));
  };
  ReleaseRunner runner(question, tell_progress);
  std::vector<MeasuredRelease> measured(stages.size());
  const RunReleases run = [&](const std::vector<size_t>& which) {
    std::vector<Side> sides;
    std::vector<size_t> places;
    std::vector<ReleaseResult> results;
    for (const size_t i : which) {
      const Registry& registry = Registry::instance();
      if (const auto lacking = registry.lacking_release(stages[i].side.contender)) {
        measured[i].result = {stages[i].release, *lacking, ""};
      } else if (!registry.has(stages[i].side.contender)) {
        measured[i].result = {stages[i].release, fmt::format("has no contender '{}'", contender.base), ""};
      } else {
        sides.push_back(stages[i].side);
        places.push_back(i);
      }
    }
    if (!sides.empty()) {
      std::vector<MeasuredRelease> made = runner.run(sides, question.starts);
      for (size_t k = 0; k < places.size(); ++k) measured[places[k]] = std::move(made[k]);
    }
    results.reserve(which.size());
    for (const size_t i : which) results.push_back(measured[i].result);
    return results;
  };
  const ReleaseDistance distance = [&](size_t a, size_t b) {
    return apart(measured[a].tracks, measured[b].tracks, samples).largest;
  };
  // the noise of one release: the first that can be run, once more
  double noise = 0;
  for (const Stage& stage : stages) {
    if (options.repeat || !Registry::instance().has(stage.side.contender)) continue;
    doing = "repetitions of " + stage.release;
    const std::vector<MeasuredRelease> twice = runner.run({stage.side, stage.side}, question.starts);
    if (!twice[0].result.usable() || !twice[1].result.usable()) continue;
    if (twice[0].result.bits != twice[1].result.bits) noise = apart(twice[0].tracks, twice[1].tracks, samples).largest;
    break;
  }
  doing = "releases";
  const ReleaseCourse course = find_course(stages.size(), options.quick, noise, run, distance);
  if (course.groups.empty()) {
    progress.clear();
    throw InputError(fmt::format("no release could be run: {}", measured.front().result.failure));
  }

  std::vector<std::vector<double>> times(stages.size());
  if (options.speed) {
    std::vector<size_t> ran;
    std::vector<Side> sides;
    for (size_t i = 0; i < stages.size(); ++i) {
      if (!course.results[i].usable() || course.results[i].bits.empty()) continue;
      ran.push_back(i);
      sides.push_back(stages[i].side);
    }
    doing = "time of a step";
    std::vector<std::vector<double>> found = runner.step_us(sides, kSpeedRounds);
    for (size_t k = 0; k < ran.size(); ++k) times[ran[k]] = std::move(found[k]);
  }
  const std::vector<StepTime> speeds = step_times(times);
  std::vector<Explained> explained;
  std::map<size_t, ProbeRun> probed;  // a release in the middle is on both sides of a change
  const auto probes_of = [&](size_t i) -> const ProbeRun& {
    const auto known = probed.find(i);
    if (known != probed.end()) return known->second;
    const std::string plugin = release_plugin(engine, stages[i].release);
    doing = "probes of " + stages[i].release;
    return probed[i] = has_probe_program(plugin) ? run_probes(plugin, 60)
                                                 : run_suite_probes(stages[i].side, question.jobs, tell_progress);
  };
  for (const ReleaseChange& change : course.changes) {
    Explained of;
    of.change = change;
    const MeasuredRelease &before = measured[change.before], &after = measured[change.after];
    of.size = apart(before.tracks, after.tracks, samples);
    of.rounding = of.size.mean <= tolerance;
    const ProbeRun &old = probes_of(change.before), &young = probes_of(change.after);
    of.no_probes = !old.failure.empty() ? old.failure : young.failure;
    if (of.no_probes.empty()) of.probes = probe_changes(old.values, young.values);
    if (!of.rounding) {
      doing = fmt::format("settings of {}", stages[change.after].release);
      of.restored = restoring(runner, stages[change.after].side, before, of.size.mean,
                              std::min(kRestoringStarts, question.starts), samples);
    }
    of.slower = ratio_of(times[change.before], times[change.after]);
    explained.push_back(std::move(of));
  }
  progress.clear();

  Json json = {{"system", question.model.name},
               {"model_hash", question.model.hash},
               {"engine", engine},
               {"contender", contender.base},
               {"control", question.control->description()},
               {"timestep_ms", question.timestep_ms},
               {"seconds", question.seconds()},
               {"starts", question.starts},
               {"noise_m", noise},
               {"settings", parse_settings(options.settings)},
               {"step_times", step_times_json(stages, speeds)},
               {"releases", Json::array()},
               {"groups", Json::array()},
               {"changes", Json::array()}};
  for (size_t i = 0; i < stages.size(); ++i) {
    const ReleaseResult& result = measured[i].result;
    const bool usable = result.usable() && !result.bits.empty();
    json["releases"].push_back({{"release", stages[i].release},
                                {"run", usable},
                                {"failure", result.failure},
                                {"bits", result.bits},
                                {"values", usable ? values_json(measured[i].values) : Json(nullptr)}});
  }
  for (const ReleaseGroup& group : course.groups) {
    json["groups"].push_back(
        {{"first", stages[group.first].release}, {"last", stages[group.last].release}, {"inferred", group.inferred}});
  }
  for (const Explained& of : explained) json["changes"].push_back(change_json(engine, stages, of, measured));

  Answer answer;
  const auto motions = std::ranges::count_if(explained, [](const Explained& of) { return !of.rounding; });
  answer.part(fmt::format("{}: {} of {}", question.model.name,
                          counted(explained.size(), "change point", "change points"), contender.base));
  answer.line(fmt::format("{}; {} of {} s at {} ms; {}", question.control->description(),
                          counted(static_cast<size_t>(question.starts), "start", "starts"),
                          shortest(question.seconds()), timestep_label(question.timestep_ms),
                          noise == 0 ? "repetitions of a release end in the same bits"
                                     : fmt::format("repetitions of a release are {} apart", distance_text(noise))));
  add_groups(stages, course, measured, answer);
  for (size_t i = 0; i < stages.size(); ++i) {
    if (measured[i].result.usable()) continue;
    answer.line(fmt::format("left out: {} ({})", stages[i].release, measured[i].result.failure));
  }
  for (const Explained& of : explained) {
    if (of.change.after - of.change.before > 1 && !options.repeat) {
      answer.line(fmt::format("the change between {} and {} lies in one of {} steps", stages[of.change.before].release,
                              stages[of.change.after].release, of.change.after - of.change.before));
    }
  }
  if (!speeds.empty()) add_step_times(stages, speeds, answer);
  for (const Explained& of : explained) {
    add_change(options, contender, stages, of, measured, answer);
  }
  if (options.out) {
    std::error_code ignored;  // what cannot be made cannot be written to: that is said
    std::filesystem::create_directories(*options.out, ignored);
    OutputFile file((std::filesystem::path(*options.out) / "bisect.json").string());
    file.write(dump_json(json) + "\n");
    file.finish();
  }
  if (options.junit) write_file(*options.junit, junit_text(question.model.name, stages, measured, explained));
  if (options.json) {
    print_json(json);
  } else if (options.markdown) {
    print_markdown(answer);
  } else {
    print(answer);
  }
  return motions > 0 ? kFailed : kDone;
}

}  // namespace

void add_bisect(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "bisect", "Find the release of an engine that changed what a robot does",
      {{"assay bisect my_robot.xml --engine mujoco", "all releases; what is not set up is fetched and compiled first"},
       {"assay bisect my_robot.xml --contender mujoco-implicitfast --from 3.6.0 --to 3.7.0 --timestep 5",
        "one step, and by which mechanism"},
       {"assay bisect cart_pole.xml --engine mujoco --policy-config policy.toml --quick", "under a policy, by halves"},
       {"assay bisect humanoid --contender drake-sap --from 1.50.0", "an engine with a Python package"},
       {"assay bisect humanoid --engine mujoco --from 3.7.0 --to 3.7.0 --repeat 20", "the noise of one release"}});
  const auto options = std::make_shared<BisectOptions>();
  add_robot(*command, *options, "ROBOT");
  command
      ->add_option("--engine", options->engine, "Engine with releases, as mujoco or drake: its first contender is run")
      ->type_name("ENGINE");
  command->add_option("--contender", options->contender, "Contender of the engine to run instead")
      ->type_name("CONTENDER");
  command->add_option("--from", options->from, "Oldest release (default: the oldest there is)")->type_name("RELEASE");
  command->add_option("--to", options->to, "Newest release (default: the newest there is)")->type_name("RELEASE");
  command->add_flag("--quick", options->quick, "Halve between releases that differ instead of running all")
      ->disable_flag_override();
  command
      ->add_option("--set", options->settings, "Overrides a setting of the contender in all releases; may be repeated")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  command->add_flag("--speed", options->speed, "Measure the time of a step in all releases that run, too")
      ->disable_flag_override();
  command->add_option("--repeat", options->repeat, "Repetitions of one release instead (--from and --to the same)")
      ->type_name("N");
  add_run_options(*command, *options);
  command->add_option("--out", options->out, "Folder for bisect.json, what --json prints")->type_name("DIR");
  command->add_flag("--no-set-up", options->no_set_up, "Use the releases that are set up, and say which are not")
      ->disable_flag_override();
  CLI::Option* json = command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  command->add_flag("--markdown", options->markdown, "Print Markdown, as for a CI's summary")
      ->disable_flag_override()
      ->excludes(json);
  command->add_option("--junit", options->junit, "JUnit file: a test for each step between releases")
      ->type_name("FILE");
  add_load_options(*command, options->model);
  command->footer(command->get_footer() +
                  "\nStatus 1: the motion changed between two\nreleases by more than rounding.\n");
  command->callback([&action, options] { action = [options] { return run_bisect(*options); }; });
}

}  // namespace assay::cli
