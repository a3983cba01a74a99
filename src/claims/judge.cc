// Verdicts on claims.
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "base/text.h"
#include "claims/claims.h"
#include "claims/results.h"
#include "claims/text.h"
#include "measures/scaling.h"

namespace assay {
namespace {

using Kind = ClaimTest::Kind;

// In this order `and` is the least and `or` the largest of several.
enum class Truth { kNo, kUnknown, kYes };

// "before: part; part after", so that tests that ask the same of several systems make one sentence.
struct Sentence {
  std::string before, after;
  std::vector<std::string> parts;
};

struct Tested {
  Truth truth = Truth::kUnknown;
  std::vector<Sentence> summary, today;
  std::vector<std::string> keys, reasons;
  std::vector<ClaimFigure> figures;
};

Truth judged(const ClaimBound& bound, const Interval& value) {
  bool yes = false;
  switch (bound.kind) {
    case ClaimBound::Kind::kAbove:
      yes = value.low > bound.x;
      break;
    case ClaimBound::Kind::kBelow:
      yes = value.high < bound.x;
      break;
    case ClaimBound::Kind::kBetween:
      yes = value.low >= bound.x && value.high <= bound.y;
      break;
    case ClaimBound::Kind::kNotAbove:
      yes = value.low <= bound.x;
      break;
  }
  return yes ? Truth::kYes : Truth::kNo;
}

// Of tests that have one.
double timestep_of(const ClaimTest& test) { return test.timestep_ms.value_or(0); }

// The first that no other is better than; there has to be one.
template <typename T, typename Better>
T best_of(std::vector<T> all, const Better& better) {
  size_t best = 0;
  for (size_t i = 1; i < all.size(); ++i) {
    if (better(all[i], all[best])) best = i;
  }
  return std::move(all[best]);
}

Verdict verdict_of(Truth truth) {
  if (truth == Truth::kYes) return Verdict::kHolds;
  return truth == Truth::kNo ? Verdict::kChanged : Verdict::kNotMeasurable;
}

class Judge {
 public:
  Judge(const ClaimsFile& file, const Results& results) : file_(file), results_(results) {}

  Tested test(const ClaimTest& test) const {
    switch (test.kind) {
      case Kind::kAtTimestep:
      case Kind::kEqualSpeed:
        return pairs(test);
      case Kind::kValue:
      case Kind::kSlope:
        return values(test);
      case Kind::kUnstable:
        return unstable(test);
      case Kind::kLargestStep:
        return largest_step(test);
    }
    return {};
  }

 private:
  const std::vector<std::string>& stand_ins(const std::string& engine) const {
    return std::ranges::find(file_.engines, engine, &std::pair<std::string, std::vector<std::string>>::first)->second;
  }

  // ---- two engines compared -------------------------------------------------------------------------------------------

  // A pair of contenders and the figure that is to be large.
  struct Pair {
    std::string who, rival;    // engines
    std::string mine, theirs;  // contenders
    Ratio ratio;
    Truth truth = Truth::kUnknown;
  };

  Ratio compare(const ClaimTest& test, const std::string& system, const std::string& mine,
                const std::string& theirs) const {
    const std::string &first = test.more ? theirs : mine, &second = test.more ? mine : theirs;
    return test.kind == Kind::kAtTimestep ? results_.at_timestep(system, first, second, test.value, timestep_of(test))
                                          : results_.at_equal_speed(system, first, second, test.value);
  }

  // Mine did not run well, or theirs.
  static bool mine_failed(const ClaimTest& test, const Ratio& ratio) {
    return ratio.state == (test.more ? Ratio::State::kSecondFailed : Ratio::State::kFirstFailed);
  }
  static bool theirs_failed(const ClaimTest& test, const Ratio& ratio) {
    return ratio.state == (test.more ? Ratio::State::kFirstFailed : Ratio::State::kSecondFailed);
  }

