// The largest timestep that holds.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/text.h"
#include "results/claims/judge.h"
#include "results/claims/text.h"

namespace assay {
namespace {

class LargestStep {
 public:
  explicit LargestStep(const Evidence& evidence) : evidence_(evidence) {}

  Tested test(const ClaimTest& test) const {
    Tested tested;
    tested.truth = Truth::kYes;
    for (const std::string& system : test.systems) {
      std::vector<std::string> parts, keys;
      for (const auto& [who, expected] : test.expected) {
        const auto [contender, found] = engine(system, who, test.value);
        if (!found.there) {
          tested.truth = std::min(tested.truth, Truth::kUnknown);
          tested.reasons.push_back(found.why);
          continue;
        }
        const double factor = found.largest_ms / expected, within = test.within * (1 + 1e-9);
        const Truth truth = factor <= within && factor * within >= 1 ? Truth::kYes : Truth::kNo;
        tested.truth = std::min(tested.truth, truth);
        tested.now.push_back({truth, factor > 0 ? 1 / std::max(factor, 1 / factor) : 0,
                              found.largest_ms > 0
                                  ? fmt::format("{} holds up to {} ms on {}, in the paper up to {} ms", who,
                                                timestep_label(found.largest_ms), system, timestep_label(expected))
                                  : fmt::format("{} holds at no timestep on {}", who, system),
                              fmt::format("within a factor of {} of the paper's", test.within)});
        add_figure(who, contender, system, found, tested);
        parts.push_back(
            fmt::format("{} {} (paper {}{})", who, step_text(found.largest_ms), timestep_label(expected),
                        found.hole_ms > 0 ? fmt::format("; not at {}", timestep_label(found.hole_ms)) : ""));
        keys.push_back(key_text(who, found));
      }
      if (!parts.empty()) {
        tested.summary.push_back({fmt::format("Largest timestep in ms that holds on {}: ", system),
                                  fmt::format(" (within a factor of {} needed).", test.within),
                                  {join(parts, ", ")}});
        tested.keys.push_back(join(keys, ", "));
      }
      if (test.today) add_steps_today(test, system, tested);
    }
    return tested;
  }

  Tested order(const ClaimTest& test) const {
    Tested tested;
    tested.truth = Truth::kYes;
    for (const std::string& system : test.systems) {
      std::map<std::string, Step> steps;
      std::vector<std::string> parts, keys;
      for (const std::vector<std::string>& group : test.order) {
        for (const std::string& name : group) {
          const auto [contender, found] = engine(system, name, test.value);
          steps[name] = found;
          if (!found.there) {
            tested.truth = std::min(tested.truth, Truth::kUnknown);
            tested.reasons.push_back(found.why);
            continue;
          }
          add_figure(name, contender, system, found, tested);
          parts.push_back(fmt::format("{} {}", name, step_text(found.largest_ms)));
          keys.push_back(key_text(name, found));
        }
      }
      for (size_t g = 0; g + 1 < test.order.size(); ++g) {
        for (const std::string& first : test.order[g]) {
          for (const std::string& second : test.order[g + 1]) {
            judge_pair(system, first, steps[first], second, steps[second], tested);
          }
        }
      }
      if (!parts.empty()) {
        tested.summary.push_back({fmt::format("Largest timestep in ms that holds on {}: ", system),
                                  fmt::format(" ({} needed).", order_text(test)),
                                  {join(parts, ", ")}});
        tested.keys.push_back(join(keys, ", "));
      }
      if (test.today) add_steps_today(test, system, tested);
    }
    return tested;
  }

 private:
  struct Step;

  static std::string order_text(const ClaimTest& test) {
    std::vector<std::string> groups;
    groups.reserve(test.order.size());
    for (const std::vector<std::string>& group : test.order) groups.push_back(join(group, " and "));
    return join(groups, ", then ");
  }

