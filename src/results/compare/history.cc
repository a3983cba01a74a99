#include "results/compare/history.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <string_view>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/text.h"
#include "measures/measure.h"
#include "results/compare/change_points.h"
#include "results/compare/samples.h"
#include "results/soundness.h"
#include "results/values.h"

namespace assay {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;
constexpr size_t kFewestRuns = 4;                                                           // of times: two levels
using CourseName = std::tuple<std::string, std::string, std::string, double, std::string>;  // with the value

// A time's own scatter within its run, relative, from its interval.
double relative_error(const Interval& value) {
  constexpr double kHalfWidths = 1.96;
  return value.value > 0 ? (value.high - value.low) / (2 * kHalfWidths * value.value) : 0;
}

class Courses {
 public:
  Courses(const std::vector<std::string>& dirs, const CompareOptions& options) {
    history_.options = options;
    std::vector<std::pair<std::string, std::string>> order;  // started, directory
    order.reserve(dirs.size());
    for (const std::string& dir : dirs) order.emplace_back(Store::open(dir).manifest("started").value_or(""), dir);
    std::ranges::stable_sort(order);
    std::optional<Store> first;
    TimingNodes first_nodes;
    for (const auto& [started, dir] : order) {
      Store store = Store::open(dir);
      std::error_code error;
      if (const auto twice = named_.emplace(fs::weakly_canonical(dir, error), dir); !twice.second) {
        throw InputError(fmt::format("'{}' and '{}' are the same results: name each once", twice.first->second, dir));
      }
      const std::vector<Cell> cells = judged_cells(store).cells;
      const TimingNodes nodes = timing_nodes(store, cells);
      if (first) refuse_others(*first, first_nodes, store, nodes);
      add(store, cells);
      if (first) continue;
      first.emplace(std::move(store));
      first_nodes = nodes;
    }
  }

  History finish() {
    const std::string& control = history_.options.control;
    require_control(control);
    if (!control.empty() && !timed_.contains(control)) {
      throw InputError(fmt::format("no results have times of the control '{}'{}", control,
                                   did_you_mean(control, {timed_.begin(), timed_.end()})));
    }
    size_t times = 0;
    for (auto& [name, course] : courses_) {
      if (course.points.size() < 2) continue;
      times += course.time ? 1 : 0;
      history_.courses.push_back(std::move(course));
    }
    for (Course& course : history_.courses) course.time ? find_time_changes(course, times) : find_changes(course);
    for (const Course& course : history_.courses) {
      if (course.time && course.points.size() < kFewestRuns) ++history_.too_short;
    }
    return std::move(history_);
  }

 private:
  void refuse_others(const Store& first, const TimingNodes& first_nodes, const Store& other,
                     const TimingNodes& nodes) const {
    std::vector<Difference> found = differences(first, other);
    if (const auto machine = other_machine(first_nodes, nodes)) found.push_back(*machine);
    for (const Difference& each : found) {
      if (accepts(history_.options, each)) continue;
      std::string_view switches;
      if (each.kind == DifferenceKind::kProgram) switches = ", or accept it with --across-programs";
      if (each.kind == DifferenceKind::kMachine) switches = ", or give --across-machines for accuracy alone";
      throw InputError(fmt::format("'{}' and '{}' do not compare: {}; leave one out{}", first.dir(), other.dir(),
                                   each.text(first.dir(), other.dir()), switches));
    }
  }

  void add(const Store& store, const std::vector<Cell>& cells) {
    const size_t run = history_.runs.size();
    history_.runs.push_back(
        {store.dir(), store.manifest("started").value_or(""), store.manifest("commit").value_or("")});
    std::map<std::tuple<std::string, double, std::string>, double> controls;  // system, timestep, measure: time
    const std::string& control = history_.options.control;
    for (const Cell& cell : cells) {
      if (is_timed(cell.measure) && cell.contender != kHarness) timed_.insert(cell.contender);
      if (control.empty() || cell.contender != control) continue;
      const Value* time = find_value(cell, time_of(cell.measure));
      if (time != nullptr && time->value) {
        controls[{cell.system, cell.timestep_ms, cell.measure}] = level_of(store, cell, *time->value);
      }
    }
    for (const Cell& cell : cells) {
      if (cell.contender == kHarness || cell.contender == control) continue;
      const bool timing = is_timed(cell.measure);
      if (timing && history_.options.across_machines) continue;
      if (cell.values.empty()) {
        add_failure(cell, run);
        continue;
      }
      if (timing && !has_first_windows(store, cell)) {
        ++history_.other_windows;
        continue;
      }
      const auto relative = controls.find({cell.system, cell.timestep_ms, cell.measure});
      if (timing && !control.empty() && relative == controls.end()) {
        ++history_.without_control;
        continue;
      }
      for (const Value& value : cell.values) {
        const bool time = value.name == time_of(cell.measure);
        if (!value.value || timing != time || value_info(value.name).better == Better::kNone) continue;
        Course& course = course_of(cell, value);
        Interval figure = {*value.value, value.low.value_or(*value.value), value.high.value_or(*value.value)};
        if (timing) {
          const double scale = level_of(store, cell, figure.value) / figure.value;
          figure = {figure.value * scale, figure.low * scale, figure.high * scale};
        }
        if (timing && relative != controls.end()) {
          figure = {figure.value / relative->second, figure.low / relative->second, figure.high / relative->second};
        }
        course.points.push_back({run, figure, std::string(outcome_text(cell.outcome))});
      }
    }
  }

