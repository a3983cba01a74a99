#include "run/search/search.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"
#include "campaign/shards.h"
#include "engines/registry.h"
#include "run/coordinator/pool.h"
#include "run/search/knowledge.h"

namespace assay {
namespace {

// A speed that was not timed may be this much larger in truth: two workers share the machine's caches.
constexpr double kSpeedDoubt = 1.25;
// A point whose expected error exceeds its limit by this factor is not tried.
constexpr double kErrorDoubt = 4;
// The timesteps that are tried first, ms. What the campaign has beyond them is tried where an answer lies at their
// edge.
constexpr double kUsualSmallest = 0.25, kUsualLargest = 16;
// Of the conformance suite, before a contender's first cells that count.
constexpr double kSuiteSeconds = 2;
// Contenders of the first look.
constexpr size_t kFirst = 3;
constexpr std::array<CellGroup, 3> kInOrder = {CellGroup::kRuns, CellGroup::kPieces, CellGroup::kTimes};

class Search {
 public:
  Search(const Campaign& campaign, const SearchOptions& options)
      : campaign_(campaign), options_(options), plan_(make_plan(campaign)), known_(campaign, plan_) {
    std::set<int> contenders;
    for (const PlannedCell& cell : plan_.cells) contenders.insert(cell.contender);
    const auto step_us = expected_step_us(campaign);
    std::map<int, double> expected;  // the less, the likelier to win
    for (const int c : contenders) {
      const std::optional<int> approximated = approximations(c);
      if (!approximated) continue;
      double slowest = 0;
      for (const auto& [at, us] : step_us) {
        if (at.second == c) slowest = std::max(slowest, us);
      }
      const ResolvedContender& own = campaign.contenders[static_cast<size_t>(c)].resolved;
      const Capabilities capabilities = own.engine->capabilities(own.settings);
      const bool single = capabilities.precision == Precision::kSingle;
      // a method of higher order takes larger steps
      expected[c] = slowest * (1 + *approximated) * (single ? 2 : 1) / std::max(1, capabilities.order);
      (starts_slowly(c) ? late_ : waiting_).push_back(c);
    }
    // One contender of each engine before the second of any.
    for (std::vector<int>* list : {&waiting_, &late_}) {
      std::ranges::stable_sort(*list, {}, [&](int c) { return expected[c]; });
      std::map<std::string, int> of_engine;
      std::map<int, int> turn;
      for (const int c : *list) turn[c] = of_engine[engine(c).name()]++;
      std::ranges::stable_sort(*list, {}, [&](int c) { return turn[c]; });
    }
    if (waiting_.empty()) waiting_.swap(late_);
    const std::vector<double>& steps = known_.timesteps_ms();
    const auto below = [&](double most) {
      return static_cast<size_t>(std::ranges::count_if(steps, [&](double step) { return step < most; }));
    };
    begin_ = below(kUsualSmallest * 0.999), end_ = below(kUsualLargest * 1.001);
    if (begin_ >= end_) begin_ = 0, end_ = steps.size();
    smallest_ = begin_;
  }

  SearchSummary run() {
    summary_.contenders = waiting_.size() + late_.size();
    summary_.cells = plan_.cells.size();
    double looks_s = 0, points_s = 0;  // what was spent on first looks, and on points after the first answer
    while (!over()) {
      const double before_s = elapsed();
      std::set<std::string> next;
      if (!contenders_.empty()) next = first_answer();
      const bool answered = next.empty();
      if (answered && !contenders_.empty() && (waiting_.empty() || points_s < looks_s)) next = candidates();
      if (next.empty() && !waiting_.empty()) {
        look_at_more();
        looks_s += elapsed() - before_s;
        continue;
      }
      if (next.empty()) next = confirmation();
      const size_t before = summary_.measured;
      if (!next.empty()) {
        measure(next, true);
        if (answered) points_s += elapsed() - before_s;
        if (summary_.measured > before) {
          tell_best();
          continue;
        }
      }
      // nothing is left that could win, or could be measured
      if (!waiting_.empty()) {
        look_at_more();
        continue;
      }
      if (go_beyond()) continue;
      if (late_.empty()) {
        summary_.ended_early = next.empty();
        break;
      }
      contenders_.push_back(late_.front());
      late_.erase(late_.begin());
      scan({contenders_.back()}, true);
    }
    contenders_.insert(contenders_.end(), waiting_.begin(), waiting_.end());
    contenders_.insert(contenders_.end(), late_.begin(), late_.end());
    for (const int c : contenders_) {
      const bool open = std::ranges::any_of(options_.goals, [&](const Limits& goal) {
        const auto point = next_point(c, goal);
        return point && can_win(*point, best(goal));
      });
      if (open) summary_.undecided.push_back(name(c));
    }
    summary_.wall_s = elapsed();
    summary_.interrupted = interrupted();
    if (summary_.interrupted) summary_.signal = interrupts_.signal();
    return summary_;
  }

