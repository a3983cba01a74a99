#include "simulation.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "model/body_rows.h"

namespace assay::python {
namespace {

constexpr size_t kBallRow = 7;  // of a ball joint: quaternion, angular velocity
constexpr size_t kContactRow = 12;

Vec3 vector_at(const double* p) { return {p[0], p[1], p[2]}; }
Quat rotation_at(const double* p) { return Quat(p[0], p[1], p[2], p[3]).normalized(); }

// The numbers of a body that the interface has as a list.
Vec3 vector_of(const nlohmann::json& values) {
  return {values.at(0).get<double>(), values.at(1).get<double>(), values.at(2).get<double>()};
}

}  // namespace

Object method_of(const Object& made, const char* name) {
  Object found(PyObject_GetAttrString(made.get(), name));
  if (!found) PyErr_Clear();
  return found;
}

Object array_of(const std::vector<double>& values) {
  static constexpr double kNothing = 0;
  const double* data = values.empty() ? &kNothing : values.data();
  const auto bytes = static_cast<Py_ssize_t>(values.size() * sizeof(double));
  return call("_array", "(N)",
              PyMemoryView_FromMemory(const_cast<char*>(reinterpret_cast<const char*>(data)), bytes, PyBUF_READ));
}

StateForm::StateForm(std::string engine, const Model& model, Coordinates coordinates)
    : engine_(std::move(engine)),
      model_(model),
      coordinates_(coordinates),
      has_free_(std::ranges::any_of(model.bodies, &Body::is_free)) {}

PythonSimulation::PythonSimulation(std::string engine, Model model, const Capabilities& capabilities, double start,
                                   double timestep, Object made)
    : engine_(std::move(engine)),
      model_(std::move(model)),
      form_(engine_, model_, capabilities.coordinates),
      explicit_springs_(capabilities.springs == SpringKind::kExplicit && model_.has_springs()),
      reads_state_(explicit_springs_ || std::ranges::any_of(model_.tendons, &Tendon::has_spring)),
      clock_{start, timestep},
      made_(std::move(made)),
      advance_(method_of(made_, "advance")),
      read_state_(method_of(made_, "read_state")),
      joined_(model_.joints.size(), 0.0) {
  model_.keyframes.clear();
  if (!advance_ || !read_state_) {
    throw std::runtime_error(fmt::format("{}: what create() gave has no {}(): see assay_adapter.Engine.create", engine_,
                                         advance_ ? "read_state" : "advance"));
  }
  if (capabilities.torques || reads_state_) set_torques_ = method_of(made_, "set_torques");
  if (set_torques_) torques_array_ = array_of(joined_);
}

void PythonSimulation::set_torques(std::span<const double> torques) {
  if (!set_torques_) return;
  if (reads_state_) read_state(scratch_);
  collect_torques(model_, torques, explicit_springs_ ? &scratch_ : nullptr, torques_);
  if (reads_state_) add_tendon_tensions(model_, scratch_, torques_);
  give_torques(torques_);
  loaded_ = fresh_ = true;
}

void PythonSimulation::give_torques(const std::vector<double>& torques) {
  std::ranges::copy(torques, joined_.begin());
  Object answer;
  {
    const Inside inside;
    answer = Object(PyObject_CallOneArg(set_torques_.get(), torques_array_.get()));
  }
  if (!answer) rethrow(engine_);
}

// An adapter's torques act until it gets others: here they end after one step.
void PythonSimulation::advance(int count) {
  if (loaded_) {
    if (fresh_) {
      fresh_ = false;
      take(1);
      if (--count == 0) return;
    }
    give_torques(std::vector<double>(torques_.size(), 0.0));
    loaded_ = false;
  }
  take(count);
}

void PythonSimulation::take(int count) {
  const Object steps(PyLong_FromLong(count));
  Object answer;
  {
    const Inside inside;
    answer = Object(PyObject_CallOneArg(advance_.get(), steps.get()));
  }
  if (!answer) rethrow(engine_);
  clock_.steps += count;
}

std::vector<double> StateForm::array(PyObject* answer, const char* name, size_t rows, size_t columns) const {
  const auto fail = [&](const std::string& what) {
    throw std::runtime_error(fmt::format("{}: read_state() gave {}", engine_, what));
  };
  const std::string wanted = columns == 1 ? fmt::format("({},)", rows) : fmt::format("({}, {})", rows, columns);
  PyObject* value = PyDict_GetItemString(answer, name);  // borrowed
  if (value == nullptr) fail(fmt::format("no '{}': give a float64 array of shape {}", name, wanted));
  Py_buffer view{};
  if (PyObject_GetBuffer(value, &view, PyBUF_STRIDES | PyBUF_FORMAT) != 0) {
    PyErr_Clear();
    fail(fmt::format("'{}' as a {}: give a float64 array of shape {}", name, Py_TYPE(value)->tp_name, wanted));
  }
  std::string fault, shape;
  for (int d = 0; d < view.ndim; ++d) shape += fmt::format("{}{}", d > 0 ? ", " : "", view.shape[d]);
  const bool fits =
      columns == 1 ? view.ndim == 1 && std::cmp_equal(view.shape[0], rows)
                   : view.ndim == 2 && std::cmp_equal(view.shape[0], rows) && std::cmp_equal(view.shape[1], columns);
  if (view.format == nullptr || std::strcmp(view.format, "d") != 0) {
    fault = fmt::format("'{}' with elements of type '{}': give float64, whose type is 'd'", name,
                        view.format == nullptr ? "" : view.format);
  } else if (!fits) {
    fault = fmt::format("'{}' of shape ({}{}): the model needs {}", name, shape, view.ndim == 1 ? "," : "", wanted);
  }
  std::vector<double> result;
  if (fault.empty()) {
    result.reserve(rows * columns);
    const auto* bytes = static_cast<const char*>(view.buf);
    for (size_t r = 0; r < rows; ++r) {
      for (size_t c = 0; c < columns; ++c) {
        const auto offset = (static_cast<Py_ssize_t>(r) * view.strides[0]) +
                            (columns == 1 ? 0 : static_cast<Py_ssize_t>(c) * view.strides[1]);
        double number = 0;
        std::memcpy(&number, bytes + offset, sizeof number);
        result.push_back(number);
      }
    }
  }
  PyBuffer_Release(&view);
  if (!fault.empty()) fail(fault);
  return result;
}

void PythonSimulation::read_state(State& out) const {
  Object answer;
  {
    const Inside inside;
    answer = Object(PyObject_CallNoArgs(read_state_.get()));
  }
  if (!answer) rethrow(engine_);
  form_.read(answer.get(), last_angles_, out);
  out.time = clock_.time();
}

void StateForm::read(PyObject* answer, std::vector<double>& last_angles, State& out) const {
  if (PyDict_Check(answer) == 0) {
    throw std::runtime_error(
        fmt::format("{}: read_state() gave a {}: give a dict of arrays", engine_, Py_TYPE(answer)->tp_name));
  }
  out.bodies.resize(model_.bodies.size());
  const bool joint = coordinates_ == Coordinates::kJoint;
  if (!joint || has_free_) {
    const std::vector<double> rows = array(answer, "bodies", model_.bodies.size(), kBodyRow);
    for (size_t i = 0; i < out.bodies.size(); ++i) {
      if (joint && !model_.bodies[i].is_free()) continue;
      out.bodies[i] = body_of(&rows[i * kBodyRow]);
    }
  }
  if (!joint) {
    out.position = last_angles;
    joints_from_bodies(model_, out);
    last_angles = out.position;
    return;
  }
  const size_t joints = model_.joints.size();
  out.position = joints == 0 ? std::vector<double>() : array(answer, "position", joints, 1);
  out.velocity = joints == 0 ? std::vector<double>() : array(answer, "velocity", joints, 1);
  std::vector<BallCoordinates> balls;
  if (!model_.balls.empty()) {
    const std::vector<double> rows = array(answer, "balls", model_.balls.size(), kBallRow);
    balls.reserve(model_.balls.size());
    for (size_t i = 0; i < model_.balls.size(); ++i) {
      balls.push_back({rotation_at(&rows[i * kBallRow]), vector_at(&rows[i * kBallRow + 4])});
    }
  }
  bodies_from_joints(model_, balls, out);
}

bool PythonSimulation::keep_contacts() {
  const Object keep = method_of(made_, "keep_contacts");
  if (!keep) return false;
  Object answer;
  {
    const Inside inside;
    answer = Object(PyObject_CallNoArgs(keep.get()));
  }
  if (!answer) rethrow(engine_);
  return contacts_kept_ = true;
}

void PythonSimulation::read_contacts(std::vector<ContactForce>& out) const {
  out.clear();
  if (!contacts_kept_ || clock_.steps == 0) return;
  const nlohmann::json rows = nlohmann::json::parse(text_of(call("_contacts", "(O)", made_.get())));
  for (const nlohmann::json& row : rows) {
    const auto values = row.get<std::array<double, kContactRow>>();
    const int first = static_cast<int>(values[0]), second = static_cast<int>(values[1]);
    const double sign = first < second ? 1 : -1;
    out.push_back({.shape_a = std::min(first, second),
                   .shape_b = std::max(first, second),
                   .p_W = vector_at(&values[2]),
                   .n_W = sign * vector_at(&values[5]),
                   .gap = values[8],
                   .impulse_W = sign * vector_at(&values[9])});
  }
}

EngineView PythonSimulation::view() const {
  const nlohmann::json held = nlohmann::json::parse(text_of(call("_view", "(O)", made_.get())));
  EngineView view;
  try {
    view.gravity = vector_of(held.at("gravity"));
    for (size_t i = 0; i < model_.bodies.size(); ++i) {
      const nlohmann::json& rows = held.at("inertia").at(i);
      Mat3 inertia;
      for (int r = 0; r < 3; ++r) inertia.row(r) = vector_of(rows.at(r));
      view.bodies.push_back(
          {.mass = held.at("mass").at(i), .p_WBcm = vector_of(held.at("com").at(i)), .I_BBcm_W = inertia});
    }
    constexpr double kNone = 1e299;
    for (size_t j = 0; j < model_.joints.size(); ++j) {
      EngineJoint joint{.p_WJ = vector_of(held.at("anchor").at(j)), .axis_W = vector_of(held.at("axis").at(j))};
      const double lower = held.at("lower").at(j), upper = held.at("upper").at(j);
      joint.limited = lower > -kNone || upper < kNone;
      if (joint.limited) {
        joint.lower = lower;
        joint.upper = upper;
      }
      view.joints.push_back(joint);
    }
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(fmt::format("{}: view() gave arrays of another shape: {}", engine_, error.what()));
  }
  return view;
}

}  // namespace assay::python