  // Of an engine's contenders the one that does best: of theirs the one with the least value, of mine likewise.
  Pair best_pair(const ClaimTest& test, const std::string& system, const std::string& who,
                 const std::string& rival) const {
    const auto better = [](const Pair& a, const Pair& b, bool larger) {
      const bool a_there = a.ratio.state == Ratio::State::kThere, b_there = b.ratio.state == Ratio::State::kThere;
      if (a_there != b_there) return a_there;
      const bool a_missing = a.ratio.state == Ratio::State::kMissing,
                 b_missing = b.ratio.state == Ratio::State::kMissing;
      if (!a_there) return !a_missing && b_missing;
      return larger ? a.ratio.value.value > b.ratio.value.value : a.ratio.value.value < b.ratio.value.value;
    };
    std::vector<Pair> nearest;
    for (const std::string& mine : stand_ins(who)) {
      std::vector<Pair> pairs;
      for (const std::string& theirs : stand_ins(rival)) {
        pairs.push_back({who, rival, mine, theirs, compare(test, system, mine, theirs), Truth::kUnknown});
      }
      nearest.push_back(
          best_of(std::move(pairs), [&](const Pair& a, const Pair& b) { return better(a, b, test.more); }));
    }
    Pair best = best_of(std::move(nearest), [&](const Pair& a, const Pair& b) { return better(a, b, !test.more); });
    if (best.ratio.state == Ratio::State::kThere) {
      best.truth = judged(test.bound, best.ratio.value);
    } else if (mine_failed(test, best.ratio)) {
      best.truth = test.more ? Truth::kUnknown : Truth::kNo;
      if (test.bound.kind == ClaimBound::Kind::kNotAbove) best.truth = Truth::kYes;  // nothing is gained
    } else if (theirs_failed(test, best.ratio) && test.bound.kind != ClaimBound::Kind::kNotAbove) {
      best.truth = Truth::kYes;  // no rival
    }
    return best;
  }

  // An engine against all rivals.
  struct Field {
    std::string who;
    Truth truth = Truth::kUnknown;
    std::vector<Pair> pairs;
    const Pair* nearest() const {
      const Pair* found = nullptr;
      for (const Pair& pair : pairs) {
        if (pair.ratio.state != Ratio::State::kThere) continue;
        if (found == nullptr || pair.ratio.value.value < found->ratio.value.value) found = &pair;
      }
      return found;
    }
  };

  Field field(const ClaimTest& test, const std::string& system, const std::string& who) const {
    Field field;
    field.who = who;
    field.truth = Truth::kYes;
    for (const std::string& rival : test.against) {
      if (rival == who) continue;
      field.pairs.push_back(best_pair(test, system, who, rival));
      field.truth = std::min(field.truth, field.pairs.back().truth);
    }
    // with no rival left there is nothing that was compared
    const bool absence = test.bound.kind == ClaimBound::Kind::kNotAbove;
    if (field.nearest() == nullptr && !absence) field.truth = std::min(field.truth, Truth::kUnknown);
    return field;
  }

  Tested pairs(const ClaimTest& test) const {
    Tested tested;
    tested.truth = Truth::kYes;
    std::vector<std::string> sentence, today;
    bool by_speed = false;
    for (const std::string& system : test.systems) {
      std::vector<Field> fields;
      fields.reserve(test.who.size());
      for (const std::string& who : test.who) fields.push_back(field(test, system, who));
      const auto rank = [&](const Field& field) {
        const Pair* nearest = field.nearest();
        return std::pair(field.truth, nearest == nullptr ? -1.0 : nearest->ratio.value.value);
      };
      const auto by_rank = [&](const Field& a, const Field& b) { return rank(a) < rank(b); };
      const Field& decisive =
          test.each ? *std::ranges::min_element(fields, by_rank) : *std::ranges::max_element(fields, by_rank);
      tested.truth = std::min(tested.truth, decisive.truth);
      add_reasons(test, decisive, tested);
      for (const Field& each : test.each ? fields : std::vector<Field>{decisive})
        add_figures(test, system, each, tested);
      const Pair* nearest = decisive.nearest();
      if (nearest == nullptr) {
        const bool failed =
            std::ranges::any_of(decisive.pairs, [&](const Pair& pair) { return mine_failed(test, pair.ratio); });
        if (failed) sentence.push_back(fmt::format("{} {} unstable", system, decisive.who));
        continue;
      }
      by_speed = by_speed || nearest->ratio.by_speed;
      sentence.push_back(pair_text(test, system, decisive, *nearest));
      tested.keys.push_back(fmt::format("{} {}x", system, figure_text(nearest->ratio.value.value)));
      if (test.today && test.bound.kind == ClaimBound::Kind::kAbove) {
        if (const std::string text = today_text(test, system, nearest->mine); !text.empty()) today.push_back(text);
      }
    }
    const std::string how = test.kind == Kind::kAtTimestep
                                ? fmt::format("at {} ms", timestep_label(timestep_of(test)))
                                : fmt::format("at equal {}", by_speed ? "speed" : "timestep");
    if (!sentence.empty()) {
      tested.summary.push_back({fmt::format("{} {}, ratio to the nearest rival: ", quantity_text(test.value), how),
                                fmt::format(" ({}).", bound_text(test.bound)), sentence});
    }
    if (!today.empty()) {
      tested.today.push_back(
          {fmt::format("All contenders, {} {}: ", quantity_text(test.value, false), how), ".", today});
    }
    return tested;
  }

