// Before anything is measured: the conformance suite, and a look at each contender's speed.
#include <algorithm>
#include <functional>

#include "base/errors.h"
#include "base/text.h"
#include "conformance/conformance.h"
#include "conformance/kept_verdicts.h"
#include "isolate/machine_lack.h"
#include "run/coordinator/runner.h"

namespace assay {

namespace {

constexpr double kLeastTestSeconds = 30;  // limit of one test of the suite

// The contender whose verdict counts. What a sweep varies stands on that of the contender it varies: the suite asks
// whether an adapter carries a model over, and what few iterations or soft contacts cost is what the sweep measures.
const std::string& scored_as(const CampaignContender& contender) {
  return contender.varies.empty() ? contender.resolved.name : contender.varies;
}

}  // namespace

// Runs the tests in one worker; when that dies in a test, the test has failed and the rest goes on in another. It does
// so as well when the worker ends before its tests do, or had too little memory left for one.
// `lost` counts workers that somebody else ended: a test is not blamed for that, nor for what the machine lacks.
void Runner::run_suite(const std::string& content, const std::vector<std::string>& tests, Pool& pool, int lost) {
  const auto found = std::ranges::find_if(campaign_.contenders,
                                          [&](const CampaignContender& each) { return each.content() == content; });
  Job job;
  job.request = ConformanceJob{contender_spec(*found), tests};
  job.title = fmt::format("conformance {}", found->resolved.name);
  job.limit_s = std::clamp(campaign_.time_limit_s, kLeastTestSeconds, kMostTestSeconds);
  job.cost = 1;
  job.lost = lost;
  const size_t before = suite_rows_[content].size();
  job.on_test = [this, content, name = found->resolved.name](const TestResult& result) {
    suite_rows_[content].push_back({"", result.test, result.status, result.figure.value_or(0),
                                    result.tolerance.value_or(0), result.unit, result.note});
    progress_.tested(fmt::format("{} {}", name, result.test), ++tests_done_, tests_);
  };
  job.on_end = [this, content, tests, before, lost, name = found->resolved.name, &pool](const JobEnd& end) {
    std::vector<ConformanceRow>& rows = suite_rows_[content];
    const auto not_run = std::ranges::find(rows.begin() + static_cast<std::ptrdiff_t>(before), rows.end(),
                                           status_text(ConformanceStatus::kNotRun), &ConformanceRow::status);
    const bool lacking = not_run != rows.end();
    if (lacking) lack_ = fmt::format("{} of {}: {}", not_run->test, name, not_run->note);
    tests_done_ -= static_cast<int>(rows.end() - not_run);
    rows.erase(not_run, rows.end());
    const size_t ran = rows.size() - before;
    const bool limited = !inherited_memory_limit().empty();
    if (end.outside && limited) lack_ = fmt::format("this shell allows {}", inherited_memory_limit());
    if (end.outside && !limited && lost + 1 < Pool::kMostTries) {
      run_suite(content, {tests.begin() + static_cast<std::ptrdiff_t>(ran), tests.end()}, pool, lost + 1);
      return;
    }
    if (end.outside || (lacking && ran == 0)) {
      lost_suite_.insert(content);
      suite_rows_.erase(content);
      return;
    }
    if (end.answer && ran > 0 && ran < tests.size()) {  // its memory was running out
      run_suite(content, {tests.begin() + static_cast<std::ptrdiff_t>(ran), tests.end()}, pool, lost);
      return;
    }
    if (!end.answer) crashed_suite_.insert(content);
    if (!end.answer && ran < tests.size()) {
      const std::string fail(status_text(ConformanceStatus::kFail));
      rows.push_back({"", tests[ran], fail, 0, 0, "",
                      fmt::format("{}: {}", outcome_text(end.failure.outcome), end.failure.reason)});
      if (end.failure.outcome == Outcome::kTimeout) {
        // A contender that never returns would cost the limit in each of the other tests again.
        for (size_t i = ran + 1; i < tests.size(); ++i) {
          rows.push_back(
              {"", tests[i], fail, 0, 0, "", fmt::format("not tried: {} did not come to an end", tests[ran])});
        }
      } else if (ran + 1 < tests.size()) {
        run_suite(content, {tests.begin() + static_cast<std::ptrdiff_t>(ran) + 1, tests.end()}, pool, lost);
        return;
      }
    }
    for (const CampaignContender& each : campaign_.contenders) {
      if (each.content() == content) store_.set_conformance(each.resolved.name, rows);
    }
    keep_suite(content);
  };
  pool.add(std::move(job));
}

std::string Runner::suite_file(const std::string& content) const {
  return options_.suites.empty() ? "" : kept_verdicts_file(options_.suites, content, /*long_series=*/false);
}

bool Runner::fetch_suite(const std::string& content) {
  if (options_.suites.empty()) return false;
  std::vector<ConformanceRow> rows;
  for (ConformanceResult& kept : kept_verdicts(suite_file(content))) {
    rows.push_back({"", std::move(kept.test), std::string(status_text(kept.status)), kept.figure, kept.tolerance,
                    std::move(kept.unit), std::move(kept.note)});
  }
  if (rows.empty()) return false;
  for (const CampaignContender& each : campaign_.contenders) {
    if (each.content() == content) store_.set_conformance(each.resolved.name, rows);
  }
  return true;
}

void Runner::keep_suite(const std::string& content) const {
  const auto rows = suite_rows_.find(content);
  // Whether it crashes may depend on more than the program and the contender: the next campaign tries again.
  if (options_.suites.empty() || rows == suite_rows_.end() || crashed_suite_.contains(content)) return;
  std::vector<ConformanceResult> results;
  for (const ConformanceRow& row : rows->second) {
    results.push_back({row.test, parse_conformance_status(row.status), row.figure, row.tolerance, row.unit, row.note});
  }
  keep_verdicts(suite_file(content), results);
}

void Runner::conformance() {
  std::set<std::string> scored;
  if (options_.gate) {
    for (const CampaignContender* each : contenders_ahead()) scored.insert(scored_as(*each));
  }
  std::set<std::string> known;
  for (const ConformanceRow& row : store_.conformance()) {
    if (!suite_again_.contains(row.contender)) known.insert(row.contender);
  }
  std::set<std::string> contents;
  for (const CampaignContender& each : campaign_.contenders) {
    if (scored.contains(each.resolved.name) && !known.contains(each.resolved.name)) contents.insert(each.content());
  }
  std::set<std::string> again;
  for (const CampaignContender& each : campaign_.contenders) {
    if (suite_again_.contains(each.resolved.name)) again.insert(each.content());
  }
  std::erase_if(contents, [&](const std::string& content) { return !again.contains(content) && fetch_suite(content); });
  if (!contents.empty()) {
    progress_.phase(fmt::format("conformance suite, {} contenders", contents.size()));
    std::vector<std::string> tests;
    for (const ConformanceTest& test : conformance_tests()) tests.push_back(test.name);
    Pool pool(program_, jobs_, interrupts_);
    for (const std::string& content : contents) run_suite(content, tests, pool);
    tests_ = static_cast<int>(contents.size() * tests.size());
    pool.run([&](const std::string& job) { progress_.started(job, remaining_s()); });
  }
  std::erase_if(todo_, [this](const PlannedCell* cell) { return lost_suite_.contains(contender(*cell).content()); });
  std::erase_if(runs_, [this](const PlannedRun* run) {
    return run->contender >= 0 &&
           lost_suite_.contains(campaign_.contenders[static_cast<size_t>(run->contender)].content());
  });
  std::map<std::string, std::vector<std::string>> failures;
  for (const ConformanceRow& row : store_.conformance()) {
    if (row.status == status_text(ConformanceStatus::kFail)) failures[row.contender].push_back(row.test);
  }
  for (const auto& [name, tests] : failures) {
    failed_gate_[name] = {Outcome::kUnsupported, fmt::format("failed the conformance suite: {}", join(tests, ", "))};
  }
  for (const CampaignContender& each : campaign_.contenders) {
    const auto failed = failed_gate_.find(scored_as(each));
    if (failed != failed_gate_.end()) failed_gate_.emplace(each.resolved.name, failed->second);
  }
  if (options_.gate) take_back_failed();
}

// How long a step takes, roughly, for the estimate of the time left. Three systems of a family of sizes are probed, and
// of the others those that take little time; the rest is interpolated by the number of bodies.
void Runner::probe() {
  std::set<std::pair<int, int>> wanted;
  for (const PlannedCell* cell : todo_) {
    if (cell->steps > 0 && !failed_gate_.contains(contender(*cell).resolved.name)) {
      wanted.insert({cell->system, cell->contender});
    }
  }
  std::map<std::pair<std::string, int>, std::vector<int>> families;  // systems by family and contender
  for (const auto& [s, c] : wanted) {
    const std::string& family = campaign_.systems[static_cast<size_t>(s)].family;
    if (!family.empty()) families[{family, c}].push_back(s);
  }
  const auto size = [&](int s) { return campaign_.systems[static_cast<size_t>(s)].model.bodies.size(); };
  for (auto& [name, systems] : families) {
    std::ranges::stable_sort(systems, {}, size);
    for (size_t i = 1; i + 1 < systems.size(); ++i) {
      if (i != systems.size() / 2) wanted.erase({systems[i], name.second});
    }
  }
  // Of each contender the smallest system, the largest, and then the others, as long as its probes have taken little
  // time: an engine that needs seconds to start would take longer to probe than to measure.
  constexpr double kContenderSeconds = 10, kStartSeconds = 60;
  struct Queue {
    std::vector<int> systems;
    size_t begun = 0;
    double spent_s = 0;
  };
  std::map<int, Queue> queues;
  for (const auto& [s, c] : wanted) queues[c].systems.push_back(s);
  if (!queues.empty()) {
    progress_.phase(
        fmt::format("a look at the speed of {}, for the estimate of the time", counted(queues.size(), "contender")));
  }
  Pool pool(program_, jobs_, interrupts_);
  const std::function<void(int)> add_next = [&](int c) {
    Queue& queue = queues.at(c);
    if (queue.begun == queue.systems.size() || queue.spent_s > kContenderSeconds) return;
    const int s = queue.systems[queue.begun++];
    const CampaignSystem& probed = campaign_.systems[static_cast<size_t>(s)];
    Job job;
    job.request = ProbeJob{subject_spec(probed, campaign_.contenders[static_cast<size_t>(c)]),
                           probed.timesteps_ms.front(), !probed.family.empty()};
    job.limit_s = kStartSeconds;
    job.on_end = [this, &add_next, &queue, at = std::pair(s, c)](const JobEnd& end) {
      if (end.answer) {
        step_us_[at] = end.answer->step_us;
        starts_.instance_s[at] = end.answer->instance_s;
        if (end.answer->start_s > 0) starts_.worker_s.emplace(at.second, end.answer->start_s);
      }
      queue.spent_s += end.wall_s;
      add_next(at.second);
    };
    pool.add(std::move(job));
  };
  for (auto& [c, queue] : queues) {
    std::ranges::stable_sort(queue.systems, {}, size);
    if (queue.systems.size() > 2) std::rotate(queue.systems.begin() + 1, queue.systems.end() - 1, queue.systems.end());
    add_next(c);
  }
  pool.run({});
  // Systems without a time, also those whose probe took too long. The probe of an engine that fails has answered 0.
  const auto interpolate = [&](const std::vector<int>& systems, int c) {
    for (std::map<std::pair<int, int>, double>* times : {&step_us_, &starts_.instance_s}) {
      std::map<double, double> known;
      for (const int s : systems) {
        const auto found = times->find({s, c});
        if (found != times->end() && found->second > 0) known[static_cast<double>(size(s))] = found->second;
      }
      if (known.empty()) continue;
      for (const int s : systems) times->try_emplace({s, c}, time_at_size(known, static_cast<double>(size(s))));
    }
  };
  for (const auto& [name, systems] : families) interpolate(systems, name.second);
  for (const auto& [c, queue] : queues) {
    // A step with contacts costs another multiple of the bodies than one without.
    for (const bool contacts : {false, true}) {
      std::vector<int> alike;
      std::ranges::copy_if(queue.systems, std::back_inserter(alike), [&](int s) {
        return campaign_.systems[static_cast<size_t>(s)].model.contacts.empty() != contacts;
      });
      interpolate(alike, c);
    }
    interpolate(queue.systems, c);
  }
}

}  // namespace assay
