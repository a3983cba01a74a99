#include "compare/compare.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/text.h"
#include "compare/samples.h"
#include "measures/rank_test.h"
#include "results/values.h"
#include "store/facts.h"

namespace assay {
namespace {

using CellName = std::tuple<std::string, std::string, std::string, double>;  // system, contender, measure, timestep

CellName name_of(const Cell& cell) { return {cell.system, cell.contender, cell.measure, cell.timestep_ms}; }

struct Logs {
  std::vector<double> values;
  double mean = 0, variance_of_mean = 0;
};

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

int freedom(const Logs& logs) { return static_cast<int>(logs.values.size()) - 1; }

Logs logs_of(const TimeSamples& samples, const TimeSamples* control) {
  Logs logs;
  for (const auto& [number, time] : samples.times) {
    if (!(time > 0)) continue;
    double log = std::log(time);
    if (control != nullptr) {
      const auto same = control->times.find(number);
      if (same == control->times.end() || !(same->second > 0)) continue;
      log -= std::log(same->second);
    }
    logs.values.push_back(log);
  }
  if (logs.values.empty()) return logs;
  // The clock's own interval, which is wider where neighbouring processes are alike.
  const Interval found = t_interval(logs.values);
  logs.mean = found.value;
  const double error = logs.values.size() > 1 ? (found.high - found.low) / 2 / student_t_975(freedom(logs)) : kUnknown;
  logs.variance_of_mean = error * error;
  return logs;
}

// exp of the difference of the means; without an interval (NaN) where there are fewer than two samples of either.
Interval ratio_of(const Logs& a, const Logs& b) {
  const double difference = b.mean - a.mean, variance = a.variance_of_mean + b.variance_of_mean;
  Interval ratio = {std::exp(difference), kUnknown, kUnknown};
  if (std::isnan(variance)) return ratio;
  double half = 0;
  if (variance > 0) {
    const auto part = [](const Logs& logs) { return logs.variance_of_mean * logs.variance_of_mean / freedom(logs); };
    const double welch = variance * variance / (part(a) + part(b));  // at least the smaller of the two freedoms
    half = student_t_975(std::max(1, static_cast<int>(welch))) * std::sqrt(variance);
  }
  ratio.low = std::exp(difference - half);
  ratio.high = std::exp(difference + half);
  return ratio;
}

// Why the two cannot be compared, or nothing.
std::optional<Difference> obstacle(const std::vector<Difference>& found, const CompareOptions& options) {
  for (const Difference& each : found) {
    if (!accepts(options, each)) return each;
  }
  return std::nullopt;
}

std::string advice(const Difference& difference) {
  switch (difference.kind) {
    case DifferenceKind::kMachine:
      return "speeds compare on one machine only: --across-machines compares accuracy alone";
    case DifferenceKind::kProgram:
      return "--across-programs accepts that";
    default:
      return "measure both with the same models, campaign and settings";
  }
}

// Nodes on which a directory's times were measured, "" for unknown ones.
std::set<std::string> timing_machines(const Store& store, const std::vector<Cell>& cells) {
  std::map<std::string, std::string> texts;
  for (const NodeRow& node : store.nodes()) {
    texts[node.id] = text_fact(facts_of(node.json), "name");
  }
  std::set<std::string> found;
  for (const Cell& cell : cells) {
    if (is_timing(cell.measure) && texts.contains(cell.node)) found.insert(texts[cell.node]);
  }
  return found;
}

class Comparer {
 public:
  Comparer(const Store& a, const Store& b, const CompareOptions& options)
      : a_(a), b_(b), options_(options), cells_a_(a.cells()), cells_b_(b.cells()) {
    found_.a = a.dir();
    found_.b = b.dir();
    found_.options = options;
  }

  Comparison run() {
    check_comparable();
    std::map<CellName, const Cell*> others;
    for (const Cell& cell : cells_b_) others[name_of(cell)] = &cell;
    for (const Cell& cell : cells_a_) by_name_a_[name_of(cell)] = &cell;
    size_t both = 0;
    for (const Cell& cell : cells_a_) {
      if (cell.contender == kHarness) continue;
      const auto other = others.find(name_of(cell));
      if (other == others.end()) {
        ++found_.only_a;
        continue;
      }
      ++both;
      if (is_timing(cell.measure)) {
        if (!options_.across_machines) compare_time(cell, *other->second, others);
      } else {
        compare_accuracy(cell, *other->second);
      }
    }
    found_.only_b = 0;
    for (const Cell& cell : cells_b_) {
      if (cell.contender != kHarness && !by_name_a_.contains(name_of(cell))) ++found_.only_b;
    }
    if (both == 0) {
      throw InputError(
          fmt::format("'{}' and '{}' have no cell in common: nothing can be compared", a_.dir(), b_.dir()));
    }
    const bool any_time = std::ranges::any_of(found_.rows, &CellChange::time);
    if (!found_.other_windows.empty() && !any_time) {
      const CellChange& first = found_.other_windows.front();
      throw InputError(
          fmt::format("'{}' and '{}' do not compare: they timed other windows of the runs, such as of '{}' on '{}' at "
                      "{} ms; measure "
                      "both with the same windows and batch_ms, or compare accuracy alone with --across-machines",
                      a_.dir(), b_.dir(), first.contender, first.system, timestep_label(first.timestep_ms)));
    }
    judge_times();
    return std::move(found_);
  }

