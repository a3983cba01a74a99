// Verdicts on claims.
#include "results/claims/judge.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include <fmt/format.h>

#include "base/text.h"
#include "results/claims/claims.h"

namespace assay {
namespace {

Verdict verdict_of(Truth truth) {
  switch (truth) {
    case Truth::kYes:
      return Verdict::kHolds;
    case Truth::kNo:
      return Verdict::kChanged;
    case Truth::kUnsettled:
      return Verdict::kNotSettled;
    case Truth::kUnknown:
      break;
  }
  return Verdict::kNotMeasurable;
}

Tested tested_by(const Evidence& evidence, const ClaimTest& test) {
  switch (test.kind) {
    case ClaimTest::Kind::kAtTimestep:
    case ClaimTest::Kind::kEqualSpeed:
      return test_pairs(evidence, test);
    case ClaimTest::Kind::kValue:
    case ClaimTest::Kind::kSlope:
      return test_values(evidence, test);
    case ClaimTest::Kind::kUnstable:
      return test_unstable(evidence, test);
    case ClaimTest::Kind::kLargestStep:
      return test_largest_step(evidence, test);
    case ClaimTest::Kind::kOrder:
      return test_order(evidence, test);
  }
  return {};
}

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

// What decides the verdict, in a sentence: of what holds the part that is nearest to its threshold, of what does not
// hold all parts.
void say_now(std::vector<Now> all, Truth truth, Judgement& judgement) {
  constexpr size_t kMost = 3;
  std::erase_if(all, [&](const Now& now) { return now.truth != truth || now.text.empty(); });
  if (all.empty()) return;
  std::ranges::stable_sort(all, {}, &Now::margin);
  if (truth == Truth::kYes) all.resize(1);
  std::vector<std::string> texts, thresholds;
  for (const Now& now : all) {
    if (texts.size() < kMost) texts.push_back(now.text);
    if (std::ranges::find(thresholds, now.threshold) == thresholds.end()) thresholds.push_back(now.threshold);
  }
  judgement.now = std::string(kNow) + join(texts, "; ");
  if (all.size() > kMost) judgement.now += fmt::format("; and {} more", all.size() - kMost);
  judgement.now += ".";
  judgement.threshold = join(thresholds, "; ");
}

}  // namespace

Truth judged(const ClaimBound& bound, const Interval& value) {
  bool inside = false, outside = false;  // the whole interval
  switch (bound.kind) {
    case ClaimBound::Kind::kAbove:
      inside = value.low > bound.x;
      outside = value.high <= bound.x;
      break;
    case ClaimBound::Kind::kBelow:
      inside = value.high < bound.x;
      outside = value.low >= bound.x;
      break;
    case ClaimBound::Kind::kBetween:
      inside = value.low >= bound.x && value.high <= bound.y;
      outside = value.high < bound.x || value.low > bound.y;
      break;
    case ClaimBound::Kind::kNotAbove:
      inside = value.high <= bound.x;
      outside = value.low > bound.x;
      break;
  }
  if (inside) return Truth::kYes;
  return outside ? Truth::kNo : Truth::kUnsettled;
}

double margin_to(const ClaimBound& bound, double value) {
  const auto factor = [&](double end) {
    if (!(value > 0) || !(end > 0)) return 1 + std::abs(value - end);
    return std::max(value / end, end / value);
  };
  return bound.kind == ClaimBound::Kind::kBetween ? std::min(factor(bound.x), factor(bound.y)) : factor(bound.x);
}

const std::vector<std::string>& Evidence::stand_ins(const std::string& engine) const {
  const auto found = std::ranges::find(file.engines, engine, &std::pair<std::string, std::vector<std::string>>::first);
  assert(found != file.engines.end());
  return found->second;
}

std::vector<Judgement> judge(const ClaimsFile& file, const Results& results) {
  const Ratios ratios(results);
  const Evidence evidence{file, results, ratios};
  std::vector<Judgement> judgements;
  for (const Claim& claim : file.claims) {
    Judgement judgement;
    judgement.claim = claim;
    Truth truth = Truth::kYes;
    std::vector<Sentence> summary, today;
    std::vector<std::string> keys, reasons;
    std::vector<Now> now;
    const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    for (const ClaimTest& test : claim.tests) {
      Tested tested = tested_by(evidence, test);
      truth = std::min(truth, tested.truth);
      append(summary, tested.summary);
      append(today, tested.today);
      append(keys, tested.keys);
      append(reasons, tested.reasons);
      append(now, tested.now);
      judgement.figures.insert(judgement.figures.end(), std::make_move_iterator(tested.figures.begin()),
                               std::make_move_iterator(tested.figures.end()));
    }
    judgement.verdict = verdict_of(truth);
    say_now(std::move(now), truth, judgement);
    judgement.summary = text_of(summary);
    judgement.today = text_of(today);
    judgement.key = join(keys, "; ");
    if (judgement.verdict == Verdict::kNotMeasurable) judgement.reason = reasons_text(reasons);
    judgements.push_back(std::move(judgement));
  }
  return judgements;
}

}  // namespace assay