 private:
  const std::string& name(int contender) const {
    return campaign_.contenders[static_cast<size_t>(contender)].resolved.name;
  }
  double elapsed() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  double left() const { return options_.budget_s - elapsed(); }
  // By the user; SIGALRM is a budget's end.
  bool interrupted() const { return interrupts_.signal() != 0 && interrupts_.signal() != SIGALRM; }
  bool over() const { return interrupted() || left() <= 0; }

  const Engine& engine(int contender) const {
    return *campaign_.contenders[static_cast<size_t>(contender)].resolved.engine;
  }
  // Adapters in Python take seconds for every process, and more to compile kernels. They have their turn when the
  // others have given an answer: as a part of the first look they would use up a budget of minutes by themselves.
  bool starts_slowly(int contender) const { return Registry::instance().runs_python(engine(contender).name()); }

  // How much of the systems that it is to be measured on the contender approximates; nothing where it refuses any.
  std::optional<int> approximations(int c) const {
    const ResolvedContender& contender = campaign_.contenders[static_cast<size_t>(c)].resolved;
    if (contender.engine == nullptr) return std::nullopt;
    std::ptrdiff_t most = 0;
    for (const CampaignSystem& system : campaign_.systems) {
      if (std::ranges::find(system.contenders, c) == system.contenders.end()) continue;
      const std::vector<Limitation> found = contender.engine->check(system.model, contender.settings);
      if (std::ranges::find(found, Fidelity::kRefused, &Limitation::fidelity) != found.end()) return std::nullopt;
      most = std::max(most, std::ranges::count(found, Fidelity::kApproximated, &Limitation::fidelity));
    }
    return static_cast<int>(most);
  }

  void measure(const std::set<std::string>& keys, bool gate) {
    for (const PlannedCell& cell : plan_.cells) {
      if (gate && keys.contains(cell.key)) passed_suite_.insert(cell.contender);
    }
    RunOptions options = options_.run;
    options.wanted = [&keys](const PlannedCell& cell) { return keys.contains(cell.key); };
    options.gate = gate;
    options.probe = false;
    options.budget_s = std::max(left(), 1e-3);
    options.truth_optional = true;
    options.truth_limit_s = std::max(5.0, options_.budget_s / 8);
    const RunSummary done = run_campaign(campaign_, options);
    summary_.cpu_s += done.cpu_s;
    summary_.failed_gate = done.failed_gate;
    for (const Missing& each : done.without_truth) {
      known_.leave_truth_out(each.name);
      summary_.without_truth.push_back(each);
    }
    const Store store = Store::open(options_.run.out);
    known_.update(store);
    summary_.measured = store.cell_keys().size();
  }

  void tell(const std::string& sentence) const {
    if (options_.tell) options_.tell(sentence);
  }

  // The place of the timestep nearest to 1 ms.
  size_t usual_step() const {
    const std::vector<double>& steps = known_.timesteps_ms();
    if (steps.empty()) return 0;
    const auto nearest = std::ranges::min_element(steps, {}, [](double step) { return std::abs(std::log(step)); });
    return std::clamp(static_cast<size_t>(nearest - steps.begin()), begin_, end_ - 1);
  }

