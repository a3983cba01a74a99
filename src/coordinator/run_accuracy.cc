// The gate, then every cell that is not a timing: on all cores.
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/hash.h"
#include "conformance/conformance.h"
#include "coordinator/runner.h"
#include "store/trajectory.h"

namespace assay {

using nlohmann::json;

namespace {

constexpr double kGateTestLeastSeconds = 30, kGateTestMostSeconds = 300;  // limits of one test of the suite
constexpr double kTruthLimitSeconds = 3600;

std::string truth_address(const CampaignSystem& system) {
  return content_hash(json{{"truth", 1}, {"model", system.model.hash}, {"duration_s", system.duration_s}}.dump());
}

}  // namespace

// ---- the gate -----------------------------------------------------------------------------------------------------------

// Runs the tests in one worker; when that dies in a test, the test has failed and the rest goes on in another.
void Runner::gate_tests(const std::string& content, const std::vector<std::string>& tests, Pool& pool) {
  const auto found = std::ranges::find_if(campaign_.contenders,
                                          [&](const CampaignContender& each) { return each.content() == content; });
  Job job;
  job.message = subject_json(campaign_.systems.front(), *found);
  job.message["kind"] = "gate";
  job.message["tests"] = tests;
  job.title = fmt::format("gate {}", found->resolved.name);
  job.limit_s = std::clamp(campaign_.time_limit_s, kGateTestLeastSeconds, kGateTestMostSeconds);
  job.cost = 1;
  const size_t before = gate_rows_[content].size();
  job.on_message = [this, content](const json& message) {
    const auto number = [&](const char* key) {
      return message.at(key).is_null() ? 0.0 : message.at(key).get<double>();
    };
    gate_rows_[content].push_back({"", message.at("test"), message.at("status"), number("figure"), number("tolerance"),
                                   message.at("unit"), message.at("note")});
  };
  job.on_end = [this, content, tests, before, &pool](const JobEnd& end) {
    std::vector<ConformanceRow>& rows = gate_rows_[content];
    const size_t ran = rows.size() - before;
    if (!end.answer && ran < tests.size()) {
      const std::string fail(status_text(ConformanceStatus::kFail));
      rows.push_back({"", tests[ran], fail, 0, 0, "", fmt::format("{}: {}", outcome_text(end.outcome), end.reason)});
      if (end.outcome == Outcome::kTimeout) {
        // one that never returns would cost the limit in each of the other tests again
        for (size_t i = ran + 1; i < tests.size(); ++i) {
          rows.push_back(
              {"", tests[i], fail, 0, 0, "", fmt::format("not tried: {} did not come to an end", tests[ran])});
        }
      } else if (ran + 1 < tests.size()) {
        gate_tests(content, {tests.begin() + static_cast<std::ptrdiff_t>(ran) + 1, tests.end()}, pool);
        return;
      }
    }
    for (const CampaignContender& each : campaign_.contenders) {
      if (each.content() == content) store_.set_conformance(each.resolved.name, rows);
    }
  };
  pool.add(std::move(job));
}

void Runner::gate() {
  std::set<std::string> scored;
  for (const PlannedCell* cell : todo_) scored.insert(contender(*cell).resolved.name);
  std::set<std::string> known;
  for (const ConformanceRow& row : store_.conformance()) known.insert(row.contender);
  std::set<std::string> contents;
  for (const CampaignContender& each : campaign_.contenders) {
    if (scored.contains(each.resolved.name) && !known.contains(each.resolved.name)) contents.insert(each.content());
  }
  if (!contents.empty()) {
    progress_.phase(fmt::format("the gate: conformance of {} contenders", contents.size()));
    std::vector<std::string> tests;
    for (const ConformanceTest& test : conformance_tests()) tests.push_back(test.name);
    Pool pool(program_, jobs_, interrupts_);
    for (const std::string& content : contents) gate_tests(content, tests, pool);
    pool.run([&](const std::string& job) { progress_.started(job); });
  }
  std::map<std::string, std::vector<std::string>> failures;
  for (const ConformanceRow& row : store_.conformance()) {
    if (row.status == status_text(ConformanceStatus::kFail)) failures[row.contender].push_back(row.test);
  }
  for (const auto& [name, tests] : failures) {
    failed_gate_[name] = {Outcome::kUnsupported, fmt::format("did not pass the gate: {}", join(tests, ", "))};
  }
}

// How long a step takes, roughly: for the time that is left. Of a family of sizes three are probed, the others lie
// between them.
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
  Pool pool(program_, jobs_, interrupts_);
  for (const auto& [s, c] : wanted) {
    Job job;
    job.message = subject_json(campaign_.systems[static_cast<size_t>(s)], campaign_.contenders[static_cast<size_t>(c)]);
    job.message["kind"] = "probe";
    job.message["timestep_ms"] = campaign_.systems[static_cast<size_t>(s)].timesteps_ms.front();
    job.message["whole_run"] = !campaign_.systems[static_cast<size_t>(s)].family.empty();
    job.limit_s = 10;
    job.on_end = [this, at = std::pair(s, c)](const JobEnd& end) {
      if (end.answer) step_us_[at] = end.answer->at("step_us");
    };
    pool.add(std::move(job));
  }
  pool.run({});
  for (const auto& [name, systems] : families) {
    std::map<double, double> known;
    for (const int s : systems) {
      const auto found = step_us_.find({s, name.second});
      if (found != step_us_.end() && found->second > 0) known[static_cast<double>(size(s))] = found->second;
    }
    for (const int s : systems) {
      // also where the probe took too long; one whose engine fails has said 0
      const std::pair<int, int> at(s, name.second);
      if (!step_us_.contains(at)) step_us_[at] = step_us_at(known, static_cast<double>(size(s)));
    }
  }
}

