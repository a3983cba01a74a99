#include "controls/control.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "controls/engine_actuators.h"
#include "controls/hold.h"
#include "controls/policy.h"
#include "controls/torque_file.h"
#include "model/actuator_force.h"
#include "model/kinematics.h"

namespace assay {
namespace {

constexpr std::string_view kPath = ",path=", kConfig = ",config=", kNetwork = ",network=";

// A run of a control without memory.
class StateRun final : public ControlRun {
 public:
  StateRun(const Control& control, double timestep_s) : control_(control), timestep_s_(timestep_s) {}
  void torques(const State& state, std::span<double> torques) override {
    torques_of_step(control_, state, timestep_s_, torques);
  }

 private:
  const Control& control_;
  double timestep_s_;
};

class PassiveControl final : public Control {
 public:
  void torques(const State& /*state*/, std::span<double> torques) const override { std::ranges::fill(torques, 0.0); }
  ControlInput input() const override { return ControlInput::kNothing; }
  bool is_zero() const override { return true; }
  std::string description() const override { return "passive"; }
};

class SineControl final : public Control {
 public:
  explicit SineControl(std::vector<Sine> sines) : sines_(std::move(sines)) {}

  void torques(const State& state, std::span<double> torques) const override {
    for (size_t j = 0; j < sines_.size(); ++j) {
      torques[j] = value_at(sines_[j], state.time);
    }
  }
  ControlInput input() const override { return is_zero() ? ControlInput::kNothing : ControlInput::kTime; }
  bool is_zero() const override {
    return std::ranges::all_of(sines_, [](const Sine& sine) { return sine.amplitude == 0; });
  }
  std::string description() const override {
    if (is_zero()) return "passive";
    const Sine& first = sines_.front();
    const bool alike = std::ranges::all_of(sines_, [&](const Sine& sine) {
      return sine.amplitude == first.amplitude && sine.frequency == first.frequency;
    });
    if (!alike) return fmt::format("sines at {} hinges", sines_.size());
    return fmt::format("sine, {} Nm, {} Hz", shortest(first.amplitude), shortest(first.frequency));
  }

 private:
  std::vector<Sine> sines_;
};

class ActuatorControl final : public Control {
 public:
  ActuatorControl(std::vector<Actuator> actuators, std::vector<double> control)
      : actuators_(std::move(actuators)), control_(std::move(control)) {}

  void torques(const State& state, std::span<double> torques) const override {
    std::ranges::fill(torques, 0.0);
    for (size_t i = 0; i < actuators_.size(); ++i) {
      const Actuator& actuator = actuators_[i];
      const double force =
          actuator_force(actuator, actuator_input(actuator, control_[i], state.time),
                         sum_of_terms(actuator.terms, state.position), sum_of_terms(actuator.terms, state.velocity));
      for (const JointTerm& term : actuator.terms) torques[term.joint] += term.coefficient * force;
    }
  }
  ControlInput input() const override {
    const bool feedback = std::ranges::any_of(actuators_, [](const Actuator& a) { return a.has_feedback(); });
    if (feedback) return ControlInput::kState;
    return std::ranges::any_of(actuators_, follows_time) ? ControlInput::kTime : ControlInput::kNothing;
  }
  bool is_zero() const override {
    for (size_t i = 0; i < actuators_.size(); ++i) {
      const Actuator& actuator = actuators_[i];
      if (actuator.has_feedback() || actuator.sine.amplitude != 0) return false;
      // an activation that is no longer at its start after 1 s moves
      const double start = actuator_input(actuator, control_[i], 0), later = actuator_input(actuator, control_[i], 1);
      if (start != later || actuator_force(actuator, start, 0, 0) != 0) return false;
    }
    return true;
  }
  void give(Model& model) const {
    model.actuators = actuators_;
    model.control0 = control_;
  }
  std::string description() const override {
    if (actuators_.empty()) return "passive";
    if (sines() == 0) return fmt::format("{} actuators, constant controls", actuators_.size());
    return fmt::format("{} actuators, {} of them with sines", actuators_.size(), sines());
  }

 private:
  std::ptrdiff_t sines() const {
    return std::ranges::count_if(actuators_, [](const Actuator& a) { return a.sine.amplitude != 0; });
  }