  // Whether the cell timed the parts of the run that the first results with this cell did.
  bool has_first_windows(const Store& store, const Cell& cell) {
    std::vector<SampleSeries> samples = store.samples(cell.id);
    const auto [first, fresh] = windows_.try_emplace(name_of(cell), std::vector<SampleSeries>());
    if (!fresh) return same_windows(first->second, samples);
    std::erase_if(samples, [](const SampleSeries& each) { return !each.name.starts_with("window_"); });
    std::erase_if(samples, [](const SampleSeries& each) { return each.name == "window_step_time_us"; });
    first->second = std::move(samples);
    return true;
  }

  // The median over processes: one that was disturbed is no change of level. The stored mean where there are no
  // samples.
  static double level_of(const Store& store, const Cell& cell, double stored) {
    std::vector<double> times;
    for (const auto& [number, time] : time_samples(store.samples(cell.id)).times) times.push_back(time);
    return times.empty() ? stored : median(times);
  }

  Course& course_of(const Cell& cell, const Value& value) {
    const auto [at, fresh] =
        courses_.try_emplace({cell.system, cell.contender, cell.measure, cell.timestep_ms, value.name});
    Course& course = at->second;
    if (fresh) course.points = failures_[name_of(cell)];
    course.system = cell.system;
    course.contender = cell.contender;
    course.measure = cell.measure;
    course.timestep_ms = cell.timestep_ms;
    course.value = value.name;
    course.unit = value.unit;
    course.time = is_timed(cell.measure);
    return course;
  }

  // A cell without values is a point of every course that it has values for in another run.
  void add_failure(const Cell& cell, size_t run) {
    failures_[name_of(cell)].push_back({run, {}, std::string(outcome_text(cell.outcome))});
    for (auto& [name, course] : courses_) {
      if (course.system == cell.system && course.contender == cell.contender && course.measure == cell.measure &&
          course.timestep_ms == cell.timestep_ms) {
        course.points.push_back({run, {}, std::string(outcome_text(cell.outcome))});
      }
    }
  }

  static bool find_outcome_change(Course& course, const CoursePoint& before, const CoursePoint& after) {
    if (before.outcome == after.outcome) return false;
    const Change change = change_of_outcome(before.outcome == "ok", after.outcome == "ok");
    course.changes.push_back({after.run, 0, change, fmt::format("{} → {}", before.outcome, after.outcome)});
    return true;
  }

  // Against the last figure that was a change, so that many small steps in one direction count.
  void find_changes(Course& course) const {
    size_t level = 0;
    for (size_t i = 1; i < course.points.size(); ++i) {
      const CoursePoint &before = course.points[level], &after = course.points[i];
      if (find_outcome_change(course, course.points[i - 1], after)) {
        level = i;
        continue;
      }
      const double a = std::abs(before.value.value), b = std::abs(after.value.value);
      if (std::max(a, b) < kRounding) continue;
      if (a == b || (a > 0 && std::abs(b / a - 1) < history_.options.threshold)) continue;
      add_change(course, after.run, a > 0 ? b / a : 0, b > a);
      level = i;
    }
  }

  void find_time_changes(Course& course, size_t courses) const {
    for (size_t i = 1; i < course.points.size(); ++i) {
      find_outcome_change(course, course.points[i - 1], course.points[i]);
    }
    std::vector<double> logs, errors;
    std::vector<size_t> runs;
    for (const CoursePoint& point : course.points) {
      if (!(point.value.value > 0)) continue;
      logs.push_back(std::log(point.value.value));
      errors.push_back(relative_error(point.value));
      runs.push_back(point.run);
    }
    if (logs.empty()) return;
    constexpr double kLeastNoise = 1e-3;  // times that are alike to the last digit are no noise to measure by
    const double noise = std::max({noise_of(logs), median(errors), kLeastNoise});
    const std::vector<size_t> changes = change_points(logs, noise, change_penalty(logs.size(), courses));
    size_t from = 0;
    for (size_t i = 0; i < changes.size(); ++i) {
      const size_t at = changes[i], to = i + 1 < changes.size() ? changes[i + 1] : logs.size();
      const auto level = [&](size_t begin, size_t end) { return mean(std::span(logs).subspan(begin, end - begin)); };
      const double ratio = std::exp(level(at, to) - level(from, at));
      if (std::abs(ratio - 1) >= history_.options.threshold) add_change(course, runs[at], ratio, ratio > 1);
      from = at;
    }
  }

