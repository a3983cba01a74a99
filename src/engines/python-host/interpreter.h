// CPython inside this process: started once, with the standard library alone, and given an engine's virtual environment
// when the first simulation is made (assay_adapter.py).
#pragma once

#include <string>
#include <utility>

#include <Python.h>

namespace assay::python {

// One reference to a Python object, or none.
class Object {
 public:
  Object() = default;
  explicit Object(PyObject* owned) : object_(owned) {}
  Object(Object&& other) noexcept : object_(std::exchange(other.object_, nullptr)) {}
  Object& operator=(Object&& other) noexcept {
    std::swap(object_, other.object_);
    return *this;
  }
  Object(const Object&) = delete;
  Object& operator=(const Object&) = delete;
  ~Object() { Py_XDECREF(object_); }

  PyObject* get() const { return object_; }
  PyObject* release() { return std::exchange(object_, nullptr); }
  explicit operator bool() const { return object_ != nullptr; }

 private:
  PyObject* object_ = nullptr;
};

// Marks that the process runs an adapter's code. A copy of the process that comes into being meanwhile, by a fork of
// native code, ends where it leaves that code: it must not go on as a second worker.
class Inside {
 public:
  Inside() { ++depth; }
  ~Inside() {
    --depth;
    if (is_copy) end_copy();
  }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;

  static inline int depth = 0;
  static inline bool is_copy = false;

 private:
  [[noreturn]] static void end_copy();
};

// The module assay_adapter, which lies in `python` beside this plugin. Starts the interpreter, but for a process that
// is one itself: there every call of this plugin needs the interpreter's lock. Throws std::runtime_error.
PyObject* adapter_module();

// Calls a function of assay_adapter. `format` is that of Py_BuildValue, a tuple: "(Os)". Throws as rethrow() does.
template <typename... Arguments>
Object call(const char* function, const char* format, Arguments... arguments);

// What Python raised, as an exception: EngineError for assay_adapter.EngineFailure, UnsupportedError for Unsupported,
// std::bad_alloc for MemoryError, std::runtime_error with the origin for anything else. `what` begins the text.
[[noreturn]] void rethrow(const std::string& what);

std::string text_of(const Object& object);

template <typename... Arguments>
Object call(const char* function, const char* format, Arguments... arguments) {
  const Object callee(PyObject_GetAttrString(adapter_module(), function));
  const Object values(Py_BuildValue(format, arguments...));
  if (!callee || !values) rethrow(function);
  Object result;
  {
    const Inside inside;
    result = Object(PyObject_CallObject(callee.get(), values.get()));
  }
  if (!result) rethrow("");
  return result;
}

}  // namespace assay::python
