// How the registry gets engines whose adapters are in Python: from the plugin assay-python-host.so, which has one C
// function, `assay_python_host`, that returns this.
#pragma once

#include <string>

#include "engines/engine.h"

namespace assay {

struct PythonHost {
  int version;  // kPluginVersion of its build
  // The engine `name` of an adapter: a file, or a folder with engine.py. Throws std::exception.
  Engine* (*make)(const std::string& name, const std::string& path);
  // The folder of its virtual environment, without links; "" for none.
  std::string (*environment)(const Engine& made);
};

}  // namespace assay
