// How the registry gets engines whose adapters are in Python: from a plugin assay-python-host, which embeds one version
// of CPython and has one C function, `assay_python_host`, that returns this.
#pragma once

#include <string>

#include "engines/engine.h"

namespace assay {

struct PythonHost {
  int version;  // kPluginVersion of its build
  // What the engine `name` of an adapter, a file or a folder with engine.py, declares: text for python_declaration().
  // Throws std::exception.
  std::string (*declare)(const std::string& name, const std::string& path);
  // The engine. `environment` is the folder of its virtual environment, "" for none. Throws std::exception.
  Engine* (*make)(const std::string& name, const std::string& path, const std::string& environment);
  // Of an engine that it has made: text for python_capabilities().
  std::string (*capabilities)(const Engine& made, const Settings& settings);
};

}  // namespace assay
