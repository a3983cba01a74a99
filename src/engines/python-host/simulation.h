// One running instance of an adapter in Python.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engines/adapter.h"
#include "interpreter.h"

namespace assay::python {

// How an adapter's read_state() becomes a State.
class StateForm {
 public:
  StateForm(std::string engine, const Model& model, Coordinates coordinates);

  // Of `answer`, a dict of arrays, checked for type and shape. `last_angles`: of the read before, in maximal
  // coordinates.
  void read(PyObject* answer, std::vector<double>& last_angles, State& out) const;

 private:
  std::vector<double> array(PyObject* answer, const char* name, size_t rows, size_t columns) const;

  std::string engine_;
  const Model& model_;
  Coordinates coordinates_;
  bool has_free_;
};

// A method of an adapter's object, or none.
Object method_of(const Object& made, const char* name);

// An array of NumPy that shows `values` to Python, which may not write them; they must stay where they are.
Object array_of(const std::vector<double>& values);

class PythonSimulation final : public Simulation {
 public:
  // `made` is what the adapter's create() gave.
  PythonSimulation(std::string engine, Model model, const Capabilities& capabilities, double start, double timestep,
                   Object made);

  void set_torques(std::span<const double> torques) override;
  void advance(int count) override;
  void read_state(State& out) const override;
  EngineView view() const override;
  bool keep_contacts() override;
  void read_contacts(std::vector<ContactForce>& out) const override;

 private:
  void give_torques(const std::vector<double>& torques);
  void take(int count);

  std::string engine_;
  Model model_;
  StateForm form_;
  bool explicit_springs_, reads_state_;
  bool contacts_kept_ = false;
  bool loaded_ = false, fresh_ = false;  // the engine has torques; they are for the next step
  Clock clock_;
  Object made_, advance_, read_state_, set_torques_, torques_array_;
  std::vector<double> torques_, joined_;  // joined_ is what torques_array_ shows to Python
  mutable State scratch_;
  mutable std::vector<double> last_angles_;
};

}  // namespace assay::python
