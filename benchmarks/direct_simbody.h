// Simbody's side of direct_simbody.cc, valid C++17 because Simbody 3.7's headers are not valid C++20.
#pragma once

#include <memory>
#include <vector>

#include "model/model.h"

namespace assay::benchmarks {

class SimbodyLoop {
 public:
  SimbodyLoop() = default;
  virtual ~SimbodyLoop() = default;
  SimbodyLoop(const SimbodyLoop&) = delete;
  SimbodyLoop& operator=(const SimbodyLoop&) = delete;

  virtual void run(int count) = 0;
  virtual void run_with_torques(const double* torques, int count) = 0;
  virtual std::vector<double> angles() const = 0;
  virtual std::vector<double> rates() const = 0;
};

// `merson`: Runge-Kutta-Merson, else semi-explicit Euler. Hinged bodies only.
std::unique_ptr<SimbodyLoop> make_simbody_loop(const Model& model, const State& start, double timestep, bool merson);

}  // namespace assay::benchmarks
