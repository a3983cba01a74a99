// Two engines compared.
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"
#include "measures/measure.h"
#include "results/claims/judge.h"
#include "results/claims/text.h"
#include "results/values.h"

namespace assay {
namespace {

class Pairs {
 public:
  explicit Pairs(const Evidence& evidence) : evidence_(evidence) {}

  Tested test(const ClaimTest& test) const {
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
        if (!failed) continue;
        sentence.push_back(fmt::format("{} {} unstable", system, decisive.who));
        tested.now.push_back(
            {decisive.truth, 1, fmt::format("{} is unstable on {}", decisive.who, system), needed(test)});
        continue;
      }
      tested.now.push_back({decisive.truth, margin_to(test.bound, nearest->ratio.value.value),
                            fmt::format("{} on {}", now_text(test, *nearest), system), needed(test)});
      by_speed = by_speed || nearest->ratio.by_speed;
      sentence.push_back(pair_text(test, system, decisive, *nearest));
      tested.keys.push_back(
          fmt::format("{} {} times ({})", system, short_text(nearest->ratio), over_text(test, *nearest)));
      if (test.today && test.bound.kind == ClaimBound::Kind::kAbove) {
        if (const std::string text = today_text(test, system, nearest->mine); !text.empty()) today.push_back(text);
      }
    }
    const std::string how = test.kind == ClaimTest::Kind::kAtTimestep
                                ? fmt::format("at {} ms", timestep_label(timestep_of(test)))
                                : fmt::format("at equal {}", by_speed ? "speed" : "timestep");
    if (!sentence.empty()) {
      tested.summary.push_back({fmt::format("{} {}, ratio to the {}: ", value_text(test.value), how, rival_words(test)),
                                fmt::format(" ({} needed).", needed(test)), sentence});
    }
    if (!today.empty()) {
      tested.today.push_back({fmt::format("All contenders, {} {}: ", value_text(test.value, false), how), ".", today});
    }
    return tested;
  }

 private:
  static std::string needed(const ClaimTest& test) {
    return bound_text(test.bound) + (test.but > 0 ? fmt::format(" over all but {}", test.but) : "");
  }
  static std::string rival_words(const ClaimTest& test) {
    return test.but > 0 ? fmt::format("nearest rival but {}", test.but) : "nearest rival";
  }

