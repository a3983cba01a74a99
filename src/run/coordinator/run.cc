#include "run/coordinator/run.h"

#include <cmath>
#include <iterator>
#include <sys/resource.h>
#include <sys/time.h>
#include <tuple>

#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "campaign/shards.h"
#include "conformance/conformance.h"
#include "isolate/sandbox.h"
#include "measures/measure.h"
#include "results/store/facts.h"
#include "run/coordinator/model_notes.h"
#include "run/coordinator/runner.h"

namespace assay {

namespace {

double children_cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

// Sends SIGALRM after some seconds, if any are given.
class Timer {
 public:
  explicit Timer(double seconds) : on_(seconds > 0) {
    if (on_) set(std::max(seconds, 1e-3));
  }
  ~Timer() {
    if (on_) set(0);
  }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

 private:
  static void set(double seconds) {
    itimerval value{};
    value.it_value.tv_sec = static_cast<time_t>(seconds);
    value.it_value.tv_usec = static_cast<suseconds_t>(1e6 * (seconds - std::floor(seconds)));
    ::setitimer(ITIMER_REAL, &value, nullptr);
  }

  bool on_;
};

}  // namespace

Cell Runner::cell_of(const PlannedCell& planned, const Ending& ending) const {
  Cell cell;
  cell.key = planned.key;
  cell.system = system(planned).name;
  cell.contender = contender(planned).resolved.name;
  cell.timestep_ms = planned.timestep_ms;
  cell.measure = planned.measure;
  cell.outcome = ending.outcome;
  cell.reason = ending.reason;
  return cell;
}

void Runner::note_stored(const Cell& cell) {
  ++done_now_;
  engine_now_s_ += cell.engine_s;
  progress_.finished(cell, remaining_s());
}

void Runner::put_failed(const PlannedCell& planned, const Ending& failure) {
  Cell cell = cell_of(planned, failure);
  cell.started = cell.finished = unix_time();
  if (!failed_gate_.contains(cell.contender)) count(planned);
  store_.put_cell(cell);
  note_stored(cell);
}

// An answer has a result for each measure. Cells that are one under two contenders' names get the same result.
void Runner::put_answer(const std::vector<const PlannedCell*>& cells, const JobEnd& end) {
  if (end.outside) return;  // nothing is known of them: they are measured at the next start
  std::vector<MeasuredCell> measured;
  for (const PlannedCell* planned : cells) {
    CellResult result = end.result(planned->measure);
    Cell cell = cell_of(*planned, result.ending);
    const double share = 1.0 / static_cast<double>(cells.size());
    cell.wall_s = share * end.wall_s;
    cell.steal = end.steal;
    cell.started = end.started;
    cell.finished = end.finished;
    if (end.answer) {
      cell.cpu_s = share * end.answer->cpu_s;
      cell.engine_s = share * end.answer->engine_s;
    }
    cell.values = std::move(result.values);
    count(*planned);
    measured.push_back({std::move(cell), std::move(result.samples)});
  }
  store_.put_cells(measured);
  for (const MeasuredCell& each : measured) note_stored(each.cell);
}

// Seconds of one worker.
double Runner::cost(const PlannedCell& cell) const {
  return estimate_seconds(campaign_, {ahead_of(cell)}, step_us_, 1, starts_);
}

PlannedCell Runner::ahead_of(const PlannedCell& cell) const {
  return options_.shard.cells == ShardCells::kAfterRuns ? after_runs(cell) : cell;
}

// Of one of the runs that the cell's cost is of.
double Runner::run_cost(const PlannedCell& cell) const { return cost(cell) / cell.runs; }

// What is left of both passes, each corrected by its own speed so far.
double Runner::remaining_s() const {
  const auto now = Clock::now();
  const auto left = [&](const Share& share, double workers) {
    const double done_s = share.done_s + share.under_way_s, expected_s = done_s / workers;
    const double elapsed_s = std::chrono::duration<double>(now - share.since).count();
    constexpr double kEnough = 0.05;  // of the pass, to learn from
    const bool learned = done_s > kEnough * share.all_s && expected_s > 0;
    return (share.all_s - done_s) / workers * (learned ? elapsed_s / expected_s : 1);
  };
  return left(accuracy_, jobs_) + left(timing_, 1);
}

void Runner::count(const PlannedCell& cell) {
  Share& share = is_timed(cell) ? timing_ : accuracy_;
  share.done_s += run_cost(cell);
}

// Times of one system compare only if one machine measured them: where some are missing and the others are another
// machine's, all of the system's (for scaling, of its family's) are measured again.
void Runner::time_again_elsewhere(std::set<std::pair<int, double>>& timed_again, std::set<int>& scaled_again) {
  std::map<std::string, std::string> elsewhere;  // by node: its machine's name
  for (const NodeRow& row : store_.nodes()) {
    const auto facts = facts_of(row.json);
    const std::string name = text_fact(facts, "name");
    if (name != node_name() || text_fact(facts, "cpu") != machine_facts().front().value) elsewhere[row.id] = name;
  }
  if (elsewhere.empty() || (timed_again.empty() && scaled_again.empty())) return;
  std::set<std::string> systems, families;
  for (const auto& [index, timestep_ms] : timed_again)
    systems.insert(campaign_.systems[static_cast<size_t>(index)].name);
  for (const int index : scaled_again) families.insert(campaign_.systems[static_cast<size_t>(index)].family);
  std::map<std::string, std::string> moved;  // system: machine
  for (const Cell& cell : store_.cells()) {
    const auto other = elsewhere.find(cell.node);
    if (other == elsewhere.end()) continue;
    const auto system = std::ranges::find(campaign_.systems, cell.system, &CampaignSystem::name);
    const bool again = ((reads(cell.measure, Reads::kSteps) || reads(cell.measure, Reads::kWorlds)) &&
                        systems.contains(cell.system)) ||
                       (reads(cell.measure, Reads::kWholeRuns) && system != campaign_.systems.end() &&
                        families.contains(system->family));
    if (!again) continue;
    timed_elsewhere_.insert(cell.key);
    moved[cell.system] = other->second;
    if (reads(cell.measure, Reads::kSteps) && system != campaign_.systems.end()) {
      timed_again.insert({static_cast<int>(system - campaign_.systems.begin()), cell.timestep_ms});
    }
  }
  for (const auto& [system, machine] : moved) {
    progress_.message(
        fmt::format("{} was timed on '{}', whose speeds do not compare with this machine's: its timings are "
                    "measured again",
                    system, machine));
  }
}

// Keys of stored cells that are measured again although they are there.
std::vector<std::string> Runner::retried() {
  std::vector<std::string> keys;
  if (!options_.retry) return keys;
  const std::vector<std::string> damaged = store_.remove_damaged_cells();
  if (!damaged.empty()) {
    progress_.message(fmt::format("{} damaged cells are measured again: {}", damaged.size(), join(damaged, "; ")));
  }
  for (const ConformanceRow& row : store_.conformance()) {
    if (row.status == status_text(ConformanceStatus::kFail)) suite_again_.insert(row.contender);
  }
  for (const Cell& cell : store_.cells()) {
    const bool failed = cell.outcome == Outcome::kCrashed || cell.outcome == Outcome::kTimeout;
    const bool unscored = cell.outcome == Outcome::kUnsupported && suite_again_.contains(cell.contender);
    if (failed || unscored) keys.push_back(cell.key);
  }
  std::ranges::sort(keys);
  return keys;
}

// Whose cells or runs are still to do.
std::set<const CampaignContender*> Runner::contenders_ahead() const {
  std::set<const CampaignContender*> ahead;
  for (const PlannedCell* cell : todo_) {
    ahead.insert(&contender(*cell));
    // whose runs it reads, in whatever part it is
    const int trained_in = system(*cell).trained_in, states_of = system(*cell).states_of;
    if (!cell->against.empty()) ahead.insert(&campaign_.contenders[static_cast<size_t>(trained_in)]);
    if (cell->reads == Reads::kSteps && states_of >= 0) {
      ahead.insert(&campaign_.contenders[static_cast<size_t>(states_of)]);
    }
  }
  for (const PlannedRun* run : runs_) {
    if (run->contender >= 0) ahead.insert(&campaign_.contenders[static_cast<size_t>(run->contender)]);
  }
  return ahead;
}

// Which cells belong to this shard, and which of them are still to do.
void Runner::choose() {
  plan_ = make_plan(campaign_, options_.shard.count, options_.shard.cells);
  for (const PlannedRun& run : plan_.runs) {
    if (run.shard == options_.shard.index) runs_.push_back(&run);
  }
  const std::vector<std::string> again_keys = retried();
  std::vector<std::string> done;
  std::ranges::set_difference(store_.cell_keys(), again_keys, std::back_inserter(done));
  std::set<std::pair<int, double>> timed_again;  // one cell of a round is missing: all of the round is repeated
  std::set<std::tuple<int, double, int>> batches_again;
  std::set<int> compared_again;  // likewise for agreement, which compares all contenders
  std::set<int> scaled_again;    // systems whose runs for scaling are all repeated
  for (const PlannedCell& cell : plan_.cells) {
    if (cell.shard != options_.shard.index || (options_.wanted && !options_.wanted(cell))) continue;
    mine_.push_back(&cell);
    if (cell.reads == Reads::kSteps && !std::ranges::binary_search(done, cell.key)) {
      timed_again.insert({cell.system, cell.timestep_ms});
    }
    if (cell.reads == Reads::kWorlds && !std::ranges::binary_search(done, cell.key)) {
      batches_again.insert({cell.system, cell.timestep_ms, cell.worlds});
    }
    if (cell.reads == Reads::kFineRuns && !std::ranges::binary_search(done, cell.key))
      compared_again.insert(cell.system);
    if (cell.reads == Reads::kWholeRuns && !std::ranges::binary_search(done, cell.key))
      scaled_again.insert(cell.system);
  }
  time_again_elsewhere(timed_again, scaled_again);
  for (const PlannedCell* cell : mine_) {
    const bool again = (cell->reads == Reads::kSteps && timed_again.contains({cell->system, cell->timestep_ms})) ||
                       batches_again.contains({cell->system, cell->timestep_ms, cell->worlds}) ||
                       (cell->reads == Reads::kFineRuns && compared_again.contains(cell->system)) ||
                       timed_elsewhere_.contains(cell->key);
    if (again || !std::ranges::binary_search(done, cell->key)) todo_.push_back(cell);
  }
  // A reference that failed earlier still fails what depends on it.
  std::map<std::string, const PlannedCell*> references;
  for (const PlannedCell& cell : plan_.cells) {
    if (cell.reads == Reads::kFineRun) references[cell.key] = &cell;
  }
  for (const Cell& cell : store_.cells()) {
    const auto found = references.find(cell.key);
    if (found == references.end() || cell.outcome == Outcome::kOk || cell.outcome == Outcome::kUnstable) continue;
    if (std::ranges::binary_search(again_keys, cell.key)) continue;
    failed_trajectory_[found->second->trajectory] = {cell.outcome, cell.reason};
  }
}

// "capsules-27: reference 14, consistency 112, raw_speed 56 cells; about 3 min", a line for each system, without the
// contenders that failed the conformance suite.
std::vector<std::string> Runner::outline(const std::vector<PlannedCell>& ahead) const {
  std::vector<std::string> lines;
  for (size_t s = 0; s < campaign_.systems.size(); ++s) {
    std::map<std::string, int> counts;
    std::vector<PlannedCell> cells;
    std::set<int> contenders;
    for (const PlannedCell& cell : ahead) {
      if (std::cmp_not_equal(cell.system, s)) continue;
      ++counts[cell.measure];
      cells.push_back(cell);
      contenders.insert(cell.contender);
    }
    if (cells.empty()) continue;
    std::vector<std::string> parts;
    parts.reserve(counts.size());
    for (const auto& [measure, count] : counts) parts.push_back(fmt::format("{} {}", measure, count));
    lines.push_back(fmt::format(
        "  {}: {} contenders; {}; about {}", campaign_.systems[s].name, contenders.size(), join(parts, ", "),
        duration_label(std::max(1.0, estimate_seconds(campaign_, cells, step_us_, jobs_, starts_)))));
  }
  return lines;
}

// Contenders may have been measured before they had to pass the conformance suite: their cells then say that they did
// not.
void Runner::take_back_failed() {
  std::map<std::string, const PlannedCell*> planned;
  for (const PlannedCell& cell : plan_.cells) planned[cell.key] = &cell;
  for (const Cell& cell : store_.cells()) {
    const auto failed = failed_gate_.find(cell.contender);
    if (failed == failed_gate_.end() || cell.outcome == Outcome::kUnsupported || !planned.contains(cell.key)) continue;
    Cell replaced = cell_of(*planned.at(cell.key), failed->second);
    replaced.started = replaced.finished = unix_time();
    store_.put_cell(replaced);
  }
}

RunSummary Runner::run() {
  const double cpu_before = children_cpu_seconds();
  const Timer timer(options_.budget_s);
  for (const std::string& note : campaign_.notes) progress_.message("note: " + note);
  for (const std::string& note : model_notes(campaign_)) progress_.message("note: " + note);
  if (const std::string lacking = offered_sandbox().lacking; !lacking.empty()) progress_.message("note: " + lacking);
  choose();
  describe();
  if (has_work() && !interrupted()) conformance();
  if (!runs_.empty()) step_us_ = expected_step_us(campaign_);
  if (!todo_.empty() && !interrupted() && options_.probe) probe();
  if (!interrupted()) {
    std::vector<PlannedCell> ahead;
    ahead.reserve(todo_.size());
    for (const PlannedCell* cell : todo_) {
      if (failed_gate_.contains(contender(*cell).resolved.name)) continue;
      ahead.push_back(ahead_of(*cell));
      (is_timed(*cell) ? timing_ : accuracy_).all_s += cost(*cell);
    }
    for (const PlannedRun* run : runs_) accuracy_.all_s += run_seconds(plan_, *run, step_us_);
    accuracy_.since = Clock::now();
    progress_.plan(outline(ahead));
    if (!runs_.empty()) {
      progress_.message(fmt::format("{} to make for other parts; about {}", counted(runs_.size(), "run"),
                                    duration_label(std::max(1.0, accuracy_.all_s / jobs_))));
    }
    if (options_.shard.cells != ShardCells::kRuns) {
      progress_.begin(static_cast<int>(todo_.size()), static_cast<int>(mine_.size() - todo_.size()),
                      estimate_seconds(campaign_, ahead, step_us_, jobs_, starts_));
    }
    accuracy();
    if (!interrupted()) scaling();
    if (!interrupted()) timing();
    if (!interrupted()) batches();
    references_.prune();
  }
  progress_.end();
  RunSummary summary;
  finish(summary, std::chrono::duration<double>(Clock::now() - start_).count(), children_cpu_seconds() - cpu_before);
  return summary;
}

RunSummary run_campaign(const Campaign& campaign, const RunOptions& options) { return Runner(campaign, options).run(); }

}  // namespace assay
