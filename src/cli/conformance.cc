// `assay conformance`: the gate by hand.
#include "conformance/conformance.h"

#include <algorithm>
#include <array>
#include <csignal>
#include <map>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "cli/child.h"
#include "cli/cli.h"

namespace assay::cli {
namespace {

struct Options {
  std::vector<std::string> contenders, engines;  // two ways to name them
  std::vector<std::string> tests;
  bool list = false;
  bool json = false;
  bool markdown = false;

  bool lines() const { return !json && !markdown; }
};

// A name may be a contender's, or an engine's for all of its contenders. None means everybody but those who do not even
// claim to move anything, as the null engine does.
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
    const auto engine = std::ranges::find(registry.engines(), name, &Engine::name);
    if (engine == registry.engines().end()) {
      contenders.push_back(registry.resolve(name));
      continue;
    }
    for (const Contender& contender : (*engine)->contenders()) contenders.push_back(registry.resolve(contender.name));
  }
  return contenders;
}

// Before anything runs: run_conformance() would say so only after the first contender was set up.
void check_tests(const std::vector<std::string>& names) {
  std::vector<std::string> known;
  for (const ConformanceTest& test : conformance_tests()) known.push_back(test.name);
  for (const std::string& name : names) {
    if (std::ranges::find(known, name) == known.end()) {
      throw InputError(fmt::format("--test is '{}', which is no conformance test{}", name, did_you_mean(name, known)));
    }
  }
}

Json result_json(const ConformanceResult& result) {
  return {{"test", result.test},     {"status", status_text(result.status)},
          {"figure", result.figure}, {"tolerance", result.tolerance},
          {"unit", result.unit},     {"note", result.note}};
}

std::string result_line(const Json& result) {
  const auto text = [&](const char* key) { return result.at(key).get<std::string>(); };
  std::string line = fmt::format("  {:<15} {:<24}", text("status"), text("test"));
  if (text("status") != "not-applicable") {
    line += fmt::format(" {:.4g} of {:.4g} allowed{}{}", result.at("figure").get<double>(),
                        result.at("tolerance").get<double>(), text("unit").empty() ? "" : " ", text("unit"));
  }
  if (!text("note").empty()) line += fmt::format("  {}", text("note"));
  return line + "\n";
}

// The suite on one contender in a process of its own, because an adapter under work crashes now and then.
Json examine(const ResolvedContender& contender, const Options& options) {
  Json results = Json::array();
  const auto take = [&](const std::string& line) {
    const Json result = Json::parse(line);
    if (options.lines()) {
      print(result_line(result));
      flush_output();
    }
    results.push_back(result);
  };
  if (options.lines()) print(contender.name + "\n");
  const ChildEnd end = run_in_child(
      [&](const Send& send) {
        std::signal(SIGINT, SIG_DFL);
        std::signal(SIGTERM, SIG_DFL);
        ConformanceOptions suite;
        suite.tests = options.tests;
        suite.on_result = [&](const ConformanceResult& result) {
          send(result_json(result).dump(-1, ' ', false, Json::error_handler_t::replace));
        };
        run_conformance(contender, suite);
        return kDone;
      },
      take);
  if (interrupted()) throw SystemError("interrupted: the tests above were run");
  // an engine may end its process in an orderly way too: what counts is whether all results came
  const auto& tests = conformance_tests();
  const auto missing = std::ranges::find_if(tests, [&](const ConformanceTest& test) {
    const bool wanted = options.tests.empty() || std::ranges::find(options.tests, test.name) != options.tests.end();
    return wanted && std::ranges::none_of(results, [&](const Json& result) { return result.at("test") == test.name; });
  });
  if (missing != tests.end() || end.signal != 0 || end.status != kDone) {
    ConformanceResult result;
    result.test = missing != tests.end() ? missing->name : "end of the suite";
    result.status = ConformanceStatus::kFail;
    result.note = end.signal != 0 ? fmt::format("crashed with {}", end.signal_text()) : "the process ended early";
    take(result_json(result).dump());
  }
  return results;
}

