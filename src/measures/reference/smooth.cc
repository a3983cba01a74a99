// Method: the equations of motion of system.h, integrated by the Bulirsch-Stoer method with step and order control
// (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.9).
#include "measures/reference/smooth.h"

#include <algorithm>

#include <boost/numeric/odeint.hpp>
#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "measures/reference/system.h"
#include "model/joint.h"

namespace assay {
namespace {

using reference::Flat;
using reference::Real;
using reference::System;

// Largest gap of an initial state that is moved onto its equality constraints: rounding of the file's numbers, m or
// rad, and m/s or rad/s.
constexpr Real kLargestGap = 1e-6;

// Steps that are taken before it is told whether there would be too many, and how many are: the dampers of some models
// (1e11 Ns/m, to lock a joint) need so many that no computer ends.
constexpr long long kStepsBeforeJudging = 1000, kMostSteps = 2'000'000;

}  // namespace

std::string smooth_obstacle(const Model& model) {
  if (!model.contacts.empty()) {
    return fmt::format("its {} contact pairs make the motion non-smooth", model.contacts.size());
  }
  std::string dry;
  each_joint(model, [&](const auto& joint) {
    if (dry.empty() && joint.dry_friction != 0) dry = fmt::format("{} '{}'", noun(joint), joint.name);
  });
  if (!dry.empty()) return fmt::format("the dry friction of {} makes the motion non-smooth", dry);
  for (const Tendon& tendon : model.tendons) {
    if (tendon.dry_friction != 0) {
      return fmt::format("the dry friction of tendon '{}' makes the motion non-smooth", tendon.name);
    }
  }
  return "";
}

std::vector<State> smooth_solution(const Model& model, const State& start, const std::vector<double>& times,
                                   const SmoothOptions& options) {
  namespace odeint = boost::numeric::odeint;
  if (const std::string obstacle = smooth_obstacle(model); !obstacle.empty()) {
    throw InputError(fmt::format("model '{}' has no smooth solution: {}{}", model.name, obstacle,
                                 model.contacts.empty() ? "" : "; switch contacts off"));
  }
  System system(model, options.torques);
  const auto derivative = [&](const Flat& y, Flat& dydt, Real t) { system.derivative(y, dydt, t); };
  const Real tolerance = options.tolerance;
  odeint::bulirsch_stoer<Flat, Real> stepper(tolerance, tolerance, 1, 1);

  Flat y = system.flatten(start);
  const System::Gap gap = system.constraint_gap(y);
  const bool met = gap.position <= kLargestGap && gap.velocity <= kLargestGap;  // false for NaN
  if (!met) {
    throw InputError(
        fmt::format("model '{}' has no smooth solution: its initial state is {:.3g} (m or rad) off its equality "
                    "constraints, and moves off them at {:.3g} per second; give it a state that satisfies them",
                    model.name, static_cast<double>(gap.position), static_cast<double>(gap.velocity)));
  }
  system.project(y);
  Real time = start.time, step = 1e-3L;
  const auto check_limits = [&] {
    if (const std::string element = system.violated_limit(y); !element.empty()) {
      throw InputError(fmt::format("model '{}' has no smooth solution beyond {} s: {} reaches its limit there",
                                   model.name, shortest(static_cast<double>(time)), element));
    }
  };
  check_limits();

  std::vector<State> states;
  long long taken = 0;  // steps, and tries
  for (const double target : times) {
    if (target < static_cast<double>(time)) {
      throw InputError(fmt::format("time {} of a smooth solution comes after {}: times must ascend from the start's",
                                   shortest(target), shortest(static_cast<double>(time))));
    }
    int rejected = 0;
    while (time < target) {
      if (++taken == kStepsBeforeJudging) {
        const Real passed = time - static_cast<Real>(start.time), whole = times.back() - static_cast<Real>(start.time);
        if (whole * taken > passed * kMostSteps) {
          throw InputError(
              fmt::format("model '{}': the smooth solution would take {:.1g} steps, because springs or dampers are "
                          "stiff: `assay check` "
                          "names the stiffest joint; make it softer, or fix it",
                          model.name, static_cast<double>(whole / passed * taken)));
        }
      }
      Real next = std::min<Real>(step, target - time);
      const bool last = next == target - time;
      const Real before = step;
      if (stepper.try_step(derivative, y, time, next) == odeint::success) {
        rejected = 0;
        if (last) time = target;                      // without leftover rounding
        step = last ? std::max(before, next) : next;  // a step shortened to reach a target is no estimate for the next
        check_limits();
      } else {
        step = next;
        if (++rejected > 100 || step < 1e-14L) {
          throw InputError(
              fmt::format("model '{}': the smooth solution stops at {} s, where no step keeps an error of {}",
                          model.name, shortest(static_cast<double>(time)), shortest(options.tolerance)));
        }
      }
    }
    states.push_back(system.unflatten(y, target));
  }
  return states;
}

State smooth_solution(const Model& model, const State& start, double time, const SmoothOptions& options) {
  return smooth_solution(model, start, std::vector<double>{time}, options).front();
}

}  // namespace assay
