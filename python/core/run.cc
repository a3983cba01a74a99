#include "run.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <new>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <nanobind/stl/string.h>

#include "base/errors.h"
#include "engines/plugin_trial.h"
#include "engines/springs.h"
#include "model/body_rows.h"
#include "results/store/trajectory.h"

namespace assay::package {
namespace {

constexpr long long kMostAtOnce = 1 << 30;  // steps in one call of an engine

// Whatever an engine throws is the engine's failure; what it refuses, and a lack of memory, stay what they are.
template <typename Work>
void of_engine(const ResolvedContender& contender, const Work& work) {
  try {
    work();
  } catch (const EngineError&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw EngineError(fmt::format("{} failed: {}", contender.name, error.what()));
  }
}

const char* name_of(Fidelity fidelity) {
  switch (fidelity) {
    case Fidelity::kRefused:
      return "refused";
    case Fidelity::kApproximated:
      return "approximated";
    case Fidelity::kExact:
      break;
  }
  return "exact";
}

// Whether any torque acts. Throws InputError for one that is not finite.
bool act(std::span<const double> torques, const Model& model) {
  bool any = false;
  for (size_t i = 0; i < torques.size(); ++i) {
    any = any || torques[i] != 0;
    if (!std::isfinite(torques[i])) {
      throw InputError(
          fmt::format("the torque of joint '{}' is {}: give finite numbers", model.joints[i].name, torques[i]));
    }
  }
  return any;
}

}  // namespace

const Registry& registry() {
  static const Registry* const loaded = [] {
    const char* more = std::getenv("ASSAY_ENGINE_PATH");
    if (more == nullptr || *more == '\0') trust_plugins();
    return &Registry::instance();
  }();
  return *loaded;
}

ResolvedContender contender_of(const std::string& name, const Texts& settings, double timestep_s) {
  if (!std::isfinite(timestep_s) || timestep_s <= 0) {
    throw InputError(fmt::format("the timestep is {} ms: give a positive number of milliseconds", 1e3 * timestep_s));
  }
  ResolvedContender resolved = registry().resolve(name, settings);
  resolved.settings.timestep = timestep_s;
  return resolved;
}

nb::list limitations(const Model& model, const std::string& contender, const Texts& settings) {
  const ResolvedContender resolved = contender_of(contender, settings, 1e-3);
  nb::list found;
  of_engine(resolved, [&] {
    for (const Limitation& each : resolved.engine->check(model, resolved.settings)) {
      found.append(nb::make_tuple(name_of(each.fidelity), each.element, each.how));
    }
  });
  return found;
}

class Run::Alone {
 public:
  explicit Alone(Run& run) : run_(run) {
    if (run.busy_.test_and_set(std::memory_order_acquire)) {
      throw InputError("another thread uses this simulation just now: give each thread a simulation of its own");
    }
    if (!run.in_python_) unlocked_.emplace();
  }
  ~Alone() { run_.busy_.clear(std::memory_order_release); }
  Alone(const Alone&) = delete;
  Alone& operator=(const Alone&) = delete;

