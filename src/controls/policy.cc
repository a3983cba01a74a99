#include "controls/policy.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "base/hash.h"
#include "base/input_file.h"
#include "base/text.h"
#include "controls/onnx_network.h"
#include "controls/recorded_actions.h"

namespace assay {
namespace {

// Of a network or a record.
constexpr std::uintmax_t kMostNetworkBytes = std::uintmax_t{256} << 20;

// Whole number of engine steps in a control step.
long long steps_of_period(const PolicyConfig& config, double timestep_s) {
  const double ratio = config.period_s / timestep_s, nearest = std::round(ratio);
  if (nearest >= 1 && std::abs(ratio - nearest) <= 1e-9 * nearest) return std::llround(nearest);
  const double steps = std::max(1.0, std::ceil(ratio));
  throw InputError(
      fmt::format("the control period of the policy '{}' is {} ms, which is not a whole number of timesteps of {} ms: "
                  "use a timestep of {} ms",
                  config.path, shortest(1e3 * config.period_s), timestep_label(1e3 * timestep_s),
                  shortest(1e3 * config.period_s / steps)));
}

class PolicyRun final : public ControlRun {
 public:
  PolicyRun(const PolicyConfig& config, const Model& model, std::unique_ptr<ActionSource> source, double timestep_s)
      : config_(config),
        model_(model),
        source_(std::move(source)),
        timestep_s_(timestep_s),
        period_(steps_of_period(config, timestep_s)),
        observation_(config.observations()),
        input_(config.inputs()),
        action_(config.joints.size(), 0.0),
        target_(config.joints.size()) {
    // what acts before the first observation's action arrives
    for (int i = 0; i < config.delay; ++i) pending_.emplace_back(action_);
  }

  void torques(const State& state, std::span<double> torques) override {
    if (step_ % period_ == 0) {
      const auto begin = std::chrono::steady_clock::now();
      decide(state);
      account_.policy_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      ++account_.policy_steps;
    }
    ++step_;
    std::ranges::fill(torques, 0.0);
    for (size_t i = 0; i < config_.joints.size(); ++i) {
      const auto joint = static_cast<size_t>(config_.joints[i]);
      const double torque = torque_of(i, state.position[joint], state.velocity[joint]);
      torques[joint] = std::clamp(torque, -config_.effort_limit[i], config_.effort_limit[i]);
      account_.work += std::abs(torques[joint] * state.velocity[joint]) * timestep_s_;
    }
  }

  ControlAccount account() const override { return account_; }

 private:
  double torque_of(size_t i, double position, double rate) const {
    const double kp = config_.stiffness[i], kd = config_.damping[i], target = target_[i];
    switch (config_.type) {
      case ActionType::kEffort:
        return target;
      case ActionType::kVelocity:
        return config_.engine_drives ? kd * target : kd * (target - rate);
      case ActionType::kPosition:
        break;
    }
    if (!config_.engine_drives) return kp * (target - position) - kd * rate;
    // the engine's spring pulls towards its own reference
    return kp * (target - model_.joints[static_cast<size_t>(config_.joints[i])].spring_reference);
  }

  void decide(const State& state) {
    const double time = static_cast<double>(account_.policy_steps) * config_.period_s;
    observe(config_, model_, state, action_, time, observation_);
    remember();
    source_->act(input_, action_);
    for (size_t i = 0; i < action_.size(); ++i) {
      if (!std::isfinite(action_[i])) {
        throw PolicyError(fmt::format("the policy's action {} of {} ('{}') is {} in control step {}", i + 1,
                                      action_.size(), model_.joints[static_cast<size_t>(config_.joints[i])].name,
                                      action_[i], account_.policy_steps + 1));
      }
      action_[i] = std::clamp(action_[i], config_.action_clip.low, config_.action_clip.high);
    }
    pending_.push_back(action_);
    for (size_t i = 0; i < target_.size(); ++i) {
      target_[i] = config_.offset[i] + config_.scale[i] * pending_.front()[i];
    }
    pending_.pop_front();
  }