  static std::string pair_text(const ClaimTest& test, const std::string& system, const Field& field,
                               const Pair& nearest) {
    const std::string over = test.more ? nearest.who : nearest.rival, under = test.more ? nearest.rival : nearest.who;
    std::string text = fmt::format("{} {} ({} over {}", system, interval_text(nearest.ratio.value), over, under);
    if (nearest.ratio.most > 1.01 * nearest.ratio.least) {
      text +=
          fmt::format(", {} to {} along the curve", figure_text(nearest.ratio.least), figure_text(nearest.ratio.most));
    }
    const bool spans = nearest.ratio.value.low <= test.bound.x && nearest.ratio.value.high > test.bound.x;
    if (spans && test.bound.kind == ClaimBound::Kind::kAbove) text += ", which does not settle it";
    std::vector<std::string> out;
    for (const Pair& pair : field.pairs) {
      if (theirs_failed(test, pair.ratio)) out.push_back(pair.rival);
    }
    if (!out.empty()) text += fmt::format(", without {}, unstable there", join(out, ", "));
    return text + ")";
  }

  static void add_reasons(const ClaimTest& test, const Field& field, Tested& tested) {
    for (const Pair& pair : field.pairs) {
      if (pair.truth == Truth::kUnknown || (mine_failed(test, pair.ratio) && pair.truth != Truth::kYes)) {
        tested.reasons.push_back(pair.ratio.why);
      }
    }
    const bool nothing = field.nearest() == nullptr && field.truth == Truth::kUnknown;
    if (!nothing) return;
    for (const Pair& pair : field.pairs) {
      if (pair.ratio.state != Ratio::State::kThere) tested.reasons.push_back(pair.ratio.why);
    }
  }

  static void add_figures(const ClaimTest& test, const std::string& system, const Field& field, Tested& tested) {
    const std::optional<double> timestep = test.kind == Kind::kAtTimestep ? test.timestep_ms : std::optional<double>();
    bool first = true;
    for (const Pair& pair : field.pairs) {
      if (pair.ratio.state != Ratio::State::kThere) continue;
      if (pair.ratio.figures.size() == 2) {  // under, over: of the engine itself once, of each rival
        const size_t mine = test.more ? 1 : 0;
        if (first) add_figure(tested, pair.who, pair.mine, system, test.value, pair.ratio.figures[mine]);
        add_figure(tested, pair.rival, pair.theirs, system, test.value, pair.ratio.figures[1 - mine]);
      }
      first = false;
      const std::string over = test.more ? pair.who : pair.rival, under = test.more ? pair.rival : pair.who;
      tested.figures.push_back({fmt::format("{} / {}", over, under), test.more ? pair.mine : pair.theirs, system,
                                timestep, test.value, pair.ratio.value.value, "1", pair.ratio.value.low,
                                pair.ratio.value.high});
    }
  }

  // Where the whole field stands against one contender.
  std::string today_text(const ClaimTest& test, const std::string& system, const std::string& mine) const {
    struct Other {
      std::string name;
      Interval ratio;
    };
    std::vector<Other> others;
    for (const std::string& other : results_.contenders()) {
      if (other == mine) continue;
      const Ratio ratio = compare(test, system, mine, other);
      if (ratio.state == Ratio::State::kThere) others.push_back({other, ratio.value});
    }
    if (others.empty()) return "";
    const auto ahead = std::ranges::count_if(others, [](const Other& other) { return other.ratio.high < 1; });
    const Other& nearest = *std::ranges::min_element(others, {}, [](const Other& other) { return other.ratio.value; });
    const char* what = test.more ? "more" : "less";
    std::string which = "the nearest";
    if (ahead > 0) which = test.more ? "the most" : "the least";
    return fmt::format("{} {} of {} have {} than {}, {} {} ({} times)", system,
                       ahead == 0 ? "none" : std::to_string(ahead), others.size(), what, mine, which, nearest.name,
                       interval_text(test.more ? inverse(nearest.ratio) : nearest.ratio));
  }

