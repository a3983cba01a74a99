// The module assay._core. What of it users see is documented where the package wraps it: python/assay/_model.py.
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "arrays.h"
#include "base/errors.h"
#include "base/paths.h"
#include "engines/python-host/model_json.h"
#include "engines/registry.h"
#include "load/mjcf.h"
#include "model/kinematics.h"
#include "model/model.h"
#include "run.h"

namespace assay::package {
namespace {

// What Python holds of a model: simulations of it keep it alive.
struct Loaded {
  std::shared_ptr<const Model> model;
};

const char* argument_of(const LoadField& field) { return field.argument != nullptr ? field.argument : field.key; }

constexpr const char* kAsInFile = "file";

// The number of a choice by its name.
int choice_of(const LoadField& field, const std::string& given) {
  if (given == kAsInFile) return 0;
  for (size_t i = 0; i < field.choices.size(); ++i) {
    if (field.choices[i].name == given) return static_cast<int>(i) + 1;
  }
  throw InputError(fmt::format("{} is '{}': give {}, {} or {}", argument_of(field), given, kAsInFile,
                               field.choices[0].name, field.choices[1].name));
}

template <typename T>
void take(const LoadField& field, const nb::object& given, T& value) {
  if constexpr (std::is_same_v<T, Folders>) {
    if (!given.is_none()) value = nb::cast<Folders>(given);
  } else if constexpr (std::is_enum_v<T>) {
    value = static_cast<T>(choice_of(field, nb::cast<std::string>(given)));
  } else if constexpr (std::is_same_v<T, std::string>) {
    // a keyframe may be a number
    const nb::object text = field.is_path() ? nb::module_::import_("os").attr("fspath")(given) : nb::str(given);
    value = nb::cast<std::string>(text);
  } else {
    value = nb::cast<T>(given);
  }
}

LoadOptions load_options(const nb::dict& given) {
  LoadOptions options;
  visit_load_fields(options, [&](const LoadField& field, auto& value) {
    const char* name = argument_of(field);
    if (!given.contains(name)) return;
    try {
      take(field, given[name], value);
    } catch (const nb::cast_error&) {
      throw nb::type_error(fmt::format("'{}' cannot be {}", name, nb::repr(given[name]).c_str()).c_str());
    }
  });
  return options;
}

// The arguments of load(): (name, default, meaning, whether it is a path).
nb::list load_arguments() {
  nb::list arguments;
  const LoadOptions defaults;
  visit_load_fields(defaults, [&]<typename T>(const LoadField& field, const T& value) {
    std::string meaning = field.meaning;
    nb::object otherwise = nb::none();
    if constexpr (std::is_enum_v<T>) {
      otherwise = nb::str(kAsInFile);
      for (const LoadChoice& each : field.choices) meaning += fmt::format("\"{}\": {}; ", each.name, each.meaning);
      meaning += fmt::format("\"{}\": as in the file", kAsInFile);
    } else if constexpr (!std::is_same_v<T, Folders>) {
      otherwise = nb::cast(value);
    }
    arguments.append(nb::make_tuple(argument_of(field), otherwise, meaning, field.is_path()));
  });
  return arguments;
}

Loaded load(const std::string& given, bool is_text, const std::string& name, const nb::dict& how) {
  const LoadOptions options = load_options(how);
  const nb::gil_scoped_release unlocked;
  return {std::make_shared<const Model>(is_text ? load_model_text(given, name, options)
                                                : load_model(find_model(given), options))};
}

Loaded variant(const Loaded& loaded, bool contacts, bool gravity) {
  Model model = *loaded.model;
  if (!contacts) model = without_contacts(std::move(model));
  if (!gravity) model = without_gravity(std::move(model));
  return {std::make_shared<const Model>(std::move(model))};
}

// The initial state with these joint coordinates, as arrays.
nb::tuple joint_state(const Loaded& loaded, const nb::object& position, const nb::object& velocity, double time) {
  const Model& model = *loaded.model;
  State state = model.initial;
  state.time = time;
  const auto take = [&](const nb::object& given, const char* what, std::vector<double>& into) {
    if (given.is_none()) return;
    const Numbers numbers = numbers_of(given, what, model.joints.size());
    into.assign(numbers.data(), numbers.data() + numbers.shape(0));
  };
  take(position, "'position'", state.position);
  take(velocity, "'velocity'", state.velocity);
  bodies_from_joints(model, state);
  return arrays_of(state);
}

nb::tuple keyframe_state(const Loaded& loaded, const std::string& name) {
  for (const Keyframe& each : loaded.model->keyframes) {
    if (each.name == name) return arrays_of(each.state);
  }
  std::string known;
  for (const Keyframe& each : loaded.model->keyframes) known += (known.empty() ? "" : ", ") + each.name;
  throw InputError(
      fmt::format("'{}' has no keyframe '{}': it has {}", loaded.model->name, name, known.empty() ? "none" : known));
}

// Classes of assay.errors, for the life of the process.
struct Classes {
  PyObject *input = nullptr, *machine = nullptr, *engine = nullptr, *unsupported = nullptr;
};
Classes& classes() {
  static Classes all;
  return all;
}

void translate(const std::exception_ptr& thrown, void* /*payload*/) {
  try {
    std::rethrow_exception(thrown);
  } catch (const UnsupportedError& error) {
    PyErr_SetString(classes().unsupported, error.what());
  } catch (const EngineError& error) {
    PyErr_SetString(classes().engine, error.what());
  } catch (const InputError& error) {
    PyErr_SetString(classes().input, error.what());
  } catch (const SystemError& error) {
    PyErr_SetString(classes().machine, error.what());
  }
}

void bind_model(nb::module_& module) {
  nb::class_<Loaded>(module, "Model")
      .def_prop_ro("name", [](const Loaded& l) { return l.model->name; })
      .def_prop_ro("source", [](const Loaded& l) { return l.model->source; })
      .def_prop_ro("hash", [](const Loaded& l) { return l.model->hash; })
      .def_prop_ro("dof", [](const Loaded& l) { return l.model->dof(); })
      .def_prop_ro("total_mass", [](const Loaded& l) { return l.model->total_mass(); })
      .def_prop_ro("notes", [](const Loaded& l) { return l.model->notes; })
      .def_prop_ro("keyframes",
                   [](const Loaded& l) {
                     std::vector<std::string> names;
                     for (const Keyframe& each : l.model->keyframes) names.push_back(each.name);
                     return names;
                   })
      .def("json", [](const Loaded& l) { return python::model_json(*l.model); })
      .def("initial", [](const Loaded& l) { return arrays_of(l.model->initial); })
      .def("keyframe", &keyframe_state)
      .def("joint_state", &joint_state, nb::arg("position").none(), nb::arg("velocity").none(), nb::arg("time"))
      .def("variant", &variant, nb::arg("contacts"), nb::arg("gravity"));
}

void bind_run(nb::module_& module) {
  nb::class_<Run>(module, "Run", "One running simulation; assay.Simulation documents it.")
      .def(
          "__init__",
          [](Run* made, const Loaded& loaded, const std::string& contender, const Texts& settings, double timestep_s,
             const std::optional<nb::tuple>& state) {
            new (made) Run(loaded.model, contender, settings, timestep_s, state);
          },
          nb::arg("model"), nb::arg("contender"), nb::arg("settings"), nb::arg("timestep_s"), nb::arg("state").none())
      .def_prop_ro("time", &Run::time, "Time of the last state that was read, s.")
      .def_prop_ro(
          "timestep_ms", [](const Run& run) { return 1e3 * run.timestep_s(); }, "Timestep, ms.")
      .def_prop_ro(
          "contender", [](const Run& run) { return run.contender().name; }, "Name of the contender.")
      .def("_arrays",
           [](const Run& run) { return nb::make_tuple(run.torques(), run.bodies(), run.position(), run.velocity()); })
      .def("step", nb::overload_cast<>(&Run::step),
           "One step. Without an argument under the torques in `torques`; `step(array)` takes a float64 array "
           "(joints,) of "
           "Nm (hinges) and N (slides) for this step alone.")
      .def("step", nb::overload_cast<const nb::object&>(&Run::step), nb::arg("torques").none())
      .def("advance", &Run::advance, nb::arg("count"), "`count` steps under the torques in `torques`.")
      .def("_read", &Run::read)
      .def("_rollout", &Run::rollout, nb::arg("steps"), nb::arg("every"), nb::arg("torques").none());
}

}  // namespace
}  // namespace assay::package

NB_MODULE(_core, module) {  // NOLINT(cppcoreguidelines-pro-type-cstyle-cast): the macro's own
  using namespace assay;
  using namespace assay::package;
  const nb::module_ errors = nb::module_::import_("assay.errors");
  classes() = {nb::object(errors.attr("InputError")).release().ptr(),
               nb::object(errors.attr("MachineError")).release().ptr(),
               nb::object(errors.attr("EngineError")).release().ptr(),
               nb::object(errors.attr("UnsupportedError")).release().ptr()};
  nb::register_exception_translator(translate);

  module.def("set_program", &set_program_path, nb::arg("path"));
  module.def("load", &load, nb::arg("given"), nb::arg("is_text"), nb::arg("name"), nb::arg("how"));
  module.def("load_arguments", &load_arguments);
  module.def("contenders", [] { return registry().contender_names(); });
  module.def("add_engine", [](const std::string& path) {
    static_cast<void>(registry());
    Registry::add(path);
  });
  module.def("limitations", [](const Loaded& loaded, const std::string& contender, const Texts& settings) {
    return limitations(*loaded.model, contender, settings);
  });
  bind_model(module);
  bind_run(module);
}
