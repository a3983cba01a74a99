#include "measures/contact_truth.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>

namespace assay {
namespace {

// Between state number `i` and the one before, above and below the level.
double fall_before(const EventWatch& watch, const std::vector<State>& states, size_t i) {
  const State &before = states[i - 1], &after = states[i];
  const double a = watch.number(before), b = watch.number(after), h = after.time - before.time;
  if (watch.place && a - b > watch.level) {
    // x_b - x_a = a s + b (h - s)
    const double way = watch.place(after) - watch.place(before);
    return before.time + std::clamp((way - b * h) / (a - b), 0.0, h);
  }
  // as it fell until then: at the event its slope may change
  const double fell = i < 2 ? 0 : (watch.number(states[i - 2]) - a) / (before.time - states[i - 2].time);
  if (fell * h > a - watch.level) return before.time + (a - watch.level) / fell;
  return before.time + h * (a - watch.level) / (a - b);
}

// Of the forces that are not known, from the start to each state, N s.
std::vector<Vec3> impulses_until(const SolutionImpulse& of, const std::vector<State>& states) {
  std::vector<Vec3> until = {Vec3::Zero()};
  const Vec3 start = of.momentum(states.front());
  Vec3 known = Vec3::Zero(), force = of.known_forces(states.front());
  for (size_t i = 1; i < states.size(); ++i) {
    const Vec3 next = of.known_forces(states[i]);
    known += (states[i].time - states[i - 1].time) / 2 * (force + next);
    force = next;
    until.emplace_back(of.momentum(states[i]) - start - known);
  }
  return until;
}

// Between one mark and the next.
std::vector<Vec3> impulses_between(const SolutionImpulse& of, const std::vector<State>& states) {
  const std::vector<Vec3> until = impulses_until(of, states);
  const auto at = [&](double time) -> Vec3 {
    const auto after = std::ranges::lower_bound(states, time, {}, &State::time);
    if (after == states.begin()) return until.front();
    if (after == states.end()) return until.back();
    const auto i = static_cast<size_t>(after - states.begin());
    const double part = (time - states[i - 1].time) / (states[i].time - states[i - 1].time);
    return until[i - 1] + part * (until[i] - until[i - 1]);
  };
  std::vector<Vec3> between;
  for (size_t k = 0; k + 1 < of.marks.size(); ++k) between.emplace_back(at(of.marks[k + 1]) - at(of.marks[k]));
  return between;
}

}  // namespace

std::optional<double> event_time(const EventWatch& watch, const std::vector<State>& states, double from) {
  const auto above = [&](const State& state) { return watch.number(state) > watch.level; };
  const auto start = std::ranges::lower_bound(states, from, {}, &State::time);
  if (watch.for_good) {
    for (auto last = states.end(); last != start;) {
      --last;
      if (!above(*last)) continue;
      const auto below = static_cast<size_t>(last - states.begin()) + 1;
      return below == states.size() ? std::nullopt : std::optional(fall_before(watch, states, below));
    }
    return start == states.end() ? std::nullopt : std::optional(start->time);
  }
  const auto first = std::find_if(start, states.end(), above);
  const auto fallen = std::find_if_not(first, states.end(), above);
  if (fallen == states.end()) return std::nullopt;
  return fall_before(watch, states, static_cast<size_t>(fallen - states.begin()));
}

EventErrors event_errors(const std::vector<SolutionEvent>& events, const std::vector<State>& states) {
  constexpr double kMsPerS = 1e3;
  assert(!states.empty());
  EventErrors errors;
  std::map<int, double> done;  // until when, of each chain
  for (const SolutionEvent& event : events) {
    const EventWatch& watch = event.watch;
    const auto before = done.find(watch.chain);
    const bool follows = watch.chain >= 0 && before != done.end();
    const auto time = event_time(watch, states, follows ? before->second : states.front().time);
    // after one that never happens the next is looked for from when it should have
    if (watch.chain >= 0) done[watch.chain] = time.value_or(event.time);
    if (!time) {
      ++errors.missed;
      continue;
    }
    const double late = kMsPerS * (*time - watch.falls_at);
    errors.largest = std::max(errors.largest, std::abs(late));
    errors.mean += (late - errors.mean) / ++errors.found;
  }
  return errors;
}

ImpulseErrors impulse_errors(const std::vector<SolutionImpulse>& impulses, const std::vector<State>& truth,
                             const std::vector<State>& states) {
  // A part of this share of the whole is rounding.
  constexpr double kNone = 1e-9;
  assert(states.size() >= 2 && truth.size() == states.size());
  ImpulseErrors errors;
  for (const SolutionImpulse& each : impulses) {
    const std::vector<Vec3> right = impulses_between(each, truth), found = impulses_between(each, states);
    double size[2] = {}, off[2] = {};
    for (size_t k = 0; k < right.size(); ++k) {
      const auto add = [&](double* to, const Vec3& impulse) {
        const double normal = impulse.dot(each.normal);
        to[0] += normal * normal;
        to[1] += (impulse - normal * each.normal).squaredNorm();
      };
      add(size, right[k]);
      add(off, found[k] - right[k]);
    }
    const auto count = [&](int part, std::optional<double>& error) {
      if (size[part] <= kNone * kNone * (size[0] + size[1])) return;
      error = std::max(error.value_or(0), std::sqrt(off[part] / size[part]));
    };
    count(0, errors.normal);
    count(1, errors.tangential);
  }
  return errors;
}

}  // namespace assay