  // Puts the observation behind those before it, and all of them in the network's order.
  void remember() {
    const auto length = static_cast<size_t>(config_.history);
    if (history_.empty()) {
      const std::vector<double> before(observation_.size(), 0.0);
      history_.assign(length, config_.zero_start ? before : observation_);
    }
    history_.pop_front();
    history_.push_back(observation_);
    const auto at = [&](size_t k) -> const std::vector<double>& {
      return history_[config_.newest_first ? length - 1 - k : k];
    };
    size_t to = 0;
    const auto copy = [&](const std::vector<double>& from, size_t first, size_t count) {
      std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(first), count,
                  input_.begin() + static_cast<std::ptrdiff_t>(to));
      to += count;
    };
    if (config_.by_step) {
      for (size_t k = 0; k < length; ++k) copy(at(k), 0, observation_.size());
      return;
    }
    size_t first = 0;
    for (const ObservationTerm& term : config_.terms) {
      for (size_t k = 0; k < length; ++k) copy(at(k), first, term.size());
      first += term.size();
    }
  }

  const PolicyConfig& config_;
  const Model& model_;
  std::unique_ptr<ActionSource> source_;
  double timestep_s_;
  long long period_ = 1, step_ = 0;  // engine steps
  std::vector<double> observation_, input_;
  std::vector<double> action_;               // the newest, clipped
  std::vector<double> target_;               // that act now: positions, rates or efforts
  std::deque<std::vector<double>> pending_;  // actions on their way, the oldest first
  std::deque<std::vector<double>> history_;  // the oldest first
  ControlAccount account_;
};

void change_config(PolicyConfig& config, const PolicyChange& change) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  if (config.delay + change.delay < 0) {
    throw InputError(fmt::format("the policy '{}' has a delay of {} control steps, which cannot be {} fewer",
                                 config.path, config.delay, -change.delay));
  }
  config.delay += change.delay;
  if (change.engine_drives) {
    if (config.type == ActionType::kEffort) {
      throw InputError(
          fmt::format("the policy '{}' gives torques: it has no drives whose law could change", config.path));
    }
    config.engine_drives = *change.engine_drives;
  }
  if (change.without_clamp || config.engine_drives) std::ranges::fill(config.effort_limit, kNone);
}

class PolicyControl final : public Control {
 public:
  PolicyControl(const Model& model, const std::string& path, const std::string& network, const PolicyChange& change)
      : model_(model), config_(read_policy_config(model, path)), network_(network.empty() ? config_.network : network) {
    change_config(config_, change);
    if (network_.empty()) {
      throw InputError(fmt::format(
          "the policy '{}' names no network: give network = \"policy.onnx\" there, or --policy", config_.path));
    }
    const bool recorded = network_.ends_with(".csv");
    bytes_ = recorded ? input_text(network_, "the file of actions", "a CSV file", kMostNetworkBytes)
                      : input_file(network_, "the network", "an ONNX file", kMostNetworkBytes);
    if (recorded) recorded_ = parse_recorded_actions(bytes_, network_, config_, model_);
    hash_ = content_hash(config_.hash + content_hash(bytes_));
  }

  void torques(const State& state, std::span<double> torques) const override {
    start(config_.period_s)->torques(state, torques);
  }
  std::unique_ptr<ControlRun> start(double timestep_s) const override {
    std::unique_ptr<ActionSource> source =
        recorded_.steps > 0 ? recorded_actions(recorded_) : onnx_network(bytes_, network_, config_);
    return policy_run(config_, model_, std::move(source), timestep_s);
  }
  bool has_memory() const override { return true; }
  void check_timestep(double timestep_s) const override { steps_of_period(config_, timestep_s); }
  void rehearse() const override {
    std::vector<double> torques(model_.joints.size());
    try {
      this->torques(model_.initial, torques);
    } catch (const PolicyError&) {  // NOLINT(bugprone-empty-catch): the outcome of a run
    }
  }
  void equip(Model& model) const override {
    if (!config_.engine_drives && config_.held.empty()) return;
    for (size_t i = 0; config_.engine_drives && i < config_.joints.size(); ++i) {
      Joint& joint = model.joints[static_cast<size_t>(config_.joints[i])];
      joint.stiffness += config_.stiffness[i];
      joint.damping += config_.damping[i];
    }
    for (size_t i = 0; i < config_.held.size(); ++i) {
      Joint& joint = model.joints[static_cast<size_t>(config_.held[i])];
      const double stiffness = joint.stiffness + config_.held_stiffness[i];
      // two springs are one that is at rest where their forces cancel
      if (stiffness > 0) {
        joint.spring_reference =
            (joint.stiffness * joint.spring_reference + config_.held_stiffness[i] * config_.held_position[i]) /
            stiffness;
      }
      joint.stiffness = stiffness;
      joint.damping += config_.held_damping[i];
    }
    model.hash = model_hash(model);
  }
  std::optional<std::vector<double>> largest_torques() const override {
    std::vector<double> largest(model_.joints.size(), 0.0);
    for (size_t i = 0; i < config_.joints.size(); ++i) {
      largest[static_cast<size_t>(config_.joints[i])] = config_.effort_limit[i];
    }
    return largest;
  }
  const PolicyConfig* policy() const override { return &config_; }
  ControlInput input() const override { return ControlInput::kState; }
  bool is_zero() const override { return false; }
  std::string description() const override {
    std::string text =
        fmt::format("{} of {} every {} ms, {}", recorded_.steps > 0 ? "record" : "policy",
                    counted(config_.joints.size(), "action"), shortest(1e3 * config_.period_s), hash_.substr(0, 12));
    if (config_.engine_drives) text += ", PD by the engine's springs, without torque limits";
    if (!config_.held.empty()) text += fmt::format(", {} held by springs", counted(config_.held.size(), "joint"));
    return text;
  }

