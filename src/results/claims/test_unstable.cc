// What fails at large timesteps.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/text.h"
#include "results/claims/judge.h"
#include "results/claims/text.h"

namespace assay {
namespace {

class Unstable {
 public:
  explicit Unstable(const Evidence& evidence) : evidence_(evidence) {}

  Tested test(const ClaimTest& test) const {
    Tested tested;
    tested.truth = Truth::kYes;
    std::vector<std::string> sentence, today;
    for (const std::string& system : test.systems) {
      std::vector<std::string> parts;
      std::map<std::string, Engine> engines;
      for (const std::vector<std::string>& names : {test.who, test.against}) {
        for (const std::string& name : names) {
          if (engines.contains(name)) continue;
          const Engine& each = engines.emplace(name, engine(system, name, test.value)).first->second;
          if (each.range.found == Found::kMissing) {
            tested.truth = std::min(tested.truth, Truth::kUnknown);
            tested.reasons.push_back(each.range.why);
            continue;
          }
          parts.push_back(fmt::format("{} {}", name, words(each.range)));
          if (each.range.good_ms > 0) {
            tested.figures.push_back({name,
                                      each.contender,
                                      system,
                                      each.range.good_ms,
                                      "stable_timestep",
                                      each.range.good_ms,
                                      "ms",
                                      {},
                                      {}});
          }
        }
      }
      for (const std::string& who : test.who) {
        const Range& found = engines.at(who).range;
        if (found.found == Found::kMissing) continue;
        tested.keys.push_back(key_text(who, found));
        if (test.always) {
          judge_one(found.good_ms == 0, who, system, found, "instability at every timestep", tested);
        } else if (test.against.empty()) {
          judge_one(found.found == Found::kFailed && found.good_ms > 0, who, system, found,
                    "instability at a larger timestep", tested);
        }
        for (const std::string& rival : test.against) {
          const Range& theirs = engines.at(rival).range;
          if (theirs.found != Found::kMissing) judge_pair(who, found, rival, theirs, system, tested);
        }
      }
      if (!parts.empty()) sentence.push_back(fmt::format("{}: {}", system, join(parts, ", ")));
      std::vector<std::string> failing;
      int ran = 0;
      for (const std::string& contender : evidence_.results.contenders()) {
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

 private:
  struct Range;

  static std::string words(const Range& range) {
    if (range.good_ms == 0) return "unstable at every timestep";
    if (range.found == Found::kFailed) {
      return fmt::format("stable up to {} ms and not at {} ms", timestep_label(range.good_ms),
                         timestep_label(range.bad_ms));
    }
    return fmt::format("stable at every timestep up to {} ms", timestep_label(range.good_ms));
  }
  static std::string key_text(const std::string& who, const Range& range) {
    if (range.good_ms == 0) return who + " never stable";
    return fmt::format("{} {} {} ms", who, range.found == Found::kFailed ? "up to" : "all up to",
                       timestep_label(range.good_ms));
  }

  static void judge_one(bool holds, const std::string& who, const std::string& system, const Range& range,
                        const char* needed, Tested& tested) {
    const Truth truth = holds ? Truth::kYes : Truth::kNo;
    tested.truth = std::min(tested.truth, truth);
    tested.now.push_back({truth, 1, fmt::format("{} is {} on {}", who, words(range), system), needed});
  }

  // Whether `who` ends before `rival`. Timesteps grow by a factor: of two that end at the same one, nobody knows.
  static void judge_pair(const std::string& who, const Range& mine, const std::string& rival, const Range& theirs,
                         const std::string& system, Tested& tested) {
    const double ends = mine.end_ms(), theirs_ends = theirs.end_ms();
    const bool same = std::isfinite(ends) && std::isfinite(theirs_ends) && same_timestep(ends, theirs_ends);
    Truth truth = ends < theirs_ends ? Truth::kYes : Truth::kNo;
    if (same) truth = Truth::kUnsettled;
    tested.truth = std::min(tested.truth, truth);
    const bool ratio = std::isfinite(ends / theirs_ends) && ends > 0;
    tested.now.push_back({truth, ratio ? std::max(ends / theirs_ends, theirs_ends / ends) : HUGE_VAL,
                          fmt::format("{} is {} on {}, {} {}", who, words(mine), system, rival, words(theirs)),
                          "instability at a smaller timestep than these"});
  }

  struct Range {
    Found found = Found::kMissing;  // kFailed: does not end well at some timestep
    std::string why;
    double good_ms = 0;  // the largest below the first failure; 0: none
    double bad_ms = 0;   // the smallest above it that fails
    // The first timestep that fails; infinite when none does.
    double end_ms() const {
      if (found != Found::kFailed) return HUGE_VAL;
      return good_ms == 0 ? 0 : bad_ms;
    }
  };
  struct Engine {
    std::string contender;
    Range range;
  };

  // Of an engine's contenders the one that goes on for longest.
  Engine engine(const std::string& system, const std::string& name, const std::string& measure) const {
    std::vector<Engine> own;
    for (const std::string& each : evidence_.stand_ins(name)) own.push_back({each, range(system, each, measure)});
    return best_of(std::move(own), [](const Engine& a, const Engine& b) {
      return std::pair(a.range.found, a.range.good_ms) > std::pair(b.range.found, b.range.good_ms);
    });
  }

  Range range(const std::string& system, const std::string& contender, const std::string& measure) const {
    Range range;
    bool failed_from_the_start = false;
    range.why = evidence_.results.why_missing(system, contender, measure);
    for (const Figure& figure : evidence_.results.outcomes(system, contender, measure)) {
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

  const Evidence& evidence_;
};

}  // namespace

Tested test_unstable(const Evidence& evidence, const ClaimTest& test) { return Unstable(evidence).test(test); }

}  // namespace assay
