#include "arrays.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nanobind/stl/string.h>

#include "base/errors.h"
#include "model/body_rows.h"
#include "results/store/trajectory.h"

namespace assay::package {
namespace {

std::string shape_text(std::initializer_list<size_t> shape) {
  std::string text;
  for (const size_t each : shape) text += fmt::format("{}{}", text.empty() ? "" : ", ", each);
  return fmt::format("({}{})", text, shape.size() == 1 ? "," : "");
}

[[noreturn]] void refuse(const nb::handle& given, const std::string& what, std::initializer_list<size_t> shape) {
  throw InputError(fmt::format("{} is {}: give a float64 array of shape {} in C order", what, description(given),
                               shape_text(shape)));
}

Memory copy_of(const std::vector<double>& values) {
  Memory copied = memory(values.size());
  std::ranges::copy(values, copied->begin());
  return copied;
}

}  // namespace

Memory memory(size_t count) { return std::make_shared<std::vector<double>>(std::max<size_t>(count, 1), 0.0); }

Array array_of(const Memory& values, std::initializer_list<size_t> shape, size_t first) {
  auto* kept = new Memory(values);
  const nb::capsule owner(kept, [](void* each) noexcept { delete static_cast<Memory*>(each); });
  return {values->data() + first, shape, owner};
}

std::string description(const nb::handle& given) {
  const auto text_of = [](const nb::object& object) { return nb::cast<std::string>(nb::str(object)); };
  if (given.is_none()) return "None";
  if (nb::hasattr(given, "dtype") && nb::hasattr(given, "shape")) {
    std::string text =
        fmt::format("an array of {} of shape {}", text_of(given.attr("dtype")), text_of(given.attr("shape")));
    const bool in_order = !nb::hasattr(given, "flags") || nb::cast<bool>(given.attr("flags").attr("c_contiguous"));
    return in_order ? text : text + ", not in C order";
  }
  const std::string type = text_of(nb::object(given.type().attr("__name__")));
  const bool vowel = std::string("aeiou").find(type.front()) != std::string::npos;
  return fmt::format("{} {}", vowel ? "an" : "a", type);
}

Numbers numbers_of(const nb::handle& given, const std::string& what, size_t size) {
  Numbers array;
  if (!nb::try_cast(given, array, false) || array.shape(0) != size) refuse(given, what, {size});
  return array;
}

Rows rows_of(const nb::handle& given, const std::string& what, size_t rows, size_t columns) {
  Rows array;
  if (!nb::try_cast(given, array, false) || array.shape(0) != rows || array.shape(1) != columns) {
    refuse(given, what, {rows, columns});
  }
  return array;
}

nb::tuple arrays_of(const State& state) {
  const size_t bodies = state.bodies.size();
  return nb::make_tuple(state.time, array_of(copy_of(assay::rows_of(state.bodies)), {bodies, kBodyRow}),
                        array_of(copy_of(state.position), {state.position.size()}),
                        array_of(copy_of(state.velocity), {state.velocity.size()}));
}

State state_of(const Model& model, const nb::tuple& arrays) {
  State state;
  state.time = nb::cast<double>(arrays[0]);
  if (!std::isfinite(state.time)) throw InputError("the state's time is not a finite number: give seconds");
  const Rows bodies = rows_of(arrays[1], "the state's 'bodies'", model.bodies.size(), kBodyRow);
  const Numbers position = numbers_of(arrays[2], "the state's 'position'", model.joints.size());
  const Numbers velocity = numbers_of(arrays[3], "the state's 'velocity'", model.joints.size());
  state.bodies.reserve(model.bodies.size());
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const double* row = bodies.data() + kBodyRow * i;
    const double length = std::hypot(std::hypot(row[3], row[4]), std::hypot(row[5], row[6]));
    if (!(length > 0)) {
      throw InputError(fmt::format("the orientation of body '{}' has length {}: give a quaternion (w, x, y, z)",
                                   model.bodies[i].name, length));
    }
    state.bodies.push_back(body_of(row));
  }
  state.position.assign(position.data(), position.data() + position.shape(0));
  state.velocity.assign(velocity.data(), velocity.data() + velocity.shape(0));
  if (const std::string fault = state_value_fault(state); !fault.empty()) {
    throw InputError(fmt::format("the state has {}: give finite numbers", fault));
  }
  return state;
}

}  // namespace assay::package
