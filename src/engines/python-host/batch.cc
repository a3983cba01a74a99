#include "batch.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "model/body_rows.h"

namespace assay::python {

void StateRows::add(const Model& model, const State& state) {
  const State full = with_joint_coordinates(model, state);
  const std::vector<double> rows = rows_of(full.bodies);
  bodies.insert(bodies.end(), rows.begin(), rows.end());
  position.insert(position.end(), full.position.begin(), full.position.end());
  velocity.insert(velocity.end(), full.velocity.begin(), full.velocity.end());
  for (size_t i = 0; i < model.balls.size(); ++i) {
    const Quat q = ball_rotation(model, full, static_cast<int>(i));
    const Vec3 w = ball_velocity(model, full, static_cast<int>(i));
    balls.insert(balls.end(), {q.w(), q.x(), q.y(), q.z(), w.x(), w.y(), w.z()});
  }
}

PythonBatch::PythonBatch(std::string engine, const Model& model, const Capabilities& capabilities,
                         std::span<const State> states, double timestep, Object made)
    : engine_(std::move(engine)),
      model_(model),
      form_(engine_, model_, capabilities.coordinates),
      precision_(capabilities.precision),
      timestep_(timestep),
      start_(states.size()),
      torques_(states.size() * model.joints.size(), 0.0),
      last_angles_(states.size()),
      made_(std::move(made)),
      advance_(required("advance")),
      synchronize_(required("synchronize")),
      restart_(required("restart")),
      read_state_(required("read_state")) {
  model_.keyframes.clear();
  if (capabilities.torques) {
    set_torques_ = required("set_torques");
    torques_array_ = array_of(torques_);
  }
  restart(states);
}

Object PythonBatch::required(const char* name) const {
  Object found = method_of(made_, name);
  if (!found) {
    throw std::runtime_error(
        fmt::format("{}: what create_batch() gave has no {}(): see assay_adapter.Engine.create_batch", engine_, name));
  }
  return found;
}

template <typename... Arguments>
Object PythonBatch::inside(const Object& callee, const Arguments&... arguments) const {
  Object answer;
  {
    const Inside marked;
    answer = Object(PyObject_CallFunctionObjArgs(callee.get(), arguments.get()..., nullptr));
  }
  if (!answer) rethrow(engine_);
  return answer;
}

void PythonBatch::restart(std::span<const State> states) {
  StateRows rows;
  for (size_t i = 0; i < states.size(); ++i) {
    rows.add(model_, states[i]);
    start_[i] = states[i].time;
    last_angles_[i] = states[i].position;
  }
  loaded_ = fresh_ = false;
  std::ranges::fill(torques_, 0.0);
  steps_ = 0;
  const Object bodies = array_of(rows.bodies), position = array_of(rows.position), velocity = array_of(rows.velocity),
               balls = array_of(rows.balls);
  call("_restart", "(OiOOOO)", made_.get(), worlds(), bodies.get(), position.get(), velocity.get(), balls.get());
}

void PythonBatch::set_torques(std::span<const double> torques) {
  if (!set_torques_) return;
  std::copy_n(torques.begin(), std::min(torques.size(), torques_.size()), torques_.begin());
  give_torques();
  loaded_ = fresh_ = true;
}

void PythonBatch::give_torques() {
  const Object shaped = call("_by_world", "(Oi)", torques_array_.get(), worlds());
  inside(set_torques_, shaped);
}

// As in PythonSimulation: torques end after one step.
void PythonBatch::advance(int count) {
  if (loaded_) {
    if (fresh_) {
      fresh_ = false;
      take(1);
      if (--count == 0) return;
    }
    std::ranges::fill(torques_, 0.0);
    give_torques();
    loaded_ = false;
  }
  take(count);
}

void PythonBatch::take(int count) {
  const Object steps(PyLong_FromLong(count));
  inside(advance_, steps);
  steps_ += count;
}

void PythonBatch::synchronize() { inside(synchronize_); }

void PythonBatch::read_state(int world, State& out) const {
  const auto index = static_cast<size_t>(world);
  const Object number(PyLong_FromLong(world));
  form_.read(inside(read_state_, number).get(), last_angles_[index], out);
  out.time = start_[index] + static_cast<double>(steps_) * timestep_;
}

BatchFacts PythonBatch::facts() const {
  const nlohmann::json told = nlohmann::json::parse(text_of(call("_batch_facts", "(O)", made_.get())));
  return {.device = told.at("device"),
          .driver = told.at("driver"),
          .precision = precision_,
          .memory_bytes = told.at("memory_bytes"),
          .compile_s = told.at("compile_s"),
          .overflow = told.at("overflow")};
}

}  // namespace assay::python
