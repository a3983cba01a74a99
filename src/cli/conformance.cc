// `assay conformance`: the conformance suite by hand.
#include "conformance/conformance.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/option_values.h"
#include "base/text.h"
#include "cli/commands.h"
#include "conformance/markdown.h"
#include "engines/builds.h"
#include "engines/registry.h"
#include "engines/releases.h"
#include "run/coordinator/campaign_run.h"
#include "run/coordinator/suite.h"

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
    const std::string build = build_of(name), plain = without_build(name);
    // a release of an engine is loaded when one of its contenders is asked for
    const auto newest = std::ranges::find(registry.engines(), plain, &Engine::name);
    if (newest != registry.engines().end() && is_release(build)) {
      static_cast<void>(registry.resolve(in_build((*newest)->contenders().front().name, build)));
    }
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

double limit_of(const Options& options) {
  if (options.time_limit) return parse_positive("--time-limit", *options.time_limit, "seconds");
  return options.long_series ? kMostLongTestSeconds : kMostTestSeconds;
}

int conformance(const Options& options) {
  if (options.list) return list_tests(options.json);
  check_tests(options.tests);
  Json json = {{"contenders", Json::array()}};
  std::vector<std::string> failed, not_run;
  std::vector<std::string> names = options.contenders;
  names.insert(names.end(), options.engines.begin(), options.engines.end());
  const SuiteRequest suite{
      .tests = options.tests, .long_series = options.long_series, .again = options.again, .limit_s = limit_of(options)};
  for (const ResolvedContender& contender : chosen(names)) {
    if (options.lines()) print(heading(contender.name) + "\n");
    const Json results = suite_apart(contender, suite, [&](const Json& result) {
      if (!options.lines()) return;
      print(result_line(result));
      flush_output();
    });
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

std::optional<std::vector<std::string>> verdict_folders(const CLI::App& command) {
  auto folders = written_folders(command);
  if (command.count("--long") == 0) return folders;
  std::error_code error;
  const std::string kept = verdicts_dir(std::nullopt);
  if (!kept.empty()) std::filesystem::create_directories(kept, error);
  if (!kept.empty() && !error) folders->push_back(kept);
  return folders;
}

void add_conformance(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "conformance", "Run the conformance suite: tests with figures and tolerances",
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
