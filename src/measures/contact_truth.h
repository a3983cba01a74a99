// What of a run with contacts is compared with its certified solution beside the places of its bodies: when events
// happen, and which impulses contacts, limits and dry friction give.
#pragma once

#include <optional>
#include <vector>

#include "measures/reference/certified.h"
#include "model/model.h"

namespace assay {

// When the event happens in a run, s: where its number falls below its level. Until then the number goes on as between
// the two states before, or else is linear; one that falls by more than the level within one interval has jumped, at
// the moment that the way between the two states tells. States before `from` do not count. Nothing where it never
// happens.
std::optional<double> event_time(const EventWatch& watch, const std::vector<State>& states, double from);

struct EventErrors {
  int found = 0, missed = 0;
  // Of those that were found, ms; late is positive.
  double largest = 0, mean = 0;
};
EventErrors event_errors(const std::vector<SolutionEvent>& events, const std::vector<State>& states);

// Errors of the impulses' two parts, relative to those of the solution: root of the sum of squares over the intervals
// between marks, the largest over the impulses. Empty where the solution has none.
struct ImpulseErrors {
  std::optional<double> normal, tangential;
};
// `truth` are the solution's states at the times of `states`, which begin at its start and go to its end (assert).
ImpulseErrors impulse_errors(const std::vector<SolutionImpulse>& impulses, const std::vector<State>& truth,
                             const std::vector<State>& states);

}  // namespace assay
