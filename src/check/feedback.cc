#include "check/feedback.h"

#include <cmath>
#include <string_view>

#include <fmt/format.h>

namespace assay {

namespace {
constexpr std::string_view kFeedback = "feedback of actuator";
}  // namespace

std::vector<Limitation> feedback_limitations(const Model& model, const Capabilities& capabilities) {
  std::vector<Limitation> limitations;
  if (capabilities.actuators) return limitations;
  for (const Actuator& actuator : model.actuators) {
    if (!actuator.has_feedback()) continue;
    limitations.push_back({.fidelity = Fidelity::kApproximated,
                           .element = fmt::format("{} '{}'", kFeedback, actuator.name),
                           .how = "explicit torque: from the state at the step's start, held for the step"});
  }
  return limitations;
}

void add_feedback_bound(std::vector<Limitation>& limitations, const StepBounds& bounds) {
  const double largest = bounds.with_feedback.largest;
  if (bounds.singular || !std::isfinite(largest)) return;
  for (Limitation& limitation : limitations) {
    if (!limitation.element.starts_with(kFeedback) || limitation.fidelity != Fidelity::kApproximated) continue;
    limitation.how += fmt::format(
        "; semi-implicit Euler with explicit feedback is stable below {:.3g} ms at the start pose", 1e3 * largest);
  }
}

}  // namespace assay
