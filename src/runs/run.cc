#include "runs/run.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <sys/resource.h>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/hash.h"
#include "base/paths.h"
#include "base/text.h"
#include "conformance/conformance.h"
#include "engines/describe.h"
#include "runs/jobs.h"
#include "runs/machine.h"
#include "runs/pool.h"
#include "runs/timing.h"
#include "store/trajectory.h"

namespace assay {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::json;

constexpr double kGateTestLimitSeconds = 300;  // of one test of the suite
constexpr double kTruthLimitSeconds = 3600;
constexpr const char* kHarness = "null";  // the contender that does nothing

// ---- rows that describe ---------------------------------------------------------------------------------------------

ContenderRow row_of(const CampaignContender& contender) {
  const ResolvedContender& resolved = contender.resolved;
  if (resolved.engine == nullptr) {
    return {resolved.name, "", "", resolved.base, "", "{}", json{{"absent", contender.absent}}.dump()};
  }
  const BuildFacts build = resolved.engine->build();
  return {resolved.name,
          resolved.engine->name(),
          build.version,
          resolved.base,
          settings_text(*resolved.engine, resolved.settings),
          json(describe(resolved.engine->capabilities(resolved.settings))).dump(),
          json{{"version", build.version},
               {"source", build.source},
               {"compiler", build.compiler},
               {"flags", build.flags},
               {"plugin", contender.plugin_hash}}
              .dump()};
}

SystemRow row_of(const CampaignSystem& system) {
  const Model& model = system.model;
  std::vector<std::string> measures;
  measures.reserve(system.measures.size());
  for (const Measure measure : system.measures) measures.emplace_back(measure_text(measure));
  return {system.name, json{{"model", std::filesystem::path(system.model_path).filename().string()},
                            {"model_hash", model.hash},
                            {"dof", model.dof()},
                            {"bodies", model.bodies.size()},
                            {"hinges", model.hinges.size()},
                            {"shapes", model.shapes.size()},
                            {"contact_pairs", model.contacts.size()},
                            {"mass_kg", model.total_mass()},
                            {"gravity", {model.gravity.x(), model.gravity.y(), model.gravity.z()}},
                            {"contacts", system.contacts},
                            {"control", make_control(model, system.control)->description()},
                            {"duration_s", system.duration_s},
                            {"sample_ms", system.sample_ms},
                            {"pieces", system.pieces},
                            {"piece_ms", system.piece_ms},
                            {"reference_ms", system.reference_ms},
                            {"timesteps_ms", system.timesteps_ms},
                            {"timing_ms", system.timing_ms},
                            {"measures", measures}}
                           .dump()};
}

std::string date_text(double unix_seconds) {
  const auto seconds = static_cast<std::time_t>(unix_seconds);
  std::tm utc{};
  ::gmtime_r(&seconds, &utc);
  return fmt::format("{:04}-{:02}-{:02} {:02}:{:02}:{:02} UTC", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday,
                     utc.tm_hour, utc.tm_min, utc.tm_sec);
}

std::string truth_address(const CampaignSystem& system) {
  return content_hash(json{{"truth", 1}, {"model", system.model.hash}, {"duration_s", system.duration_s}}.dump());
}

double children_cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

// ---- one run of a campaign --------------------------------------------------------------------------------------------

struct Failure {
  Outcome outcome = Outcome::kOk;
  std::string reason;
};

class Runner {
 public:
  Runner(const Campaign& campaign, const RunOptions& options)
      : campaign_(campaign),
        options_(options),
        progress_(options.progress != nullptr ? *options.progress : silent_),
        program_(options.program.empty() ? program_path() : options.program),
        store_(Store::create(options.out, {campaign.name, campaign.hash()})),
        jobs_(options.jobs > 0 ? options.jobs : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()))) {}

  RunSummary run();

 private:
  // An accuracy job that waits for trajectories.
  struct Waiting {
    Job job;
    std::set<std::string> needs;
    std::vector<const PlannedCell*> cells;
  };

  const CampaignSystem& system(const PlannedCell& cell) const {
    return campaign_.systems[static_cast<size_t>(cell.system)];
  }
  const CampaignContender& contender(const PlannedCell& cell) const {
    return campaign_.contenders[static_cast<size_t>(cell.contender)];
  }
  std::string title(const PlannedCell& cell) const {
    return fmt::format("{} {} {} {} ms", cell.measure, system(cell).name, contender(cell).resolved.name,
                       timestep_label(cell.timestep_ms));
  }

  void describe();
  void choose();
  void gate();
  void gate_tests(const std::string& content, const std::vector<std::string>& tests, Pool& pool);
  void probe();
  void accuracy();
  void plan_references(std::map<std::string, Waiting>& producers);
  void plan_truths(std::map<std::string, Waiting>& producers);
  std::vector<Waiting> plan_measures();
  void timing();
  void time_system(TimingPass& pass, int system_index);
  void finish(RunSummary& summary, double wall_s, double cpu_s);

  Cell cell_of(const PlannedCell& planned, Outcome outcome, const std::string& reason) const;
  void put(const Cell& cell, const std::vector<SampleSeries>& samples = {});
  void put_failed(const PlannedCell& planned, Outcome outcome, const std::string& reason);
  void put_answer(const std::vector<const PlannedCell*>& cells, const JobEnd& end);
  double cost(const PlannedCell& cell) const;
  void count(const PlannedCell& cell);
  double remaining_s() const;
  bool interrupted() const { return interrupts_.signal() != 0; }

  const Campaign& campaign_;
  const RunOptions& options_;
  Progress silent_;
  Progress& progress_;
  std::string program_;
  Interrupts interrupts_;
  Store store_;
  int jobs_;
  Plan plan_;
  std::vector<const PlannedCell*> mine_, todo_;
  std::map<std::string, Failure> failed_gate_;        // by contender
  std::map<std::string, Failure> failed_trajectory_;  // by address
  std::map<std::pair<int, int>, double> step_us_;
  std::map<std::string, std::vector<ConformanceRow>> gate_rows_;  // by contender's content
  TimingFacts timing_facts_;
  int done_now_ = 0;
  Clock::time_point start_ = Clock::now();
  // Estimated seconds of one worker, of a pass and of what is done of it.
  struct Share {
    double all_s = 0, done_s = 0;
    Clock::time_point since;
  };
  Share accuracy_, timing_;
};