 private:
  Run& run_;
  std::optional<nb::gil_scoped_release> unlocked_;
};

Run::Run(std::shared_ptr<const Model> model, const std::string& contender, const Texts& settings, double timestep_s,
         const std::optional<nb::tuple>& state)
    : model_(std::move(model)),
      contender_(contender_of(contender, settings, timestep_s)),
      in_python_(registry().runs_python(contender_.engine->name())),
      torques_(memory(model_->joints.size())),
      bodies_(memory(kBodyRow * model_->bodies.size())),
      position_(memory(model_->joints.size())),
      velocity_(memory(model_->joints.size())) {
  const State start = state ? state_of(*model_, *state) : model_->initial;
  const Alone alone(*this);
  of_engine(contender_, [&] {
    const Capabilities capabilities = contender_.engine->capabilities(contender_.settings);
    takes_torques_ = capabilities.torques;
    // torques are the user's: no actuator of the model acts
    driven_ = *model_;
    driven_.actuators.clear();
    driven_.control0.clear();
    adds_torques_ = adapter_adds_torques(driven_, capabilities);
    simulation_ = contender_.engine->create(driven_, start, contender_.settings);
  });
  read_state();
}

Array Run::bodies() const { return array_of(bodies_, {model_->bodies.size(), kBodyRow}); }

void Run::take(const double* torques, long long count) {
  const std::span<const double> all(torques, joints());
  const bool acting = act(all, *model_);
  if (acting && !takes_torques_) {
    throw UnsupportedError(fmt::format("{} takes no joint torques", contender_.name));
  }
  of_engine(contender_, [&] {
    if (!acting && !adds_torques_) {
      for (; count > 0; count -= kMostAtOnce) {
        simulation_->advance(static_cast<int>(std::min(count, kMostAtOnce)));
      }
      return;
    }
    for (long long i = 0; i < count; ++i) {
      simulation_->set_torques(all);
      simulation_->advance(1);
    }
  });
}

void Run::step() {
  const Alone alone(*this);
  take(torques_->data(), 1);
}

void Run::step(const nb::object& torques) {
  const Numbers given = numbers_of(torques, "the argument of step()", joints());
  const Alone alone(*this);
  take(given.data(), 1);
}

void Run::advance(long long count) {
  if (count < 0) throw InputError(fmt::format("{} steps were asked for: give a whole number from 0 on", count));
  const Alone alone(*this);
  take(torques_->data(), count);
}

void Run::read_state() {
  of_engine(contender_, [&] { simulation_->read_state(state_); });
  std::string fault = state_shape_fault(state_, model_->bodies.size(), joints());
  if (fault.empty()) fault = state_value_fault(state_);
  if (!fault.empty()) throw EngineError(fmt::format("{} gave {}", contender_.name, fault));
  for (size_t i = 0; i < state_.bodies.size(); ++i) put_body(state_.bodies[i], bodies_->data() + kBodyRow * i);
  std::ranges::copy(state_.position, position_->begin());
  std::ranges::copy(state_.velocity, velocity_->begin());
}

void Run::read() {
  const Alone alone(*this);
  read_state();
}

nb::tuple Run::rollout(long long steps, long long every, const nb::object& torques) {
  if (steps < 1 || every < 1 || steps % every != 0) {
    throw InputError(
        fmt::format("{} steps with a state each {} were asked for: give whole numbers from 1 on, the first a "
                    "multiple of the second",
                    steps, every));
  }
  std::optional<Rows> given;
  if (!torques.is_none()) given = rows_of(torques, "'torques'", static_cast<size_t>(steps), joints());
  const auto count = static_cast<size_t>(steps / every + 1);
  const size_t bodies = bodies_->size();
  const Memory times = memory(count), all_bodies = memory(count * kBodyRow * model_->bodies.size()),
               positions = memory(count * joints()), velocities = memory(count * joints());
  {
    const Alone alone(*this);
    for (size_t i = 0; i < count; ++i) {
      const auto first = static_cast<long long>(i - 1) * every;
      if (i > 0 && !given) take(torques_->data(), every);
      for (long long k = 0; i > 0 && given && k < every; ++k) {
        take(given->data() + static_cast<size_t>(first + k) * joints(), 1);
      }
      read_state();
      (*times)[i] = state_.time;
      if (!model_->bodies.empty()) {
        std::ranges::copy(*bodies_, all_bodies->begin() + static_cast<std::ptrdiff_t>(i * bodies));
      }
      std::copy_n(position_->begin(), joints(), positions->begin() + static_cast<std::ptrdiff_t>(i * joints()));
      std::copy_n(velocity_->begin(), joints(), velocities->begin() + static_cast<std::ptrdiff_t>(i * joints()));
    }
  }
  return nb::make_tuple(array_of(times, {count}), array_of(all_bodies, {count, model_->bodies.size(), kBodyRow}),
                        array_of(positions, {count, joints()}), array_of(velocities, {count, joints()}));
}

}  // namespace assay::package
