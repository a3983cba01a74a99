// States and torques as NumPy arrays. Shapes and units are those of python/assay/_model.py.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include "model/model.h"
#include "model/state.h"

namespace assay::package {

namespace nb = nanobind;

using Numbers = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;  // (n,)
using Rows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;     // (n, m)
using Array = nb::ndarray<nb::numpy, double>;

using Memory = std::shared_ptr<std::vector<double>>;

// Zeros for `count` numbers, at least one, so that arrays without elements have an address, too.
Memory memory(size_t count);

// An array of this shape that shows `values` from `first` on and keeps them alive.
Array array_of(const Memory& values, std::initializer_list<size_t> shape, size_t first = 0);

// "a list", "an array of float32 of shape (3,)".
std::string description(const nb::handle& given);

// `given` as numbers in C order. Throws InputError for anything but a float64 array of this shape: nothing is
// converted.
Numbers numbers_of(const nb::handle& given, const std::string& what, size_t size);
Rows rows_of(const nb::handle& given, const std::string& what, size_t rows, size_t columns);

// (time, bodies, position, velocity): new arrays.
nb::tuple arrays_of(const State& state);
// The other way round, checked. Throws InputError.
State state_of(const Model& model, const nb::tuple& arrays);

}  // namespace assay::package
