#include "run/coordinator/suite.h"

#include <algorithm>
#include <csignal>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/exit_status.h"
#include "base/json.h"
#include "campaign/campaign.h"
#include "conformance/conformance.h"
#include "conformance/kept_verdicts.h"
#include "engines/engine_files.h"
#include "isolate/activity.h"
#include "isolate/guarded_child.h"
#include "isolate/interruption.h"
#include "isolate/machine_lack.h"
#include "isolate/processes.h"
#include "isolate/sandbox.h"
#include "run/coordinator/campaign_run.h"

namespace assay {
namespace {

Json conformance_json(const ConformanceResult& result) {
  Json row = {{"test", result.test},     {"status", status_text(result.status)},
              {"figure", result.figure}, {"tolerance", result.tolerance},
              {"unit", result.unit},     {"note", result.note}};
  for (const TimestepResult& each : result.timesteps) {
    row["timesteps"].push_back({{"timestep_ms", 1e3 * each.timestep},
                                {"status", status_text(each.status)},
                                {"figure", each.figure},
                                {"tolerance", each.tolerance}});
  }
  return row;
}

ConformanceResult conformance_of(const Json& json) {
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

// Names of the tests that were asked for, in the order in which they run.
std::vector<std::string> wanted_tests(const std::vector<std::string>& tests) {
  std::vector<std::string> wanted;
  for (const ConformanceTest& test : conformance_tests()) {
    const bool all = tests.empty();
    if (all || std::ranges::find(tests, test.name) != tests.end()) wanted.push_back(test.name);
  }
  return wanted;
}

// Verdicts of the long series, which takes up to hours: each is kept as soon as it is there.
class KeptSeries {
 public:
  KeptSeries(const ResolvedContender& contender, bool long_series) {
    const std::string folder = long_series ? verdicts_dir(std::nullopt) : "";
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

}  // namespace

Json suite_apart(const ResolvedContender& contender, const SuiteRequest& request,
                 const std::function<void(const Json&)>& on_result) {
  KeptSeries series(contender, request.long_series);
  Json results = Json::array();
  const auto show = [&](const Json& result) {
    on_result(result);
    results.push_back(result);
  };
  const auto take = [&](const std::string& line) {
    const Json result = Json::parse(line);
    series.add(conformance_of(result));
    show(result);
  };
  std::vector<std::string> wanted;
  for (std::string& test : wanted_tests(request.tests)) {
    const ConformanceResult* kept = request.again ? nullptr : series.find(test);
    if (kept == nullptr) {
      wanted.push_back(std::move(test));
      continue;
    }
    Json result = conformance_json(*kept);
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
          if (request.long_series) enter_sandbox({.read_everything = true, .writable = engine_caches()});
          ConformanceOptions suite;
          suite.long_series = request.long_series;
          suite.on_result = [&](const ConformanceResult& result) { send(dump_json(conformance_json(result))); };
          for (size_t i = ran; i < wanted.size() && (i == ran || !is_half_full()); ++i) {
            suite.tests = {wanted[i]};
            run_conformance(contender, suite);
          }
          return exits::kDone;
        },
        take, request.limit_s);
    if (interrupted())
      throw SystemError(request.long_series ? "interrupted: the verdicts above are kept, the same command continues"
                                            : "interrupted: the tests above were completed");
    // an engine may also end its process in an orderly way: what counts is whether results come
    const bool orderly = end.signal == 0 && end.status == exits::kDone, has_more = results.size() > shown + ran;
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
    show(conformance_json(result));  // not kept: it may depend on more than the program and the contender
    break;
  }
  return results;
}

}  // namespace assay