  // Timesteps grow by a factor: of two that hold up to the same one, nobody knows which holds for longer.
  static void judge_pair(const std::string& system, const std::string& first, const Step& a, const std::string& second,
                         const Step& b, Tested& tested) {
    if (!a.there || !b.there) return;
    Truth truth = a.largest_ms > b.largest_ms ? Truth::kYes : Truth::kNo;
    if (same_timestep(a.largest_ms, b.largest_ms)) truth = Truth::kUnsettled;
    tested.truth = std::min(tested.truth, truth);
    const double low = std::min(a.largest_ms, b.largest_ms), high = std::max(a.largest_ms, b.largest_ms);
    tested.now.push_back({truth, low > 0 ? high / low : HUGE_VAL,
                          fmt::format("{} holds {} on {} and {} {}", first, up_to(a), system, second, up_to(b)),
                          fmt::format("a larger timestep of {} than of {}", first, second)});
  }
  static std::string up_to(const Step& step) {
    return step.largest_ms > 0 ? fmt::format("up to {} ms", timestep_label(step.largest_ms)) : "at no timestep";
  }

  static std::string key_text(const std::string& who, const Step& step) {
    return fmt::format("{} {}{}", who, step_text(step.largest_ms), step.largest_ms > 0 ? " ms" : "");
  }
  static void add_figure(const std::string& who, const std::string& contender, const std::string& system,
                         const Step& step, Tested& tested) {
    ClaimFigure figure{who, contender, system, {}, "largest_stable_timestep", step.largest_ms, "ms", {}, {}};
    if (step.largest_ms > 0) figure.timestep_ms = step.largest_ms;
    tested.figures.push_back(std::move(figure));
  }

  struct Step {
    bool there = false;
    std::string why;
    double largest_ms = 0;  // 0: none
    double hole_ms = 0;     // the smallest below it that does not hold; 0: none
  };

  // Of an engine's contenders the one that holds for longest.
  std::pair<std::string, Step> engine(const std::string& system, const std::string& name,
                                      const std::string& value) const {
    using Own = std::pair<std::string, Step>;
    std::vector<Own> own;
    for (const std::string& each : evidence_.stand_ins(name)) own.emplace_back(each, step(system, each, value));
    return best_of(std::move(own), [](const Own& a, const Own& b) {
      return std::pair(a.second.there, a.second.largest_ms) > std::pair(b.second.there, b.second.largest_ms);
    });
  }

  Step step(const std::string& system, const std::string& contender, const std::string& value) const {
    Step step;
    step.why = evidence_.results.why_missing(system, contender, value);
    double lost_ms = 0;
    for (const Figure& figure : evidence_.results.figures(system, contender, value)) {
      if (figure.found == Found::kMissing) {
        step.why = figure.why;
        continue;
      }
      step.there = true;
      if (figure.found == Found::kThere && figure.value.value == 1) {
        step.largest_ms = figure.timestep_ms;
        step.hole_ms = lost_ms;
      } else if (lost_ms == 0) {
        lost_ms = figure.timestep_ms;
      }
    }
    return step;
  }

  static std::string step_text(double ms) { return ms > 0 ? timestep_label(ms) : "none"; }

  void add_steps_today(const ClaimTest& test, const std::string& system, Tested& tested) const {
    std::map<double, std::vector<std::string>, std::greater<>> by_step;
    for (const std::string& contender : evidence_.results.contenders()) {
      const Step found = step(system, contender, test.value);
      if (found.there) by_step[found.largest_ms].push_back(contender);
    }
    std::vector<std::string> parts;
    parts.reserve(by_step.size());
    for (const auto& [ms, names] : by_step) {
      parts.push_back(
          fmt::format("{}: {}", ms > 0 ? fmt::format("{} ms", timestep_label(ms)) : "at none", join(names, ", ")));
    }
    if (!parts.empty()) tested.today.push_back({fmt::format("All contenders on {}: ", system), ".", parts});
  }

  const Evidence& evidence_;
};

}  // namespace

Tested test_largest_step(const Evidence& evidence, const ClaimTest& test) { return LargestStep(evidence).test(test); }
Tested test_order(const Evidence& evidence, const ClaimTest& test) { return LargestStep(evidence).order(test); }

}  // namespace assay
