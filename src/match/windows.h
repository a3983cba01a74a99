// Windows of logs: stretches that are simulated from their own first states, what was measured there, and how far a
// simulation is from it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "match/config.h"
#include "match/log.h"
#include "match/log_check.h"
#include "model/model.h"
#include "run/messages/messages.h"

namespace assay::match {

// What an error is measured in: angles of joints in degrees (slides: millimetres), of free bodies the position in
// percent of the body's size and the rotation in degrees.
struct BodyMeasure {
  int body = 0;
  double size = 0;  // m, the largest extent of its shapes
};

enum class WindowUse { kFit, kReport };

struct Window {
  size_t log = 0;
  double start_s = 0, end_s = 0;  // in the log's time
  WindowUse use = WindowUse::kFit;
  MatchWindow message;
  std::vector<int> joints;       // that are compared: of the model
  std::vector<double> measured;  // as MatchRun::samples has the compared joints and all flights
  // Standard deviations: of the first state's position and velocity of each compared joint, and of a sample.
  std::vector<std::array<double, 3>> joint_noise;
  std::vector<std::array<double, 4>> flight_noise;  // of each flight: position, velocity, rotation, angular velocity
  size_t flown = 0;                                 // samples before the first impact; whole motions alone
};

// What is scored of a window.
struct WindowError {
  double joints = 0;    // RMS over samples and joints, degrees or mm
  double position = 0;  // mean over samples, % of the size
  double rotation = 0;  // mean over samples, degrees
  bool failed = false;  // the run ended early, or never began: counts as lost from there on
};

// The most that one sample counts: beyond it a simulation says nothing of the motion. A rotation is half a turn at
// most.
inline constexpr double kLostDegrees = 90, kLostPercent = 200, kHalfTurn = 180;

class Windows {
 public:
  // Windows that touch what `check` calls spoiled are left out. Throws InputError where nothing is left.
  Windows(const Model& model, const std::vector<MeasuredLog>& logs, const MatchConfig& config, const LogCheck& check);

  const std::vector<Window>& all() const { return windows_; }
  const std::vector<MatchDrive>& drives() const { return drives_; }  // of each log
  const std::vector<BodyMeasure>& bodies() const { return bodies_; }
  bool whole() const { return whole_; }
  std::vector<size_t> of(WindowUse use, const std::vector<bool>& logs) const;

  // Number of residuals of a window; the residuals, components of errors in degrees and percent.
  size_t residual_count(const Window& window) const;
  // How many of the unit of errors a radian or metre of the joint is.
  double unit_of(int joint) const;
  std::vector<double> residuals(const Window& window, const MatchRun& run) const;
  WindowError error(const Window& window, const MatchRun& run) const;
  // The errors of single samples, joints' or (position, rotation) pairs, for what is left and where.
  std::vector<WindowError> sample_errors(const Window& window, const MatchRun& run) const;
  // The error of what stays at the first measured sample.
  WindowError error_at_rest(const Window& window) const;
  // How far two simulations of one window are apart.
  WindowError distance(const Window& window, const MatchRun& a, const MatchRun& b) const;

  // The window from a first state that its noise could have given; equal seeds give equal ones.
  MatchWindow perturbed(const Window& window, std::uint64_t seed) const;

 private:
  void add(const Model& model, const MeasuredLog& log, size_t index, size_t from, size_t to, WindowUse use,
           const MatchConfig& config);
  std::vector<WindowError> compare(const Window& window, const std::vector<double>& a,
                                   const std::vector<double>& b) const;

  std::vector<Window> windows_;
  std::vector<MatchDrive> drives_;
  std::vector<BodyMeasure> bodies_;
  size_t joints_ = 0;  // of the model
  std::vector<bool> slides_;
  bool whole_ = false;
};

// The mean over windows, weighted by their samples for joints.
WindowError mean_error(const std::vector<WindowError>& errors);

}  // namespace assay::match
