#include "explain/explain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"

namespace assay {
namespace {

constexpr int kFirstStarts = 3;      // of swaps of which there are many
constexpr double kWorthMore = 0.05;  // share from these that is worth the other starts
constexpr size_t kMostSteps = 6;     // that are tried for the advice
constexpr double kClosed = 0.01;     // of the gap, left: nothing more to look for
constexpr double kExplainedPart = 0.1;
constexpr double kTie = 1e-3;

// Equal sides are run twice: what repeats differently in an engine is a gap.
std::string key_of(const Side& side) {
  std::string key = fmt::format("{}\n{}", side.name, side.contender);
  for (const auto& [name, value] : side.overrides) key += fmt::format("\n{}={}", name, value);
  return key + "\n\n" + join(change_texts(side.changes), "\n");
}

class Explainer {
 public:
  Explainer(const Pairing& pairing, const MakeRuns& run, const ExplainOptions& options)
      : pairing_(pairing), run_(run), options_(options) {}

  Explanation explain(const std::function<std::vector<Swap>()>& swaps) {
    Explanation found;
    compare(found);
    found.remaining = found.gap;
    if (found.gap.value <= options_.tolerance) return found;
    measure(swaps(), found);
    find_concerned(found);
    advise(found);
    judge(found);
    return found;
  }

 private:
  // Runs those of `sides` that have not been run yet.
  void ensure(const std::vector<Side>& sides) {
    std::vector<Side> missing;
    for (const Side& side : sides) {
      if (sets_.emplace(key_of(side), RunSet()).second) missing.push_back(side);
    }
    if (missing.empty()) return;
    std::vector<RunSet> made = run_(missing, options_.starts);
    for (size_t i = 0; i < missing.size(); ++i) sets_[key_of(missing[i])] = std::move(made[i]);
  }
  const RunSet& runs(const Side& side) const { return sets_.at(key_of(side)); }

  std::vector<double> gaps(const RunSet& a, const RunSet& b, size_t starts) const {
    std::vector<double> found;
    found.reserve(starts);
    for (size_t i = 0; i < starts; ++i) {
      found.push_back(gap_of(gap_curve(a.tracks[i], b.tracks[i], options_.samples), windows_[i]));
    }
    return found;
  }
  std::vector<double> gaps(const Side& a, const Side& b) const { return gaps(runs(a), runs(b), windows_.size()); }

  // The pair as it is, and each side beside itself at half the timestep.
  void compare(Explanation& found) {
    const std::vector<RunChange> half = {{ChangeKind::kTimestep, "", "0.5"}};
    const Side half_a = pairing_.a.with(half), half_b = pairing_.b.with(half);
    ensure({pairing_.a, pairing_.b, half_a, half_b});
    for (const Side* side : {&pairing_.a, &pairing_.b}) {
      if (const RunSet& set = runs(*side); !set.failure.empty()) {
        throw EngineError(fmt::format("{} cannot be compared: {}", side->contender, set.failure));
      }
    }
    const RunSet &a = runs(pairing_.a), &b = runs(pairing_.b);
    for (size_t i = 0; i < a.tracks.size(); ++i) {
      const std::vector<double> curve = gap_curve(a.tracks[i], b.tracks[i], options_.samples);
      // where both end at the same sample, as two equal runs do that blow up, nothing is known of what follows
      const bool together = a.tracks[i].samples() == b.tracks[i].samples();
      const size_t known = together ? std::clamp<size_t>(a.tracks[i].samples(), 2, curve.size()) : curve.size();
      windows_.push_back(gap_window(std::span(curve).first(known)));
      if (std::ranges::max(std::span(curve).first(windows_.back())) >= kFarMetres) ++found.parted;
    }
    found.gaps = gaps(pairing_.a, pairing_.b);
    found.gap = bootstrap_mean(found.gaps, options_.seed);
    found.early_a = a.early, found.early_b = b.early;
    found.fall_rate_a = a.fall_rate;
    found.fall_rate_b = b.fall_rate;
    for (const auto& [side, finer] : {std::pair(&pairing_.a, &half_a), std::pair(&pairing_.b, &half_b)}) {
      if (!runs(*finer).failure.empty()) continue;
      found.timestep_gap = std::max(found.timestep_gap, mean(gaps(*side, *finer)));
    }
  }