  // A first look at the next contenders in the order of what is expected of them. The first few have to give an answer
  // before others are begun.
  void look_at_more() {
    const size_t count = std::min(wave_, waiting_.size());
    const std::vector<int> next(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
    contenders_.insert(contenders_.end(), next.begin(), next.end());
    wave_ *= 2;
    scan(next, false);
  }

  // Cheap cells of these contenders at the timestep nearest to 1 ms.
  void scan(const std::vector<int>& contenders, bool is_late) {
    if (known_.timesteps_ms().empty()) return;
    const size_t step = usual_step();
    std::set<std::string> keys;
    for (const int c : contenders) {
      for (const PlannedCell* cell : known_.missing({c, step}, CellGroup::kRuns)) keys.insert(cell->key);
    }
    if (keys.empty()) return;
    const std::string at = fmt::format("at {} ms", timestep_label(known_.timesteps_ms()[step]));
    if (is_late) {
      tell(fmt::format("{} {}, which takes longer to start", name(contenders.front()), at));
    } else if (contenders.size() < contenders_.size()) {
      tell(fmt::format("{} more of {} contenders {}", contenders.size(), summary_.contenders, at));
    } else if (contenders.size() == summary_.contenders) {
      tell(fmt::format("{} contenders take part; first all of them {}", summary_.contenders, at));
    } else {
      tell(fmt::format("{} contenders take part; first {} of them {}, the others when these have given an answer",
                       summary_.contenders, contenders.size(), at));
    }
    measure(keys, false);
  }

  // The contender's largest timestep that is not excluded, unless that is known to be within the limits. Its place is
  // below `end`, and its expected error at most `doubt` times the limit.
  std::optional<PointAt> next_point(int c, const Limits& goal, size_t end, double doubt) const {
    double limit = HUGE_VAL;
    for (const auto& [value, largest] : goal.largest) {
      if (value == kTruthError) limit = largest;
    }
    for (size_t i = end; i-- > smallest_;) {
      const PointAt point{c, i};
      if (i < begin_ && !may_do_below(point, goal)) break;
      const Verdict verdict = known_.verdict(point, goal);
      if (verdict == Verdict::kOut) continue;
      if (verdict == Verdict::kFeasible) return std::nullopt;
      if (known_.expected_error(point) > doubt * limit) continue;
      if (goal.realtime && known_.speed(point).value_or(HUGE_VAL) * kSpeedDoubt < *goal.realtime) continue;
      return point;
    }
    return std::nullopt;
  }

  std::optional<PointAt> next_point(int c, const Limits& goal) const { return next_point(c, goal, end_, kErrorDoubt); }

  // Whether the next larger timestep misses the limits by an error of the motion alone, which this one can make good.
  bool may_do_below(const PointAt& point, const Limits& goal) const {
    const PointAt above{point.contender, point.step + 1};
    const auto excess = known_.error_excess(above, goal);
    if (!excess) return false;
    const ResolvedContender& own = campaign_.contenders[static_cast<size_t>(point.contender)].resolved;
    const double order = own.engine->capabilities(own.settings).order;
    const double smaller = known_.timesteps_ms()[point.step] / known_.timesteps_ms()[above.step];
    if (*excess * std::pow(smaller, order) > kErrorDoubt) return false;
    return !goal.realtime || known_.speed(above).value_or(HUGE_VAL) * smaller * kSpeedDoubt >= *goal.realtime;
  }

  // Where the campaign has timesteps beyond those that were tried: a larger one when a point at the largest within the
  // limits may do better there than the best, a smaller one when no point is within them.
  bool go_beyond() {
    const std::vector<double>& steps = known_.timesteps_ms();
    bool larger = false, smaller = false;
    if (steps.empty()) return false;
    for (const Limits& goal : options_.goals) {
      const double fastest = best(goal);
      for (const int c : contenders_) {
        const PointAt last{c, end_ - 1};
        larger = larger || (end_ < steps.size() && known_.verdict(last, goal) == Verdict::kFeasible &&
                            known_.speed(last).value_or(HUGE_VAL) * steps[end_] / steps[end_ - 1] > fastest);
        smaller = smaller || (smallest_ > 0 && fastest == 0 && may_do_below({c, smallest_ - 1}, goal));
      }
    }
    if (larger) tell(fmt::format("an answer may lie at a larger timestep: {} ms", timestep_label(steps[end_])));
    if (smaller) {
      tell(fmt::format("an answer may lie at a smaller timestep: {} ms", timestep_label(steps[smallest_ - 1])));
    }
    end_ += larger ? 1 : 0;
    smallest_ -= smaller ? 1 : 0;
    return larger || smaller;
  }

  // The realtime factor of the fastest point that is within the limits; 0 when there is none yet.
  double best(const Limits& goal) const {
    double best = 0;
    for (const PointAt& point : feasible(goal)) best = std::max(best, known_.speed(point).value_or(0));
    return best;
  }
  std::vector<PointAt> feasible(const Limits& goal) const {
    std::vector<PointAt> points;
    for (const int c : contenders_) {
      for (size_t i = end_; i-- > smallest_;) {
        if (known_.verdict({c, i}, goal) != Verdict::kFeasible) continue;
        points.push_back({c, i});
        break;
      }
    }
    return points;
  }
  bool can_win(const PointAt& point, double best) const {
    return known_.speed(point).value_or(HUGE_VAL) * kSpeedDoubt > best;
  }

  // The next cells of a point: its cheapest group that is not complete.
  std::vector<const PlannedCell*> next_cells(const PointAt& point) const {
    for (const CellGroup group : kInOrder) {
      std::vector<const PlannedCell*> cells = known_.missing(point, group);
      if (!cells.empty()) return cells;
    }
    return {};
  }

  // For each goal without a point within its limits: the next cells of the fastest contender at the timestep of the
  // first look, or below, where it is expected to be within them. An answer that a larger timestep beats is better than
  // many points that were begun.
  std::set<std::string> first_answer() {
    std::set<std::string> keys;
    for (const Limits& goal : options_.goals) {
      if (!feasible(goal).empty()) continue;
      std::optional<PointAt> first;
      for (const int c : contenders_) {
        const auto point = next_point(c, goal, usual_step() + 1, 1);
        if (!point) continue;
        if (!first || known_.speed(*point).value_or(0) > known_.speed(*first).value_or(0)) first = point;
      }
      if (!first) continue;
      const std::string sentence = fmt::format("for a first answer: {} at {} ms", name(first->contender),
                                               timestep_label(known_.timesteps_ms()[first->step]));
      if (std::exchange(last_told_, sentence) != sentence) tell(sentence);
      for (const PlannedCell* cell : next_cells(*first)) keys.insert(cell->key);
    }
    return keys;
  }

  // Cells of the points that may win, the fastest first. Each call may cost a sixth of what was spent so far: what one
  // teaches makes cells of the next unnecessary.
  std::set<std::string> candidates() {
    constexpr double kLeast = 3;  // s
    std::set<std::string> keys;
    double cost = 0;
    const double enough = std::max(kLeast, std::min(elapsed() / 6, left() / 8));
    for (const Limits& goal : options_.goals) {
      const double fastest = best(goal);
      std::vector<PointAt> points;
      for (const int c : contenders_) {
        if (const auto point = next_point(c, goal); point && can_win(*point, fastest)) points.push_back(*point);
      }
      std::ranges::stable_sort(points, std::greater(),
                               [&](const PointAt& point) { return known_.speed(point).value_or(HUGE_VAL); });
      double own = 0;
      for (const PointAt& point : points) {
        const std::vector<const PlannedCell*> cells = next_cells(point);
        for (const PlannedCell* cell : cells) keys.insert(cell->key);
        own += known_.cost_s(cells) + (passed_suite_.contains(point.contender) ? 0 : kSuiteSeconds);
        if (own > enough / static_cast<double>(options_.goals.size())) break;
      }
      cost += own;
    }
    if (!keys.empty())
      tell(fmt::format("{} cells of points that may win, about {}", keys.size(), duration_label(cost)));
    return keys;
  }

  // What makes the answers sure: the smaller timesteps of the best point and of those that are nearly as fast, and the
  // next larger one, which gives the margin.
  std::set<std::string> confirmation() {
    constexpr double kNearly = 0.7;
    std::set<std::string> keys;
    for (const Limits& goal : options_.goals) {
      const double fastest = best(goal);
      for (const PointAt& point : feasible(goal)) {
        if (known_.speed(point).value_or(0) < kNearly * fastest) continue;
        const size_t last = std::min(point.step + 1, end_ - 1);
        for (size_t i = last + 1; i-- > begin_;) {
          if (i == point.step) continue;
          if (i > point.step && known_.verdict({point.contender, i}, goal) == Verdict::kOut) continue;
          for (const CellGroup group : {CellGroup::kRuns, CellGroup::kPieces}) {
            const std::vector<const PlannedCell*> cells = known_.missing({point.contender, i}, group);
            for (const PlannedCell* cell : cells) keys.insert(cell->key);
            if (!cells.empty()) break;
          }
        }
      }
    }
    if (!keys.empty()) tell(fmt::format("{} cells that confirm the best points", keys.size()));
    return keys;
  }

  void tell_best() const {
    for (const Limits& goal : options_.goals) {
      std::optional<PointAt> winner;
      for (const PointAt& point : feasible(goal)) {
        if (!winner || known_.speed(point).value_or(0) > known_.speed(*winner).value_or(0)) winner = point;
      }
      if (!winner) continue;
      size_t open = 0;
      for (const int c : contenders_) {
        const auto point = next_point(c, goal);
        open += point && can_win(*point, best(goal)) ? 1 : 0;
      }
      tell(fmt::format("after {}: {} at {} ms, {:.3g} times real time; {} may still be faster",
                       duration_label(elapsed()), name(winner->contender),
                       timestep_label(known_.timesteps_ms()[winner->step]), known_.speed(*winner).value_or(0), open));
      return;
    }
  }

  const Campaign& campaign_;
  const SearchOptions& options_;
  Plan plan_;
  Knowledge known_;
  size_t begin_ = 0, end_ = 0;   // places of the usual timesteps; `end_` grows where an answer lies there
  size_t smallest_ = 0;          // that is tried: at most `begin_`
  std::string last_told_;        // of first_answer()
  std::vector<int> contenders_;  // that had their first look
  std::vector<int> waiting_;     // for theirs, the likeliest to win first
  std::vector<int> late_;        // after all others (starts_slowly)
  size_t wave_ = kFirst;         // how many have their look next
  std::set<int> passed_suite_;   // or failed it
  const Interrupts interrupts_;
  SearchSummary summary_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

SearchSummary search(const Campaign& campaign, const SearchOptions& options) { return Search(campaign, options).run(); }

}  // namespace assay