  static Interval inverse(const Interval& of) { return {1 / of.value, 1 / of.high, 1 / of.low}; }

  // ---- engines by themselves ------------------------------------------------------------------------------------------

  static void add_figure(Tested& tested, const std::string& engine, const std::string& contender,
                         const std::string& system, const std::string& measure, const Figure& figure) {
    tested.figures.push_back({engine, contender, system, figure.timestep_ms, measure, figure.value.value, figure.unit,
                              figure.has_interval ? std::optional(figure.value.low) : std::nullopt,
                              figure.has_interval ? std::optional(figure.value.high) : std::nullopt});
  }

  Figure slope(const std::string& system, const std::string& contender, const std::string& value) const {
    constexpr double kLeast = 1e-16;  // rounding
    constexpr std::uint64_t kSeed = 1;
    std::vector<TimeAtSize> points;
    Figure found;
    found.why = results_.why_missing(system, contender, value);
    for (const Figure& figure : results_.figures(system, contender, value)) {
      if (figure.found == Found::kThere) {
        points.push_back({figure.timestep_ms, {std::max(figure.value.value, kLeast)}});
      } else {
        found.why = figure.why;
      }
    }
    // The slope of a line through logarithms, whatever they are of.
    if (const auto fitted = scaling_exponent(points, kSeed)) {
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
    if (test.kind == Kind::kSlope) return slope(system, contender, test.value);
    if (test.family.empty()) return results_.figure(system, contender, test.value, test.timestep_ms);
    Figure missing;
    const std::vector<std::string> systems = results_.family(test.family);
    missing.why = systems.empty() ? fmt::format("the results have no systems of family '{}'", test.family)
                                  : results_.why_missing(systems.back(), contender, test.value);
    for (const std::string& each : systems) {
      for (const Figure& figure : results_.figures(each, contender, test.value)) {
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

  Tested values(const ClaimTest& test) const {
    Tested tested;
    tested.truth = Truth::kYes;
    const std::string what = quantity_text(test.value);
    std::vector<std::string> sentence, today;
    for (const std::string& system : test.family.empty() ? test.systems : std::vector{test.family}) {
      std::vector<std::string> parts;
      for (const std::string& who : test.who) {
        using Own = std::pair<std::string, Figure>;
        std::vector<Own> own;
        for (const std::string& each : stand_ins(who)) own.emplace_back(each, own_figure(test, system, each));
        const auto [contender, figure] =
            best_of(std::move(own), [&](const Own& a, const Own& b) { return better(test.bound, a.second, b.second); });
        Truth truth = Truth::kUnknown;
        if (figure.found == Found::kThere) {
          truth = judged(test.bound, figure.value);
          ClaimFigure shown{who, contender, system, {}, test.value, figure.value.value, figure.unit, {}, {}};
          if (test.kind != Kind::kSlope && test.family.empty()) shown.timestep_ms = figure.timestep_ms;
          if (test.kind == Kind::kSlope) shown.measure += "_slope";
          if (figure.has_interval) shown.low = figure.value.low, shown.high = figure.value.high;
          tested.figures.push_back(std::move(shown));
          parts.push_back(fmt::format("{} {}", who, interval_text(figure.value)));
        } else if (figure.found == Found::kFailed) {
          truth = Truth::kNo;
          parts.push_back(fmt::format("{} unstable", who));
        } else {
          tested.reasons.push_back(figure.why);
        }
        tested.truth = std::min(tested.truth, truth);
      }
      if (!parts.empty()) sentence.push_back(fmt::format("{}: {}", system, join(parts, ", ")));
      if (!parts.empty()) tested.keys.push_back(join(parts, ", "));
      if (test.today) add_today(test, system, today);
    }
    std::string how;
    if (test.kind == Kind::kSlope) {
      how = " over the timestep, slope in logarithms";
    } else if (test.timestep_ms) {
      how = fmt::format(" at {} ms", timestep_label(*test.timestep_ms));
    } else if (test.family.empty()) {
      how = " at the smallest timestep";
    }
    if (!sentence.empty()) {
      tested.summary.push_back(
          {fmt::format("{}{}, ", what, how), fmt::format(" ({}).", bound_text(test.bound)), sentence});
    }
    if (!today.empty()) {
      tested.today.push_back(
          {fmt::format("All contenders, {}{}: ", quantity_text(test.value, false), how), ".", today});
    }
    return tested;
  }

  // How many of all contenders do what the line-up is to do, and who is at the ends.
  void add_today(const ClaimTest& test, const std::string& system, std::vector<std::string>& today) const {
    std::vector<std::pair<double, std::string>> found;
    int failed = 0, yes = 0;
    for (const std::string& contender : results_.contenders()) {
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

  // ---- what fails at large timesteps ----------------------------------------------------------------------------------

  struct Range {
    Found found = Found::kMissing;  // kFailed: does not end well at some timestep
    std::string why;
    double good_ms = 0;  // the largest below the first failure; 0: none
    double bad_ms = 0;   // the smallest above it that fails
  };

  Range range(const std::string& system, const std::string& contender, const std::string& measure) const {
    Range range;
    bool failed_from_the_start = false;
    range.why = results_.why_missing(system, contender, measure);
    for (const Figure& figure : results_.outcomes(system, contender, measure)) {
      if (figure.found == Found::kMissing) {
        range.why = figure.why;
        continue;
      }
      const bool fails = figure.found == Found::kFailed;
      if (range.found == Found::kFailed) continue;
      if (!fails) {
        range.found = Found::kThere;
        range.good_ms = figure.timestep_ms;
      } else if (range.found == Found::kThere) {
        range.found = Found::kFailed;
        range.bad_ms = figure.timestep_ms;
      } else {
        failed_from_the_start = true;
      }
    }
    if (range.found == Found::kMissing && failed_from_the_start) range.found = Found::kFailed;
    return range;
  }

  Tested unstable(const ClaimTest& test) const {
    Tested tested;
    tested.truth = Truth::kYes;
    std::vector<std::string> sentence, today;
    for (const std::string& system : test.systems) {
      std::vector<std::string> parts;
      for (const std::string& who : test.who) {
        using Own = std::pair<std::string, Range>;
        std::vector<Own> own;
        for (const std::string& each : stand_ins(who)) own.emplace_back(each, range(system, each, test.value));
        // the one that goes on for longest
        const auto [contender, found] = best_of(std::move(own), [](const Own& a, const Own& b) {
          return std::pair(a.second.found, a.second.good_ms) > std::pair(b.second.found, b.second.good_ms);
        });
        if (found.found == Found::kMissing) {
          tested.truth = std::min(tested.truth, Truth::kUnknown);
          tested.reasons.push_back(found.why);
          continue;
        }
        if (found.good_ms == 0) {
          tested.truth = Truth::kNo;
          parts.push_back(fmt::format("{} unstable at every timestep", who));
          continue;
        }
        const bool fails = found.found == Found::kFailed;
        tested.truth = std::min(tested.truth, fails ? Truth::kYes : Truth::kNo);
        tested.figures.push_back(
            {who, contender, system, found.good_ms, "stable_timestep", found.good_ms, "ms", {}, {}});
        parts.push_back(
            fails ? fmt::format("{} stable up to {} ms and not at {} ms", who, timestep_label(found.good_ms),
                                timestep_label(found.bad_ms))
                  : fmt::format("{} stable at every timestep up to {} ms", who, timestep_label(found.good_ms)));
        tested.keys.push_back(
            fmt::format("{} {} {} ms", who, fails ? "up to" : "all up to", timestep_label(found.good_ms)));
      }
      if (!parts.empty()) sentence.push_back(fmt::format("{}: {}", system, join(parts, ", ")));
      std::vector<std::string> failing;
      int ran = 0;
      for (const std::string& contender : results_.contenders()) {
        const Range found = range(system, contender, test.value);
        if (found.found == Found::kMissing) continue;
        ++ran;
        if (found.found == Found::kFailed) {
          failing.push_back(found.good_ms > 0 ? fmt::format("{} above {} ms", contender, timestep_label(found.good_ms))
                                              : fmt::format("{} always", contender));
        }
      }
      if (test.today && ran > 0) {
        today.push_back(fmt::format("{} {} of {} go unstable{}{}", system, failing.size(), ran,
                                    failing.empty() ? "" : ": ", join(failing, ", ")));
      }
    }
    if (!sentence.empty()) tested.summary.push_back({"On the ", ".", sentence});
    if (!today.empty()) tested.today.push_back({"All contenders: ", ".", today});
    return tested;
  }

  // ---- the largest timestep that holds --------------------------------------------------------------------------------

  struct Step {
    bool there = false;
    std::string why;
    double largest_ms = 0;  // 0: none
    double hole_ms = 0;     // the smallest below it that does not hold; 0: none
  };

  Step step(const std::string& system, const std::string& contender, const std::string& value) const {
    Step step;
    step.why = results_.why_missing(system, contender, value);
    double lost_ms = 0;
    for (const Figure& figure : results_.figures(system, contender, value)) {
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

  Tested largest_step(const ClaimTest& test) const {
    Tested tested;
    tested.truth = Truth::kYes;
    for (const std::string& system : test.systems) {
      std::vector<std::string> parts, keys;
      for (const auto& [who, expected] : test.expected) {
        using Own = std::pair<std::string, Step>;
        std::vector<Own> own;
        for (const std::string& each : stand_ins(who)) own.emplace_back(each, step(system, each, test.value));
        const auto [contender, found] = best_of(std::move(own), [](const Own& a, const Own& b) {
          return std::pair(a.second.there, a.second.largest_ms) > std::pair(b.second.there, b.second.largest_ms);
        });
        if (!found.there) {
          tested.truth = std::min(tested.truth, Truth::kUnknown);
          tested.reasons.push_back(found.why);
          continue;
        }
        const double factor = found.largest_ms / expected, within = test.within * (1 + 1e-9);
        tested.truth = std::min(tested.truth, factor <= within && factor * within >= 1 ? Truth::kYes : Truth::kNo);
        ClaimFigure figure{who, contender, system, {}, "largest_stable_timestep", found.largest_ms, "ms", {}, {}};
        if (found.largest_ms > 0) figure.timestep_ms = found.largest_ms;
        tested.figures.push_back(std::move(figure));
        parts.push_back(
            fmt::format("{} {} (paper {}{})", who, step_text(found.largest_ms), timestep_label(expected),
                        found.hole_ms > 0 ? fmt::format("; not at {}", timestep_label(found.hole_ms)) : ""));
        keys.push_back(fmt::format("{} {}", who, step_text(found.largest_ms)));
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

  void add_steps_today(const ClaimTest& test, const std::string& system, Tested& tested) const {
    std::map<double, std::vector<std::string>, std::greater<>> by_step;
    for (const std::string& contender : results_.contenders()) {
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

  const ClaimsFile& file_;
  const Results& results_;
};

std::string text_of(const std::vector<Sentence>& sentences) {
  std::vector<Sentence> merged;
  for (const Sentence& each : sentences) {
    if (!merged.empty() && merged.back().before == each.before && merged.back().after == each.after) {
      merged.back().parts.insert(merged.back().parts.end(), each.parts.begin(), each.parts.end());
    } else {
      merged.push_back(each);
    }
  }
  std::vector<std::string> texts;
  texts.reserve(merged.size());
  for (const Sentence& each : merged) texts.push_back(each.before + join(each.parts, "; ") + each.after);
  return join(texts, " ");
}

// Each once, and not more than a reader takes in.
std::string reasons_text(const std::vector<std::string>& reasons) {
  constexpr size_t kMost = 4;
  std::vector<std::string> once;
  for (const std::string& reason : reasons) {
    if (!reason.empty() && std::ranges::find(once, reason) == once.end()) once.push_back(reason);
  }
  const size_t more = once.size() > kMost ? once.size() - kMost : 0;
  once.resize(once.size() - more);
  std::string text = join(once, "; ");
  if (more > 0) text += fmt::format("; and {} more", more);
  return text;
}

}  // namespace

std::vector<Judgement> judge(const ClaimsFile& file, const Store& store) {
  const Results results(store);
  const Judge judge(file, results);
  std::vector<Judgement> judgements;
  for (const Claim& claim : file.claims) {
    Judgement judgement;
    judgement.claim = claim;
    Truth truth = Truth::kYes;
    std::vector<Sentence> summary, today;
    std::vector<std::string> keys, reasons;
    const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    for (const ClaimTest& test : claim.tests) {
      Tested tested = judge.test(test);
      truth = std::min(truth, tested.truth);
      append(summary, tested.summary);
      append(today, tested.today);
      append(keys, tested.keys);
      append(reasons, tested.reasons);
      judgement.figures.insert(judgement.figures.end(), std::make_move_iterator(tested.figures.begin()),
                               std::make_move_iterator(tested.figures.end()));
    }
    judgement.verdict = verdict_of(truth);
    judgement.summary = text_of(summary);
    judgement.today = text_of(today);
    judgement.key = join(keys, "; ");
    if (judgement.verdict == Verdict::kNotMeasurable) judgement.reason = reasons_text(reasons);
    judgements.push_back(std::move(judgement));
  }
  return judgements;
}

}  // namespace assay
