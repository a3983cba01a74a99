// The reference solution of smooth systems: an error-controlled, high-order solution of the equations of motion that
// shares no code with any engine. It has its own forward dynamics (projected Newton-Euler equations in joint
// coordinates) in extended precision, so its error is the rounding of the doubles that it takes and returns.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "model/model.h"

namespace assay {

struct SmoothOptions {
  // Local error per step, absolute and relative to each coordinate. Extended precision cannot reach much below 1e-17.
  double tolerance = 1e-15;

  // Torques of hinges (Nm) and forces of slides (N) as a function of time and joint coordinates; none when empty. The
  // function has to be smooth: an input that is held during a timestep makes another system.
  std::function<void(double time, std::span<const double> position, std::span<const double> velocity,
                     std::span<double> torque)>
      torques;
};

// Why the model has no smooth solution, as a sentence; empty when it has one. Limits are allowed: smooth_solution()
// throws when a joint or tendon reaches one. A tendon's rest range is too: the error control finds its ends.
std::string smooth_obstacle(const Model& model);

// States at `times` (s, ascending, none before start.time) of the motion that starts in `start`. Covers all joints in
// any order, massless bodies, gravity, springs, dampers and armature, and equality constraints, which it holds exactly.
// Throws InputError for contact pairs, dry friction, a limit that is reached, a start more than 1e-6 (m, rad) off the
// equality constraints, when the error control fails, and for motions so stiff that millions of steps would not do.
std::vector<State> smooth_solution(const Model& model, const State& start, const std::vector<double>& times,
                                   const SmoothOptions& options = {});

// The same for one time.
State smooth_solution(const Model& model, const State& start, double time, const SmoothOptions& options = {});

}  // namespace assay
