// MuJoCo's objects with their owners, and its errors.
#pragma once

#include <memory>
#include <string>

#include <mujoco/mujoco.h>

namespace assay::mujoco {

struct SpecDeleter {
  void operator()(mjSpec* spec) const { mj_deleteSpec(spec); }
};
struct ModelDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
struct DataDeleter {
  void operator()(mjData* data) const { mj_deleteData(data); }
};
using SpecPtr = std::unique_ptr<mjSpec, SpecDeleter>;
using ModelPtr = std::unique_ptr<mjModel, ModelDeleter>;
using DataPtr = std::unique_ptr<mjData, DataDeleter>;

// Turns MuJoCo's errors into EngineError. To be called before a simulation is made.
void initialise_library();

// A message of MuJoCo's without its line breaks.
std::string one_line(std::string text);

}  // namespace assay::mujoco