  SwapResult result_of(const Swap& swap, const RunSet& a, const RunSet& b, const Explanation& found) const {
    SwapResult result;
    result.swap = swap;
    result.failure = a.failure.empty() ? b.failure : a.failure;
    if (!result.failure.empty()) return result;
    const size_t starts = std::min({a.tracks.size(), b.tracks.size(), windows_.size()});
    const std::vector<double> after = gaps(a, b, starts);
    result.starts = static_cast<int>(starts);
    result.gap = bootstrap_mean(after, options_.seed);
    result.share = share_closed(std::span(found.gaps).first(starts), after, options_.seed);
    result.fall_rate_a = a.fall_rate;
    result.fall_rate_b = b.fall_rate;
    return result;
  }

  void measure(const std::vector<Swap>& swaps, Explanation& found) {
    const auto put = [&](SwapResult result) {
      (result.swap.is_advice() ? found.causes : found.where).push_back(std::move(result));
    };
    std::vector<const Swap*> all;
    std::vector<Swap> many;
    for (const Swap& swap : swaps) {
      if (swap.many && options_.starts > kFirstStarts) {
        many.push_back(swap);
      } else {
        all.push_back(&swap);
      }
    }
    for (SwapResult& result : first_starts(many, found)) {
      const bool more = result.failure.empty() && result.share.value > kWorthMore;
      const auto own = std::ranges::find(many, result.swap.words, &Swap::words);
      if (more && own != many.end()) {
        all.push_back(&*own);
      } else {
        put(std::move(result));
      }
    }
    std::vector<Side> sides;
    for (const Swap* swap : all) {
      sides.push_back(pairing_.a.with(swap->a));
      sides.push_back(pairing_.b.with(swap->b));
    }
    ensure(sides);
    for (size_t i = 0; i < all.size(); ++i) {
      put(result_of(*all[i], runs(sides[2 * i]), runs(sides[(2 * i) + 1]), found));
    }
    // of equal shares the simpler swap; those that failed last
    const auto rank = [](const SwapResult& result) {
      const double share = result.failure.empty() ? std::round(result.share.value / kTie) : -1e9;
      return std::pair(-share, result.swap.a.size() + result.swap.b.size());
    };
    for (std::vector<SwapResult>* list : {&found.causes, &found.where}) std::ranges::stable_sort(*list, {}, rank);
  }

  std::vector<SwapResult> first_starts(const std::vector<Swap>& swaps, const Explanation& found) const {
    std::vector<Side> sides;
    for (const Swap& swap : swaps) {
      if (!swap.a.empty()) sides.push_back(pairing_.a.with(swap.a));
      if (!swap.b.empty()) sides.push_back(pairing_.b.with(swap.b));
    }
    if (sides.empty()) return {};
    const std::vector<RunSet> made = run_(sides, kFirstStarts);
    std::vector<SwapResult> results;
    size_t next = 0;
    for (const Swap& swap : swaps) {
      const RunSet& a = swap.a.empty() ? runs(pairing_.a) : made[next++];
      const RunSet& b = swap.b.empty() ? runs(pairing_.b) : made[next++];
      results.push_back(result_of(swap, a, b, found));
    }
    return results;
  }

  void find_concerned(Explanation& found) const {
    constexpr double kMost = 0.5;  // of the gap
    std::array<bool, 2> any = {false, false};
    for (const KnownDeviation& each : options_.known) {
      const auto shows = [&](const SwapResult& result) {
        return result.closes() && result.share.value >= kMost &&
               std::ranges::find(each.causes, result.swap.cause) != each.causes.end();
      };
      if (std::ranges::none_of(found.causes, shows) && std::ranges::none_of(found.where, shows)) continue;
      found.concerned.push_back(each);
      any.at(each.in_b ? 1 : 0) = true;
    }
    if (any[0] != any[1]) found.wrong_is_b = any[1];
  }

