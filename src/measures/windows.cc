#include "measures/windows.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace assay {
namespace {

constexpr long long kFewestSteps = 4;    // of a stratum: shorter ones say more of the clock than of the step
constexpr long long kUntimedShare = 50;  // untimed steps at the start of a continuous run: at most one in so many

std::vector<TimingWindow> continuous(const WindowLayout& layout, long long steps, long long count) {
  const double timestep_s = 1e-3 * layout.timestep_ms;
  const long long untimed = std::min<long long>(layout.warmup, steps / kUntimedShare), timed = steps - untimed;
  std::vector<TimingWindow> windows;
  for (long long k = 0; k < count; ++k) {
    const long long begin = timed * k / count, end = timed * (k + 1) / count;
    windows.push_back({k == 0 ? 0 : -1, k == 0 ? untimed : 0, end - begin,
                       timestep_s * static_cast<double>(untimed + begin),
                       static_cast<double>(end - begin) / static_cast<double>(timed)});
  }
  return windows;
}

}  // namespace

std::vector<TimingWindow> timing_windows(const WindowLayout& layout) {
  assert(layout.duration_s > 0 && layout.timestep_ms > 0 && layout.sample_ms > 0 && layout.share > 0);
  const double timestep_s = 1e-3 * layout.timestep_ms, sample_s = 1e-3 * layout.sample_ms;
  const long long steps = std::max(1LL, std::llround(layout.duration_s / timestep_s));
  const long long states = std::max(1LL, std::llround(layout.duration_s / sample_s));  // without the run's last one
  const auto wanted = static_cast<long long>(layout.windows);
  if (layout.share >= 1 && !layout.restart) {
    return continuous(layout, steps, std::clamp(std::min(wanted, steps / kFewestSteps), 1LL, steps));
  }
  const long long count = std::max(1LL, std::min({wanted, steps / kFewestSteps, states}));
  const double stratum_s = layout.duration_s / static_cast<double>(count);
  const double share = std::min(1.0, layout.share);
  const long long timed = std::max(1LL, std::llround(std::floor(share * stratum_s / timestep_s + 1e-9)));
  std::vector<TimingWindow> windows;
  for (long long k = 0; k < count; ++k) {
    const double begin_s =
        std::max(0.0, (static_cast<double>(k) + 0.5) * stratum_s - 0.5 * static_cast<double>(timed) * timestep_s);
    // at the run's start there is no room: what is cold there is so in every run
    const auto before = static_cast<long long>(begin_s / timestep_s + 1e-9);
    const long long untimed = std::min<long long>(layout.warmup, before);
    const double from_s = begin_s - static_cast<double>(untimed) * timestep_s;
    long long state = std::clamp(std::llround(from_s / sample_s), 0LL, states - 1);
    const double length_s = static_cast<double>(untimed + timed) * timestep_s;
    while (state > 0 && static_cast<double>(state) * sample_s + length_s > layout.duration_s * (1 + 1e-9)) --state;
    windows.push_back({state, untimed, timed,
                       static_cast<double>(state) * sample_s + static_cast<double>(untimed) * timestep_s,
                       1.0 / static_cast<double>(count)});
  }
  return windows;
}

double coverage(const std::vector<TimingWindow>& windows, const WindowLayout& layout) {
  const auto steps = std::accumulate(windows.begin(), windows.end(), 0LL,
                                     [](long long sum, const TimingWindow& each) { return sum + each.steps; });
  return static_cast<double>(steps) * 1e-3 * layout.timestep_ms / layout.duration_s;
}

TimingShare timing_share(std::span<const double> run_s, double turn_s, int rounds, std::optional<double> given) {
  assert(turn_s > 0 && rounds > 0);
  constexpr double kLongTurn = 4;  // a contender whose turn takes more than so many of the mean's gets fewer rounds
  constexpr double kSmallest = 0x1p-24;
  TimingShare found;
  const double budget_s = turn_s * rounds * static_cast<double>(run_s.size());
  for (found.share = given.value_or(1);; found.share *= 0.5) {
    double spent_s = 0;
    found.rounds.clear();
    for (const double whole_s : run_s) {
      const double own_s = found.share * whole_s;
      const double fitting = own_s > 0 ? kLongTurn * turn_s / own_s * rounds : rounds;
      found.rounds.push_back(static_cast<int>(std::clamp(fitting, 1.0, static_cast<double>(rounds))));
      spent_s += own_s * found.rounds.back();
    }
    if (given || spent_s <= budget_s || found.share <= kSmallest) break;
  }
  return found;
}

}  // namespace assay