Cell Runner::cell_of(const PlannedCell& planned, Outcome outcome, const std::string& reason) const {
  Cell cell;
  cell.key = planned.key;
  cell.system = system(planned).name;
  cell.contender = contender(planned).resolved.name;
  cell.timestep_ms = planned.timestep_ms;
  cell.measure = planned.measure;
  cell.outcome = outcome;
  cell.reason = reason;
  return cell;
}

void Runner::put(const Cell& cell, const std::vector<SampleSeries>& samples) {
  store_.put_cell(cell, samples);
  ++done_now_;
  progress_.finished(cell, remaining_s());
}

void Runner::put_failed(const PlannedCell& planned, Outcome outcome, const std::string& reason) {
  Cell cell = cell_of(planned, outcome, reason);
  cell.started = cell.finished = unix_time();
  if (!failed_gate_.contains(cell.contender)) count(planned);
  put(cell);
}

// An answer has a cell for each measure; cells that are one under two contenders' names get the same.
void Runner::put_answer(const std::vector<const PlannedCell*>& cells, const JobEnd& end) {
  for (const PlannedCell* planned : cells) {
    Cell cell = cell_of(*planned, end.outcome, end.reason);
    std::vector<SampleSeries> samples;
    const double share = 1.0 / static_cast<double>(cells.size());
    cell.wall_s = share * end.wall_s;
    cell.steal = end.steal;
    cell.started = end.started;
    cell.finished = end.finished;
    if (end.answer) {
      cell.cpu_s = share * end.answer->at("cpu_s").get<double>();
      cell.engine_s = share * end.answer->at("engine_s").get<double>();
      for (const json& answered : end.answer->at("cells")) {
        if (answered.at("measure") != planned->measure) continue;
        cell.outcome = parse_outcome(answered.at("outcome").get<std::string>()).value_or(Outcome::kCrashed);
        cell.reason = answered.at("reason");
        const auto number = [](const json& value) {
          return value.is_null() ? std::nullopt : std::optional(value.get<double>());
        };
        for (const json& value : answered.at("values")) {
          cell.values.push_back({value.at("name"), value.at("unit"), number(value.at("value")), number(value.at("low")),
                                 number(value.at("high"))});
        }
        for (const auto& [name, values] : answered.at("samples").items()) {
          samples.push_back({name, values.get<std::vector<double>>()});
        }
      }
    }
    count(*planned);
    put(cell, samples);
  }
}

