#include "run/coordinator/run_conformance.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"
#include "conformance/conformance.h"
#include "conformance/kept_verdicts.h"
#include "isolate/machine_lack.h"
#include "run/coordinator/subject.h"

namespace assay {
namespace {

constexpr double kLeastTestSeconds = 30;  // limit of one test of the suite

// The contender whose verdict counts. What a sweep varies stands on that of the contender it varies: the suite asks
// whether an adapter carries a model over, and what few iterations or soft contacts cost is what the sweep measures.
const std::string& scored_as(const CampaignContender& contender) {
  return contender.varies.empty() ? contender.resolved.name : contender.varies;
}

// Whose cells or runs are still to do.
std::set<const CampaignContender*> contenders_ahead(const RunShared& run, const Work& work) {
  std::set<const CampaignContender*> ahead;
  for (const PlannedCell* cell : work.todo) {
    ahead.insert(&run.contender(*cell));
    // whose runs it reads, in whatever part it is
    const CampaignSystem& system = run.system(*cell);
    if (!cell->against.empty()) ahead.insert(&run.contender(system.trained_in));
    if (cell->reads == Reads::kSteps && system.states_of >= 0) ahead.insert(&run.contender(system.states_of));
  }
  for (const PlannedRun* each : work.runs) {
    if (each->contender >= 0) ahead.insert(&run.contender(each->contender));
  }
  return ahead;
}

void store_suite(RunShared& run, const std::string& content, const std::vector<ConformanceRow>& rows) {
  for (const CampaignContender& each : run.campaign.contenders) {
    if (each.content() == content) run.store.set_conformance(each.resolved.name, rows);
  }
}

std::string suite_file(const RunOptions& options, const std::string& content) {
  return kept_verdicts_file(options.suites, content, /*long_series=*/false);
}

// Stores the verdicts that another campaign has kept, if there are any.
bool fetch_suite(RunShared& run, const std::string& content) {
  if (run.options.suites.empty()) return false;
  std::vector<ConformanceRow> rows;
  for (ConformanceResult& kept : kept_verdicts(suite_file(run.options, content))) {
    rows.push_back({"", std::move(kept.test), std::string(status_text(kept.status)), kept.figure, kept.tolerance,
                    std::move(kept.unit), std::move(kept.note)});
  }
  if (rows.empty()) return false;
  store_suite(run, content, rows);
  return true;
}

void keep_suite(const RunOptions& options, const std::string& content, const std::vector<ConformanceRow>& rows) {
  if (options.suites.empty()) return;
  std::vector<ConformanceResult> results;
  for (const ConformanceRow& row : rows) {
    results.push_back({row.test, parse_conformance_status(row.status), row.figure, row.tolerance, row.unit, row.note});
  }
  keep_verdicts(suite_file(options, content), results);
}

// Contents (CampaignContender::content) of contenders whose suites have to run.
std::set<std::string> suites_to_run(RunShared& run, const Work& work) {
  std::set<std::string> scored, known, contents, again;
  if (run.options.gate) {
    for (const CampaignContender* each : contenders_ahead(run, work)) scored.insert(scored_as(*each));
  }
  for (const ConformanceRow& row : run.store.conformance()) {
    if (!work.suite_again.contains(row.contender)) known.insert(row.contender);
  }
  for (const CampaignContender& each : run.campaign.contenders) {
    const std::string& name = each.resolved.name;
    if (scored.contains(name) && !known.contains(name)) contents.insert(each.content());
    if (work.suite_again.contains(name)) again.insert(each.content());
  }
  std::erase_if(contents,
                [&](const std::string& content) { return !again.contains(content) && fetch_suite(run, content); });
  return contents;
}

// Suites of several contenders at a time, each named by the contender's content.
class SuiteRuns {
 public:
  explicit SuiteRuns(RunShared& run) : run_(run), pool_(run.program, run.jobs, run.interrupts) {}

  void run(const std::set<std::string>& contents);

  const std::set<std::string>& lost() const { return lost_; }  // somebody else ended their workers: no verdict
  const std::string& lack() const { return lack_; }

 private:
  void add(const std::string& content, const std::vector<std::string>& tests, int lost = 0);
  void ended(const std::string& content, const std::string& name, const std::vector<std::string>& tests, size_t before,
             int lost, const JobEnd& end);

