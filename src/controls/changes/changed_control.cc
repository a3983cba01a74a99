#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "controls/changes/change.h"
#include "controls/policy.h"

namespace assay {
namespace {

struct Damper {
  size_t joint = 0;
  double stiffness = 0, reference = 0, damping = 0;
};

// What becomes of a control's torques, in this order: `source` of each joint and its factor, the delay, the dampers.
struct TorqueChange {
  std::vector<size_t> source;
  std::vector<double> factor;
  int delay = 0;       // engine steps
  double delay_s = 0;  // besides
  std::vector<Damper> dampers;

  bool is_none(size_t joints) const {
    if (delays() || !dampers.empty()) return false;
    for (size_t j = 0; j < joints; ++j) {
      if (source[j] != j || factor[j] != 1) return false;
    }
    return true;
  }

  bool delays() const { return delay > 0 || delay_s > 0; }
  // In steps of that length. Throws InputError where they are not whole ones.
  int steps(double timestep_s) const {
    const double more = delay_s / timestep_s;
    if (std::abs(more - std::round(more)) > 1e-6 * std::max(1.0, more)) {
      throw InputError(
          fmt::format("a delay of {:g} ms is not a whole number of steps of {:g} ms: give a multiple of it",
                      1e3 * delay_s, 1e3 * timestep_s));
    }
    return delay + static_cast<int>(std::lround(more));
  }

  void place(std::span<double> torques) const {
    const std::vector<double> asked(torques.begin(), torques.end());
    for (size_t j = 0; j < torques.size(); ++j) torques[j] = factor[j] * asked[source[j]];
  }
  void damp(const State& state, std::span<double> torques) const {
    for (const Damper& damper : dampers) {
      torques[damper.joint] -= damper.stiffness * (state.position[damper.joint] - damper.reference) +
                               damper.damping * state.velocity[damper.joint];
    }
  }
};

class ChangedRun final : public ControlRun {
 public:
  ChangedRun(std::unique_ptr<ControlRun> inner, const TorqueChange& change, size_t joints, double timestep_s)
      : inner_(std::move(inner)),
        change_(change),
        pending_(static_cast<size_t>(change.steps(timestep_s)), std::vector<double>(joints, 0.0)) {}

  void torques(const State& state, std::span<double> torques) override {
    inner_->torques(state, torques);
    change_.place(torques);
    if (!pending_.empty()) {
      pending_.emplace_back(torques.begin(), torques.end());
      std::ranges::copy(pending_.front(), torques.begin());
      pending_.pop_front();
    }
    change_.damp(state, torques);
  }
  ControlAccount account() const override { return inner_->account(); }

 private:
  std::unique_ptr<ControlRun> inner_;
  const TorqueChange& change_;
  std::deque<std::vector<double>> pending_;  // torques on their way, the oldest first
};

class ChangedControl final : public Control {
 public:
  ChangedControl(std::unique_ptr<Control> inner, TorqueChange change)
      : inner_(std::move(inner)), change_(std::move(change)) {}

  void torques(const State& state, std::span<double> torques) const override {
    inner_->torques(state, torques);
    change_.place(torques);
    change_.damp(state, torques);
  }
  std::unique_ptr<ControlRun> start(double timestep_s) const override {
    return std::make_unique<ChangedRun>(inner_->start(timestep_s), change_, change_.source.size(), timestep_s);
  }
  bool has_memory() const override { return inner_->has_memory() || change_.delays(); }
  void check_timestep(double timestep_s) const override {
    inner_->check_timestep(timestep_s);
    static_cast<void>(change_.steps(timestep_s));
  }
  void rehearse() const override { inner_->rehearse(); }
  void equip(Model& model) const override { inner_->equip(model); }
  std::optional<std::vector<double>> largest_torques() const override {
    auto largest = inner_->largest_torques();
    if (!largest) return largest;
    change_.place(*largest);
    for (double& torque : *largest) torque = std::abs(torque);
    // of a damper it depends on the motion
    for (const Damper& damper : change_.dampers) largest->at(damper.joint) = std::numeric_limits<double>::infinity();
    return largest;
  }
  const PolicyConfig* policy() const override { return inner_->policy(); }
  ControlInput input() const override { return change_.dampers.empty() ? inner_->input() : ControlInput::kState; }
  bool is_zero() const override { return inner_->is_zero() && change_.dampers.empty(); }
  std::string description() const override { return inner_->description() + ", changed"; }