// Seconds of one worker.
double Runner::cost(const PlannedCell& cell) const { return estimate_seconds(campaign_, {cell}, step_us_, 1); }

// What is left of both passes, each corrected by how it fared so far.
double Runner::remaining_s() const {
  const auto now = Clock::now();
  const auto left = [&](const Share& share, double workers) {
    const double expected_s = share.done_s / workers;
    const double elapsed_s = std::chrono::duration<double>(now - share.since).count();
    constexpr double kEnough = 0.05;  // of the pass, to learn from
    const bool learned = share.done_s > kEnough * share.all_s && expected_s > 0;
    return (share.all_s - share.done_s) / workers * (learned ? elapsed_s / expected_s : 1);
  };
  return left(accuracy_, jobs_) + left(timing_, 1);
}

void Runner::count(const PlannedCell& cell) {
  Share& share = cell.measure == "raw_speed" ? timing_ : accuracy_;
  share.done_s += cost(cell);
}

// ---- preparation ------------------------------------------------------------------------------------------------------

void Runner::describe() {
  std::vector<SystemRow> systems;
  systems.reserve(campaign_.systems.size());
  for (const CampaignSystem& each : campaign_.systems) systems.push_back(row_of(each));
  store_.set_systems(systems);
  std::vector<ContenderRow> contenders;
  bool has_harness = false;
  for (const CampaignContender& each : campaign_.contenders) {
    contenders.push_back(row_of(each));
    has_harness |= each.resolved.name == kHarness;
  }
  const std::vector<std::string> known = Registry::instance().contender_names();
  if (!has_harness && std::ranges::find(known, kHarness) != known.end()) {
    CampaignContender harness;
    harness.resolved = Registry::instance().resolve(kHarness);
    contenders.push_back(row_of(harness));
  }
  store_.set_contenders(contenders);

  std::vector<ManifestEntry> entries = machine_facts();
  const auto before = store_.manifest("cpu");
  if (before && *before != entries.front().value) {
    progress_.message(
        fmt::format("the results so far were measured on another machine ({}): speeds do not compare", *before));
  }
  entries.push_back({"campaign_title", campaign_.title});
  entries.push_back({"seed", std::to_string(campaign_.seed)});
  const TimingOptions& timing = campaign_.timing;
  entries.push_back(
      {"timing", fmt::format("{} rounds of {} ms a contender in {} processes, from {} states of its reference "
                             "run, {} untimed steps first",
                             timing.rounds, shortest(timing.batch_ms), std::min(timing.processes, timing.rounds),
                             timing.states, timing.warmup)});
  if (!options_.command.empty()) entries.push_back({"command", options_.command});
  if (!store_.manifest("started")) entries.push_back({"started", date_text(unix_time())});
  store_.set_manifest(entries);
}

