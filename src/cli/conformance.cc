// `assay conformance`: the conformance suite by hand.
#include "conformance/conformance.h"

#include <algorithm>
#include <csignal>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/json.h"
#include "base/quantity.h"
#include "base/text.h"
#include "campaign/campaign.h"
#include "cli/campaign_run.h"
#include "cli/cli.h"
#include "conformance/kept_verdicts.h"
#include "conformance/markdown.h"
#include "engines/builds.h"
#include "engines/engine_files.h"
#include "isolate/activity.h"
#include "isolate/guarded_child.h"
#include "isolate/machine_lack.h"
#include "isolate/processes.h"
#include "isolate/sandbox.h"

namespace assay::cli {
namespace {

struct Options {
  std::vector<std::string> contenders, engines;  // two ways to name them
  std::vector<std::string> tests;
  std::optional<std::string> time_limit;  // s, as given
  bool list = false;
  bool long_series = false;
  bool again = false;
  bool json = false;
  bool markdown = false;

  bool lines() const { return !json && !markdown; }
};

// A name is a contender's, or an engine's for all of its contenders. No name means all contenders except those that do
// not claim to move anything, as the null engine's.
std::vector<ResolvedContender> chosen(const std::vector<std::string>& names) {
  const Registry& registry = Registry::instance();
  std::vector<ResolvedContender> contenders;
  if (names.empty()) {
    for (const std::string& name : registry.contender_names()) {
      ResolvedContender contender = registry.resolve(name);
      if (contender.engine->capabilities(contender.settings).order > 0) contenders.push_back(std::move(contender));
    }
  }
  for (const std::string& name : names) {
    const std::string build = build_of(name);
    const std::vector<const Engine*>& engines = build == kBaseline ? registry.engines() : registry.other_builds();
    const auto engine = std::ranges::find(engines, name, &Engine::name);
    if (engine == engines.end()) {
      contenders.push_back(registry.resolve(name));
      continue;
    }
    for (const Contender& contender : (*engine)->contenders()) {
      contenders.push_back(registry.resolve(in_build(contender.name, build)));
    }
  }
  return contenders;
}

// Before anything runs: run_conformance() would refuse a name only after the first contender was set up.
void check_tests(const std::vector<std::string>& names) {
  std::vector<std::string> known;
  for (const ConformanceTest& test : conformance_tests()) known.push_back(test.name);
  for (const std::string& name : names) {
    if (std::ranges::find(known, name) == known.end()) {
      throw InputError(fmt::format("unknown conformance test '{}'{}", name, did_you_mean(name, known)));
    }
  }
}

Json result_json(const ConformanceResult& result) {
  Json json = {{"test", result.test},     {"status", status_text(result.status)},
               {"figure", result.figure}, {"tolerance", result.tolerance},
               {"unit", result.unit},     {"note", result.note}};
  for (const TimestepResult& each : result.timesteps) {
    json["timesteps"].push_back({{"timestep_ms", 1e3 * each.timestep},
                                 {"status", status_text(each.status)},
                                 {"figure", each.figure},
                                 {"tolerance", each.tolerance}});
  }
  return json;
}

ConformanceResult result_of(const Json& json) {
  const auto status = [](const Json& of) { return parse_conformance_status(of.at("status").get<std::string>()); };
  ConformanceResult result{json.at("test").get<std::string>(), status(json),
                           json.at("figure").get<double>(),    json.at("tolerance").get<double>(),
                           json.at("unit").get<std::string>(), json.at("note").get<std::string>()};
  if (!json.contains("timesteps")) return result;
  for (const Json& at : json.at("timesteps")) {
    result.timesteps.push_back({at.at("timestep_ms").get<double>() / 1e3, status(at), at.at("figure").get<double>(),
                                at.at("tolerance").get<double>()});
  }
  return result;
}

std::string result_line(const Json& result) {
  const auto text = [&](const char* key) { return result.at(key).get<std::string>(); };
  constexpr size_t kStatusWidth = 15;  // "not-applicable " is the longest
  std::string line = "  " + status(text("status"));
  line.append(kStatusWidth - text("status").size(), ' ');
  line += fmt::format(" {:<24}", text("test"));
  if (text("status") != "not-applicable") {
    line += fmt::format(" {} allowed", figure_text(result));
  }
  if (result.contains("kept")) line += " (kept)";
  if (text("note").empty()) return paragraph(line, 4);
  if (!terminal_columns(stdout)) return paragraph(line + "  " + text("note"));
  return paragraph(line, 4) + paragraph("    " + text("note"), 4);
}

// Names of the tests that were asked for, in the order in which they run.
std::vector<std::string> wanted_tests(const Options& options) {
  std::vector<std::string> wanted;
  for (const ConformanceTest& test : conformance_tests()) {
    const bool all = options.tests.empty();
    if (all || std::ranges::find(options.tests, test.name) != options.tests.end()) wanted.push_back(test.name);
  }
  return wanted;
}

double limit_of(const Options& options) {
  if (options.time_limit) return parse_positive("--time-limit", *options.time_limit, "seconds");
  return options.long_series ? kMostLongTestSeconds : kMostTestSeconds;
}

// Verdicts of the long series, which takes up to hours: each is kept as soon as it is there.
class KeptSeries {
 public:
  KeptSeries(const ResolvedContender& contender, const Options& options) {
    const std::string folder = options.long_series ? verdicts_dir(std::nullopt) : "";
    if (folder.empty()) return;
    CampaignContender kept;
    kept.resolved = contender;
    kept.plugin_hash = Registry::instance().plugin_hash(contender.engine->name());
    path_ = kept_verdicts_file(folder, kept.content(), /*long_series=*/true);
    results_ = kept_verdicts(path_);
  }

