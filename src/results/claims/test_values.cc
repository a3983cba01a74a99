// Engines by themselves.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/text.h"
#include "measures/scaling.h"
#include "results/claims/judge.h"
#include "results/claims/text.h"

namespace assay {
namespace {

class Values {
 public:
  explicit Values(const Evidence& evidence) : evidence_(evidence) {}

  Tested test(const ClaimTest& test) const {
    Tested tested;
    tested.truth = Truth::kYes;
    const std::string what = value_text(test.value);
    std::vector<std::string> sentence, today;
    for (const std::string& system : test.family.empty() ? test.systems : std::vector{test.family}) {
      std::vector<std::string> parts;
      for (const std::string& who : test.who) {
        using Own = std::pair<std::string, Figure>;
        std::vector<Own> own;
        for (const std::string& each : evidence_.stand_ins(who)) own.emplace_back(each, own_figure(test, system, each));
        const auto [contender, figure] =
            best_of(std::move(own), [&](const Own& a, const Own& b) { return better(test.bound, a.second, b.second); });
        Truth truth = Truth::kUnknown;
        if (figure.found == Found::kThere) {
          truth = judged(test.bound, figure.value);
          ClaimFigure shown{who, contender, system, {}, test.value, figure.value.value, figure.unit, {}, {}};
          if (test.kind != ClaimTest::Kind::kSlope && test.family.empty()) shown.timestep_ms = figure.timestep_ms;
          if (test.kind == ClaimTest::Kind::kSlope) shown.measure += "_slope";
          if (figure.has_interval) shown.low = figure.value.low, shown.high = figure.value.high;
          tested.figures.push_back(std::move(shown));
          parts.push_back(fmt::format("{} {}", who, interval_text(figure.value)));
          tested.now.push_back({truth, margin_to(test.bound, figure.value.value),
                                now_text(test, who, system, figure.value), bound_text(test.bound)});
        } else if (figure.found == Found::kFailed) {
          truth = Truth::kNo;
          parts.push_back(fmt::format("{} unstable", who));
          tested.now.push_back({truth, 1, fmt::format("{} is unstable on {}", who, system), bound_text(test.bound)});
        } else {
          tested.reasons.push_back(figure.why);
        }
        tested.truth = std::min(tested.truth, truth);
      }
      if (!parts.empty()) sentence.push_back(fmt::format("{}: {}", system, join(parts, ", ")));
      if (!parts.empty()) {
        tested.keys.push_back(fmt::format("{}{}: {}", value_text(test.value, false),
                                          test.kind == ClaimTest::Kind::kSlope ? ", slope" : "", join(parts, ", ")));
      }
      if (test.today) add_today(test, system, today);
    }
    std::string how;
    if (test.kind == ClaimTest::Kind::kSlope) {
      how = " over the timestep, slope in logarithms";
    } else if (test.timestep_ms) {
      how = fmt::format(" at {} ms", timestep_label(*test.timestep_ms));
    } else if (test.family.empty()) {
      how = " at the smallest timestep";
    }
    if (!sentence.empty()) {
      tested.summary.push_back(
          {fmt::format("{}{}, ", what, how), fmt::format(" ({} needed).", bound_text(test.bound)), sentence});
    }
    if (!today.empty()) {
      tested.today.push_back({fmt::format("All contenders, {}{}: ", value_text(test.value, false), how), ".", today});
    }
    return tested;
  }

 private:
  static std::string now_text(const ClaimTest& test, const std::string& who, const std::string& system,
                              const Interval& value) {
    if (test.value == "grasp_held") {
      if (value.low == value.high) {
        return fmt::format("{} {} the object on {}", who, value.value == 1 ? "holds" : "drops", system);
      }
      return fmt::format("{} holds the object on {} from {:.0f} % of the initial states ({:.0f} to {:.0f} %)", who,
                         system, 100 * value.value, 100 * value.low, 100 * value.high);
    }
    return fmt::format("the {}{} of {} on {} is {}", test.kind == ClaimTest::Kind::kSlope ? "slope of the " : "",
                       value_text(test.value, false), who, system, interval_text(value));
  }

  Figure slope(const std::string& system, const std::string& contender, const std::string& value) const {
    constexpr double kLeast = 1e-16;  // rounding
    std::vector<TimeAtSize> points;
    Figure found;
    found.why = evidence_.results.why_missing(system, contender, value);
    for (const Figure& figure : evidence_.results.figures(system, contender, value)) {
      if (figure.found == Found::kThere) {
        points.push_back({figure.timestep_ms, {std::max(figure.value.value, kLeast)}});
      } else {
        found.why = figure.why;
      }
    }
    // The slope of a line through logarithms, whatever they are of.
    if (const auto fitted = scaling_exponent(points, kBootstrapSeed)) {
      found.found = Found::kThere;
      found.value = *fitted;
      found.has_interval = true;
      found.unit = "1";
    } else if (!points.empty()) {
      found.why = fmt::format("'{}' of {} on {} was measured at {} timesteps: a slope needs 3", value, contender,
                              system, points.size());
    }
    return found;
  }

  // Of one contender in a test of values.
  Figure own_figure(const ClaimTest& test, const std::string& system, const std::string& contender) const {
    if (test.kind == ClaimTest::Kind::kSlope) return slope(system, contender, test.value);
    if (test.family.empty()) return evidence_.results.figure(system, contender, test.value, test.timestep_ms);
    Figure missing;
    const std::vector<std::string> systems = evidence_.results.family_members(test.family);
    missing.why = systems.empty() ? fmt::format("the results have no systems of family '{}'", test.family)
                                  : evidence_.results.why_missing(systems.back(), contender, test.value);
    for (const std::string& each : systems) {
      for (const Figure& figure : evidence_.results.figures(each, contender, test.value)) {
        if (figure.found == Found::kThere) return figure;
        missing.why = figure.why;
      }
    }
    return missing;
  }

  static bool better(const ClaimBound& bound, const Figure& a, const Figure& b) {
    if (a.found != b.found) return a.found > b.found;
    const bool upward = bound.kind == ClaimBound::Kind::kAbove;
    return upward ? a.value.value > b.value.value : a.value.value < b.value.value;
  }

  // How many of all contenders do what the line-up is to do, and who is at the ends.
  void add_today(const ClaimTest& test, const std::string& system, std::vector<std::string>& today) const {
    std::vector<std::pair<double, std::string>> found;
    int failed = 0, yes = 0;
    for (const std::string& contender : evidence_.results.contenders()) {
      const Figure figure = own_figure(test, system, contender);
      if (figure.found == Found::kFailed) ++failed;
      if (figure.found != Found::kThere) continue;
      found.emplace_back(figure.value.value, contender);
      if (judged(test.bound, figure.value) == Truth::kYes) ++yes;
    }
    if (found.empty()) return;
    const auto [least, most] = std::ranges::minmax_element(found);
    std::string text = fmt::format("{} {} of {}", system, yes, found.size() + static_cast<size_t>(failed));
    if (least->first < most->first) {
      text += fmt::format(", from {} ({}) to {} ({})", figure_text(least->first), least->second,
                          figure_text(most->first), most->second);
    }
    today.push_back(std::move(text));
  }

  const Evidence& evidence_;
};

}  // namespace

Tested test_values(const Evidence& evidence, const ClaimTest& test) { return Values(evidence).test(test); }

}  // namespace assay