// Which cells are ours, and which of them are still to do.
void Runner::choose() {
  plan_ = make_plan(campaign_, options_.shard.count);
  const std::vector<std::string> done = store_.cell_keys();
  std::set<std::pair<int, double>> timed_again;  // a cell of a round is missing: the round is repeated with all in it
  for (const PlannedCell& cell : plan_.cells) {
    if (cell.shard != options_.shard.index) continue;
    mine_.push_back(&cell);
    if (cell.measure == "raw_speed" && !std::ranges::binary_search(done, cell.key)) {
      timed_again.insert({cell.system, cell.timestep_ms});
    }
  }
  for (const PlannedCell* cell : mine_) {
    const bool again = cell->measure == "raw_speed" && timed_again.contains({cell->system, cell->timestep_ms});
    if (again || !std::ranges::binary_search(done, cell->key)) todo_.push_back(cell);
  }
  // A reference that failed fails what depends on it, this time too.
  std::map<std::string, const PlannedCell*> references;
  for (const PlannedCell& cell : plan_.cells) {
    if (cell.measure == "reference") references[cell.key] = &cell;
  }
  for (const Cell& cell : store_.cells()) {
    const auto found = references.find(cell.key);
    if (found == references.end() || cell.outcome == Outcome::kOk || cell.outcome == Outcome::kUnstable) continue;
    failed_trajectory_[found->second->trajectory] = {cell.outcome, cell.reason};
  }
}

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
  job.limit_s = kGateTestLimitSeconds;
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
      rows.push_back({"", tests[ran], std::string(status_text(ConformanceStatus::kFail)), 0, 0, "",
                      fmt::format("{}: {}", outcome_text(end.outcome), end.reason)});
      if (ran + 1 < tests.size()) {
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

// How long a step takes, roughly: for the time that is left.
void Runner::probe() {
  std::set<std::pair<int, int>> wanted;
  for (const PlannedCell* cell : todo_) {
    if (cell->steps > 0 && !failed_gate_.contains(contender(*cell).resolved.name)) {
      wanted.insert({cell->system, cell->contender});
    }
  }
  Pool pool(program_, jobs_, interrupts_);
  for (const auto& [s, c] : wanted) {
    Job job;
    job.message = subject_json(campaign_.systems[static_cast<size_t>(s)], campaign_.contenders[static_cast<size_t>(c)]);
    job.message["kind"] = "probe";
    job.message["timestep_ms"] = campaign_.systems[static_cast<size_t>(s)].timesteps_ms.front();
    job.limit_s = 10;
    job.on_end = [this, at = std::pair(s, c)](const JobEnd& end) {
      if (end.answer) step_us_[at] = end.answer->at("step_us");
    };
    pool.add(std::move(job));
  }
  pool.run({});
}

// ---- accuracy -------------------------------------------------------------------------------------------------------------

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
    const bool there = has_trajectory(store_.trajectories_dir(), address);
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
    if (producers.contains(address) || has_trajectory(store_.trajectories_dir(), address)) continue;
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
  // Truth and drift read the same run.
  std::map<std::tuple<int, int, double>, size_t> runs;
  for (const PlannedCell* cell : todo_) {
    if (cell->measure == "reference" || cell->measure == "raw_speed") continue;
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
        job.message["seed"] = campaign_.seed;
      }
    }
    waiting.cells.push_back(cell);
    if (!cell->trajectory.empty()) waiting.needs.insert(cell->trajectory);
    if (is_run) job.message["measures"].push_back(cell->measure);
    if (cell->measure == "truth") {
      job.message["truth"] = truth_address(system(*cell));
      waiting.needs.insert(truth_address(system(*cell)));
    }
  }
  return jobs;
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
      if (one.needs.erase(address) == 0 || (!failure && !one.needs.empty())) {
        ++i;
        continue;
      }
      if (failure) {
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

// ---- timing ---------------------------------------------------------------------------------------------------------------

void Runner::time_system(TimingPass& pass, int system_index) {
  const CampaignSystem& timed = campaign_.systems[static_cast<size_t>(system_index)];
  std::vector<double> timesteps;
  for (const PlannedCell* cell : todo_) {
    if (cell->measure != "raw_speed" || cell->system != system_index) continue;
    if (std::ranges::find(timesteps, cell->timestep_ms) == timesteps.end()) timesteps.push_back(cell->timestep_ms);
  }
  std::ranges::sort(timesteps);
  const std::vector<std::string> known = Registry::instance().contender_names();
  const bool has_harness = std::ranges::find(known, kHarness) != known.end() &&
                           std::ranges::none_of(campaign_.contenders, [](const CampaignContender& each) {
                             return each.resolved.name == kHarness;
                           });
  const std::vector<std::string> stored = store_.cell_keys();
  for (const double timestep : timesteps) {
    std::vector<TimedContender> contenders;
    std::map<std::string, std::string> keys;
    std::map<std::string, const PlannedCell*> planned;
    for (const PlannedCell* cell : todo_) {
      if (cell->measure != "raw_speed" || cell->system != system_index || cell->timestep_ms != timestep) continue;
      const std::string& name = contender(*cell).resolved.name;
      if (failed_gate_.contains(name)) continue;
      const auto failed = failed_trajectory_.find(cell->trajectory);
      if (failed != failed_trajectory_.end()) {
        put_failed(*cell, failed->second.outcome, failed->second.reason);
        continue;
      }
      contenders.push_back({name, subject_json(timed, contender(*cell)), cell->trajectory});
      keys[name] = cell->key;
      planned[name] = cell;
    }
    if (contenders.empty()) continue;
    const std::string key =
        content_hash(json{{"harness", campaign_.name}, {"system", timed.name}, {"h", timestep}}.dump());
    // a finished cell is not measured again when a run is resumed, this one neither
    const bool with_harness = has_harness && !std::ranges::binary_search(stored, key);
    if (with_harness) {
      CampaignContender harness;
      harness.resolved = Registry::instance().resolve(kHarness);
      json subject = subject_json(timed, harness);
      contenders.push_back({kHarness, std::move(subject), ""});
      keys[kHarness] = key;
    }
    pass.measure(
        timed, contenders, timestep, keys, with_harness ? kHarness : "",
        [&](const std::string& what) { progress_.started(what); },
        [&](const Cell& cell, const std::vector<SampleSeries>& samples) {
          if (has_harness && cell.contender == kHarness) {
            store_.put_cell(cell, samples);  // no cell of the campaign
            return;
          }
          count(*planned.at(cell.contender));
          put(cell, samples);
        });
    if (interrupted()) return;
  }
}

void Runner::timing() {
  if (std::ranges::none_of(todo_, [](const PlannedCell* cell) { return cell->measure == "raw_speed"; })) return;
  progress_.phase("timing, alone on one core");
  timing_.since = Clock::now();
  TimingPass pass(campaign_, program_, store_.trajectories_dir(), interrupts_);
  for (size_t s = 0; s < campaign_.systems.size() && !interrupted(); ++s) {
    time_system(pass, static_cast<int>(s));
    pass.close();
  }
  timing_facts_ = pass.facts();
}

// ---- the whole ------------------------------------------------------------------------------------------------------------

void Runner::finish(RunSummary& summary, double wall_s, double cpu_s) {
  summary.warnings = derive_values(store_);
  summary.cells = static_cast<int>(mine_.size());
  summary.done_before = static_cast<int>(mine_.size() - todo_.size());
  summary.done_now = done_now_;
  summary.wall_s = wall_s;
  summary.cpu_s = cpu_s;
  summary.signal = interrupts_.signal();
  summary.interrupted = summary.signal != 0;
  for (const auto& [name, failure] : failed_gate_) {
    summary.failed_gate.push_back(fmt::format("{} ({})", name, failure.reason));
  }
  for (const CampaignContender& each : campaign_.contenders) {
    if (!each.absent.empty()) summary.left_out.push_back(each.absent);
  }
  std::set<std::string> keys;
  for (const PlannedCell* cell : mine_) keys.insert(cell->key);
  double timing_engine = 0, timing_wall = 0, accuracy_engine = 0, accuracy_cpu = 0;
  for (const Cell& cell : store_.cells()) {
    if (!keys.contains(cell.key)) continue;
    ++summary.outcomes[std::string(outcome_text(cell.outcome))];
    (cell.measure == "raw_speed" ? timing_engine : accuracy_engine) += cell.engine_s;
    (cell.measure == "raw_speed" ? timing_wall : accuracy_cpu) +=
        cell.measure == "raw_speed" ? cell.wall_s : cell.cpu_s;
    for (const Value& value : cell.values) {
      if (value.name != "aa_ratio" || !value.value) continue;
      summary.aa.push_back({cell.system, "", cell.contender, cell.timestep_ms, *value.value, value.low.value_or(0),
                            value.high.value_or(0)});
    }
  }
  for (AaPair& pair : summary.aa) {
    const auto content = [&](const std::string& name) {
      const auto found = std::ranges::find_if(
          campaign_.contenders, [&](const CampaignContender& each) { return each.resolved.name == name; });
      return found->content();
    };
    for (const CampaignContender& each : campaign_.contenders) {
      if (pair.a.empty() && each.absent.empty() && each.content() == content(pair.b)) pair.a = each.resolved.name;
    }
  }
  summary.engine_share_timing = timing_wall > 0 ? timing_engine / timing_wall : 0;
  summary.engine_share_accuracy = accuracy_cpu > 0 ? accuracy_engine / accuracy_cpu : 0;

  std::vector<ManifestEntry> entries;
  const auto sum = [&](const std::string& key, double more) {
    const double before = parse_number(store_.manifest(key).value_or("")).value_or(0);
    entries.push_back({key, fmt::format("{:.1f}", before + more)});
  };
  if (done_now_ > 0) {
    sum("wall_s", wall_s);
    sum("cpu_s", cpu_s);
    entries.push_back({"finished", date_text(unix_time())});
  }
  if (timing_wall > 0) entries.push_back({"engine_share_timing", fmt::format("{:.3f}", summary.engine_share_timing)});
  if (accuracy_cpu > 0) {
    entries.push_back({"engine_share_accuracy", fmt::format("{:.3f}", summary.engine_share_accuracy)});
  }
  if (timing_facts_.core >= 0) entries.push_back({"timing_core", std::to_string(timing_facts_.core)});
  if (timing_facts_.clock_s > 0) {
    entries.push_back({"clock_cost_ns", fmt::format("{:.0f}", 1e9 * timing_facts_.clock_s)});
  }
  if (!entries.empty()) store_.set_manifest(entries);
}

RunSummary Runner::run() {
  const double cpu_before = children_cpu_seconds();
  choose();
  describe();
  if (!todo_.empty() && !interrupted()) gate();
  if (!todo_.empty() && !interrupted()) probe();
  if (!interrupted()) {
    std::vector<PlannedCell> ahead;
    ahead.reserve(todo_.size());
    for (const PlannedCell* cell : todo_) {
      if (failed_gate_.contains(contender(*cell).resolved.name)) continue;
      ahead.push_back(*cell);
      (cell->measure == "raw_speed" ? timing_ : accuracy_).all_s += cost(*cell);
    }
    accuracy_.since = Clock::now();
    progress_.begin(static_cast<int>(todo_.size()), static_cast<int>(mine_.size() - todo_.size()),
                    estimate_seconds(campaign_, ahead, step_us_, jobs_));
    accuracy();
    if (!interrupted()) timing();
  }
  progress_.end();
  RunSummary summary;
  finish(summary, std::chrono::duration<double>(Clock::now() - start_).count(), children_cpu_seconds() - cpu_before);
  return summary;
}

}  // namespace

RunSummary run_campaign(const Campaign& campaign, const RunOptions& options) { return Runner(campaign, options).run(); }

}  // namespace assay