// ---- accuracy -------------------------------------------------------------------------------------------------------------

// Made here before, or kept from another campaign.
bool Runner::has_run(const std::string& address) const {
  return has_trajectory(store_.trajectories_dir(), address) || references_.fetch(address, store_.trajectories_dir());
}

// Runs that others need or that are cells of their own.
void Runner::plan_references(std::map<std::string, Waiting>& producers) {
  // Cells of equal contenders under several names share one run.
  std::map<std::string, std::vector<const PlannedCell*>> cells;
  std::map<std::string, const PlannedCell*> any;
  for (const PlannedCell* cell : todo_) {
    if (cell->trajectory.empty() || failed_gate_.contains(contender(*cell).resolved.name)) continue;
    any[cell->trajectory] = cell;
    if (cell->measure == "reference") cells[cell->trajectory].push_back(cell);
  }
  for (const auto& [address, cell] : any) {
    if (failed_trajectory_.contains(address)) continue;
    const bool there = has_run(address);
    if (there && !cells.contains(address)) continue;
    Waiting waiting;
    waiting.cells = cells[address];
    Job& job = waiting.job;
    job.message = subject_json(system(*cell), contender(*cell));
    job.message["kind"] = "run";
    job.message["timestep_ms"] = system(*cell).reference_ms;
    job.message["measures"] = {"reference"};
    job.message["trajectories"] = store_.trajectories_dir();
    job.message["save"] = there ? "" : address;
    job.message["use"] = there ? address : "";
    job.message["truth"] = "";
    job.message["seed"] = campaign_.seed;
    job.title = fmt::format("reference {} {}", system(*cell).name, contender(*cell).resolved.name);
    job.limit_s = campaign_.time_limit_s;
    // Others wait for these: first come the dearest of them.
    job.cost = 1e6 + (waiting.cells.empty() ? 0 : cost(*waiting.cells.front()));
    producers[address] = std::move(waiting);
  }
}

void Runner::plan_truths(std::map<std::string, Waiting>& producers) {
  for (const PlannedCell* cell : todo_) {
    if (cell->measure != "truth") continue;
    const std::string address = truth_address(system(*cell));
    if (producers.contains(address) || has_run(address)) continue;
    Waiting waiting;
    waiting.job.message = subject_json(system(*cell), contender(*cell));
    waiting.job.message["kind"] = "truth";
    waiting.job.message["trajectories"] = store_.trajectories_dir();
    waiting.job.message["save"] = address;
    waiting.job.title = fmt::format("truth {}", system(*cell).name);
    waiting.job.limit_s = kTruthLimitSeconds;
    waiting.job.cost = 1e7;
    producers[address] = std::move(waiting);
  }
}

std::vector<Runner::Waiting> Runner::plan_measures() {
  std::vector<Waiting> jobs;
  // All but consistency read the same run.
  std::map<std::tuple<int, int, double>, size_t> runs;
  for (const PlannedCell* cell : todo_) {
    if (cell->measure == "reference" || cell->measure == "agreement" || is_timed(*cell)) continue;
    if (failed_gate_.contains(contender(*cell).resolved.name)) continue;
    const bool is_run = cell->measure != "consistency";
    const auto at = std::tuple(cell->system, cell->contender, cell->timestep_ms);
    const auto found = runs.find(at);
    Waiting& waiting = is_run && found != runs.end() ? jobs[found->second] : jobs.emplace_back();
    Job& job = waiting.job;
    if (job.message.is_null()) {
      job.message = subject_json(system(*cell), contender(*cell));
      job.message["timestep_ms"] = cell->timestep_ms;
      job.message["trajectories"] = store_.trajectories_dir();
      job.title = title(*cell);
      job.limit_s = campaign_.time_limit_s;
      job.cost = cost(*cell);
      job.message["seed"] = campaign_.seed;
      if (is_run) {
        runs[at] = jobs.size() - 1;
        job.message["kind"] = "run";
        job.message["measures"] = json::array();
        job.message["save"] = "";
        job.message["use"] = cell->trajectory;
        job.message["truth"] = "";
      } else {
        job.message["kind"] = "pieces";
        job.message["reference"] = cell->trajectory;
        job.message["pieces"] = system(*cell).pieces;
        job.message["piece_ms"] = system(*cell).piece_ms;
        job.message["reference_ms"] = system(*cell).reference_ms;
      }
    }
    waiting.cells.push_back(cell);
    if (!cell->trajectory.empty()) waiting.needs.insert(cell->trajectory);
    if (is_run) job.message["measures"].push_back(cell->measure);
    if (cell->measure == "grasp") {
      const GraspBodies& grasp = system(*cell).grasp;
      job.message["grasp"] = {{"object", grasp.object}, {"hand", grasp.hand}, {"drop_m", grasp.drop_m}};
    }
    if (cell->measure == "truth") {
      job.message["truth"] = truth_address(system(*cell));
      waiting.needs.insert(truth_address(system(*cell)));
    }
  }
  plan_agreement(jobs);
  return jobs;
}

