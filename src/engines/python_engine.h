// Engines whose adapters are in Python, as the registry has them: they are known by what they declare, which is kept in
// the user's cache, and start an interpreter only to check a model or to simulate. A process has one interpreter. Which
// one an engine needs is said by its virtual environment, which holds binaries for it.
#pragma once

#include <memory>
#include <string>

#include "engines/engine.h"

namespace assay {

// What is known of an adapter besides what an Engine says.
struct PythonFacts {
  std::string environment;   // folder of its virtual environment, without links; "" for none
  std::string prefix;        // of the interpreter that the environment was made with; "" for none
  std::string host, module;  // the plugin that runs it, and its half in Python
};

// Whether this process is an interpreter that has assay as a library.
bool is_python_process();

// What the adapter at `path` declared to an earlier process, as text; "" where none of them kept it, or where a file
// that it comes from has changed.
std::string kept_declaration(const std::string& name, const std::string& path);
// For later processes. A cache that cannot be written is none.
void keep_declaration(const std::string& name, const std::string& path, const std::string& declaration);

// Asks the adapter itself, with whatever interpreter is here. Throws std::exception with the end of a sentence that
// begins with the path.
std::string declare_in_python(const std::string& name, const std::string& path);

// Throws as declare_in_python(), as for an interpreter that is not here.
std::unique_ptr<const Engine> python_engine(const std::string& name, const std::string& path,
                                            const std::string& declaration);
PythonFacts python_facts(const Engine& made);

}  // namespace assay