 private:
  Model model_;  // as it is without the drives
  PolicyConfig config_;
  std::string network_, bytes_;
  RecordedActions recorded_;
  std::string hash_;
};

}  // namespace

void observe(const PolicyConfig& config, const Model& model, const State& state, std::span<const double> last_action,
             double time, std::span<double> observation) {
  // of the base, in its own axes
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero(), gravity = -Vec3::UnitZ(), origin = Vec3::Zero();
  Quat q_WB = Quat::Identity();
  if (config.base >= 0) {
    const auto base = static_cast<size_t>(config.base);
    const BodyState& body = state.bodies[base];
    q_WB = body.q_WB;
    const Vec3 p_BcmB_W = -(q_WB * model.bodies[base].p_BBcm);
    origin = body.p_WBcm + p_BcmB_W;
    linear = q_WB.conjugate() * Vec3(body.v_WBcm + body.w_WB.cross(p_BcmB_W));
    angular = q_WB.conjugate() * body.w_WB;
    const Vec3 down = model.gravity.norm() > 0 ? Vec3(model.gravity.normalized()) : Vec3(-Vec3::UnitZ());
    gravity = q_WB.conjugate() * down;
  }
  size_t at = 0;
  const auto put = [&](const ObservationTerm& term, size_t i, double value) {
    value = std::clamp(value, term.clip.low, term.clip.high) * term.scale[i];
    observation[at++] = std::clamp(value, config.clip.low, config.clip.high);
  };
  for (const ObservationTerm& term : config.terms) {
    const auto put_all = [&](std::span<const double> values) {
      size_t i = 0;
      for (const double value : values) put(term, i++, value);
    };
    const auto put_vector = [&](const Vec3& vector) { put_all({vector.data(), 3}); };
    switch (term.kind) {
      case TermKind::kBaseLinearVelocity:
        put_vector(linear);
        break;
      case TermKind::kBaseAngularVelocity:
        put_vector(angular);
        break;
      case TermKind::kProjectedGravity:
        put_vector(gravity);
        break;
      case TermKind::kBaseQuaternion: {
        const double sign = q_WB.w() < 0 ? -1 : 1;
        put_all(std::array{sign * q_WB.w(), sign * q_WB.x(), sign * q_WB.y(), sign * q_WB.z()});
        break;
      }
      case TermKind::kBaseHeight:
        put(term, 0, origin.z());
        break;
      case TermKind::kCommand:
        put_all(config.command);
        break;
      case TermKind::kJointPositionRelative:
      case TermKind::kJointPosition:
        for (size_t i = 0; i < term.size(); ++i) {
          put(term, i, state.position[static_cast<size_t>(term.joints[i])] - term.joint_zero[i]);
        }
        break;
      case TermKind::kJointVelocity:
        for (size_t i = 0; i < term.size(); ++i) put(term, i, state.velocity[static_cast<size_t>(term.joints[i])]);
        break;
      case TermKind::kLastAction:
        put_all(last_action);
        break;
      case TermKind::kPhase: {
        const double phase = 2 * std::numbers::pi * time / term.period_s;
        put_all(std::array{std::sin(phase), std::cos(phase)});
        break;
      }
      case TermKind::kConstant:
        put_all(term.values);
        break;
    }
  }
}

std::unique_ptr<ControlRun> policy_run(const PolicyConfig& config, const Model& model,
                                       std::unique_ptr<ActionSource> source, double timestep_s) {
  return std::make_unique<PolicyRun>(config, model, std::move(source), timestep_s);
}

std::unique_ptr<Control> policy_control(const Model& model, const std::string& config, const std::string& network,
                                        const PolicyChange& change) {
  return std::make_unique<PolicyControl>(model, config, network, change);
}

}  // namespace assay