// The table for documents: a row a contender, a column a test, and what is not a plain pass in words below it.
std::string markdown(const Json& contenders) {
  const std::map<std::string, std::string> marks = {
      {"pass", "✓"}, {"fail", "✕"}, {"deviation", "≈"}, {"not-applicable", "–"}};
  std::vector<std::string> columns;
  for (const ConformanceTest& test : conformance_tests()) columns.push_back(test.name);
  std::string text = fmt::format("| contender | {} |\n| --- |", join(columns, " | "));
  for (std::size_t i = 0; i < columns.size(); ++i) text += " :-: |";
  text += "\n";
  // What is said of several contenders alike is said once.
  std::vector<std::pair<std::array<std::string, 3>, std::vector<std::string>>> notes;
  for (const Json& contender : contenders) {
    const std::string name = contender.at("contender");
    std::map<std::string, std::string> cells;
    for (const Json& result : contender.at("results")) {
      const std::string status = result.at("status");
      cells[result.at("test")] = marks.at(status);
      if (status == "pass") continue;
      const std::array<std::string, 3> key = {status, result.at("test"), result.at("note")};
      auto entry = std::ranges::find(notes, key, [](const auto& note) { return note.first; });
      if (entry == notes.end()) entry = notes.insert(notes.end(), {key, {}});
      entry->second.push_back(status == "not-applicable"
                                  ? name
                                  : fmt::format("{} ({:.3g} of {:.3g}{}{})", name, result.at("figure").get<double>(),
                                                result.at("tolerance").get<double>(),
                                                result.at("unit").get<std::string>().empty() ? "" : " ",
                                                result.at("unit").get<std::string>()));
    }
    text += fmt::format("| {} |", name);
    for (const std::string& test : columns) text += fmt::format(" {} |", cells.contains(test) ? cells[test] : " ");
    text += "\n";
  }
  const std::vector<std::pair<std::string, std::string>> headings = {
      {"fail", "Failures"}, {"deviation", "Declared deviations"}, {"not-applicable", "Not applicable"}};
  for (const auto& [status, heading] : headings) {
    std::string lines;
    for (const auto& [key, who] : notes) {
      if (key[0] == status) lines += fmt::format("- **{}**: {}. {}\n", key[1], join(who, ", "), key[2]);
    }
    if (!lines.empty()) text += fmt::format("\n## {}\n\n{}", heading, lines);
  }
  return text;
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
  std::vector<std::string> failed;
  std::vector<std::string> names = options.contenders;
  names.insert(names.end(), options.engines.begin(), options.engines.end());
  for (const ResolvedContender& contender : chosen(names)) {
    const Json results = examine(contender, options);
    std::map<std::string, int> counts;
    for (const Json& result : results) ++counts[result.at("status").get<std::string>()];
    const bool passed = counts["fail"] == 0;
    if (!passed) failed.push_back(contender.name);
    json["contenders"].push_back({{"contender", contender.name}, {"conforms", passed}, {"results", results}});
    if (options.lines()) {
      print(fmt::format("  {}: {} pass, {} fail, {} declared deviations, {} not applicable\n\n",
                        passed ? "conforms" : "does not conform", counts["pass"], counts["fail"], counts["deviation"],
                        counts["not-applicable"]));
    }
  }
  if (options.json) print_json(json);
  if (options.markdown) print(markdown(json.at("contenders")));
  if (failed.empty()) return kDone;
  message(fmt::format("{} not conform: {}", failed.size() == 1 ? "one contender does" : "some contenders do",
                      join(failed, ", ")));
  return kFailed;
}

}  // namespace

void add_conformance(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "conformance", "Put contenders through the gate: each test with its figure and tolerance",
      {{"assay conformance mujoco-rk4", "the suite on one contender"},
       {"assay conformance ode --test free-fall --test pendulum", "two tests on all contenders of an engine"},
       {"assay conformance --list", "the tests, what each means and what it needs"}});
  const auto options = std::make_shared<Options>();
  command
      ->add_option("CONTENDER", options->contenders,
                   "Contenders, or engines for all of theirs (default: all that move)")
      ->type_name("");
  command->add_option("--engine", options->engines, "The same as an option; may be repeated")
      ->type_name("CONTENDER")
      ->allow_extra_args(false);
  command->add_option("--test", options->tests, "Only this test; may be repeated")
      ->type_name("TEST")
      ->allow_extra_args(false);
  command->add_flag("--list", options->list, "List the tests instead")->disable_flag_override();
  CLI::Option* json = command->add_flag("--json", options->json, "Print everything that is known as JSON");
  json->disable_flag_override();
  command->add_flag("--markdown", options->markdown, "Print a table for a document")
      ->disable_flag_override()
      ->excludes(json);
  command->callback([&action, options] { action = [options] { return conformance(*options); }; });
}

}  // namespace assay::cli
