// Rebound of an impact: with what part of its speed a ball leaves a plane that it should not bounce from. No model of
// assay has a restitution, so any rebound is the engine's: it pushes out what has sunk in during the step of the
// impact. Formula: docs/methodology.md, "Rebound".
#pragma once

#include <optional>
#include <vector>

#include "measures/measure.h"
#include "model/model.h"

namespace assay {

// Half of the least thickness of a shape of a moving body that can touch another, m; infinite where there is none.
double least_half_thickness(const Model& system);

// Balls that reach a plane at 1 m/s, each at another phase of a step, without gravity, until the last ball has had its
// impact and a time to leave. At a system's own scale: balls of the size and mass of its smallest colliding shape and
// that one's body. Empty when no moving body can touch anything, and when a ball would move by more than its radius in
// a step.
std::optional<Experiment> impact_experiment(const Model& system, double timestep_s);

// The largest speed away from the plane of any ball in any state, over the speed of the impact.
double rebound(const std::vector<State>& states);

}  // namespace assay
