// What fails at large timesteps.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/text.h"
#include "claims/judge.h"
#include "claims/text.h"

namespace assay {
namespace {

// What the test asks for.
constexpr const char* kNeeded = "instability at a larger timestep";

class Unstable {
 public:
  explicit Unstable(const Evidence& evidence) : evidence_(evidence) {}

  Tested test(const ClaimTest& test) const {
    Tested tested;
    tested.truth = Truth::kYes;
    std::vector<std::string> sentence, today;
    for (const std::string& system : test.systems) {
      std::vector<std::string> parts;
      for (const std::string& who : test.who) {
        using Own = std::pair<std::string, Range>;
        std::vector<Own> own;
        for (const std::string& each : evidence_.stand_ins(who))
          own.emplace_back(each, range(system, each, test.value));
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
          tested.now.push_back(
              {Truth::kNo, 1, fmt::format("{} is unstable at every timestep on {}", who, system), kNeeded});
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
        tested.now.push_back({fails ? Truth::kYes : Truth::kNo, 1,
                              fmt::format("{} is {} on {}", who, parts.back().substr(who.size() + 1), system),
                              kNeeded});
        tested.keys.push_back(
            fmt::format("{} {} {} ms", who, fails ? "up to" : "all up to", timestep_label(found.good_ms)));
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
  struct Range {
    Found found = Found::kMissing;  // kFailed: does not end well at some timestep
    std::string why;
    double good_ms = 0;  // the largest below the first failure; 0: none
    double bad_ms = 0;   // the smallest above it that fails
  };

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
