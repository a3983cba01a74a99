#include "results/compare/compare.h"

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
#include "measures/measure.h"
#include "measures/rank_test.h"
#include "results/compare/samples.h"
#include "results/soundness.h"
#include "results/store/facts.h"
#include "results/values.h"

namespace assay {
namespace {

struct Logs {
  std::vector<double> values;
  double mean = 0, variance_of_mean = 0;
};

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

int freedom(const Logs& logs) { return static_cast<int>(logs.values.size()) - 1; }

// What processes of one cell differ by, relative (standard deviation; docs/lab/performance.md#what-compare-finds):
// rounds of one process do not show it.
constexpr double kOfProcess = 0.0101;
// Of a time, to name a change; and what its mean is known to at best, relative: samples that are alike to the last
// digit do not show that the next process would be.
constexpr size_t kFewestSamples = 3;
constexpr double kLeastError = 1e-4;

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
  logs.variance_of_mean = error * error + kLeastError * kLeastError;
  // of each process that a ratio is of
  if (samples.rounds) logs.variance_of_mean += (control == nullptr ? 1 : 2) * kOfProcess * kOfProcess;
  return logs;
}

struct Tested {
  Interval ratio;
  double p = 1;
};

// exp of the difference of the means; without an interval (NaN) where there are fewer than two samples of either.
Tested welch(const Logs& a, const Logs& b) {
  const double difference = b.mean - a.mean, variance = a.variance_of_mean + b.variance_of_mean;
  Tested tested = {{std::exp(difference), kUnknown, kUnknown}, 1};
  if (std::isnan(variance)) return tested;
  const auto part = [](const Logs& logs) { return logs.variance_of_mean * logs.variance_of_mean / freedom(logs); };
  // at least the smaller of the two freedoms
  const int both = std::max(1, static_cast<int>(variance * variance / (part(a) + part(b))));
  const double half = student_t_975(both) * std::sqrt(variance);
  tested.p = student_t_p(difference / std::sqrt(variance), both);
  tested.ratio.low = std::exp(difference - half);
  tested.ratio.high = std::exp(difference + half);
  return tested;
}

// The means of a series by another one's numbers, in the order of these.
std::vector<double> means_by(const std::vector<double>& figures, const std::vector<double>& numbers) {
  std::map<double, std::vector<double>> groups;
  for (size_t i = 0; i < std::min(figures.size(), numbers.size()); ++i) groups[numbers[i]].push_back(figures[i]);
  std::vector<double> means;
  means.reserve(groups.size());
  for (const auto& [number, of_group] : groups) means.push_back(mean(of_group));
  return means;
}

// The figures over which an accuracy value is a mean, in the same order in every results: in each initial state, as far
// as all of them have one. Pieces of one motion depend on each other: they stand for themselves only where there is
// one.
std::vector<double> figures_of(const std::vector<SampleSeries>& samples, const std::string& value) {
  constexpr std::string_view kOfStates = " of states", kConsistency = "consistency";
  if (const auto* found = series_named(samples, value + std::string(kOfStates))) {
    // one that some states lack says not which
    const bool whole = std::ranges::none_of(samples, [&](const SampleSeries& other) {
      return other.name.ends_with(kOfStates) && other.values.size() > found->size();
    });
    return whole ? *found : std::vector<double>();
  }
  std::string length;  // of pieces that are not the main ones: " 100 ms"
  if (value.starts_with("consistency_") && value.ends_with("ms")) {
    length = fmt::format(" {} ms", value.substr(kConsistency.size() + 1, value.size() - kConsistency.size() - 3));
  } else if (value != kConsistency && value != "restart_floor") {
    return {};
  }
  const auto* errors = series_named(samples, "piece_error_m" + length);
  const auto* states = series_named(samples, "piece_state" + length);
  if (errors == nullptr) return {};
  return states == nullptr ? *errors : means_by(*errors, *states);
}

// Of a change that is alike in all pairs: the p-value of Student's t on the pairs' ratios where all are positive, else
// on their differences, and whether they grew. Nothing for fewer than three pairs.
struct Paired {
  double p = 1;
  bool grew = false;
};
std::optional<Paired> paired(const std::vector<double>& a, const std::vector<double>& b) {
  constexpr size_t kFewest = 3;
  if (a.size() != b.size()) return std::nullopt;
  const auto positive = [](double figure) { return figure > 0; };
  const bool logs = std::ranges::all_of(a, positive) && std::ranges::all_of(b, positive);
  std::vector<double> changes;
  for (size_t i = 0; i < a.size(); ++i) {
    const double change = logs ? std::log(b[i] / a[i]) : b[i] - a[i];
    if (std::isfinite(change)) changes.push_back(change);
  }
  if (changes.size() < kFewest) return std::nullopt;
  const auto count = static_cast<double>(changes.size());
  const double middle = mean(changes);
  double squares = 0;
  for (const double change : changes) squares += (change - middle) * (change - middle);
  if (squares == 0) return Paired{middle == 0 ? 1.0 : 0.0, middle > 0};
  return Paired{student_t_p(middle / std::sqrt(squares / (count - 1) / count), count - 1), middle > 0};
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

class Comparer {
 public:
  Comparer(const Store& a, const Store& b, const CompareOptions& options)
      : a_(a), b_(b), options_(options), cells_a_(judged_cells(a).cells), cells_b_(judged_cells(b).cells) {
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
        if (!options_.across_machines || !is_timed(cell.measure)) found_.only_a.push_back(row_of(cell, cell));
        continue;
      }
      ++both;
      if (is_timed(cell.measure)) {
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
    judge();
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
    if (!options_.across_machines) {
      if (const auto machine = other_machine(timing_nodes(a_, cells_a_), timing_nodes(b_, cells_b_))) {
        throw InputError(fmt::format("'{}' and '{}' do not compare: {}; {}", a_.dir(), b_.dir(),
                                     machine->text(a_.dir(), b_.dir()), advice(*machine)));
      }
    }
    for (const Difference& each : all) {
      std::vector<Difference>& other = each.kind == DifferenceKind::kCoverage ? found_.coverage : found_.ignored;
      (each.kind == DifferenceKind::kBuild ? found_.builds : other).push_back(each);
    }
    if (options_.control.empty()) return;
    require_control(options_.control);
    for (const Store* store : {&a_, &b_}) {
      const std::vector<Cell>& cells = store == &a_ ? cells_a_ : cells_b_;
      std::set<std::string> timed;
      for (const Cell& cell : cells) {
        if (is_timed(cell.measure)) timed.insert(cell.contender);
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
    if (a.outcome == b.outcome) return a.outcome != Outcome::kOk && a.outcome != Outcome::kUnstable;
    CellChange row = row_of(a, b);
    row.value = "outcome";
    row.change = change_of_outcome(a.outcome == Outcome::kOk, b.outcome == Outcome::kOk);
    found_.rows.push_back(std::move(row));
    return true;
  }

  void compare_accuracy(const Cell& a, const Cell& b) {
    if (compare_outcomes(a, b)) return;
    std::optional<std::vector<SampleSeries>> samples_a, samples_b;  // read once, where a value differs
    for (const Value& value : a.values) {
      const Value* other = find_value(b, value.name);
      if (!value.value) continue;
      if (other == nullptr || !other->value) {
        // more of the others may be none at all, as when a grasp no longer drops its object
        if (value_info(value.name).better != Better::kLow) continue;
        found_.values_only_in_a.push_back(row_of(a, b));
        found_.values_only_in_a.back().value = value.name;
        continue;
      }
      const Better better = value_info(value.name).better;
      const double in_a = *value.value, in_b = *other->value;
      const double size_a = std::abs(in_a), size_b = std::abs(in_b);
      CellChange row = row_of(a, b);
      row.value = value.name;
      row.unit = value.unit;
      row.a = in_a;
      row.b = in_b;
      if (in_a != 0) row.ratio = Interval{better == Better::kNone ? in_b / in_a : size_b / size_a, kUnknown, kUnknown};
      if (in_a != in_b) {
        const bool rounding = std::max(size_a, size_b) < kRounding;
        const bool small = row.ratio && std::abs(row.ratio->value - 1) < options_.threshold;
        row.change = small || rounding ? Change::kWithin : change_of(size_b > size_a, better);
        if (!samples_a) samples_a = a_.samples(a.id);
        if (!samples_b) samples_b = b_.samples(b.id);
        const auto of_a = figures_of(*samples_a, value.name), of_b = figures_of(*samples_b, value.name);
        if (const auto found = paired(of_a, of_b)) {
          row.tested = true;
          // a mean that one large figure moved against the others has not changed alike
          row.p = found->grew == (better == Better::kNone ? in_b > in_a : size_b > size_a) ? found->p : 1;
          row.samples_a = row.samples_b = of_a.size();
        }
      }
      found_.rows.push_back(std::move(row));
    }
  }

  void compare_time(const Cell& a, const Cell& b, const std::map<CellName, const Cell*>& others) {
    if (compare_outcomes(a, b) || a.contender == options_.control) return;
    const Value *in_a = find_value(a, time_of(a.measure)), *in_b = find_value(b, time_of(b.measure));
    if (in_a == nullptr) return;
    CellChange row = row_of(a, b);
    row.time = true;
    row.value = in_a->name;
    if (in_b == nullptr) {
      found_.values_only_in_a.push_back(std::move(row));
      return;
    }
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
    const bool controlled = !options_.control.empty();
    if (controlled) {
      CellName control = name_of(a);
      std::get<1>(control) = options_.control;
      const auto of_a = by_name_a_.find(control);
      const auto of_b = others.find(control);
      if (of_a != by_name_a_.end()) control_a = time_samples(a_.samples(of_a->second->id));
      if (of_b != others.end()) control_b = time_samples(b_.samples(of_b->second->id));
      if (control_a.times.empty() || control_b.times.empty()) {
        found_.without_control.push_back(std::move(row));
        return;
      }
    }
    const Logs logs_a = logs_of(samples_a, controlled ? &control_a : nullptr),
               logs_b = logs_of(samples_b, controlled ? &control_b : nullptr);
    row.samples_a = logs_a.values.size();
    row.samples_b = logs_b.values.size();
    row.rounds = samples_a.rounds || samples_b.rounds;
    if (!logs_a.values.empty() && !logs_b.values.empty()) {
      const Tested tested = welch(logs_a, logs_b);
      row.ratio = tested.ratio;
      row.p = tested.p;
      row.p_rank = rank_test(logs_a.values, logs_b.values);
      row.tested = std::min(row.samples_a, row.samples_b) >= kFewestSamples;
    }
    found_.rows.push_back(std::move(row));
  }

  // p-values corrected for the number of `rows`.
  static void correct(const std::vector<CellChange*>& rows) {
    std::vector<double> p;
    std::vector<std::string> contenders;
    for (const CellChange* row : rows) {
      p.push_back(row->p);
      contenders.push_back(row->contender);
    }
    const std::vector<double> corrected = corrected_by_family(p, contenders);
    for (size_t i = 0; i < rows.size(); ++i) rows[i]->p_corrected = corrected[i];
  }

  void judge() {
    std::vector<CellChange*> times, others;
    for (CellChange& row : found_.rows) {
      if (row.tested) (row.time ? times : others).push_back(&row);
    }
    correct(times);
    correct(others);
    std::vector<double> ratios;
    std::set<std::string> contenders;
    for (CellChange* row : times) {
      const double ratio = row->ratio.value_or(Interval{}).value;
      ratios.push_back(ratio);
      contenders.insert(row->contender);
      const double rank_level = std::max(options_.level, 1.0001 * smallest_rank_p(row->samples_a, row->samples_b));
      if (row->p_corrected > options_.level || row->p_rank > rank_level) continue;
      row->change = ratio > 1 ? Change::kWorse : Change::kBetter;
      if (std::abs(ratio - 1) < options_.threshold) row->change = Change::kWithin;
    }
    for (CellChange* row : others) {
      const bool changed =
          row->change == Change::kWorse || row->change == Change::kBetter || row->change == Change::kOther;
      if (changed && row->p_corrected > options_.level) row->change = Change::kUnsettled;
    }
    constexpr size_t kEnoughContenders = 3;
    if (contenders.size() >= kEnoughContenders && options_.control.empty()) found_.common_ratio = median(ratios);
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
    case Change::kUnsettled:
      return "unsettled";
    case Change::kNone:
      break;
  }
  return "none";
}

void require_control(const std::string& control) {
  if (control != kHarness) return;
  throw InputError(
      fmt::format("the control is '{}', the harness without an engine, whose times are noise alone: "
                  "give an engine's contender that did not change",
                  kHarness));
}

TimingNodes timing_nodes(const Store& store, const std::vector<Cell>& cells) {
  std::map<std::string, std::string> names;
  for (const NodeRow& node : store.nodes()) names[node.id] = text_fact(facts_of(node.json), "name");
  TimingNodes found;
  for (const Cell& cell : cells) {
    if (is_timed(cell.measure) && names.contains(cell.node)) found[cell.system].insert(names[cell.node]);
  }
  return found;
}

std::optional<Difference> other_machine(const TimingNodes& a, const TimingNodes& b) {
  const auto listed = [](const std::set<std::string>& names) { return join({names.begin(), names.end()}, ", "); };
  for (const auto& [system, nodes] : a) {
    const auto other = b.find(system);
    if (other == b.end() || other->second == nodes) continue;
    return Difference{DifferenceKind::kMachine, system, fmt::format("the machine that timed '{}'", system),
                      listed(nodes), listed(other->second)};
  }
  return std::nullopt;
}

Comparison compare(const Store& a, const Store& b, const CompareOptions& options) {
  return Comparer(a, b, options).run();
}

namespace {

// By outcome, from zero, or by a ratio that is that far from 1: of a value of which more is better 1 over it.
bool is_by(const CellChange& row, double limit) {
  const bool by_outcome = row.value == "outcome" || !row.ratio;
  const double ratio = row.ratio.value_or(Interval{}).value;
  return by_outcome || std::max(ratio, 1 / std::max(ratio, 1e-300)) >= 1 + limit;
}

bool is_regression(const CellChange& row, double limit) { return row.change == Change::kWorse && is_by(row, limit); }

bool is_larger_where_less_is_better(const CellChange& row) {
  const bool grew = std::abs(row.b.value_or(0)) > std::abs(row.a.value_or(0));
  return change_of(grew, value_info(row.value).better) == Change::kWorse;
}

}  // namespace

std::vector<const CellChange*> regressions(const Comparison& comparison, double limit) {
  std::vector<const CellChange*> found;
  for (const CellChange& row : comparison.rows) {
    if (is_regression(row, limit)) found.push_back(&row);
  }
  return found;
}

std::vector<const CellChange*> undecided(const Comparison& comparison, double limit) {
  std::vector<const CellChange*> found;
  for (const CellChange& row : comparison.rows) {
    const bool time = row.time && row.value != "outcome" && !is_regression(row, limit) &&
                      (!row.ratio || !(row.ratio->high < 1 + limit));
    const bool accuracy = row.change == Change::kUnsettled && is_larger_where_less_is_better(row) && is_by(row, limit);
    if (time || accuracy) found.push_back(&row);
  }
  return found;
}

std::string gaps(const Comparison& comparison) {
  const auto example = [](const std::vector<CellChange>& rows) {
    const CellChange& row = rows.front();
    return fmt::format("such as {} of '{}' on '{}' at {} ms", row.measure, row.contender, row.system,
                       timestep_label(row.timestep_ms));
  };
  std::vector<std::string> parts;
  if (!comparison.only_a.empty()) {
    parts.push_back(fmt::format("{} of '{}' {} not in '{}', {}", counted(comparison.only_a.size(), "cell", "cells"),
                                comparison.a, comparison.only_a.size() == 1 ? "is" : "are", comparison.b,
                                example(comparison.only_a)));
  }
  if (!comparison.values_only_in_a.empty()) {
    const CellChange& row = comparison.values_only_in_a.front();
    parts.push_back(fmt::format("{} of '{}' {} no figure in '{}', such as {} of '{}' on '{}' at {} ms",
                                counted(comparison.values_only_in_a.size(), "value", "values"), comparison.a,
                                comparison.values_only_in_a.size() == 1 ? "has" : "have", comparison.b, row.value,
                                row.contender, row.system, timestep_label(row.timestep_ms)));
  }
  if (!comparison.other_windows.empty()) {
    parts.push_back(fmt::format("{} of other windows of the run, {} (measure with `--windows-of {}`)",
                                counted(comparison.other_windows.size(), "time is", "times are"),
                                example(comparison.other_windows), comparison.a));
  }
  if (!comparison.without_control.empty()) {
    parts.push_back(fmt::format("{} without a time of the control, {}",
                                counted(comparison.without_control.size(), "time is", "times are"),
                                example(comparison.without_control)));
  }
  return join(parts, "; ");
}

}  // namespace assay