  // Null when there is none.
  const ConformanceResult* find(const std::string& test) const {
    const auto found = std::ranges::find(results_, test, &ConformanceResult::test);
    return found == results_.end() ? nullptr : &*found;
  }

  void add(const ConformanceResult& result) {
    if (path_.empty() || result.status == ConformanceStatus::kNotRun) return;
    std::erase_if(results_, [&](const ConformanceResult& old) { return old.test == result.test; });
    results_.push_back(result);
    keep_verdicts(path_, results_);
  }

 private:
  std::string path_;  // empty: nothing is kept
  std::vector<ConformanceResult> results_;
};

// Runs the suite on one contender in a process of its own, because an adapter under development may crash. It goes on
// in another one when somebody else has ended the first, or its memory is running out.
Json examine(const ResolvedContender& contender, const Options& options) {
  const double limit_s = limit_of(options);
  KeptSeries series(contender, options);
  Json results = Json::array();
  const auto show = [&](const Json& result) {
    if (options.lines()) {
      print(result_line(result));
      flush_output();
    }
    results.push_back(result);
  };
  const auto take = [&](const std::string& line) {
    const Json result = Json::parse(line);
    series.add(result_of(result));
    show(result);
  };
  if (options.lines()) print(heading(contender.name) + "\n");
  std::vector<std::string> wanted;
  for (std::string& test : wanted_tests(options)) {
    const ConformanceResult* kept = options.again ? nullptr : series.find(test);
    if (kept == nullptr) {
      wanted.push_back(std::move(test));
      continue;
    }
    Json result = result_json(*kept);
    result["kept"] = true;
    show(result);
  }
  const size_t shown = results.size();
  constexpr int kMostTries = 3;
  for (int lost = 0; results.size() < shown + wanted.size();) {
    const size_t ran = results.size() - shown;
    const ChildEnd end = run_in_child(
        [&](const Send& send) {
          std::signal(SIGINT, SIG_DFL);
          std::signal(SIGTERM, SIG_DFL);
          // an adapter writes no verdicts
          if (options.long_series) enter_sandbox({.read_everything = true, .writable = engine_caches()});
          ConformanceOptions suite;
          suite.long_series = options.long_series;
          suite.on_result = [&](const ConformanceResult& result) { send(dump_json(result_json(result))); };
          for (size_t i = ran; i < wanted.size() && (i == ran || !is_half_full()); ++i) {
            suite.tests = {wanted[i]};
            run_conformance(contender, suite);
          }
          return kDone;
        },
        take, limit_s);
    if (interrupted())
      throw SystemError(options.long_series ? "interrupted: the verdicts above are kept, the same command continues"
                                            : "interrupted: the tests above were completed");
    // an engine may also end its process in an orderly way: what counts is whether results come
    const bool orderly = end.signal == 0 && end.status == kDone, has_more = results.size() > shown + ran;
    if (orderly && has_more) continue;
    const size_t next = results.size() - shown;
    const std::string at = next < wanted.size() ? wanted[next] : "end of the suite";
    if (end.from_outside()) {
      lost = has_more ? 1 : lost + 1;
      if (lost == kMostTries) throw EndedFromOutside(fmt::format("{} of {}", at, contender.name), end.signal);
      continue;
    }
    ConformanceResult result;
    result.test = at;
    result.status = ConformanceStatus::kFail;
    result.note = end.signal != 0 ? fmt::format("crashed with {}", end.signal_text()) : "the process ended early";
    if (!end.stopped.empty()) result.note = end.stopped;
    if (const std::string limit = inherited_memory_limit(); !limit.empty() && end.stopped.empty()) {
      result.status = ConformanceStatus::kNotRun;
      result.note += fmt::format(", and this shell allows {}", limit);
    }
    show(result_json(result));  // not kept: it may depend on more than the program and the contender
    break;
  }
  return results;
}

int list_tests(bool as_json) {
  Json json = Json::array();
  std::vector<std::vector<std::string>> rows;
  for (const ConformanceTest& test : conformance_tests()) {
    json.push_back({{"test", test.name}, {"meaning", test.meaning}, {"needs", test.needs}});
    rows.push_back({test.name, test.needs.empty() ? "-" : test.needs, test.meaning});
  }
  if (as_json) {
    print_json(Json{{"tests", json}});
  } else {
    print(table({"test", "needs", "meaning"}, rows));
  }
  return kDone;
}

int conformance(const Options& options) {
  if (options.list) return list_tests(options.json);
  check_tests(options.tests);
  Json json = {{"contenders", Json::array()}};
  std::vector<std::string> failed, not_run;
  std::vector<std::string> names = options.contenders;
  names.insert(names.end(), options.engines.begin(), options.engines.end());
  for (const ResolvedContender& contender : chosen(names)) {
    const Json results = examine(contender, options);
    std::map<std::string, int> counts;
    for (const Json& result : results) ++counts[result.at("status").get<std::string>()];
    const bool passed = counts["fail"] + counts["not-run"] == 0;
    if (counts["fail"] > 0) failed.push_back(contender.name);
    if (counts["not-run"] > 0) not_run.push_back(contender.name);
    json["contenders"].push_back({{"contender", contender.name}, {"conforms", passed}, {"results", results}});
    if (options.lines()) {
      print(paragraph(fmt::format("  {}: {} pass, {} fail, {} declared deviations, {} not applicable",
                                  status(passed ? "conforms" : "does not conform"), counts["pass"], counts["fail"],
                                  counts["deviation"], counts["not-applicable"]),
                      4) +
            "\n");
    }
  }
  if (options.json) print_json(json);
  if (options.markdown) print(conformance_markdown(json.at("contenders")));
  if (!not_run.empty()) {
    message(
        fmt::format("the machine lacks what some tests take, so nothing is said of {}: raise the limits of memory "
                    "(ulimit -v, -d) or "
                    "free memory and room, and run it again",
                    join(not_run, ", ")));
  }
  if (failed.empty()) return not_run.empty() ? kDone : kFailed;
  message(fmt::format("{} not conform: {}",
                      failed.size() == 1 ? "1 contender does" : fmt::format("{} contenders do", failed.size()),
                      join(failed, ", ")));
  return kFailed;
}

}  // namespace

void add_conformance(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "conformance", "Run the conformance suite: each test with its figure and tolerance",
      {{"assay conformance mujoco-rk4", "the suite on one contender"},
       {"assay conformance ode --test free-fall --test pendulum", "two tests on all contenders of an engine"},
       {"assay conformance --list", "the tests, with the meaning and the needs of each"}});
  const auto options = std::make_shared<Options>();
  command
      ->add_option("CONTENDER", options->contenders,
                   "Contenders, or engines for all of their contenders (default: all but null)")
      ->type_name("");
  command->add_option("--engine", options->engines, "The same as an option; may be repeated")
      ->type_name("CONTENDER")
      ->allow_extra_args(false);
  command->add_option("--test", options->tests, "Only this test; may be repeated")
      ->type_name("TEST")
      ->allow_extra_args(false);
  command
      ->add_option(
          "--time-limit", options->time_limit,
          fmt::format("Seconds for one test (default: {:g}, with --long {:g})", kMostTestSeconds, kMostLongTestSeconds))
      ->type_name("S");
  command
      ->add_flag(
          "--long", options->long_series,
          "Tests that have a longer version run that: bodies rest for 60 s, at more timesteps (minutes to hours). "
          "Verdicts are kept, so that the same command continues after an interruption")
      ->disable_flag_override();
  command->add_flag("--again", options->again, "With --long: run again what has a kept verdict")
      ->disable_flag_override();
  command->add_flag("--list", options->list, "List the tests instead")->disable_flag_override();
  CLI::Option* json = command->add_flag("--json", options->json, "Print JSON");
  json->disable_flag_override();
  command->add_flag("--markdown", options->markdown, "Print a table for a document")
      ->disable_flag_override()
      ->excludes(json);
  command->callback([&action, options] { action = [options] { return conformance(*options); }; });
}

}  // namespace assay::cli
