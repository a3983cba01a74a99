#include "controls/log_drive.h"

#include <algorithm>

namespace assay {
namespace {

class LogControl final : public Control {
 public:
  explicit LogControl(const LogDrive& drive)
      : drive_(drive),
        has_targets_(std::ranges::any_of(drive.targets, [](const auto& series) { return !series.empty(); })),
        has_torques_(std::ranges::any_of(drive.torques, [](const auto& series) { return !series.empty(); })) {}

  void torques(const State& state, std::span<double> torques) const override {
    const double time = drive_.start_s + state.time - drive_.delay_s;
    const std::vector<double>& times = drive_.times;
    const auto after = static_cast<size_t>(std::ranges::upper_bound(times, time) - times.begin());
    const size_t next = std::min(after, times.size() - 1), last = after == 0 ? 0 : after - 1;
    const double span = times[next] - times[last], share = span > 0 ? (time - times[last]) / span : 0;
    const auto at = [&](const std::vector<double>& series) {
      return series[last] + share * (series[next] - series[last]);
    };
    for (size_t j = 0; j < torques.size(); ++j) {
      torques[j] = j < drive_.torques.size() && !drive_.torques[j].empty() ? at(drive_.torques[j]) : 0;
      if (j < drive_.targets.size() && !drive_.targets[j].empty()) {
        torques[j] +=
            drive_.stiffness[j] * (at(drive_.targets[j]) - state.position[j]) - drive_.damping[j] * state.velocity[j];
      }
      if (!drive_.gear.empty()) torques[j] *= drive_.gear[j];
    }
  }
  ControlInput input() const override { return has_targets_ ? ControlInput::kState : ControlInput::kTime; }
  bool is_zero() const override { return drive_.times.empty() || (!has_targets_ && !has_torques_); }
  std::string description() const override { return "as logged"; }

 private:
  const LogDrive& drive_;
  bool has_targets_, has_torques_;
};

}  // namespace

std::unique_ptr<Control> log_control(const LogDrive& drive) { return std::make_unique<LogControl>(drive); }

}  // namespace assay
