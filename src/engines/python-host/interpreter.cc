#include "interpreter.h"

#include <cstdlib>
#include <dlfcn.h>
#include <filesystem>
#include <new>
#include <pthread.h>
#include <stdexcept>
#include <unistd.h>

#include <fmt/format.h>

#include "base/errors.h"

namespace assay::python {
namespace {

namespace fs = std::filesystem;

// The file that holds `symbol`.
std::string library_of(const void* symbol) {
  Dl_info info{};
  if (::dladdr(symbol, &info) == 0 || info.dli_fname == nullptr) return "";
  return info.dli_fname;
}

// What a user's environment may name instead: the prefix of the interpreter's standard library.
std::string python_home() {
  const char* given = std::getenv("ASSAY_PYTHON_HOME");
  return given != nullptr && *given != '\0' ? given : ASSAY_PYTHON_HOME;
}

// False where an interpreter runs already, whose settings are its owner's: assay is a library of it.
bool start() {
  if (Py_IsInitialized() != 0) return false;
  // Plugins are loaded RTLD_LOCAL, and extension modules take Python's symbols from the global ones
  const std::string library = library_of(reinterpret_cast<const void*>(&Py_InitializeFromConfig));
  if (::dlopen(library.c_str(), RTLD_NOW | RTLD_GLOBAL) == nullptr) {
    throw std::runtime_error(fmt::format("Python's library '{}' cannot be loaded: {}", library, ::dlerror()));
  }
  ::pthread_atfork(nullptr, nullptr, [] {
    if (Inside::depth > 0) Inside::is_copy = true;
  });
  // files are UTF-8 whatever the locale is, as packages expect
  PyPreConfig before;
  PyPreConfig_InitIsolatedConfig(&before);
  before.utf8_mode = 1;
  PyStatus status = Py_PreInitialize(&before);
  PyConfig config;
  PyConfig_InitIsolatedConfig(&config);
  config.site_import = 0;
  config.write_bytecode = 0;
  config.install_signal_handlers = 0;
  if (PyStatus_Exception(status) == 0) {
    status = PyConfig_SetBytesString(&config, &config.home, python_home().c_str());
  }
  if (PyStatus_Exception(status) == 0) status = Py_InitializeFromConfig(&config);
  PyConfig_Clear(&config);
  if (PyStatus_Exception(status) != 0) {
    throw std::runtime_error(
        fmt::format("Python does not start: {}", status.err_msg == nullptr ? "no reason given" : status.err_msg));
  }
  return true;
}

PyObject* import_module() {
  const bool ours = start();
  const std::string folder =
      fs::path(library_of(reinterpret_cast<const void*>(&import_module))).parent_path() / "python";
  if (ours) {                                  // else the package has imported it
    PyObject* path = PySys_GetObject("path");  // borrowed
    const Object text(PyUnicode_FromString(folder.c_str()));
    if (path == nullptr || !text || PyList_Insert(path, 0, text.get()) != 0) rethrow("sys.path");
  }
  Object module(PyImport_ImportModule("assay_adapter"));
  const Object prepared(module && ours ? PyObject_CallMethod(module.get(), "_own_process", nullptr) : nullptr);
  if (!module || (ours && !prepared)) {
    PyErr_Clear();
    throw std::runtime_error(fmt::format("'{}/assay_adapter.py' cannot be loaded", folder));
  }
  return module.release();
}

// What Python raised, with its traceback; it is no longer raised. Null for nothing.
PyObject* raised() {
#if PY_VERSION_HEX >= 0x030C0000
  return PyErr_GetRaisedException();
#else
  PyObject *type = nullptr, *value = nullptr, *trace = nullptr;
  PyErr_Fetch(&type, &value, &trace);
  PyErr_NormalizeException(&type, &value, &trace);
  if (trace != nullptr && value != nullptr) PyException_SetTraceback(value, trace);
  const Object owned_type(type), owned_trace(trace);
  return value;
#endif
}

bool matches(PyObject* error, const char* name) {
  const Object type(PyObject_GetAttrString(adapter_module(), name));
  return type && PyErr_GivenExceptionMatches(error, type.get()) != 0;
}

}  // namespace

void Inside::end_copy() {
  constexpr int kStatus = 70;
  ::_exit(kStatus);
}

PyObject* adapter_module() {
  static PyObject* const module = import_module();
  return module;
}

std::string text_of(const Object& object) {
  Py_ssize_t size = 0;
  const char* text = PyUnicode_AsUTF8AndSize(object.get(), &size);
  if (text == nullptr) rethrow("text");
  return {text, static_cast<size_t>(size)};
}

void rethrow(const std::string& what) {
  const Object error(raised());
  if (!error) throw std::runtime_error(fmt::format("{}: Python gave no reason", what));
  if (PyErr_GivenExceptionMatches(error.get(), PyExc_MemoryError) != 0) throw std::bad_alloc();
  const Object describe(PyObject_GetAttrString(adapter_module(), "_describe"));
  const Object described(describe ? PyObject_CallOneArg(describe.get(), error.get()) : nullptr);
  if (!described) {
    PyErr_Clear();
    throw std::runtime_error(fmt::format("{}: an exception that cannot be described", what));
  }
  const std::string text = (what.empty() ? "" : what + ": ") + text_of(described);
  if (matches(error.get(), "Unsupported")) throw UnsupportedError(text);
  if (matches(error.get(), "EngineFailure")) throw EngineError(text);
  throw std::runtime_error(text);
}

}  // namespace assay::python