  RunShared& run_;
  Pool pool_;
  std::map<std::string, std::vector<ConformanceRow>> rows_;
  std::set<std::string> lost_, crashed_;  // crashed: with a test that ended its worker
  std::string lack_;
  int tests_ = 0, tests_done_ = 0;
};

void SuiteRuns::run(const std::set<std::string>& contents) {
  run_.progress.phase(fmt::format("conformance suite, {} contenders", contents.size()));
  std::vector<std::string> tests;
  for (const ConformanceTest& test : conformance_tests()) tests.push_back(test.name);
  for (const std::string& content : contents) add(content, tests);
  tests_ = static_cast<int>(contents.size() * tests.size());
  pool_.run([&](const std::string& job) { run_.progress.started(job, 0); });  // nobody knows yet what is left
}

// Runs the tests in one worker; when that dies in a test, the test has failed and the rest goes on in another. It does
// so as well when the worker ends before its tests do, or had too little memory left for one.
// `lost` counts workers that somebody else ended: a test is not blamed for that, nor for what the machine lacks.
void SuiteRuns::add(const std::string& content, const std::vector<std::string>& tests, int lost) {
  const auto found = std::ranges::find_if(run_.campaign.contenders,
                                          [&](const CampaignContender& each) { return each.content() == content; });
  Job job;
  job.request = ConformanceJob{contender_spec(*found), tests};
  job.title = fmt::format("conformance {}", found->resolved.name);
  job.limit_s = std::clamp(run_.campaign.time_limit_s, kLeastTestSeconds, kMostTestSeconds);
  job.cost = 1;
  job.lost = lost;
  job.on_test = [this, content, name = found->resolved.name](const TestResult& result) {
    rows_[content].push_back({"", result.test, result.status, result.figure.value_or(0), result.tolerance.value_or(0),
                              result.unit, result.note});
    run_.progress.tested(fmt::format("{} {}", name, result.test), ++tests_done_, tests_);
  };
  job.on_end = [this, content, name = found->resolved.name, tests, before = rows_[content].size(),
                lost](const JobEnd& end) { ended(content, name, tests, before, lost, end); };
  pool_.add(std::move(job));
}

// `before`: how many of the suite's tests had ended before this worker's.
void SuiteRuns::ended(const std::string& content, const std::string& name, const std::vector<std::string>& tests,
                      size_t before, int lost, const JobEnd& end) {
  std::vector<ConformanceRow>& rows = rows_[content];
  const auto not_run = std::ranges::find(rows.begin() + static_cast<std::ptrdiff_t>(before), rows.end(),
                                         status_text(ConformanceStatus::kNotRun), &ConformanceRow::status);
  const bool lacking = not_run != rows.end();
  if (lacking) lack_ = fmt::format("{} of {}: {}", not_run->test, name, not_run->note);
  tests_done_ -= static_cast<int>(rows.end() - not_run);
  rows.erase(not_run, rows.end());
  const size_t ran = rows.size() - before;
  const auto go_on = [&](size_t from, int lost_now) {
    add(content, {tests.begin() + static_cast<std::ptrdiff_t>(from), tests.end()}, lost_now);
  };
  const bool limited = !inherited_memory_limit().empty();
  if (end.outside && limited) lack_ = fmt::format("this shell allows {}", inherited_memory_limit());
  if (end.outside && !limited && lost + 1 < Pool::kMostTries) {
    go_on(ran, lost + 1);
    return;
  }
  if (end.outside || (lacking && ran == 0)) {
    lost_.insert(content);
    rows_.erase(content);
    return;
  }
  if (end.answer && ran > 0 && ran < tests.size()) {  // its memory was running out
    go_on(ran, lost);
    return;
  }
  if (!end.answer) crashed_.insert(content);
  if (!end.answer && ran < tests.size()) {
    const std::string fail(status_text(ConformanceStatus::kFail));
    rows.push_back(
        {"", tests[ran], fail, 0, 0, "", fmt::format("{}: {}", outcome_text(end.failure.outcome), end.failure.reason)});
    if (end.failure.outcome == Outcome::kTimeout) {
      // A contender that never returns would cost the limit in each of the other tests again.
      for (size_t i = ran + 1; i < tests.size(); ++i) {
        rows.push_back({"", tests[i], fail, 0, 0, "", fmt::format("not tried: {} did not come to an end", tests[ran])});
      }
    } else if (ran + 1 < tests.size()) {
      go_on(ran + 1, lost);
      return;
    }
  }
  store_suite(run_, content, rows);
  // Whether it crashes may depend on more than the program and the contender: the next campaign tries again.
  if (!crashed_.contains(content)) keep_suite(run_.options, content, rows);
}

void take_out(Work& work, const RunShared& run, const std::set<std::string>& lost) {
  work.out_of_reach +=
      std::erase_if(work.todo, [&](const PlannedCell* cell) { return lost.contains(run.contender(*cell).content()); });
  std::erase_if(work.runs, [&](const PlannedRun* each) {
    return each->contender >= 0 && lost.contains(run.contender(each->contender).content());
  });
}

// Contenders that failed, now or before, with what stands on their verdicts.
std::map<std::string, Ending> failed_suites(const RunShared& run) {
  std::map<std::string, std::vector<std::string>> failures;
  for (const ConformanceRow& row : run.store.conformance()) {
    if (row.status == status_text(ConformanceStatus::kFail)) failures[row.contender].push_back(row.test);
  }
  std::map<std::string, Ending> failed;
  for (const auto& [name, tests] : failures) {
    failed[name] = {Outcome::kUnsupported, fmt::format("failed the conformance suite: {}", join(tests, ", "))};
  }
  for (const CampaignContender& each : run.campaign.contenders) {
    const auto found = failed.find(scored_as(each));
    if (found != failed.end()) failed.emplace(each.resolved.name, found->second);
  }
  return failed;
}

// Contenders may have been measured before they had to pass the conformance suite: their cells then say that they did
// not.
void take_back(RunShared& run, const Work& work) {
  std::map<std::string, const PlannedCell*> planned;
  for (const PlannedCell& cell : work.plan.cells) planned[cell.key] = &cell;
  for (const Cell& cell : run.store.cells()) {
    const auto failed = work.unscored.find(cell.contender);
    if (failed == work.unscored.end() || cell.outcome == Outcome::kUnsupported || !planned.contains(cell.key)) continue;
    Cell replaced = run.cell_of(*planned.at(cell.key), failed->second);
    replaced.started = replaced.finished = unix_time();
    run.store.put_cell(replaced);
  }
}

}  // namespace

std::string score_contenders(RunShared& run, Work& work) {
  std::string lack;
  if (const std::set<std::string> contents = suites_to_run(run, work); !contents.empty()) {
    SuiteRuns suites(run);
    suites.run(contents);
    take_out(work, run, suites.lost());
    lack = suites.lack();
  }
  work.unscored = failed_suites(run);
  if (run.options.gate) take_back(run, work);
  return lack;
}

}  // namespace assay