  // Whether a swap changes only the side that is right.
  static bool spoils(const Explanation& found, const Swap& swap) {
    if (!found.wrong_is_b) return false;
    return *found.wrong_is_b ? swap.b.empty() && !swap.a.empty() : swap.a.empty() && !swap.b.empty();
  }

  // Adds swaps in the order of their shares, and keeps those that close more of what the ones before them leave.
  void advise(Explanation& found) {
    std::vector<double> left = found.gaps;
    Side a = pairing_.a, b = pairing_.b;
    std::vector<std::string> kept;
    size_t tried = 0;
    for (size_t i = 0; i < found.causes.size() && tried < kMostSteps; ++i) {
      const SwapResult& result = found.causes[i];
      if (!result.closes() || std::ranges::find(kept, result.swap.cause) != kept.end()) continue;
      if (spoils(found, result.swap)) continue;
      if (mean(left) <= std::max(options_.tolerance, kClosed * found.gap.value)) break;
      ++tried;
      const Side next_a = a.with(result.swap.a), next_b = b.with(result.swap.b);
      try {
        static_cast<void>(recipe_of(next_a)), static_cast<void>(recipe_of(next_b));
      } catch (const InputError&) {
        continue;  // a setting of a contender that another swap has taken away
      }
      ensure({next_a, next_b});
      if (!runs(next_a).failure.empty() || !runs(next_b).failure.empty()) continue;
      const std::vector<double> after = gaps(next_a, next_b);
      const bool more = mean(left) - mean(after) >= SwapResult::kLeastShare * found.gap.value;
      if (!more || share_closed(left, after, options_.seed).low <= 0) continue;
      left = after, a = next_a, b = next_b;
      kept.push_back(result.swap.cause);
      found.advice.push_back({i, share_closed(found.gaps, left, options_.seed)});
    }
    found.remaining = bootstrap_mean(left, options_.seed);
  }

  static void judge(Explanation& found) {
    constexpr double kShrinks = 0.25, kDecides = 0.5;
    double best = 0;
    bool shrinks = false;
    for (const SwapResult& result : found.causes) {
      if (!result.failure.empty()) continue;
      const bool both = !result.swap.a.empty() && !result.swap.b.empty();
      if (result.swap.cause != kTimestepCause) {
        best = std::max(best, result.share.low);
      } else if (both) {
        shrinks = result.share.low > kShrinks;
      }
    }
    if (shrinks && best < kDecides && found.gap.value <= found.timestep_gap) {
      found.verdict = GapVerdict::kTimestepAlone;
    } else if (found.advice.empty()) {
      found.verdict = GapVerdict::kUnexplained;
    } else {
      const bool all = found.remaining.value <= kExplainedPart * found.gap.value;
      found.verdict = all ? GapVerdict::kExplained : GapVerdict::kPartlyExplained;
    }
  }

  const Pairing& pairing_;
  const MakeRuns& run_;
  const ExplainOptions& options_;
  std::map<std::string, RunSet> sets_;
  std::vector<size_t> windows_;  // by start, of the pair as it is
};

}  // namespace

std::string gap_verdict_text(GapVerdict verdict) {
  switch (verdict) {
    case GapVerdict::kNoDifference:
      return "no difference";
    case GapVerdict::kTimestepAlone:
      return "no difference beyond the timestep";
    case GapVerdict::kExplained:
      return "explained";
    case GapVerdict::kPartlyExplained:
      return "partly explained";
    case GapVerdict::kUnexplained:
      break;
  }
  return "unexplained";
}

Explanation explain(const Pairing& pairing, const std::function<std::vector<Swap>()>& swaps, const MakeRuns& run,
                    const ExplainOptions& options) {
  return Explainer(pairing, run, options).explain(swaps);
}

}  // namespace assay