  // Of tests that have one.
  static double timestep_of(const ClaimTest& test) { return test.timestep_ms.value_or(0); }

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
    return test.kind == ClaimTest::Kind::kAtTimestep
               ? evidence_.ratios.at_timestep(system, first, second, test.value, timestep_of(test))
               : evidence_.ratios.at_equal_speed(system, first, second, test.value);
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
    for (const std::string& mine : evidence_.stand_ins(who)) {
      std::vector<Pair> pairs;
      for (const std::string& theirs : evidence_.stand_ins(rival)) {
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
    size_t but = 0;  // so many rivals do not count: the best
    // The rival that decides; null when none was compared.
    const Pair* nearest() const {
      std::vector<const Pair*> there;
      for (const Pair& pair : pairs) {
        if (pair.ratio.state == Ratio::State::kThere) there.push_back(&pair);
      }
      if (there.empty()) return nullptr;
      std::ranges::stable_sort(there, {},
                               [](const Pair* pair) { return std::pair(pair->truth, pair->ratio.value.value); });
      return there[std::min(but, there.size() - 1)];
    }
  };

  Field field(const ClaimTest& test, const std::string& system, const std::string& who) const {
    Field field;
    field.who = who;
    field.but = static_cast<size_t>(test.but);
    std::vector<Truth> truths = {Truth::kYes};
    for (const std::string& rival : test.against) {
      if (rival == who) continue;
      field.pairs.push_back(best_pair(test, system, who, rival));
      truths.push_back(field.pairs.back().truth);
    }
    std::ranges::sort(truths);
    field.truth = truths[std::min(field.but, truths.size() - 1)];
    // with no rival left there is nothing that was compared
    const bool absence = test.bound.kind == ClaimBound::Kind::kNotAbove;
    if (field.nearest() == nullptr && !absence) field.truth = std::min(field.truth, Truth::kUnknown);
    return field;
  }

  // Whose value is divided by whose.
  static std::string over_text(const ClaimTest& test, const Pair& pair) {
    return fmt::format("{} over {}", test.more ? pair.who : pair.rival, test.more ? pair.rival : pair.who);
  }

  static std::string range_text(const Ratio& ratio) {
    return fmt::format("{} to {}", figure_text(ratio.least), figure_text(ratio.most));
  }
  static std::string short_text(const Ratio& ratio) {
    return ratio.is_range() ? range_text(ratio) : figure_text(ratio.value.value);
  }

  static std::string pair_text(const ClaimTest& test, const std::string& system, const Field& field,
                               const Pair& nearest) {
    const Ratio& ratio = nearest.ratio;
    std::string text =
        fmt::format("{} {} ({}", system, ratio.is_range() ? range_text(ratio) : interval_text(ratio.value),
                    over_text(test, nearest));
    if (ratio.points > 1 && !ratio.is_range()) text += fmt::format(", {} along the curve", range_text(ratio));
    if (ratio.points > 0) text += fmt::format(", {}", counted(static_cast<size_t>(ratio.points), "point"));
    if (nearest.truth == Truth::kUnsettled) text += ", which does not settle it";
    std::vector<std::string> out;
    for (const Pair& pair : field.pairs) {
      if (theirs_failed(test, pair.ratio)) out.push_back(pair.rival);
    }
    if (!out.empty()) text += fmt::format(", without {}, unstable there", join(out, ", "));
    return text + ")";
  }

  // What the ratio says today, the larger of the two first.
  static std::string now_text(const ClaimTest& test, const Pair& pair) {
    const bool swapped = pair.ratio.value.value < 1;
    const Ratio ratio = swapped ? inverse(pair.ratio) : pair.ratio;
    const std::string times = ratio.is_range() ? range_text(ratio) + " times" : times_text(ratio.value);
    // of the larger and the smaller value
    const bool mine_larger = test.more != swapped;
    const std::string &larger = mine_larger ? pair.who : pair.rival, &smaller = mine_larger ? pair.rival : pair.who;
    const ValueInfo info = value_info(test.value);
    if (reads(info.measure, Reads::kSteps) || reads(info.measure, Reads::kWholeRuns)) {
      const bool fast = info.better == Better::kHigh;
      return fmt::format("{} is {} faster than {}", fast ? larger : smaller, times, fast ? smaller : larger);
    }
    return fmt::format("the {} of {} is {} that of {}", value_text(test.value, false), larger, times, smaller);
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

  static void add_figure(Tested& tested, const std::string& engine, const std::string& contender,
                         const std::string& system, const std::string& measure, const Figure& figure) {
    tested.figures.push_back({engine, contender, system, figure.timestep_ms, measure, figure.value.value, figure.unit,
                              figure.has_interval ? std::optional(figure.value.low) : std::nullopt,
                              figure.has_interval ? std::optional(figure.value.high) : std::nullopt});
  }

  static void add_figures(const ClaimTest& test, const std::string& system, const Field& field, Tested& tested) {
    const std::optional<double> timestep =
        test.kind == ClaimTest::Kind::kAtTimestep ? test.timestep_ms : std::optional<double>();
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
      Ratio ratio;
    };
    std::vector<Other> others;
    for (const std::string& other : evidence_.results.contenders()) {
      if (other == mine) continue;
      Ratio ratio = compare(test, system, mine, other);
      if (ratio.state == Ratio::State::kThere) others.push_back({other, std::move(ratio)});
    }
    if (others.empty()) return "";
    const auto ahead = std::ranges::count_if(others, [](const Other& other) { return other.ratio.value.high < 1; });
    const Other& nearest =
        *std::ranges::min_element(others, {}, [](const Other& other) { return other.ratio.value.value; });
    const char* what = test.more ? "more" : "less";
    std::string which = "the nearest";
    if (ahead > 0) which = test.more ? "the most" : "the least";
    const Ratio shown = test.more ? inverse(nearest.ratio) : nearest.ratio;
    return fmt::format("{} {} of {} have {} than {}, {} {} ({} times)", system,
                       ahead == 0 ? "none" : std::to_string(ahead), others.size(), what, mine, which, nearest.name,
                       shown.is_range() ? range_text(shown) : interval_text(shown.value));
  }

  static Ratio inverse(Ratio of) {
    of.value = {1 / of.value.value, 1 / of.value.high, 1 / of.value.low};
    std::tie(of.least, of.most) = std::pair(1 / of.most, 1 / of.least);
    return of;
  }

  const Evidence& evidence_;
};

}  // namespace

Tested test_pairs(const Evidence& evidence, const ClaimTest& test) { return Pairs(evidence).test(test); }

}  // namespace assay