// Each contender's reference with those of all others that have one.
void Runner::plan_agreement(std::vector<Waiting>& jobs) {
  std::map<int, std::vector<const PlannedCell*>> systems;
  for (const PlannedCell* cell : todo_) {
    if (cell->measure == "agreement" && !failed_gate_.contains(contender(*cell).resolved.name)) {
      systems[cell->system].push_back(cell);
    }
  }
  for (const auto& [index, cells] : systems) {
    for (const PlannedCell* own : cells) {
      Waiting& waiting = jobs.emplace_back();
      waiting.tolerant = true;
      waiting.cells = {own};
      waiting.needs = {own->trajectory};
      Job& job = waiting.job;
      job.message = {{"kind", "agreement"}, {"own", own->trajectory}, {"trajectories", store_.trajectories_dir()}};
      job.message["others"] = json::array();
      job.title = title(*own);
      job.limit_s = campaign_.time_limit_s;
      for (const PlannedCell* other : cells) {
        if (other == own || failed_trajectory_.contains(other->trajectory)) continue;
        job.message["others"].push_back({{"name", contender(*other).resolved.name}, {"address", other->trajectory}});
        waiting.needs.insert(other->trajectory);
      }
    }
  }
}

void Runner::accuracy() {
  progress_.phase("accuracy");
  for (const PlannedCell* cell : todo_) {
    const auto failed = failed_gate_.find(contender(*cell).resolved.name);
    if (failed != failed_gate_.end()) put_failed(*cell, failed->second.outcome, failed->second.reason);
  }
  std::map<std::string, Waiting> producers;
  plan_references(producers);
  plan_truths(producers);
  std::vector<Waiting> waiting = plan_measures();

  Pool pool(program_, jobs_, interrupts_);
  const auto start = [&](Waiting& ready) {
    ready.job.on_end = [this, cells = ready.cells](const JobEnd& end) { put_answer(cells, end); };
    pool.add(std::move(ready.job));
  };
  // What waits for a trajectory goes on or fails with it.
  const auto release = [&](const std::string& address, const std::optional<Failure>& failure) {
    for (size_t i = 0; i < waiting.size();) {
      Waiting& one = waiting[i];
      const bool needed = one.needs.erase(address) > 0;
      const bool fails = failure && needed && !(one.tolerant && one.job.message.at("own") != address);
      if (needed && failure && !fails) {
        json& others = one.job.message.at("others");
        for (size_t k = others.size(); k > 0; --k) {
          if (others[k - 1].at("address") == address) others.erase(k - 1);
        }
      }
      if (!needed || (!fails && !one.needs.empty())) {
        ++i;
        continue;
      }
      if (fails) {
        for (const PlannedCell* cell : one.cells) put_failed(*cell, failure->outcome, failure->reason);
      } else {
        start(one);
      }
      waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(i));
    }
  };
  for (auto& [address, producer] : producers) {
    producer.job.on_end = [this, &release, address = address, cells = producer.cells](const JobEnd& end) {
      put_answer(cells, end);
      Failure failure{end.outcome, end.reason};
      if (end.answer) {
        for (const json& cell : end.answer->at("cells")) {
          failure = {parse_outcome(cell.at("outcome").get<std::string>()).value_or(Outcome::kCrashed),
                     cell.at("reason")};
        }
      }
      if (failure.outcome == Outcome::kOk || failure.outcome == Outcome::kUnstable) {
        references_.keep(address, store_.trajectories_dir());
        release(address, std::nullopt);
      } else {
        failure.reason = fmt::format("its reference run: {}", failure.reason);
        failed_trajectory_[address] = failure;
        release(address, failure);
      }
    };
    pool.add(std::move(producer.job));
  }
  // Trajectories that are there, or that are known to fail.
  std::set<std::string> settled;
  for (const Waiting& one : waiting) {
    for (const std::string& address : one.needs) {
      if (!producers.contains(address)) settled.insert(address);
    }
  }
  for (const std::string& address : settled) {
    const auto failed = failed_trajectory_.find(address);
    release(address, failed == failed_trajectory_.end() ? std::nullopt : std::optional(failed->second));
  }
  // and what needs none
  for (size_t i = 0; i < waiting.size();) {
    if (!waiting[i].needs.empty()) {
      ++i;
      continue;
    }
    start(waiting[i]);
    waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(i));
  }
  pool.run([&](const std::string& job) { progress_.started(job); });
}

}  // namespace assay