  static void add_change(Course& course, size_t run, double ratio, bool larger) {
    const Change change = change_of(larger, value_info(course.value).better);
    std::string text = fmt::format("{:+.1f} %", 100 * (ratio - 1));
    if (ratio > 10 || ratio < 0.1) text = fmt::format("× {:.3g}", ratio);
    if (ratio <= 0) text = "from zero";
    course.changes.push_back({run, ratio, change, text});
  }

  History history_;
  std::set<std::string> timed_;            // contenders
  std::map<fs::path, std::string> named_;  // directories, by where they are
  std::map<CourseName, Course> courses_;
  std::map<CellName, std::vector<CoursePoint>> failures_;
  std::map<CellName, std::vector<SampleSeries>> windows_;
};

}  // namespace

double change_penalty(size_t runs, size_t courses) {
  // Under equal levels the largest gain of one change grows like twice the logarithm of the places that it may have,
  // and with it that of many courses. The noise is estimated from as many figures: its own error is allowed for.
  const auto n = static_cast<double>(std::max<size_t>(runs, 2));
  const double few = 1 + 12 / n;
  return few * (6 + 2 * std::log(n) + 2 * std::log(static_cast<double>(std::max<size_t>(courses, 1))));
}

History history(const std::vector<std::string>& dirs, const CompareOptions& options) {
  if (dirs.size() < 2) throw InputError("a history needs at least two results directories: name them all");
  return Courses(dirs, options).finish();
}

std::string history_markdown(const History& history) {
  std::string text = fmt::format("# {} runs from {} to {}\n\n", history.runs.size(), history.runs.front().started,
                                 history.runs.back().started);
  std::string rows;
  size_t steady = 0;
  for (const Course& course : history.courses) {
    if (course.changes.empty()) ++steady;
    for (const CourseChange& change : course.changes) {
      const HistoryRun& run = history.runs[change.run];
      rows += fmt::format("| {} | {} | {} | {} | {} | {} | {} |\n", change_text(change.change), course.system,
                          course.contender, timestep_label(course.timestep_ms), course.value, change.text,
                          fmt::format("{} ({})", run.dir, run.started));
    }
  }
  if (rows.empty()) {
    text += fmt::format("Nothing changed in {} courses.\n", history.courses.size());
  } else {
    text += "| change | system | contender | ms | value | by | since |\n| --- | --- | --- | --- | --- | --- | --- |\n" +
            rows + fmt::format("\n{} other courses did not change.\n", steady);
  }
  if (history.too_short > 0) {
    text +=
        fmt::format("\nA level of times has at least two runs: of fewer than {} no change is found, which {} have.\n",
                    kFewestRuns, counted(history.too_short, "course of times", "courses of times"));
  }
  if (history.without_control > 0) {
    text += fmt::format("\nTimes without one of the control beside them, left out: {}.\n", history.without_control);
  }
  if (history.other_windows > 0) {
    text += fmt::format("\nTimes of other windows of the run than the first results timed, left out: {}.\n",
                        history.other_windows);
  }
  text += fmt::format(
      "\nLevels of step times by optimal partitioning, practical threshold {:.2g} %{}. A change that only the last run "
      "shows is for `assay compare`, and so is whether a change of accuracy is alike in the initial states.\n",
      100 * history.options.threshold,
      history.options.control.empty() ? "" : fmt::format(", relative to the control {}", history.options.control));
  return text;
}

json history_json(const History& history) {
  json runs = json::array(), courses = json::array();
  for (const HistoryRun& run : history.runs) {
    runs.push_back({{"dir", run.dir}, {"started", run.started}, {"commit", run.commit}});
  }
  for (const Course& course : history.courses) {
    json points = json::array(), changes = json::array();
    for (const CoursePoint& point : course.points) {
      points.push_back({{"run", point.run},
                        {"value", point.outcome == "ok" || point.value.value != 0 ? json(point.value.value) : json()},
                        {"low", point.value.low},
                        {"high", point.value.high},
                        {"outcome", point.outcome}});
    }
    for (const CourseChange& change : course.changes) {
      changes.push_back({{"run", change.run},
                         {"ratio", change.ratio > 0 ? json(change.ratio) : json()},
                         {"change", change_text(change.change)},
                         {"text", change.text}});
    }
    courses.push_back({{"system", course.system},
                       {"contender", course.contender},
                       {"timestep_ms", course.timestep_ms},
                       {"measure", course.measure},
                       {"value", course.value},
                       {"unit", course.unit},
                       {"time", course.time},
                       {"points", std::move(points)},
                       {"changes", std::move(changes)}});
  }
  return {{"runs", std::move(runs)},
          {"courses", std::move(courses)},
          {"other_windows", history.other_windows},
          {"without_control", history.without_control},
          {"too_short", history.too_short},
          {"threshold", history.options.threshold},
          {"control", history.options.control.empty() ? json(nullptr) : json(history.options.control)}};
}

}  // namespace assay
