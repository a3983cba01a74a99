#include "worker/stepper.h"

#include <algorithm>
#include <stdexcept>

#include "base/errors.h"

namespace assay {
namespace {

// An engine's InputError or SystemError is the engine's failure, not the user's or the machine's, and must not end the
// campaign.
template <typename Work>
void engines_own(const Work& work) {
  try {
    work();
  } catch (const InputError& error) {
    throw std::runtime_error(error.what());
  } catch (const SystemError& error) {
    throw std::runtime_error(error.what());
  }
}

}  // namespace

Stepper::Stepper(const Subject& subject, const State& start, double timestep_s)
    : subject_(subject), timestep_s_(timestep_s), torques_(subject.model.joints.size(), 0.0) {
  Settings settings = subject.contender.settings;
  settings.timestep = timestep_s;
  engines_own([&] {
    simulation_ = subject.contender.engine->create(subject.model, start, settings);
    simulation_->read_state(state_);
  });
}

void Stepper::advance(long long steps) {
  engines_own([&] { take(steps); });
}

void Stepper::take(long long steps) {
  constexpr long long kMostAtOnce = 1 << 30;
  while (steps > 0) {
    const long long count = subject_.free_running ? std::min(steps, kMostAtOnce) : 1;
    if (!subject_.free_running) {
      if (subject_.control->input() != ControlInput::kNothing) simulation_->read_state(state_);
      torques_of_step(*subject_.control, state_, timestep_s_, torques_);
      simulation_->set_torques(torques_);
    }
    const Clock::time_point start = Clock::now();
    simulation_->advance(static_cast<int>(count));
    engine_s_ += seconds_since(start);
    ++clock_reads_;
    steps -= count;
  }
}

const State& Stepper::read() {
  engines_own([&] { simulation_->read_state(state_); });
  return state_;
}

}  // namespace assay