 private:
  void check_comparable() {
    const std::vector<Difference> all = differences(a_, b_);
    // A system or contender that only one has is left out, whatever else it is.
    if (const auto why = obstacle(all, options_)) {
      throw InputError(fmt::format("'{}' and '{}' do not compare: {}; {}", a_.dir(), b_.dir(),
                                   why->text(a_.dir(), b_.dir()), advice(*why)));
    }
    const std::set<std::string> in_a = timing_machines(a_, cells_a_), in_b = timing_machines(b_, cells_b_);
    if (!options_.across_machines && !in_a.empty() && !in_b.empty() && in_a != in_b) {
      const Difference machine = {DifferenceKind::kMachine, "", "the machine", join({in_a.begin(), in_a.end()}, ", "),
                                  join({in_b.begin(), in_b.end()}, ", ")};
      throw InputError(fmt::format("'{}' and '{}' do not compare: {}; {}", a_.dir(), b_.dir(),
                                   machine.text(a_.dir(), b_.dir()), advice(machine)));
    }
    for (const Difference& each : all) {
      std::vector<Difference>& other = each.kind == DifferenceKind::kCoverage ? found_.coverage : found_.ignored;
      (each.kind == DifferenceKind::kBuild ? found_.builds : other).push_back(each);
    }
    if (options_.control.empty()) return;
    for (const Store* store : {&a_, &b_}) {
      const std::vector<Cell>& cells = store == &a_ ? cells_a_ : cells_b_;
      std::set<std::string> timed;
      for (const Cell& cell : cells) {
        if (is_timing(cell.measure)) timed.insert(cell.contender);
      }
      if (timed.contains(options_.control)) continue;
      throw InputError(fmt::format("'{}' has no times of the control '{}'{}", store->dir(), options_.control,
                                   did_you_mean(options_.control, {timed.begin(), timed.end()})));
    }
  }

  static CellChange row_of(const Cell& a, const Cell& b) {
    CellChange row;
    row.system = a.system;
    row.contender = a.contender;
    row.measure = a.measure;
    row.timestep_ms = a.timestep_ms;
    row.outcome_a = outcome_text(a.outcome);
    row.outcome_b = outcome_text(b.outcome);
    return row;
  }

  // An outcome that changed is a change by itself, without figures.
  bool compare_outcomes(const Cell& a, const Cell& b) {
    if (a.outcome == b.outcome) return a.outcome != Outcome::kOk;
    CellChange row = row_of(a, b);
    row.value = "outcome";
    row.change = change_of_outcome(a.outcome == Outcome::kOk, b.outcome == Outcome::kOk);
    found_.rows.push_back(std::move(row));
    return true;
  }

  void compare_accuracy(const Cell& a, const Cell& b) {
    if (compare_outcomes(a, b)) return;
    for (const Value& value : a.values) {
      const Value* other = find_value(b, value.name);
      if (!value.value || other == nullptr || !other->value) continue;
      const double in_a = *value.value, in_b = *other->value;
      CellChange row = row_of(a, b);
      row.value = value.name;
      row.unit = value.unit;
      row.a = in_a;
      row.b = in_b;
      if (in_a != 0) row.ratio = Interval{in_b / in_a, kUnknown, kUnknown};
      if (in_a != in_b) {
        const bool small = in_a != 0 && std::abs(in_b / in_a - 1) < options_.threshold;
        row.change =
            small ? Change::kWithin : change_of(std::abs(in_b) > std::abs(in_a), value_info(value.name).better);
      }
      found_.rows.push_back(std::move(row));
    }
  }