  std::vector<Actuator> actuators_;
  std::vector<double> control_;
};

}  // namespace

bool equip_for(bool engine_actuators, const Control& control, Model& model) {
  const auto* actuators = dynamic_cast<const ActuatorControl*>(&control);
  model.actuators.clear();
  model.control0.clear();
  control.equip(model);
  if (engine_actuators && actuators != nullptr) actuators->give(model);
  return !model.actuators.empty();
}

std::unique_ptr<ControlRun> Control::start(double timestep_s) const {
  return std::make_unique<StateRun>(*this, timestep_s);
}

void torques_of_step(const Control& control, const State& state, double timestep_s, std::span<double> torques) {
  if (control.input() != ControlInput::kTime) {
    control.torques(state, torques);
    return;
  }
  State middle = state;  // of which such a control uses the time alone
  middle.time += 0.5 * timestep_s;
  control.torques(middle, torques);
}

std::unique_ptr<Control> passive_control() { return std::make_unique<PassiveControl>(); }

std::unique_ptr<Control> sine_control(const Model& model, std::vector<Sine> sines) {
  if (sines.size() != model.joints.size()) throw std::invalid_argument("sine_control: one sine per hinge");
  return std::make_unique<SineControl>(std::move(sines));
}

std::unique_ptr<Control> actuator_control(const Model& model, std::vector<double> control) {
  if (control.empty()) control = model.control0;
  if (control.size() != model.actuators.size())
    throw std::invalid_argument("actuator_control: one control per actuator");
  return std::make_unique<ActuatorControl>(model.actuators, std::move(control));
}

std::vector<std::string> control_kinds() {
  return {"passive", "sine", "actuators", "hold", "random", "file", "policy"};
}

std::string control_text(const ControlSpec& spec) {
  std::string text = spec.kind;
  if (spec.kind == "file") return fmt::format("{}{}{}", text, kPath, spec.file);
  if (spec.kind == "policy") {
    text += fmt::format("{}{}", kConfig, spec.policy);
    return spec.network.empty() ? text : fmt::format("{}{}{}", text, kNetwork, spec.network);
  }
  for (const ControlPart& part : kControlParts) {
    if (spec.kind == part.kind) text += fmt::format(",{}={}", part.name, shortest(spec.*part.member));
  }
  return text;
}

ControlSpec parse_control(const std::string& text) {
  ControlSpec spec;
  size_t at = std::min(text.find(','), text.size());
  spec.kind = text.substr(0, at);
  if (spec.kind == "file" && text.compare(at, kPath.size(), kPath) == 0) {
    spec.file = text.substr(at + kPath.size());
    return spec;
  }
  if (spec.kind == "policy" && text.compare(at, kConfig.size(), kConfig) == 0) {
    const size_t network = std::min(text.rfind(kNetwork), text.size());
    spec.policy = text.substr(at + kConfig.size(), network - at - kConfig.size());
    if (network < text.size()) spec.network = text.substr(network + kNetwork.size());
    return spec;
  }
  if (text.ends_with(".csv")) {
    spec.kind = "file";
    spec.file = text;
    return spec;
  }
  while (at < text.size()) {
    const size_t next = std::min(text.find(',', at + 1), text.size());
    const std::string part = text.substr(at + 1, next - at - 1);
    at = next;
    const size_t sign = std::min(part.find('='), part.size());
    const std::string key = part.substr(0, sign);
    const auto* found = std::ranges::find_if(
        kControlParts, [&](const ControlPart& each) { return spec.kind == each.kind && key == each.name; });
    const auto number = sign < part.size() ? parse_number(part.substr(sign + 1)) : std::nullopt;
    if (found == kControlParts.end() || !number) {
      throw InputError(
          fmt::format("the control '{}' has '{}': a sine has the parameters amplitude (Nm), frequency (Hz) and "
                      "phase_step (rad), hold has natural_frequency (Hz), random has motion (rad) and seed, the others "
                      "have none; write them as in sine,amplitude=2,frequency=1",
                      text, part));
    }
    spec.*(found->member) = *number;
  }
  return spec;
}

std::unique_ptr<Control> make_control(const Model& model, const ControlSpec& spec) {
  const std::vector<std::string> kinds = control_kinds();
  if (std::ranges::find(kinds, spec.kind) == kinds.end()) {
    throw InputError(fmt::format(
        "there is no control '{}'{}; use one of {}, the last two with their files: "
        "file,path=torques.csv, policy,config=policy.toml, in a campaign {{kind = \"file\", path = "
        "\"torques.csv\"}}",
        spec.kind, nearest_name(spec.kind, kinds) ? did_you_mean(spec.kind, kinds) : "", join(kinds, ", ")));
  }
  for (const ControlPart& part : kControlParts) {
    const double value = spec.*part.member;
    if (spec.kind == part.kind && !std::isfinite(value)) {
      throw InputError(
          fmt::format("the {} of the control '{}' is {}; give a finite number", part.name, spec.kind, value));
    }
  }
  if (spec.kind == "passive") return passive_control();
  if (spec.kind == "actuators") return actuator_control(model);
  if (spec.kind == "hold") {
    if (spec.natural_frequency < 0) {
      throw InputError(
          fmt::format("the natural_frequency of the control 'hold' is {}; give a positive number of Hz, "
                      "or 0 for the default, 10 Hz",
                      shortest(spec.natural_frequency)));
    }
    return hold_control(model, spec.natural_frequency);
  }
  if (spec.kind == "random") {
    if (spec.seed < 0 || spec.seed > 1e15 || spec.seed != std::floor(spec.seed)) {
      throw InputError(fmt::format("the seed of the control 'random' is {}; give a whole number from 0 to 1e15",
                                   shortest(spec.seed)));
    }
    return random_control(model, spec.motion, static_cast<std::uint64_t>(spec.seed));
  }
  if (spec.kind == "file") {
    if (spec.file.empty()) {
      throw InputError(
          "the control 'file' has no path: write file,path=torques.csv, in a campaign {kind = \"file\", path = "
          "\"torques.csv\"}");
    }
    return file_control(model, spec.file);
  }
  if (spec.kind == "policy") {
    if (spec.policy.empty()) {
      throw InputError(
          "the control 'policy' has no configuration: write policy,config=policy.toml, in a campaign {kind = "
          "\"policy\", "
          "config = \"policy.toml\"}");
    }
    return policy_control(model, spec.policy, spec.network);
  }
  std::vector<Sine> sines;
  sines.reserve(model.joints.size());
  for (size_t j = 0; j < model.joints.size(); ++j) {
    sines.push_back({spec.amplitude, spec.frequency, spec.phase_step * static_cast<double>(j)});
  }
  return sine_control(model, std::move(sines));
}

}  // namespace assay