 private:
  std::unique_ptr<Control> inner_;
  TorqueChange change_;
};

size_t joint_named(const Model& model, const std::string& name, const RunChange& change) {
  const auto found = std::ranges::find(model.joints, name, &Joint::name);
  if (found != model.joints.end()) return static_cast<size_t>(found - model.joints.begin());
  std::vector<std::string> names;
  names.reserve(model.joints.size());
  for (const Joint& joint : model.joints) names.push_back(joint.name);
  throw InputError(fmt::format("the change '{}' names '{}', and the model '{}' has no such hinge or slide{}",
                               change_text(change), name, model.name, did_you_mean(name, names)));
}

void reorder(const Model& model, const RunChange& change, TorqueChange& torques) {
  if (change.value == "reversed") {
    std::ranges::reverse(torques.source);
    return;
  }
  const size_t comma = change.value.find(',');
  if (comma == std::string::npos) {
    throw InputError(fmt::format("the change '{}' names one joint: write two, as in order=hip,knee, or reversed",
                                 change_text(change)));
  }
  std::swap(torques.source[joint_named(model, change.value.substr(0, comma), change)],
            torques.source[joint_named(model, change.value.substr(comma + 1), change)]);
}

Model without_clamps(Model model) {
  for (Actuator& actuator : model.actuators) actuator.control_limited = actuator.force_limited = false;
  return model;
}

}  // namespace

std::unique_ptr<Control> changed_control(const Model& model, const ControlSpec& spec,
                                         const std::vector<RunChange>& changes) {
  const bool policy = spec.kind == "policy", unclamped = last_change(changes, ChangeKind::kClamp) != nullptr;
  const RunChange* law = last_change(changes, ChangeKind::kLaw);
  const int delay = delay_of(changes);
  if (law != nullptr && !policy) {
    throw InputError(
        fmt::format("the change '{}' is for a policy's drives, and the control is '{}'", change_text(*law), spec.kind));
  }
  std::unique_ptr<Control> control;
  if (policy) {
    PolicyChange change{.delay = delay, .without_clamp = unclamped, .engine_drives = {}};
    if (law != nullptr) change.engine_drives = law->value == "engine";
    control = policy_control(model, spec.policy, spec.network, change);
  } else {
    control = make_control(unclamped ? without_clamps(model) : model, spec);
  }
  TorqueChange torques;
  torques.source.resize(model.joints.size());
  std::iota(torques.source.begin(), torques.source.end(), size_t{0});
  torques.factor = joint_factors(model, ChangeKind::kGear, changes);
  torques.delay = policy ? 0 : delay;
  torques.delay_s = delay_s_of(changes);
  if (torques.delay < 0 || torques.delay_s < 0) {
    throw InputError(fmt::format(
        "a delay of {} is before the control '{}' itself",
        torques.delay < 0 ? fmt::format("{} control steps", delay) : fmt::format("{:g} ms", 1e3 * torques.delay_s),
        spec.kind));
  }
  for (const RunChange& change : changes) {
    if (change.kind == ChangeKind::kOrder) reorder(model, change, torques);
  }
  if (last_change(changes, ChangeKind::kDampers) != nullptr) {
    std::vector<RunChange> others;
    std::ranges::copy_if(changes, std::back_inserter(others),
                         [](const RunChange& change) { return change.kind != ChangeKind::kDampers; });
    const Model changed = changed_model(model, others);
    for (size_t j = 0; j < changed.joints.size(); ++j) {
      const Joint& joint = changed.joints[j];
      if (joint.has_spring()) torques.dampers.push_back({j, joint.stiffness, joint.spring_reference, joint.damping});
    }
  }
  if (torques.is_none(model.joints.size())) return control;
  return std::make_unique<ChangedControl>(std::move(control), std::move(torques));
}

}  // namespace assay