  void compare_time(const Cell& a, const Cell& b, const std::map<CellName, const Cell*>& others) {
    if (a.contender == options_.control || compare_outcomes(a, b)) return;
    const Value *in_a = find_value(a, time_of(a.measure)), *in_b = find_value(b, time_of(b.measure));
    if (in_a == nullptr || in_b == nullptr) return;
    CellChange row = row_of(a, b);
    row.time = true;
    row.value = in_a->name;
    row.unit = in_a->unit;
    row.a = in_a->value;
    row.b = in_b->value;
    const std::vector<SampleSeries> series_a = a_.samples(a.id), series_b = b_.samples(b.id);
    if (!same_windows(series_a, series_b)) {
      found_.other_windows.push_back(std::move(row));
      return;
    }
    const TimeSamples samples_a = time_samples(series_a), samples_b = time_samples(series_b);
    TimeSamples control_a, control_b;
    if (!options_.control.empty()) {
      CellName control = name_of(a);
      std::get<1>(control) = options_.control;
      const auto of_a = by_name_a_.find(control);
      const auto of_b = others.find(control);
      if (of_a == by_name_a_.end() || of_b == others.end()) return;
      control_a = time_samples(a_.samples(of_a->second->id));
      control_b = time_samples(b_.samples(of_b->second->id));
    }
    const bool controlled = !options_.control.empty();
    const Logs logs_a = logs_of(samples_a, controlled ? &control_a : nullptr),
               logs_b = logs_of(samples_b, controlled ? &control_b : nullptr);
    row.samples_a = logs_a.values.size();
    row.samples_b = logs_b.values.size();
    row.rounds = samples_a.rounds || samples_b.rounds;
    if (!logs_a.values.empty() && !logs_b.values.empty()) {
      row.ratio = ratio_of(logs_a, logs_b);
      row.p = rank_test(logs_a.values, logs_b.values);
    }
    found_.rows.push_back(std::move(row));
  }

  void judge_times() {
    std::vector<CellChange*> times;
    for (CellChange& row : found_.rows) {
      if (row.time && row.ratio) times.push_back(&row);
    }
    std::vector<double> p;
    p.reserve(times.size());
    double least_possible = 1;
    for (const CellChange* row : times) {
      p.push_back(row->p);
      least_possible = std::min(least_possible, smallest_rank_p(row->samples_a, row->samples_b));
    }
    const std::vector<double> corrected = corrected_for_number(p);
    std::vector<double> ratios;
    std::set<std::string> contenders;
    for (size_t i = 0; i < times.size(); ++i) {
      CellChange& row = *times[i];
      const Interval ratio = row.ratio.value_or(Interval{});
      row.p_corrected = corrected[i];
      ratios.push_back(ratio.value);
      contenders.insert(row.contender);
      const bool one_sided = ratio.low > 1 || ratio.high < 1;
      if (row.p_corrected > options_.level || !one_sided) continue;
      row.change = ratio.value > 1 ? Change::kWorse : Change::kBetter;
      if (std::abs(ratio.value - 1) < options_.threshold) row.change = Change::kWithin;
    }
    constexpr size_t kEnoughContenders = 3;
    if (contenders.size() >= kEnoughContenders && options_.control.empty()) found_.common_ratio = median(ratios);
    // one changed time among many has to stand out by itself
    found_.too_few_samples = !times.empty() && least_possible * static_cast<double>(times.size()) > options_.level;
  }

  const Store &a_, &b_;
  CompareOptions options_;
  std::vector<Cell> cells_a_, cells_b_;
  std::map<CellName, const Cell*> by_name_a_;
  Comparison found_;
};

}  // namespace

Change change_of(bool grew, Better better) {
  if (better == Better::kNone) return Change::kOther;
  return grew == (better == Better::kLow) ? Change::kWorse : Change::kBetter;
}

Change change_of_outcome(bool was_ok, bool is_ok) {
  if (is_ok) return Change::kBetter;
  return was_ok ? Change::kWorse : Change::kOther;
}

bool accepts(const CompareOptions& options, const Difference& difference) {
  return difference.kind == DifferenceKind::kBuild || difference.kind == DifferenceKind::kCoverage ||
         (difference.kind == DifferenceKind::kMachine && options.across_machines) ||
         (difference.kind == DifferenceKind::kProgram && options.across_programs);
}

std::string_view change_text(Change change) {
  switch (change) {
    case Change::kWithin:
      return "within";
    case Change::kBetter:
      return "better";
    case Change::kWorse:
      return "worse";
    case Change::kOther:
      return "other";
    case Change::kNone:
      break;
  }
  return "none";
}

Comparison compare(const Store& a, const Store& b, const CompareOptions& options) {
  return Comparer(a, b, options).run();
}

std::vector<const CellChange*> regressions(const Comparison& comparison, double limit) {
  std::vector<const CellChange*> found;
  for (const CellChange& row : comparison.rows) {
    if (row.change != Change::kWorse) continue;
    const bool by_outcome = row.value == "outcome" || !row.ratio;
    const double ratio = std::abs(row.ratio.value_or(Interval{}).value);
    // a value of which more is better got worse when it fell
    if (by_outcome || std::max(ratio, 1 / std::max(ratio, 1e-300)) >= 1 + limit) found.push_back(&row);
  }
  return found;
}

}  // namespace assay
