// Joint torques that a log has measured, or the drives that followed its targets.
#pragma once

#include <memory>
#include <vector>

#include "controls/control.h"

namespace assay {

struct LogDrive {
  std::vector<double> times;  // s, ascending; before the first and after the last one it stays as there
  // By hinge and slide of the model, one number for each time; empty: none.
  std::vector<std::vector<double>> torques;  // Nm, N
  std::vector<std::vector<double>> targets;  // rad, m: torque = stiffness (target - position) - damping velocity
  std::vector<double> stiffness, damping;    // of each joint
  std::vector<double> gear;                  // times the torque, of each joint
  double start_s = 0;                        // the log's time at a run's time 0
  double delay_s = 0;                        // torques and targets act that much later than the log has them
};

// The torques of the log, interpolated between its times, or those of its drives. `drive` has to outlive the control.
std::unique_ptr<Control> log_control(const LogDrive& drive);

}  // namespace assay
