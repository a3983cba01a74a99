#include "run/worker/stepper.h"

#include <algorithm>
#include <cmath>
#include <new>

#include <fmt/format.h>

#include "base/errors.h"
#include "isolate/machine_lack.h"
#include "model/state_faults.h"
#include "run/worker/failures.h"

namespace assay {

void examine_state(const State& state, const Model& model, double start_s, double timestep_s, long long steps) {
  if (const std::string fault = state_shape_fault(state, model.bodies.size(), model.joints.size()); !fault.empty()) {
    throw AdapterFault(fmt::format("the engine gave {}", fault));
  }
  if (const std::string fault = state_value_fault(state, &model); !fault.empty()) {
    throw EngineError(fmt::format("the engine gave {}", fault));
  }
  if (const std::string fault = state_time_fault(state, start_s, timestep_s, steps); !fault.empty()) {
    throw AdapterFault(fmt::format("the engine gave {}", fault));
  }
}

Stepper::Stepper(const Subject& subject, const State& start, double timestep_s)
    : subject_(subject),
      control_(subject.control->start(timestep_s)),
      torques_(subject.model.joints.size(), 0.0),
      start_s_(start.time),
      timestep_s_(timestep_s) {
  create(start);
}

void Stepper::create(const State& start) {
  Settings settings = subject_.contender.settings;
  settings.timestep = timestep_s_;
  jobs::engines_own([&] {
    try {
      simulation_ = subject_.contender.engine->create(subject_.model, start, settings);
    } catch (const EngineError& error) {
      if (!machine_lack(error).empty()) throw std::bad_alloc();
      throw;
    }
  });
  read_state();
}

void Stepper::restart(State from) {
  start_s_ += timestep_s_ * static_cast<double>(steps_);
  steps_ = 0;
  from.time = start_s_;
  simulation_.reset();
  create(from);
}

void Stepper::read_state() {
  jobs::engines_own([&] { simulation_->read_state(state_); });
  examine_state(state_, subject_.model, start_s_, timestep_s_, steps_);
}

void Stepper::advance(long long steps) {
  jobs::engines_own([&] { take(steps); });
}

void Stepper::take(long long steps) {
  constexpr long long kMostAtOnce = 1 << 30;
  Clock::time_point end = Clock::now();
  while (steps > 0) {
    const long long count = subject_.free_running ? std::min(steps, kMostAtOnce) : 1;
    if (!subject_.free_running) {
      if (!subject_.engine_drives) {
        if (subject_.control->input() != ControlInput::kNothing) read_state();
        control_->torques(state_, torques_);
      }
      simulation_->set_torques(torques_);
    }
    const Clock::time_point start = Clock::now();
    simulation_->advance(static_cast<int>(count));
    if (!subject_.free_running) input_s_ += std::chrono::duration<double>(start - end).count();
    end = Clock::now();
    engine_s_ += std::chrono::duration<double>(end - start).count();
    ++clock_reads_;
    steps_ += count;
    steps -= count;
  }
}

bool Stepper::keep_contacts() {
  bool kept = false;
  jobs::engines_own([&] { kept = simulation_->keep_contacts(); });
  return kept;
}

void Stepper::read_contacts(std::vector<ContactForce>& out) const {
  jobs::engines_own([&] { simulation_->read_contacts(out); });
  const auto shapes = static_cast<int>(subject_.model.shapes.size());
  for (const ContactForce& contact : out) {
    if (contact.shape_a < 0 || contact.shape_b <= contact.shape_a || contact.shape_b >= shapes) {
      throw AdapterFault(fmt::format("the engine gave a contact of shapes {} and {} where the model has {}",
                                     contact.shape_a, contact.shape_b, shapes));
    }
    if (!contact.p_W.allFinite() || !contact.n_W.allFinite() || !contact.impulse_W.allFinite()) {
      throw EngineError("the engine gave a contact force that is not a finite number");
    }
  }
}

const State& Stepper::read() {
  read_state();
  return state_;
}

}  // namespace assay
